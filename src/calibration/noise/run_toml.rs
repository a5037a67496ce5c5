//! Learnt noise as `run.toml` states it.

use std::fmt::Write;

use super::report::NoiseReport;
use super::source::Source;
use crate::imu::{NoiseKeys, PerSensor, Sensor};

impl NoiseReport {
    /// `[imu.noise]` of learnt noise, ready to be pasted into `run.toml`, with those sources in comments
    /// that it cannot state there; none where nothing was learnt. `correlation_time` is that of each
    /// triad's Gauss–Markov bias in s.
    pub fn run_toml(&self, correlation_time: PerSensor<Option<f64>>) -> Option<String> {
        if !self.learnt {
            return None;
        }
        let mut text = "[imu.noise]\n".to_owned();
        for figures in self.sources.iter().filter(|figures| figures.used > 0.0) {
            let value = rounded(figures.used);
            // Writing to a string cannot fail.
            let _ = match figures.source {
                Source::AngleRandomWalk => {
                    writeln!(
                        text,
                        "{} = {value}",
                        NoiseKeys::of(Sensor::Gyro).random_walk.0
                    )
                }
                Source::VelocityRandomWalk => {
                    writeln!(
                        text,
                        "{} = {value}",
                        NoiseKeys::of(Sensor::Accel).random_walk.0
                    )
                }
                Source::GyroGaussMarkov => {
                    gauss_markov(&mut text, Sensor::Gyro, &value, correlation_time.gyro)
                }
                Source::AccelGaussMarkov => {
                    gauss_markov(&mut text, Sensor::Accel, &value, correlation_time.accel)
                }
                _ => writeln!(text, "# {}: {value} {}", figures.name, figures.unit),
            };
        }
        Some(text)
    }
}

fn gauss_markov(
    text: &mut String,
    sensor: Sensor,
    value: &str,
    correlation_time: Option<f64>,
) -> std::fmt::Result {
    let keys = NoiseKeys::of(sensor);
    writeln!(text, "{} = {value}", keys.gauss_markov.0)?;
    match correlation_time {
        Some(time) => writeln!(text, "{} = {}", keys.correlation_time, rounded(time)),
        None => Ok(()),
    }
}

/// A TOML number of four digits.
fn rounded(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    format!("{rounded:?}")
}
