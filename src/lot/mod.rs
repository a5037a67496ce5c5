//! Comparison of several calibrations of one instrument, or of many instruments of one type.
//!
//! All calibrations are converted to one form, body frame and nominal scale. The results are the mean and spread of
//! each quantity, with a test of whether the spread exceeds the σ of the calibrations; outliers; differences from a
//! truth; and the decisions on limits.

mod joint;
mod limits;
mod quantity;
mod scatter;
mod specification;
mod statistics;
#[cfg(test)]
pub(crate) mod tests;
mod unit;

use nalgebra::{DMatrix, DVector, Vector3};

use crate::calibration::result::frame::{
    Canonical, MagneticValues, free_parameters, magnetic_in, own_nominal,
};
use crate::calibration::result::{Calibration, MagRecord};
use crate::calibration::{Nees, nees};
use crate::imu::{BodyFrame, Nominal, PerSensor};
use crate::magnetic::MATRIX;
use crate::statistics::median_of_axes;

use joint::joint;
use limits::overall;
use statistics::of_all;

pub use limits::{Check, Limit, Specification, Verdict, checks, probability_outside};
pub use quantity::{Quantity, Sample, Shared};
pub use scatter::{ChiSquare, Scatter, Spread};
pub use statistics::{FALSE_ALARM, Statistics};
pub use unit::{Calibrated, Row, Unit};

/// Fields whose magnitudes differ by less than this many σ are one field; the Earth's field changes by less in a year.
const SAME_FIELD: f64 = 0.1;

/// The calibrations that are compared.
#[derive(Debug, Clone, PartialEq)]
pub struct Lot {
    /// Every unit, in the order given.
    pub rows: Vec<Row>,
    /// The true values, if known.
    pub truth: Option<Row>,
    /// The common body frame: the accelerometer frame if any record is in it.
    pub body_frame: BodyFrame,
    /// Nominal scales by which all calibrations are normalised: for each axis, the median of the values stated in the
    /// runs; if none are stated, the scale factors of the truth, or of the first calibration.
    pub nominal: PerSensor<Nominal>,
    /// Whether a run states nominal scales.
    pub nominal_is_stated: bool,
    /// Relative 1σ of gravity and of the magnetic field, if all units were calibrated at one site and therefore have
    /// their errors in common. These σ are part of each unit's σ and of the mean's σ, but not of the scatter.
    pub shared: Shared,
    /// Units of matrix and bias of the magnetometers that are compared.
    pub magnetic_unit: Option<[String; 2]>,
    /// Every quantity that at least two units have.
    pub statistics: Vec<Statistics>,
    /// χ² of the scatter of all parameters with their correlations, over the units that give correlations; `None` if
    /// fewer than two units give correlations.
    pub joint: Option<ChiSquare>,
    /// The limits for units; `None` if there are none.
    pub specification: Option<Specification>,
}

impl Lot {
    /// Compares units, and checks them against a truth and against limits if given.
    pub fn new(
        units: Vec<Unit>,
        truth: Option<Unit>,
        specification: Option<Specification>,
    ) -> Self {
        let common = Common::new(truth.iter().chain(&units));
        let parameters = free_parameters(common.body_frame);
        let truth = truth.map(|truth| common.row(truth));
        let exact = truth
            .as_ref()
            .and_then(|truth| truth.canonical.as_ref().ok());
        let rows = units.into_iter().map(|unit| {
            let mut row = common.row(unit);
            let own = row.canonical.as_ref().ok();
            row.nees = own
                .zip(exact)
                .and_then(|(own, exact)| nees_of(own, exact, &parameters));
            if let Some(specification) = &specification {
                row.checks = checks(specification, |k| row.sample(Quantity::Parameter(k)));
                row.verdict = Some(overall(&row.checks));
            }
            row
        });
        let rows: Vec<Row> = rows.collect();
        let shared = Shared {
            gravity: shared_gravity(&rows),
            field: shared_field(&rows),
        };
        Self {
            statistics: of_all(&rows, common.body_frame, shared),
            joint: joint_scatter(&rows, &parameters, shared),
            rows,
            truth,
            body_frame: common.body_frame,
            nominal: common.nominal,
            nominal_is_stated: common.is_stated,
            shared,
            magnetic_unit: common.magnetic_unit,
            specification,
        }
    }

    /// Calibrations that failed or cannot be used, with the reason.
    pub fn failures(&self) -> impl Iterator<Item = (&Unit, &str)> {
        let all = self.truth.iter().chain(&self.rows);
        all.filter_map(|row| Some((&row.unit, row.canonical.as_ref().err()?.as_str())))
    }

