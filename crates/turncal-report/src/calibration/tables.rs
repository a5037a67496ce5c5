//! The tables, which are the same on the terminal and on the page.

use super::super::terms;
use super::super::terms::improvement;
use super::report::Report;
use crate::prelude::*;
use turncal::calibration::{Estimate, Measures, Nis, Outcome, Quality, Spread, parameter_name};
use turncal::imu::PerSensor;
use turncal::recording::TableLog;

/// Number of observed directions shown.
const WEAKEST: usize = 3;

impl Report<'_> {
    /// Every parameter with its accuracy, and its error if the truth is known.
    pub fn parameters(&self, estimate: &Estimate) -> Table {
        let prior = self.outcome.map(|outcome| outcome.prior_sigma);
        let truth = self.truth_vector();
        let (form, posterior, values) = (estimate.form(), estimate.sigma(), estimate.vector());
        let row = |group: Group, i: usize| {
            let unit = group.unit_value();
            let of = [group.shown(values[i]), posterior[i] / unit];
            let prior = prior.map(|prior| prior[i] / unit);
            let error = truth.map(|truth| Some((values[i] - truth[i]) / unit));
            let name = parameter_name(form, i)?;
            Some(terms::parameter_row(name, group.unit(), of, prior, error))
        };
        let mut columns = vec!["parameter", "value ± 1σ", "unit"];
        let mut optional = Vec::new();
        if prior.is_some() {
            optional.push(columns.len());
            columns.extend(["prior σ", "prior : σ"]);
        }
        if truth.is_some() {
            columns.extend(["error", "error/σ"]);
        }
        let mut table = Table::new("Parameters", columns).sections(Group::all().map(|group| {
            let rows = group.parameters(form).into_iter();
            rows.filter_map(move |i| row(group, i)).collect::<Vec<_>>()
        }));
        if let Some(outcome) = self.outcome {
            table = table.section(terms::rows(
                &outcome.auxiliary,
                self.true_terms,
                truth.is_some(),
            ));
        }
        table.optional = optional;
        let log = self.run.recording.imu.log.as_ref();
        match log.and_then(|log| log.named.along_body()) {
            Some(PerSensor { gyro, accel }) => table.note(format!(
                "Axes x, y, z: columns {} (gyros) and {} (accelerometers).",
                gyro.join(", "),
                accel.join(", ")
            )),
            None => table,
        }
    }
}

/// The least observed directions: all directions that are not observed, and some that are observed.
pub fn weakest(outcome: &Outcome) -> Table {
    let observability = &outcome.observability;
    let shown = observability.unobserved().count() + WEAKEST;
    let rows = observability.directions.iter().take(shown);
    Table::new("Least observed directions", ["direction", "prior : σ"])
        .section(rows.map(|of| vec![of.words.clone(), improvement(1.0, of.remaining)]))
        .note(
            "Combinations of parameters, each in units of its prior σ, that the data determine \
             independently. “With” joins parameters whose errors have the same sign; “against” joins parameters whose \
             errors have opposite signs.",
        )
}

fn observed(outcome: &Outcome) -> impl Iterator<Item = (&'static str, Nis)> {
    let kinds = outcome.consistency.kinds();
    kinds.map(|(observation, nis)| (observation.name(), nis))
}

/// NIS of each kind of observation, with its 95 % interval.
pub fn nis(outcome: &Outcome) -> Vec<String> {
    let shown = |(name, nis): (&str, Nis)| {
        let (low, high) = nis.interval;
        let [mean, low, high] = [nis.mean, low, high].map(|x| value(x, 0.01));
        format!("{name} {mean} ({low} to {high})")
    };
    observed(outcome).map(shown).collect()
}

/// Table of the consistency of the innovations with their covariance.
pub fn consistency(outcome: &Outcome) -> Table {
    let rows = observed(outcome).map(|(name, nis)| {
        let (low, high) = nis.interval;
        let verdict = match nis.mean {
            mean if mean < low => ", below",
            mean if mean > high => ", above",
            _ => "",
        };
        cells![
            name,
            format!("{}{verdict}", value(nis.mean, 0.01)),
            format!("{} … {}", value(low, 0.01), value(high, 0.01)),
            value(nis.lag_one, 0.01),
            count(nis.count),
        ]
    });
    Table::new("Consistency", columns("observation | NIS per scalar | 95 % interval | lag-one correlation | scalars")).section(rows).note(
        "If the NIS is within its interval and the lag-one correlation is near zero, the innovations are as large and \
         as white as the filter predicts.",
    )
}

/// One line with the residuals in dwells excluded from the fit.
pub fn cross_validation(quality: &Quality) -> Option<String> {
    let held_out = quality.held_out.as_ref()?;
    let of = |name: &str, spread: &Spread, units: &[(&'static str, f64); 2]| {
        let (unit, size) = readable(units, spread.rms);
        let [rms, largest] = [spread.rms, spread.largest].map(|x| three_digits(x / size));
        (spread.count > 0).then(|| format!("{name} {rms} {unit} RMS, largest {largest}"))
    };
    let parts = [
        of("|f| − g", &held_out.gravity, &FORCE),
        of("up after a turn", &held_out.direction, &ANGLE),
    ];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    (!parts.is_empty()).then(|| format!("{} ({} dwells)", parts.join("; "), held_out.gravity.count))
}

/// Each residual, over the whole recording and over the excluded dwells; empty if there are no data.
pub fn residuals(quality: &Quality, table: Option<&TableLog>) -> Table {
    let turns = match table {
        Some(_) => "attitude after a turn, gyros minus table",
        None => "labelled turns, gyros minus label",
    };
    let named = [
        ("|f| minus g in dwells", FORCE),
        ("vertical after a turn, gyros minus accels", ANGLE),
        (turns, ANGLE),
    ];
    let of = |m: &Measures| [m.gravity, m.direction, m.turns];
    let held_out = quality.held_out.as_ref().map(of);
    let all = named.into_iter().zip(of(&quality.all)).enumerate();
    let all = all.filter(|(_, (_, all))| all.count > 0);
    let rows = all.map(|(k, ((name, units), all))| {
        let (unit, size) = readable(&units, all.rms);
        let cells = |of: &Spread| match of.count {
            0 => [NONE; 3].map(str::to_owned),
            n => {
                let [rms, largest] = [of.rms, of.largest].map(|x| three_digits(x / size));
                [count(n), rms, largest]
            }
        };
        let mut row = cells![name, unit];
        row.extend(cells(&all));
        row.extend(held_out.iter().flat_map(|of| cells(&of[k])));
        row
    });
    let mut columns = vec!["", "unit", "number", "RMS", "largest"];
    if quality.held_out.is_some() {
        columns.extend(["cross-validation: number", "RMS", "largest"]);
    }
    let table = Table::new("Residuals at rest and after turns", columns).section(rows);
    if quality.held_out.is_some() {
        table.note(
            "Cross-validation: residuals in dwells excluded from the fit, and over the turns that end in these \
             dwells.",
        )
    } else {
        table
    }
}

/// Units of residuals.
pub const FORCE: [(&str, f64); 2] = [("mg", MILLI_G), ("µg", MICRO_G)];
pub const ANGLE: [(&str, f64); 2] = [("°", DEGREE), ("″", ARCSEC)];
