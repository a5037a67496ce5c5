//! The coefficients and the deviations as tables.

use super::super::number::{count, sigma, three_digits, value};
use super::super::side_by_side::Table;
use super::quantity::{deviation_unit, quantity};
use super::words;
use crate::imu::{AXES, PerSensor, Sensor};
use crate::noise::{AxisNoise, Found, NoiseAnalysis, Process, TriadNoise, of_kind};

const NONE: &str = "–";
/// In the place of any correlation time.
const MARKOV: Process = Process::GaussMarkov {
    correlation_time: 1.0,
};

/// What was found in a triad: a row for each process, a column for each axis and one for their mean.
pub(super) fn coefficients(analysis: &NoiseAnalysis, sensor: Sensor) -> Table {
    let triad = analysis.triads.get(sensor);
    let columns: Vec<&AxisNoise> = triad.axes.iter().chain([&triad.mean]).collect();
    let mut rows = Vec::new();
    for process in Process::SLOPES.into_iter().chain([MARKOV]) {
        let found = |axis: &&AxisNoise| of_kind(axis.found(), process).copied();
        let limit = |axis: &AxisNoise| axis.hidden().iter().find(|h| h.process == process).copied();
        let is_slope = Process::SLOPES[..4].contains(&process);
        if !is_slope && !columns.iter().any(|axis| found(axis).is_some()) {
            continue;
        }
        let of = quantity(process, sensor);
        let cell = |axis: &&AxisNoise| match (found(axis), limit(axis)) {
            (Some(found), _) => with_sigma(found.strength / of.value, found.sigma / of.value),
            (None, Some(hidden)) => format!("< {}", sigma(hidden.limit / of.value)),
            (None, None) => NONE.to_owned(),
        };
        rows.push(row(of.name, of.unit, columns.iter().map(cell)));
        if process == MARKOV {
            let time = |axis: &&AxisNoise| found(axis).map_or(NONE.to_owned(), correlation_time);
            rows.push(row(
                "Gauss–Markov correlation time",
                "s",
                columns.iter().map(time),
            ));
        }
    }
    let (symbol, unit, _) = deviation_unit(sensor);
    let lowest = columns.iter().map(|axis| match axis.minimum() {
        _ if axis.is_constant => NONE.to_owned(),
        Some((_, deviation)) => three_digits(deviation / unit),
        None => "falling".to_owned(),
    });
    rows.push(row("lowest deviation", symbol, lowest));
    let at = columns.iter().map(|axis| {
        let minimum = axis.minimum().filter(|_| !axis.is_constant);
        minimum.map_or(NONE.to_owned(), |(tau, _)| three_digits(tau))
    });
    rows.push(row("at a cluster time of", "s", at));
    let name = match sensor {
        Sensor::Gyro => "Gyros",
        Sensor::Accel => "Accelerometers",
    };
    let mut headings = vec![String::new(), "unit".to_owned()];
    headings.extend(AXES.map(String::from));
    headings.push("triad".to_owned());
    let mut notes = vec![
        "± 1σ. <: its slope is not there; what it is below with 95 % probability. triad: the mean of the \
         three variances."
            .to_owned(),
    ];
    let pulse = *analysis.pulse.get(sensor);
    if pulse > 0.0 {
        let of = quantity(Process::Quantisation, sensor);
        notes.push(format!(
            "One pulse makes Q = {} {}, where noise is more than a pulse.",
            three_digits(pulse / 12f64.sqrt() / of.value),
            of.unit
        ));
    }
    Table {
        title: name,
        headings,
        sections: vec![rows],
        notes,
    }
}

fn row(name: &str, unit: &str, cells: impl Iterator<Item = String>) -> Vec<String> {
    let first = [name.to_owned(), unit.to_owned()];
    first.into_iter().chain(cells).collect()
}

fn with_sigma(number: f64, of: f64) -> String {
    format!("{} ± {}", value(number, of), sigma(of))
}

fn correlation_time(found: Found) -> String {
    let Process::GaussMarkov { correlation_time } = found.process else {
        return NONE.to_owned();
    };
    match found.sigma_log_time {
        // Where it is known to a factor only, its logarithm is what has a σ.
        Some(of) if of > 0.5 => {
            format!(
                "{} ×÷ {}",
                three_digits(correlation_time),
                three_digits(of.exp())
            )
        }
        Some(of) => with_sigma(correlation_time, of * correlation_time),
        None => three_digits(correlation_time),
    }
}

/// Allan deviations of all axes at every so-manieth cluster time.
pub(super) fn deviations(analysis: &NoiseAnalysis, every: usize) -> Table {
    let PerSensor { gyro, accel } = &analysis.triads;
    let mut headings = vec!["τ, s".to_owned()];
    for sensor in Sensor::ALL {
        let symbol = deviation_unit(sensor).0;
        headings.extend(AXES.map(|axis| format!("{} {axis}, {symbol}", sensor.name())));
    }
    headings.push("degrees of freedom".to_owned());
    let freedom = |triad: &TriadNoise, point: usize| {
        let of = |axis: &AxisNoise| Some(*axis.identified.as_ref()?.freedom.get(point)?);
        triad.axes.iter().filter_map(of).fold(f64::NAN, f64::min)
    };
    let taus = gyro.mean.curve.tau.iter().enumerate();
    let rows = taus.step_by(every).map(|(point, tau)| {
        let mut row = vec![three_digits(*tau)];
        for sensor in Sensor::ALL {
            let unit = deviation_unit(sensor).1;
            for axis in &analysis.triads.get(sensor).axes {
                let variance = axis.curve.variance.get(point).copied();
                row.push(three_digits(variance.unwrap_or(f64::NAN).sqrt() / unit));
            }
        }
        let least = freedom(gyro, point).min(freedom(accel, point));
        row.push(if least.is_finite() {
            count(least.round() as usize)
        } else {
            NONE.to_owned()
        });
        row
    });
    Table {
        title: "Overlapping Allan deviation",
        headings,
        sections: vec![rows.collect()],
        notes: vec![format!(
            "Degrees of freedom: the fewest of the six. {}",
            words::INTERVALS
        )],
    }
}
