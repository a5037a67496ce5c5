//! Fields of a calibration that follow from each other: if they disagree, the file was edited or damaged.

use std::iter::zip;

use nalgebra::{Matrix3, Vector3};

use crate::quantity::{Of, spelled, units_of_field};
use turncal::calibration::result::{Calibration, ConsistencyRecord, MagRecord, NisRecord};
use turncal::calibration::{
    BudgetPartRecord, BudgetRecord, FindingKind, Verdict, Word, coverage_factor,
};
use turncal::imu::Sensor;
use turncal_input::{counted, list};

/// An error, with the content found and the content expected.
pub type Wrong = (String, String);
/// Outcome of a check.
pub type Checked = Result<(), Wrong>;

/// Relative tolerance of variances and coverage factors: rounding, also by other programs.
const RELATIVE: f64 = 1e-6;
/// Relative tolerance of the sum of a budget, and of degrees of freedom from it: some parts are finite differences.
const BUDGET: f64 = 1e-3;
/// Tolerance of the inverse of a matrix, and of outputs relative to the largest.
const INVERSE: f64 = 1e-9;
/// A finding states a NIS above its 99.9 % limit. This limit is at most this many times as far from one as the upper
/// end of the 95 % interval (χ², for any number of degrees of freedom).
const BEYOND: f64 = 4.0;

pub fn check_agreement(record: &Calibration) -> Checked {
    check_sigma(record)?;
    if let Some(budget) = &record.budget {
        check_budget(record, budget)?;
    }
    check_verdict(record)?;
    if let Some(consistency) = &record.consistency {
        check_nis(record, consistency)?;
    }
    if let Some(mag) = &record.mag {
        check_magnetometer(mag)?;
    }
    for sensor in Sensor::ALL {
        check_unit(record, sensor)?;
        let sensitivity = record.triad(sensor).sensitivity();
        // The code that inverts a singular matrix refuses it and gives the cause.
        if sensitivity.try_inverse().is_some() {
            check_inverse(record, sensor)?;
            check_vectors(record, sensor)?;
        }
    }
    Ok(())
}

fn is_near(one: f64, other: f64, relative: f64) -> bool {
    one == other || (one - other).abs() <= relative * one.abs().max(other.abs())
}

fn check_sigma(record: &Calibration) -> Checked {
    for (n, name) in record.parameters.iter().enumerate() {
        let Some(&sigma) = record.sigma_of(name) else {
            continue;
        };
        let variance = record.covariance[n][n];
        expect!(
            is_near(sigma * sigma, variance, RELATIVE),
            "the square of sigma on the diagonal of covariance",
            "sigma of {name} = {sigma:e}, but its variance in covariance = {variance:e}"
        );
    }
    Ok(())
}

fn check_budget(record: &Calibration, budget: &BudgetRecord) -> Checked {
    let size = record.parameters.len();
    let lengths = budget.sources.iter().map(|part| part.u.len());
    let of_parameters = [
        budget.degrees_of_freedom.len(),
        budget.coverage_factor.len(),
    ];
    let found = lengths.chain(of_parameters).find(|len| *len != size);
    expect!(
        found.is_none(),
        format!("{size} values in each list, one per entry of parameters"),
        "a list of {} in budget",
        counted(found.unwrap_or(size), "value")
    );
    for (n, name) in record.parameters.iter().enumerate() {
        let squares = || budget.sources.iter().map(|part| part.u[n].powi(2));
        let (sum, variance) = (squares().sum::<f64>(), record.covariance[n][n]);
        expect!(
            is_near(sum, variance, BUDGET),
            "equal values, because the sum of the squares in a budget is the variance",
            "the sum of u² in budget.sources for {name} = {sum:e}, but its variance in covariance = {variance:e}"
        );
        let freedom = |part: &BudgetPartRecord| part.degrees_of_freedom.unwrap_or(f64::INFINITY);
        let shares = zip(squares(), &budget.sources).map(|(u, part)| u.powi(2) / freedom(part));
        let (of_parts, stated) = (
            sum.powi(2) / shares.sum::<f64>(),
            budget.degrees_of_freedom[n].unwrap_or(f64::INFINITY),
        );
        expect!(
            is_near(of_parts, stated, BUDGET),
            format!(
                "{of_parts:.6}, computed from the degrees of freedom in budget.sources (Welch and Satterthwaite)"
            ),
            "budget.degrees_of_freedom of {name} = {stated}"
        );
        let (k, expected) = (budget.coverage_factor[n], coverage_factor(stated));
        expect!(
            is_near(k, expected, RELATIVE),
            format!("{expected:.6}, computed from budget.degrees_of_freedom"),
            "budget.coverage_factor of {name} = {k}"
        );
    }
    Ok(())
}

/// Kinds of findings that are unknown to this version do not affect the verdict.
fn check_verdict(record: &Calibration) -> Checked {
    let Some(stated) = record.verdict.as_ref().map(|verdict| verdict.word) else {
        return Ok(());
    };
    let mut known = record.findings.clone();
    known.retain(|finding| FindingKind::named(&finding.kind).is_some());
    let found = Verdict::of(&known).word;
    let failed = (stated == Word::Failed) == (found == Word::Failed);
    let is_worse = stated == Word::Good && found != Word::Good;
    expect!(
        failed && !is_worse,
        format!("{found}, from findings"),
        "verdict.word = {stated}"
    );
    Ok(())
}