    /// Usable calibrations whose magnetometer is not compared although others have one, with the reason.
    pub fn without_magnetometer(&self) -> impl Iterator<Item = (&Unit, &str)> {
        let all = self.truth.iter().chain(&self.rows);
        let usable = all.filter(|row| self.magnetic_unit.is_some() && row.canonical.is_ok());
        usable.filter_map(|row| Some((&row.unit, *row.magnetic.as_ref().err()?)))
    }

    /// Quantities in which a unit, given by its index, is an outlier.
    pub fn outliers_of(&self, row: usize) -> impl Iterator<Item = &Statistics> {
        let is_outlier = move |of: &&Statistics| of.outliers.contains(&row);
        self.statistics.iter().filter(is_outlier)
    }

    /// Every quantity that a unit has.
    pub fn quantities(&self) -> impl Iterator<Item = Quantity> {
        let has = |quantity: &Quantity| self.rows.iter().any(|row| row.sample(*quantity).is_some());
        Quantity::all(self.body_frame).filter(has)
    }

    /// The statistics of a quantity, if at least two units have it.
    pub fn statistics_of(&self, quantity: Quantity) -> Option<&Statistics> {
        self.statistics.iter().find(|of| of.quantity == quantity)
    }

    /// Reference for differences: the truth or, without a truth, the first of two units.
    pub fn reference(&self) -> Option<&Row> {
        let first = self.rows.first().filter(|_| self.rows.len() == 2);
        self.truth.as_ref().or(first)
    }

    /// The value of another unit minus the value of the reference, with its 1σ, assuming that the data of both are
    /// independent except for gravity and the magnetic field.
    pub fn difference(&self, row: &Row, quantity: Quantity) -> Option<Sample> {
        let reference = self.reference().filter(|from| !std::ptr::eq(*from, row));
        let (own, from) = (row.sample(quantity)?, reference?.sample(quantity)?);
        let is_exact = self.truth.is_some();
        let shared = |of: Sample| self.shared.of(quantity, of.value);
        let common = if is_exact {
            0.0
        } else {
            shared(own) * shared(from)
        };
        let variance = own.sigma.powi(2) + from.sigma.powi(2) - 2.0 * common;
        let is_known = own.sigma > 0.0 && (is_exact || from.sigma > 0.0);
        Some(Sample {
            value: own.value - from.value,
            sigma: if is_known {
                variance.max(0.0).sqrt()
            } else {
                0.0
            },
        })
    }
}

/// Units and nominal scales to which all records are converted.
struct Common {
    /// The output of most records; the first of several equally common ones.
    output: Option<PerSensor<String>>,
    body_frame: BodyFrame,
    nominal: PerSensor<Nominal>,
    is_stated: bool,
    /// Units of the first magnetometer.
    magnetic_unit: Option<[String; 2]>,
}

impl Common {
    fn new<'a>(units: impl Iterator<Item = &'a Unit> + Clone) -> Self {
        let stated = units.clone().filter_map(|unit| usable(unit, None).ok());
        let stated: Vec<_> = stated
            .filter_map(|of| of.calibration.unit.as_ref())
            .collect();
        let count = |of: &&PerSensor<String>| stated.iter().filter(|other| *other == of).count();
        // If several are equally common, the last in this order is taken.
        let output = stated.iter().rev().copied().max_by_key(count).cloned();
        let compared = units.filter_map(|unit| usable(unit, output.as_ref()).ok());
        let compared: Vec<&Calibrated> = compared.collect();
        let frames = compared.iter().map(|of| of.calibration.body_frame);
        let stated: Vec<_> = compared.iter().filter_map(|of| of.nominal()).collect();
        let own = compared.first().map(|of| own_nominal(&of.calibration));
        let nominal = PerSensor::from_fn(|sensor| {
            let of_all = stated.iter().map(|nominal| (*nominal.get(sensor)).into());
            let middle = median_of_axes(&of_all.collect::<Vec<_>>()).map(Nominal);
            let own = own.as_ref().map(|own| *own.get(sensor));
            middle.or(own).unwrap_or(Nominal(Vector3::repeat(1.0)))
        });
        let mut magnetometers = compared.iter().filter_map(|of| of.calibration.mag.as_ref());
        Self {
            magnetic_unit: magnetometers.next().map(MagRecord::shown_units),
            output,
            body_frame: BodyFrame::common(frames),
            is_stated: !stated.is_empty(),
            nominal,
        }
    }

    fn row(&self, unit: Unit) -> Row {
        let usable = usable(&unit, self.output.as_ref());
        let canonical = usable.and_then(|of| {
            Canonical::new(&unit.name, &of.calibration, &self.nominal, self.body_frame)
                .map_err(|error| error.to_string())
        });
        let calibrated = unit.calibrated.as_ref().ok();
        Row {
            magnetic: self.magnetic(calibrated.map(|of| &of.calibration)),
            noise: calibrated.and_then(|of| of.noise_by(&self.nominal)),
            canonical,
            unit,
            nees: None,
            checks: Vec::new(),
            verdict: None,
        }
    }

    fn magnetic(&self, record: Option<&Calibration>) -> Result<MagneticValues, &'static str> {
        let record = record.ok_or("no calibration")?;
        let mag = record.mag.as_ref().ok_or("no magnetometer")?;
        if self.magnetic_unit != Some(mag.shown_units()) {
            return Err("the magnetometer is in other units");
        }
        let (_, size) = mag.shown_field();
        let mut of = magnetic_in(self.body_frame, (mag, record), &self.nominal);
        let matrices = of.iter_mut().map(|of| of.rows_range_mut(..MATRIX));
        matrices.for_each(|mut matrix| matrix *= size);
        Ok(of)
    }
}

