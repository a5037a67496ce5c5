//! The coefficients as tables.

use super::quantity::{deviation_unit, quantity};
use crate::prelude::*;
use turncal::imu::{AXES, Sensor};
use turncal::noise::{AxisNoise, Found, NoiseAnalysis, Process, of_kind};

/// Results for a triad: one row per process, one column per axis and one for their mean.
pub fn coefficients(analysis: &NoiseAnalysis, sensor: Sensor) -> Table {
    let triad = analysis.triads.get(sensor);
    let columns: Vec<&AxisNoise> = triad.axes.iter().chain([&triad.mean]).collect();
    let row = |name: &str, unit: &str, cell: &dyn Fn(&AxisNoise) -> String| {
        let mut row = cells![name, unit];
        row.extend(columns.iter().map(|axis| cell(axis)));
        row
    };
    let mut rows = Vec::new();
    for process in Process::SLOPES.into_iter().chain([Process::MARKOV]) {
        let found = |axis: &AxisNoise| of_kind(axis.found(), process).copied();
        let limit = |axis: &AxisNoise| axis.hidden().iter().find(|h| h.process == process).copied();
        let always = Process::SLOPES[..4].contains(&process);
        if !always && !columns.iter().any(|axis| found(axis).is_some()) {
            continue;
        }
        let of = quantity(process, sensor);
        rows.push(row(
            of.name,
            of.unit,
            &|axis| match (found(axis), limit(axis)) {
                (Some(found), _) => plus_minus(found.strength / of.value, found.sigma / of.value),
                (None, Some(hidden)) => format!("< {}", sigma(hidden.limit / of.value)),
                (None, None) => NONE.to_owned(),
            },
        ));
        if process == Process::MARKOV {
            rows.push(row("Gauss–Markov correlation time", "s", &|axis| {
                found(axis).map_or(NONE.to_owned(), correlation_time)
            }));
        }
    }
    let (symbol, unit, _) = deviation_unit(sensor);
    rows.push(row(
        "lowest deviation",
        symbol,
        &|axis| match axis.minimum() {
            _ if axis.is_constant => NONE.to_owned(),
            Some((_, deviation)) => three_digits(deviation / unit),
            None => "falling".to_owned(),
        },
    ));
    rows.push(row("at a cluster time of", "s", &|axis| {
        let minimum = axis.minimum().filter(|_| !axis.is_constant);
        or_dash(minimum.map(|(tau, _)| tau), three_digits)
    }));
    let axes = AXES.map(String::from);
    let headings = cells!["", "unit"]
        .into_iter()
        .chain(axes)
        .chain(["triad".to_owned()]);
    let table = Table::new(capital(triad_name(sensor)), headings).section(rows).note(
        "± 1σ. <: 95 % upper limit, because the slope was not detected. Triad: results from the mean of the variances \
         of the three axes.",
    );
    match of_a_pulse(*analysis.pulse.get(sensor), sensor) {
        Some(note) => table.note(note),
        None => table,
    }
}

/// Quantisation due to pulses.
fn of_a_pulse(pulse: f64, sensor: Sensor) -> Option<String> {
    let of = quantity(Process::Quantisation, sensor);
    (pulse > 0.0).then(|| {
        format!(
            "One pulse corresponds to Q = {} {} if the noise exceeds one pulse.",
            three_digits(pulse / 12f64.sqrt() / of.value),
            of.unit
        )
    })
}

fn correlation_time(found: Found) -> String {
    let Process::GaussMarkov { correlation_time } = found.process else {
        return NONE.to_owned();
    };
    match found.sigma_log_time {
        // If the value is known only to within a factor, σ is that of its logarithm.
        Some(of) if of > 0.5 => {
            format!(
                "{} ×÷ {}",
                three_digits(correlation_time),
                three_digits(of.exp())
            )
        }
        Some(of) => plus_minus(correlation_time, of * correlation_time),
        None => three_digits(correlation_time),
    }
}
