//! Comparison of calibrations: differences in one form and one frame, and their consistency with the
//! stated σ.

use super::frame::{Canonical, free_parameters, own_nominal};
use super::nees::{Nees, nees};
use super::scatter::{Scatter, scatter};
use crate::calibration::result::Calibration;
use crate::calibration::{ComparisonError, ParameterMatrix, ParameterVector, sensor_and_parameter};
use crate::imu::{BodyFrame, Nominal, ParameterKind, PerSensor, Sensor, Triad};

/// A record with its name in tables and messages.
#[derive(Debug, Clone, Copy)]
pub struct Named<'a> {
    /// Its name.
    pub name: &'a str,
    /// The calibration, or the truth.
    pub record: &'a Calibration,
}

/// Calibrations in the general form and a common body frame, compared with a reference.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The common frame: of the accelerometers if any record is in theirs.
    pub body_frame: BodyFrame,
    /// Scale factors of the reference in the quantity of the file, by which all are normalised.
    pub nominal: PerSensor<Nominal>,
    /// Nominal scale factors of the instrument, in the quantity of the file, if a record states them.
    pub stated_nominal: Option<PerSensor<[f64; 3]>>,
    /// The truth, or the first calibration.
    pub reference: Canonical,
    /// Whether the reference is a truth, which is exact except for its stated σ, if any.
    pub against_truth: bool,
    /// Indices of the parameters that the common frame leaves free.
    pub parameters: Vec<usize>,
    /// Every calibration except the reference, in the given order.
    pub sides: Vec<Side>,
    /// Scatter of all calibrations, if at least three.
    pub scatter: Option<Scatter>,
}

impl Comparison {
    /// The reference, then every other.
    pub fn calibrations(&self) -> impl Iterator<Item = &Canonical> {
        let sides = self.sides.iter().map(|side| &side.calibration);
        std::iter::once(&self.reference).chain(sides)
    }

    /// Scale factor of the reference in the quantity of the file; `None` for other parameters.
    pub fn scale_factor(&self, parameter: usize) -> Option<f64> {
        let (sensor, of_triad) = sensor_and_parameter(parameter);
        (Triad::kind(of_triad) == ParameterKind::Scale)
            .then(|| self.nominal.get(sensor).factor(of_triad))
    }

    /// Deviation of the scale factor of the reference from nominal; none for other parameters, or if no nominal value
    /// is stated.
    pub fn departure(&self, parameter: usize) -> Option<f64> {
        let (sensor, axis) = sensor_and_parameter(parameter);
        let nominal = self.stated_nominal.as_ref()?.get(sensor).get(axis)?;
        Some(self.scale_factor(parameter)? / nominal - 1.0)
    }
}

/// A calibration minus the reference.
#[derive(Debug, Clone, PartialEq)]
pub struct Side {
    /// The calibration.
    pub calibration: Canonical,
    /// Calibration minus reference, normalised: scale factors relative, angles pure numbers, biases in
    /// rad/s or m/s².
    pub difference: ParameterVector,
    /// 1σ of the difference, as if both came from independent data; `None` if one of them states no σ.
    pub difference_sigma: Option<ParameterVector>,
    /// Consistency of the difference with its covariance; `None` without covariance.
    pub nees: Option<Nees>,
}

impl Side {
    /// A calibration minus the reference of this covariance.
    fn new(
        calibration: Canonical,
        reference: &Canonical,
        known: Option<ParameterMatrix>,
        parameters: &[usize],
    ) -> Self {
        let difference = calibration.vector() - reference.vector();
        let covariance = known.zip(calibration.covariance).map(|(a, b)| a + b);
        // A reference without σ, a truth, has no correlations to miss.
        let correlated =
            calibration.correlated && (reference.correlated || reference.covariance.is_none());
        Self {
            difference,
            difference_sigma: covariance.map(|p| p.diagonal().map(|v| v.max(0.0).sqrt())),
            nees: covariance
                .filter(|_| correlated)
                .and_then(|p| nees(&difference, &p, parameters)),
            calibration,
        }
    }

    /// Difference in units of its σ; `None` if there is no σ.
    pub fn z(&self, parameter: usize) -> Option<f64> {
        let sigma = self.difference_sigma?[parameter];
        (sigma > 0.0).then(|| self.difference[parameter] / sigma)
    }
}

/// Compares calibrations with the truth or, without a truth, with the first of them.
pub fn compare(
    calibrations: &[Named],
    truth: Option<Named>,
) -> Result<Comparison, ComparisonError> {
    let all: Vec<Named> = truth
        .into_iter()
        .chain(calibrations.iter().copied())
        .collect();
    let [first, _, ..] = all[..] else {
        return Err(ComparisonError::Single);
    };
    same_units(&all)?;
    let in_accelerometer_frame = |n: &Named| n.record.body_frame == BodyFrame::Accelerometer;
    let body_frame = match all.iter().any(in_accelerometer_frame) {
        true => BodyFrame::Accelerometer,
        false => BodyFrame::Table,
    };
    let nominal = own_nominal(first.record);
    let provenance = all
        .iter()
        .find_map(|named| named.record.provenance.as_ref());
    let stated_nominal = provenance.map(|of| of.nominal);
    let canonical = |n: &Named| Canonical::new(n.name, n.record, &nominal, body_frame);
    let mut all: Vec<Canonical> = all.iter().map(canonical).collect::<Result<_, _>>()?;
    let parameters = free_parameters(body_frame);
    let estimates = &all[usize::from(truth.is_some())..];
    let scatter = (estimates.len() >= 3).then(|| {
        let reference = all[0].vector();
        scatter(estimates, &reference, &parameters)
    });
    let reference = all.remove(0);
    let exact = truth.is_some().then(ParameterMatrix::zeros);
    let known = reference.covariance.or(exact);
    let sides = all.into_iter();
    let sides = sides.map(|calibration| Side::new(calibration, &reference, known, &parameters));
    Ok(Comparison {
        body_frame,
        nominal,
        stated_nominal,
        against_truth: truth.is_some(),
        sides: sides.collect(),
        scatter,
        reference,
        parameters,
    })
}

