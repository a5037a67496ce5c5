//! Learnt noise as `run.toml` states it.

use super::report::NoiseReport;
use super::source::Source;
use crate::imu::{NoiseKeys, PerSensor, Sensor};
use crate::units::{ARCSEC, DEGREE};

/// Tables of `run.toml` that state noise.
const TABLES: [&str; 3] = ["imu.noise", "standstill", "turntable"];

impl NoiseReport {
    /// The lines of `run.toml` that state learnt noise, each below the table it belongs to; none where
    /// nothing was learnt. `correlation_time` is that of each triad's Gauss–Markov bias in s.
    pub fn run_toml(&self, correlation_time: PerSensor<Option<f64>>) -> Option<String> {
        if !self.learnt {
            return None;
        }
        let used = self.sources.iter().filter(|figures| figures.used > 0.0);
        let lines: Vec<(&str, String)> = used
            .flat_map(|figures| {
                let sigma = figures.used * figures.source.unit().1;
                figures.source.lines(sigma, correlation_time)
            })
            .collect();
        let of_table = |table: &str| -> Option<String> {
            let of_table = lines.iter().filter(|(of, _)| *of == table);
            let lines: String = of_table.map(|(_, line)| format!("{line}\n")).collect();
            (!lines.is_empty()).then(|| format!("[{table}]\n{lines}"))
        };
        let tables: Vec<String> = TABLES.into_iter().filter_map(of_table).collect();
        Some(tables.join("\n"))
    }
}

impl Source {
    /// Table and line for each figure that states this σ, in SI and radians.
    fn lines(
        self,
        sigma: f64,
        correlation_time: PerSensor<Option<f64>>,
    ) -> Vec<(&'static str, String)> {
        let [imu, standstill, turntable] = TABLES;
        let keys = |sensor| NoiseKeys::of(sensor);
        let line = |table, (name, unit): (&str, f64)| {
            (table, format!("{name} = {}", rounded(sigma / unit)))
        };
        match self {
            Self::AngleRandomWalk => vec![line(imu, keys(Sensor::Gyro).random_walk)],
            Self::VelocityRandomWalk => vec![line(imu, keys(Sensor::Accel).random_walk)],
            Self::GyroMotion => vec![line(imu, (keys(Sensor::Gyro).by_motion, 1.0))],
            Self::AccelMotion => vec![line(imu, (keys(Sensor::Accel).by_motion, 1.0))],
            Self::GyroMoving => vec![line(imu, keys(Sensor::Gyro).by_duration)],
            Self::AccelMoving => vec![line(imu, keys(Sensor::Accel).by_duration)],
            Self::Velocity => vec![line(standstill, ("velocity_sigma_m_s", 1.0))],
            Self::Attitude => vec![line(standstill, ("attitude_sigma_arcsec", ARCSEC))],
            Self::RotationAtRest => vec![line(standstill, ("turning_deg_per_sqrt_s", DEGREE))],
            Self::TablePosition => vec![line(turntable, ("position_sigma_arcsec", ARCSEC))],
            Self::TableReading => vec![line(turntable, ("reading_sigma_arcsec", ARCSEC))],
            Self::GyroGaussMarkov | Self::AccelGaussMarkov => {
                let sensor = match self {
                    Self::GyroGaussMarkov => Sensor::Gyro,
                    _ => Sensor::Accel,
                };
                let keys = keys(sensor);
                let time = correlation_time.get(sensor);
                let time =
                    time.map(|t| (imu, format!("{} = {}", keys.correlation_time, rounded(t))));
                let mut lines = vec![line(imu, keys.gauss_markov)];
                lines.extend(time);
                lines
            }
        }
    }
}

/// A TOML number of four digits.
fn rounded(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    format!("{rounded:?}")
}
