//! A production lot: joint evaluation of the calibrations of many units of one type.
//!
//! All units are converted to one form, body frame and nominal scale. Results are mean and spread of the lot, with a
//! test whether the spread exceeds the units' σ; outliers; trends; limits.

mod limits;
mod outlier;
mod quantity;
mod spread;
mod statistics;
#[cfg(test)]
pub(crate) mod tests;
mod trend;
mod unit;

use nalgebra::Vector3;

use crate::calibration::result::frame::Canonical;
use crate::imu::{BodyFrame, Nominal, PerSensor};
use crate::statistics::median_of_axes;

use limits::overall;
use statistics::of_all;
use unit::noise_at_rest;

pub use limits::{Check, Limit, Specification, Verdict, checks, probability_outside};
pub use quantity::{Quantity, Sample};
pub use spread::{Scatter, Spread};
pub use statistics::{FALSE_ALARM, FALSE_TREND, Statistics};
pub use trend::{Against, Trend};
pub use unit::{Calibrated, Row, Unit};

/// The evaluation of a lot.
#[derive(Debug, Clone, PartialEq)]
pub struct Lot {
    /// Every unit, in the order given.
    pub rows: Vec<Row>,
    /// The common body frame.
    pub body_frame: BodyFrame,
    /// Nominal scales by which all are normalised: for each axis, the median of the values stated in the runs.
    pub nominal: PerSensor<Nominal>,
    /// Relative 1σ of gravity, if all units were calibrated at one site and therefore share its error. It is part of
    /// each unit's σ and of the mean's σ, but not of the scatter.
    pub shared_gravity: Option<f64>,
    /// Every quantity that at least two units have.
    pub statistics: Vec<Statistics>,
    /// The limits for units; `None` if there are none.
    pub specification: Option<Specification>,
}

impl Lot {
    /// Evaluates units, and checks them against limits if given.
    pub fn new(units: Vec<Unit>, specification: Option<Specification>) -> Self {
        let output = common_output(&units);
        let usable: Vec<_> = units.iter().map(|unit| usable(unit, output)).collect();
        let compared: Vec<&Calibrated> = usable.iter().flatten().copied().collect();
        let by_accelerometers =
            |of: &&Calibrated| of.calibration.body_frame == BodyFrame::Accelerometer;
        let body_frame = match compared.iter().any(by_accelerometers) {
            true => BodyFrame::Accelerometer,
            false => BodyFrame::Table,
        };
        let nominal = PerSensor::from_fn(|sensor| {
            let stated = compared.iter().map(|of| (*of.nominal.get(sensor)).into());
            let middle = median_of_axes(&stated.collect::<Vec<_>>());
            Nominal(middle.unwrap_or(Vector3::repeat(1.0)))
        });
        let shared_gravity = shared_gravity(&compared);
        let canonical = |(unit, usable): (&Unit, Result<&Calibrated, String>)| {
            Canonical::new(&unit.name, &usable?.calibration, &nominal, body_frame)
                .map_err(|error| error.to_string())
        };
        let canonical: Vec<_> = units.iter().zip(usable).map(canonical).collect();
        let rows = units.into_iter().zip(canonical).map(|(unit, canonical)| {
            let mut row = Row {
                noise: noise_at_rest(&unit, &nominal),
                unit,
                canonical,
                checks: Vec::new(),
                verdict: None,
            };
            if let Some(specification) = &specification {
                row.checks = checks(specification, |k| row.sample(Quantity::Parameter(k)));
                row.verdict = Some(overall(&row.checks));
            }
            row
        });
        let rows: Vec<Row> = rows.collect();
        Self {
            statistics: of_all(&rows, body_frame, shared_gravity.unwrap_or(0.0)),
            rows,
            body_frame,
            nominal,
            shared_gravity,
            specification,
        }
    }

    /// Units whose calibration failed or cannot be used, with the reason.
    pub fn failures(&self) -> impl Iterator<Item = (&Unit, &str)> {
        self.rows
            .iter()
            .filter_map(|row| Some((&row.unit, row.canonical.as_ref().err()?.as_str())))
    }

    /// Quantities in which a unit, given by its index in the lot, is an outlier.
    pub fn outliers_of(&self, row: usize) -> impl Iterator<Item = &Statistics> {
        let apart = move |of: &&Statistics| of.outliers.contains(&row);
        self.statistics.iter().filter(apart)
    }
}

/// The calibration of a unit, if comparable with units of this output; otherwise the reason.
fn usable<'a>(
    unit: &'a Unit,
    output: Option<&PerSensor<String>>,
) -> Result<&'a Calibrated, String> {
    let calibrated = unit.calibrated.as_ref().map_err(Clone::clone)?;
    let own = calibrated.calibration.unit.as_ref();
    if calibrated.calibration.converged == Some(false) {
        return Err("not converged; do not use the values or σ".to_owned());
    }
    if output.is_none() || own == output {
        return Ok(calibrated);
    }
    let [own, of_lot] = [own, output].map(|of| match of {
        Some(unit) => format!("`{}` and `{}`", unit.gyro, unit.accel),
        None => "not stated".to_owned(),
    });
    Err(format!(
        "outputs are {own}, but most units of the lot have {of_lot}. Give units of one type"
    ))
}

/// The output of most units; the first of several equally common ones.
fn common_output(units: &[Unit]) -> Option<&PerSensor<String>> {
    let usable = units.iter().filter_map(|unit| usable(unit, None).ok());
    let stated: Vec<_> = usable
        .filter_map(|of| of.calibration.unit.as_ref())
        .collect();
    // Of those that are as many the last is taken.
    let count = |of: &&PerSensor<String>| stated.iter().filter(|other| *other == of).count();
    stated.iter().rev().copied().max_by_key(count)
}

/// Relative 1σ of gravity, if all units have it from the same site.
fn shared_gravity(all: &[&Calibrated]) -> Option<f64> {
    let first = all.first()?.calibration.gravity?;
    let same = all.iter().all(|of| of.calibration.gravity == Some(first));
    (same && first.sigma_m_s2 > 0.0).then(|| first.sigma_m_s2 / first.m_s2)
}
