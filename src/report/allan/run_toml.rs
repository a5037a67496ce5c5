//! The table for `run.toml`.

use serde_json::{Map, Value};

use super::super::number::three_digits;
use super::quantity::quantity;
use crate::formats::NoiseKeys;
use crate::imu::Sensor;
use crate::noise::{NoiseAnalysis, Process, of_kind};

/// A field of `[imu.noise]` with what has to be said of it.
struct Field {
    key: &'static str,
    value: f64,
    comment: String,
}

/// `[imu.noise]` with all that was found, ready to be pasted.
pub(super) fn noise_table(analysis: &NoiseAnalysis) -> String {
    let mut text = "[imu.noise]\n".to_owned();
    for &sensor in &analysis.sensors {
        let fields = of_triad(analysis, sensor);
        if fields.is_empty() {
            let name = sensor.name();
            text += &format!("# {name}: nothing was found; state the data sheet's figure\n");
        }
        for Field {
            key,
            value,
            comment,
        } in fields
        {
            let comment = if comment.is_empty() {
                comment
            } else {
                format!("  # {comment}")
            };
            text += &format!("{key} = {}{comment}\n", four_digits(value));
        }
    }
    text
}

/// The same fields to all digits.
pub(super) fn fields(analysis: &NoiseAnalysis) -> Map<String, Value> {
    let fields = Sensor::ALL
        .into_iter()
        .flat_map(|sensor| of_triad(analysis, sensor));
    fields
        .map(|field| (field.key.to_owned(), field.value.into()))
        .collect()
}

fn of_triad(analysis: &NoiseAnalysis, sensor: Sensor) -> Vec<Field> {
    let Some(figures) = analysis.triads.get(sensor).figures() else {
        return Vec::new();
    };
    let walk = quantity(Process::RandomWalk, sensor);
    let comment = match figures.random_walk_is_limit {
        true => "a limit: its slope was not found",
        false => "root of the mean square of the axes",
    };
    let mut fields = vec![Field {
        key: walk.key,
        value: figures.noise.random_walk / walk.value,
        comment: comment.to_owned(),
    }];
    let Some(of) = figures.noise.gauss_markov else {
        return fields;
    };
    let NoiseKeys {
        gauss_markov: (key, unit),
        correlation_time: time_key,
        ..
    } = NoiseKeys::of(sensor);
    let correlation_time = of.correlation_time;
    fields.push(Field {
        key,
        value: of.sigma / unit,
        comment: format!(
            "1σ of a Gauss–Markov process{}",
            in_place_of(analysis, sensor)
        ),
    });
    let open = match figures.correlation_is_open {
        true => "as long as the record can show; σ grows with its root",
        false => "",
    };
    fields.push(Field {
        key: time_key,
        value: correlation_time,
        comment: open.to_owned(),
    });
    fields
}

/// What the process stands for, if it was not found as such.
fn in_place_of(analysis: &NoiseAnalysis, sensor: Sensor) -> String {
    let found = analysis.triads.get(sensor).mean.found();
    let stands_for = [Process::BiasInstability, Process::RateRandomWalk].into_iter();
    let stands_for: Vec<String> = stands_for
        .filter_map(|process| {
            let of = quantity(process, sensor);
            let strength = three_digits(of_kind(found, process)?.strength / of.value);
            Some(format!("{} = {strength} {}", of.letter(), of.unit))
        })
        .collect();
    match stands_for.is_empty() {
        true => String::new(),
        false => format!(
            " fitted to the same deviations in the place of {}",
            stands_for.join(" and ")
        ),
    }
}

/// A TOML number.
fn four_digits(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    format!("{rounded:?}")
}
