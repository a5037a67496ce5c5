//! The table for `run.toml`.

use std::fmt::Write;

use super::super::number::three_digits;
use super::quantity::quantity;
use crate::imu::Sensor;
use crate::noise::{NoiseAnalysis, NoiseFigures, Process, of_kind};

/// `[imu.noise]` with all that was found, ready to be pasted.
pub(super) fn noise_table(analysis: &NoiseAnalysis) -> String {
    let mut text = "[imu.noise]\n".to_owned();
    for sensor in Sensor::ALL {
        let Some(figures) = analysis.figures(sensor) else {
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "# {}: nothing was found; state the data sheet's figure",
                sensor.name()
            );
            continue;
        };
        triad(&mut text, analysis, sensor, &figures);
    }
    text
}

fn triad(text: &mut String, analysis: &NoiseAnalysis, sensor: Sensor, figures: &NoiseFigures) {
    let walk = quantity(Process::RandomWalk, sensor);
    let noise = figures.noise;
    let comment = if figures.random_walk_is_limit {
        "a limit: its slope was not found"
    } else {
        "root of the mean square of the axes"
    };
    let _ = writeln!(
        text,
        "{} = {}  # {comment}",
        walk.key,
        four_digits(noise.random_walk / walk.value)
    );
    let Some(gauss_markov) = noise.gauss_markov else {
        return;
    };
    let (key, time_key) = match sensor {
        Sensor::Gyro => ("gyro_instability_deg_per_h", "gyro_correlation_time_s"),
        Sensor::Accel => ("accel_instability_ug", "accel_correlation_time_s"),
    };
    let sigma = quantity(
        Process::GaussMarkov {
            correlation_time: gauss_markov.correlation_time,
        },
        sensor,
    );
    let _ = writeln!(
        text,
        "{key} = {}  # 1σ of a Gauss–Markov process{}",
        four_digits(gauss_markov.sigma / sigma.value),
        from(analysis, sensor)
    );
    let _ = writeln!(
        text,
        "{time_key} = {}{}",
        four_digits(gauss_markov.correlation_time),
        if figures.correlation_is_open {
            "  # as long as the record can show; σ grows with its root"
        } else {
            ""
        }
    );
}

/// What the process stands for, if it was not found as such.
fn from(analysis: &NoiseAnalysis, sensor: Sensor) -> String {
    let found = analysis.triads.get(sensor).mean.found();
    let stands_for: Vec<String> = [Process::BiasInstability, Process::RateRandomWalk]
        .into_iter()
        .filter_map(|process| {
            let of = quantity(process, sensor);
            let strength = of_kind(found, process)?.strength / of.value;
            Some(format!(
                "{} = {} {}",
                of.letter,
                three_digits(strength),
                of.unit
            ))
        })
        .collect();
    if stands_for.is_empty() {
        return String::new();
    }
    format!(
        " fitted to the same deviations in the place of {}",
        stands_for.join(" and ")
    )
}

/// A TOML number.
pub(super) fn four_digits(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    format!("{rounded:?}")
}
