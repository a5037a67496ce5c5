//! A production lot: what the calibrations of many units of one type say together.
//!
//! Every unit's parameters in one form, body frame and nominal scale; mean and spread of the lot, and whether
//! the spread is more than the units' own σ make; units apart from the others; trends; limits.

mod limits;
mod outlier;
mod spread;
mod statistics;
#[cfg(test)]
pub(crate) mod tests;
mod trend;
mod unit;

use nalgebra::Vector3;

use crate::calibration::result::Calibration;
use crate::calibration::result::frame::{Canonical, free_parameters};
use crate::imu::{BodyFrame, Nominal, ParameterKind, PerSensor, Sensor, Triad};
use crate::statistics::median;

use limits::{checks, overall};
use statistics::of_all;
use unit::{axes, noise_at_rest};

pub use limits::{Check, Limit, Specification, Verdict, probability_outside};
pub use spread::{Scatter, Spread};
pub use statistics::{FALSE_ALARM, FALSE_TREND, Statistics};
pub use trend::{Against, Trend};
pub use unit::{Calibrated, Quantity, Row, Sample, Unit};

/// What the units say together.
#[derive(Debug, Clone, PartialEq)]
pub struct Lot {
    /// Every unit, in the order given.
    pub rows: Vec<Row>,
    /// The body frame that all are brought to.
    pub body_frame: BodyFrame,
    /// Nominal scales by which all are normalised: of each axis the median of what the runs state.
    pub nominal: PerSensor<Nominal>,
    /// 1σ of gravity over gravity, where all units have it from one site and so share its error; it is in each
    /// unit's σ and in the mean's, not in the scatter.
    pub shared_gravity: Option<f64>,
    /// Every quantity that at least two units have.
    pub statistics: Vec<Statistics>,
    /// The limits that units are held against; none if none are given.
    pub specification: Option<Specification>,
}

impl Lot {
    /// Brings units together, and holds them against limits where they are given.
    pub fn new(units: Vec<Unit>, specification: Option<Specification>) -> Self {
        let usable: Vec<Result<&Calibrated, String>> = units.iter().map(usable).collect();
        let output = common_output(usable.iter().flatten().map(|of| &of.calibration));
        let alike = |of: &&Calibrated| output.is_none() || of.calibration.unit.as_ref() == output;
        let compared: Vec<&Calibrated> = usable.iter().flatten().copied().filter(alike).collect();
        let accelerometer =
            |of: &&Calibrated| of.calibration.body_frame == BodyFrame::Accelerometer;
        let body_frame = match compared.iter().any(accelerometer) {
            true => BodyFrame::Accelerometer,
            false => BodyFrame::Table,
        };
        let nominal = PerSensor::from_fn(|sensor| {
            Nominal(Vector3::from_fn(|axis, _| {
                let stated = compared.iter().map(|of| of.nominal.get(sensor)[axis]);
                median(&mut stated.collect::<Vec<_>>()).unwrap_or(1.0)
            }))
        });
        let shared_gravity = shared_gravity(&compared);
        let canonical = |(unit, usable): (&Unit, Result<&Calibrated, String>)| {
            let calibrated = usable?;
            if !alike(&calibrated) {
                return Err(other_output(calibrated, output));
            }
            Canonical::new(&unit.name, &calibrated.calibration, &nominal, body_frame)
                .map_err(|error| error.to_string())
        };
        let canonical: Vec<_> = units.iter().zip(usable.clone()).map(canonical).collect();
        let rows = units.into_iter().zip(canonical);
        let rows = rows.map(|(unit, canonical)| {
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
        let parameters = free_parameters(body_frame).into_iter();
        let noise = axes().map(|(sensor, axis)| Quantity::Noise(sensor, axis));
        let quantities: Vec<Quantity> = parameters.map(Quantity::Parameter).chain(noise).collect();
        let statistics = of_all(&rows, &quantities, |quantity| match quantity {
            Quantity::Parameter(index) if is_accel_scale(index) => shared_gravity.unwrap_or(0.0),
            _ => 0.0,
        });
        Self {
            rows,
            body_frame,
            nominal,
            shared_gravity,
            statistics,
            specification,
        }
    }

    /// Units whose calibration failed or cannot be used, with the reason.
    pub fn failures(&self) -> impl Iterator<Item = (&Unit, &str)> {
        self.rows
            .iter()
            .filter_map(|row| Some((&row.unit, row.canonical.as_ref().err()?.as_str())))
    }

    /// What is apart in a unit, by its place in the lot.
    pub fn outliers_of(&self, row: usize) -> impl Iterator<Item = &Statistics> {
        let apart = move |of: &&Statistics| of.outliers.contains(&row);
        self.statistics.iter().filter(apart)
    }
}

/// What was calibrated and may be used.
fn usable(unit: &Unit) -> Result<&Calibrated, String> {
    let calibrated = unit.calibrated.as_ref().map_err(Clone::clone)?;
    match calibrated.calibration.converged {
        Some(false) => Err("not converged; values and σ may not be used".to_owned()),
        _ => Ok(calibrated),
    }
}

/// The output that most units have, the first of them where several are as many.
fn common_output<'a>(
    calibrations: impl Iterator<Item = &'a Calibration>,
) -> Option<&'a PerSensor<String>> {
    let stated: Vec<&PerSensor<String>> = calibrations.filter_map(|c| c.unit.as_ref()).collect();
    let count = |of: &PerSensor<String>| stated.iter().filter(|other| **other == of).count();
    let most = stated.iter().map(|of| count(of)).max()?;
    stated.iter().copied().find(|of| count(of) == most)
}

fn other_output(calibrated: &Calibrated, output: Option<&PerSensor<String>>) -> String {
    let words = |of: Option<&PerSensor<String>>| {
        of.map_or_else(
            || "not stated".to_owned(),
            |unit| format!("`{}` and `{}`", unit.gyro, unit.accel),
        )
    };
    format!(
        "outputs are {}, those of most units of the lot {}; give units of one type",
        words(calibrated.calibration.unit.as_ref()),
        words(output)
    )
}

/// Relative 1σ of gravity, if all have it from the same place.
fn shared_gravity(all: &[&Calibrated]) -> Option<f64> {
    let first = all.first()?.calibration.gravity?;
    let same = all.iter().all(|of| of.calibration.gravity == Some(first));
    (same && first.sigma_m_s2 > 0.0).then(|| first.sigma_m_s2 / first.m_s2)
}

fn is_accel_scale(index: usize) -> bool {
    let (sensor, of_triad) = crate::calibration::sensor_and_parameter(index);
    sensor == Sensor::Accel && Triad::kind(of_triad) == ParameterKind::Scale
}