fn check_nis(record: &Calibration, consistency: &ConsistencyRecord) -> Checked {
    let all = &consistency.all;
    let kinds = [
        ("velocity", consistency.velocity),
        ("table", consistency.table),
        ("attitude", consistency.attitude),
    ];
    let kinds = kinds.map(|(name, of)| of.map(|of| (name, of)));
    let each = || kinds.iter().flatten();
    let means = || each().map(|(_, of)| of.nis);
    let (low, high) = (
        means().fold(f64::INFINITY, f64::min),
        means().fold(0.0, f64::max),
    );
    let between = low * (1.0 - RELATIVE)..=high * (1.0 + RELATIVE);
    expect!(
        low > high || between.contains(&all.nis),
        format!(
            "a value from {low:.4} to {high:.4}, the range of consistency.velocity, .table and .attitude"
        ),
        "consistency.nis = {}",
        all.nis
    );
    let is_cause = |kind| record.findings.iter().any(|finding| finding.is(kind));
    let is_told = is_cause(FindingKind::Inconsistent) || is_cause(FindingKind::Unexplained);
    for (name, NisRecord { nis, nis_interval }) in each().chain([&("all", *all)]) {
        let [_, end] = nis_interval;
        expect!(
            is_told || *nis <= 1.0 + BEYOND * (end - 1.0),
            "finding W10 or W03, which reports a NIS beyond its limit",
            "consistency: NIS ({name}) = {nis} and upper end of nis_interval = {end}, without a finding about this"
        );
    }
    Ok(())
}

fn check_unit(record: &Calibration, sensor: Sensor) -> Checked {
    let Some(unit) = record.unit.as_ref().map(|unit| unit.get(sensor)) else {
        return Ok(());
    };
    let is_of_triad = |of: Of| of == Of::Count || matches!(of, Of::Rows(own, _) if own == sensor);
    expect!(
        spelled(unit).is_some_and(|(.., of)| is_of_triad(of)),
        sensor.pick(
            "a unit of angular rate or angle, or count",
            "a unit of specific force or velocity, or count"
        ),
        "unit.{} = {unit:?}",
        sensor.name()
    );
    Ok(())
}

fn check_inverse(record: &Calibration, sensor: Sensor) -> Checked {
    let Some(correction) = &record.correction else {
        return Ok(());
    };
    let sensitivity = record.triad(sensor).sensitivity();
    let correction = correction.get(sensor);
    let correction = Matrix3::from_fn(|i, j| correction[i][j]);
    let off = (correction * sensitivity - Matrix3::identity()).amax();
    expect!(
        off <= INVERSE,
        "correction · scale · installation = 1",
        "correction.{0} and {0}.scale · {0}.installation, whose product differs from 1 by {off:.3e}",
        sensor.name()
    );
    Ok(())
}

fn check_magnetometer(mag: &MagRecord) -> Checked {
    let units: Vec<&str> = units_of_field().map(|(name, _)| name).collect();
    expect!(
        units.contains(&mag.unit.as_str()),
        format!("one of {}", list(units)),
        "mag.unit = {:?}",
        mag.unit
    );
    let [correction, matrix] =
        [mag.correction, mag.matrix].map(|of| Matrix3::from_fn(|i, j| of[i][j]));
    let off = (correction * matrix - Matrix3::identity()).amax();
    expect!(
        off <= INVERSE,
        "mag.correction · mag.matrix = 1",
        "mag.correction and mag.matrix, whose product differs from 1 by {off:.3e}"
    );
    let size = mag.parameters.len();
    expect!(
        mag.covariance.len() == size && mag.covariance.iter().all(|row| row.len() == size),
        format!("{size} rows of {size} values, as many as mag.parameters"),
        "another size of mag.covariance"
    );
    for (n, name) in mag.parameters.iter().enumerate() {
        let (sigma, variance) = (mag.sigma_of(name), mag.covariance[n][n]);
        expect!(
            sigma.is_some_and(|sigma| is_near(sigma * sigma, variance, RELATIVE)),
            "the square of mag.sigma on the diagonal of mag.covariance",
            "sigma of {name} = {sigma:?}, but its variance in mag.covariance = {variance:e}"
        );
    }
    Ok(())
}

fn check_vectors(record: &Calibration, sensor: Sensor) -> Checked {
    let (triad, first) = (record.triad(sensor), sensor.pick(0, 3));
    for (n, vector) in record.test_vectors.iter().enumerate() {
        let of = |all: &[f64; 6]| Vector3::from_column_slice(&all[first..first + 3]);
        let output = triad.sensitivity() * of(&vector.calibrated) + Vector3::from(triad.bias);
        let off = (output - of(&vector.raw)).amax();
        expect!(
            off <= INVERSE * output.amax().max(triad.sensitivity().amax()),
            "raw = scale · (installation · calibrated) + bias",
            "test_vectors[{n}], whose raw output of the {} differs from the model by {off:.3e}",
            sensor.name()
        );
    }
    Ok(())
}