/// Records without a unit are assumed to have that of the others.
fn same_units(all: &[Named]) -> Result<(), ComparisonError> {
    for sensor in Sensor::ALL {
        let mut stated = all.iter().filter_map(|n| {
            let unit = n.record.unit.as_ref()?.get(sensor);
            Some((n.name, unit))
        });
        let Some((name, expected)) = stated.next() else {
            continue;
        };
        if let Some((other, found)) = stated.find(|(_, unit)| *unit != expected) {
            return Err(ComparisonError::Unit {
                sensor,
                name: name.to_owned(),
                expected: expected.clone(),
                other: other.to_owned(),
                found: found.clone(),
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::result::frame::tests::{record, with_covariance};
    use crate::imu::InstallationForm;

    fn named<'a>(name: &'a str, record: &'a Calibration) -> Named<'a> {
        Named { name, record }
    }

    #[test]
    fn a_difference_is_calibration_less_reference_in_parts_of_the_reference() {
        let truth = record();
        let mut estimate = with_covariance(record(), InstallationForm::General);
        estimate.gyro.scale[1] *= 1.0 + 3e-6;
        estimate.accel.bias[0] += 2e-5 * 1.006e5;
        let comparison = compare(&[named("a", &estimate)], Some(named("truth", &truth))).unwrap();
        let side = &comparison.sides[0];
        assert!((side.difference[1] - 3e-6).abs() < 1e-15);
        assert!((side.difference[21] - 2e-5).abs() < 1e-15);
        let sigma = side.calibration.sigma().unwrap();
        assert_eq!(side.z(1), Some(side.difference[1] / sigma[1]));
        let swapped = compare(&[named("t", &truth), named("a", &truth)], None).unwrap();
        assert_eq!(swapped.sides[0].z(1), None);
        assert_eq!(swapped.sides[0].nees, None);
    }

    #[test]
    fn nees_of_the_truth_is_zero_and_of_one_sigma_along_one_axis_one_in_n() {
        let truth = record();
        let mut estimate = with_covariance(record(), InstallationForm::General);
        let nees = |estimate: &Calibration| {
            let comparison = compare(&[named("a", estimate)], Some(named("t", &truth))).unwrap();
            comparison.sides[0].nees.unwrap()
        };
        assert!(nees(&estimate).mean < 1e-12);
        assert_eq!(nees(&estimate).count, 24);
        for (i, row) in estimate.covariance.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                *value *= f64::from(i == j);
            }
        }
        estimate.gyro.bias[2] += estimate.covariance[11][11].sqrt();
        assert!((nees(&estimate).mean * 24.0 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn three_angles_have_as_many_directions_as_they_have_parameters() {
        let mut estimate = record();
        let c = InstallationForm::ThreeAngle.matrix(&[0.003, -0.002, 0.004, 0.0, 0.0, 0.0].into());
        for triad in [&mut estimate.gyro, &mut estimate.accel] {
            triad.installation = [0, 1, 2].map(|i| [c[(i, 0)], c[(i, 1)], c[(i, 2)]]);
        }
        let truth = estimate.clone();
        let estimate = with_covariance(estimate, InstallationForm::ThreeAngle);
        let comparison = compare(&[named("a", &estimate)], Some(named("t", &truth))).unwrap();
        assert_eq!(comparison.sides[0].nees.unwrap().count, 18);
    }

    #[test]
    fn two_calibrations_differ_by_the_sigma_of_both() {
        let (a, mut b) = (
            with_covariance(record(), InstallationForm::General),
            with_covariance(record(), InstallationForm::General),
        );
        b.unit = None;
        let comparison = compare(&[named("a", &a), named("b", &b)], None).unwrap();
        let own = comparison.reference.sigma().unwrap();
        let both = comparison.sides[0].difference_sigma.unwrap();
        assert!((both - own * 2f64.sqrt()).amax() < 1e-12 * own.amax());
        assert!(comparison.scatter.is_none() && !comparison.against_truth);
    }

    #[test]
    fn other_units_are_an_error_that_names_both() {
        let a = record();
        let mut b = record();
        if let Some(unit) = &mut b.unit {
            unit.accel = "m/s".to_owned();
        }
        let error = compare(&[named("one", &a), named("two", &b)], None).unwrap_err();
        let text = error.to_string();
        for part in ["one", "two", "accel", "`count`", "`m/s`"] {
            assert!(text.contains(part), "{text}");
        }
        let single = compare(&[named("one", &a)], None);
        assert_eq!(single.unwrap_err(), ComparisonError::Single);
    }
}