/// The calibration of a unit, if comparable with units of this output; otherwise the reason. A record without units is
/// assumed to have those of the others.
fn usable<'a>(
    unit: &'a Unit,
    output: Option<&PerSensor<String>>,
) -> Result<&'a Calibrated, String> {
    let calibrated = unit.calibrated.as_ref().map_err(Clone::clone)?;
    if calibrated.calibration.converged == Some(false) {
        return Err("the calibration did not converge; do not use the values or σ".to_owned());
    }
    match (calibrated.calibration.unit.as_ref(), output) {
        (Some(own), Some(common)) if own != common => Err(format!(
            "the outputs are in `{}` and `{}`, but most calibrations have outputs in `{}` and `{}`. Give calibrations \
             with the same units",
            own.gyro, own.accel, common.gyro, common.accel
        )),
        _ => Ok(calibrated),
    }
}

/// Relative 1σ of gravity, if gravity is from the same site for all units.
fn shared_gravity(rows: &[Row]) -> Option<f64> {
    let usable = rows.iter().filter(|row| row.canonical.is_ok());
    let mut all = usable.filter_map(|row| row.unit.calibrated.as_ref().ok());
    let first = all.next()?.calibration.gravity?;
    let same = all.all(|of| of.calibration.gravity == Some(first));
    (same && first.sigma_m_s2 > 0.0).then(|| first.sigma_m_s2 / first.m_s2)
}

/// Relative 1σ of the magnitude of the field, if all units with a magnetometer were calibrated in the same field.
fn shared_field(rows: &[Row]) -> Option<f64> {
    let usable = rows.iter().filter(|row| row.magnetic.is_ok());
    let fields = usable.filter_map(|row| {
        let calibrated = row.unit.calibrated.as_ref().ok()?;
        Some(&calibrated.calibration.mag.as_ref()?.field)
    });
    let mut all = fields.filter_map(|of| Some((of.magnitude, of.sigma?[0])));
    let (magnitude, sigma) = all.next().filter(|(_, sigma)| *sigma > 0.0)?;
    let same = all.all(|(of, _)| (of - magnitude).abs() < SAME_FIELD * sigma);
    same.then(|| sigma / magnitude)
}

/// Consistency of the difference of a calibration from the truth with its covariance.
fn nees_of(own: &Canonical, truth: &Canonical, parameters: &[usize]) -> Option<Nees> {
    // A truth without σ needs no correlations.
    let correlated = own.correlated && (truth.correlated || truth.covariance.is_none());
    let covariance = own.covariance.filter(|_| correlated)?;
    let covariance = covariance + truth.covariance.unwrap_or_default();
    nees(&(own.vector() - truth.vector()), &covariance, parameters)
}

/// χ² of the scatter of all parameters that every unit with correlations estimated.
fn joint_scatter(rows: &[Row], parameters: &[usize], shared: Shared) -> Option<ChiSquare> {
    let usable = rows.iter().filter_map(|row| row.canonical.as_ref().ok());
    let all = usable.filter(|of| of.correlated);
    let all = all.filter_map(|of| Some((of.vector(), of.covariance?)));
    let all: Vec<_> = all.collect();
    let estimated = |index: &usize| all.iter().all(|(_, p)| p[(*index, *index)] > 0.0);
    let indices: Vec<usize> = parameters.iter().copied().filter(estimated).collect();
    let n = indices.len();
    let shared = |i: usize| shared.of(Quantity::Parameter(indices[i]), 1.0);
    joint(all.iter().map(|(vector, covariance)| {
        let vector = DVector::from_fn(n, |i, _| vector[indices[i]]);
        let own = |i, j| covariance[(indices[i], indices[j])] - shared(i) * shared(j);
        (vector, DMatrix::from_fn(n, n, own))
    }))
}
