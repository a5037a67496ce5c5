//! Parameters that the prior does not allow, and what most likely made them so.

use nalgebra::Vector3;

use super::finding::Finding;
use super::prior_cause::PriorCause;
use crate::calibration::estimate::Estimate;
use crate::calibration::model::Model;
use crate::calibration::parameters::{
    ParameterMatrix, from_vector, parameter, parameter_name, sensor_and_parameter,
};
use crate::imu::{AXES, ParameterKind, PerSensor, Sensor, Triad};
use crate::statistics::chi_square_limit;
use crate::units::{DEGREE, PPM};

/// Parameters further from their prior than this many of its σ contradict it.
const CONTRADICTS: f64 = 5.0;
/// Chance that a prior which is right is widened.
const FALSE_ALARM: f64 = 1e-3;
/// What data do not see, rounding moves by such a part of the prior's variance.
const ROUNDING: f64 = 1e-9;
/// Parts that differ by less than this much of what they have in common are alike.
const ALIKE: f64 = 0.5;

/// Parameters of an estimate that are too far from their prior, as a finding, if there are any.
pub fn far_from_prior(model: &Model, estimate: &Estimate) -> Option<Finding> {
    let far = far(model, estimate);
    let off = estimate.vector() - model.prior_mean;
    let names = far
        .iter()
        .filter_map(|&i| parameter_name(estimate.form(), i));
    (!far.is_empty()).then(|| Finding::FarFromPrior {
        sigmas: CONTRADICTS,
        parameters: names.collect(),
        distances: far.iter().map(|&i| off[i] / model.prior_sigma[i]).collect(),
        causes: causes(&far, &estimate.triads),
    })
}

/// Parameters of which the data alone say other than their prior does, where that is in the estimate; by the
/// covariance of how far data bring an estimate from a prior that is right.
///
/// A prior that is too tight holds the estimate, so that its distance says nothing. With `P⁻¹ = S⁻¹ + V⁻¹` of
/// prior and data it is `P V⁻¹` of theirs, `P S⁻¹ P V⁻¹` its variance where the prior is right: over its σ it is what
/// theirs is over both σ.
pub fn far_by_data(
    model: &Model,
    estimate: &Estimate,
    distance: &ParameterMatrix,
) -> Option<Finding> {
    let mut by_data = estimate.vector();
    let mut sigma = estimate.sigma();
    for i in estimate.estimated() {
        let (off, prior) = (by_data[i] - model.prior_mean[i], model.prior_sigma[i]);
        let share = distance[(i, i)] / prior.powi(2);
        if off == 0.0 || share.is_nan() || share <= ROUNDING {
            continue;
        }
        by_data[i] = model.prior_mean[i] + off / share;
        // Both σ together are those of the distance over the share that the data have in it.
        sigma[i] = prior * (share.recip() - 1.0).max(0.0).sqrt();
    }
    let by_data = Estimate {
        triads: from_vector(estimate.form(), &by_data),
        covariance: ParameterMatrix::from_diagonal(&sigma.map(|sigma| sigma.powi(2))),
    };
    far_from_prior(model, &by_data)
}

/// The model with a prior that its estimate does not contradict: where it does, σ of each parameter is at
/// least its distance. None where the prior holds. A wrong prior would make sound observations outliers,
/// and noise of what is none.
pub fn widened(model: &Model, estimate: &Estimate) -> Option<Model> {
    let off = estimate.vector() - model.prior_mean;
    let known: Vec<usize> = estimate
        .estimated()
        .filter(|&i| model.prior_sigma[i] > 0.0)
        .collect();
    let distance = |&i: &usize| (off[i] / model.prior_sigma[i]).powi(2);
    let squared: f64 = known.iter().map(distance).sum();
    let limit = chi_square_limit(known.len() as f64, FALSE_ALARM);
    let contradicted = squared > limit || !far(model, estimate).is_empty();
    let mut widened = model.clone();
    for &i in &known {
        widened.prior_sigma[i] = widened.prior_sigma[i].max(off[i].abs());
    }
    contradicted.then_some(widened)
}

/// The parameters that contradict their prior. Their own σ counts with the prior's, for an estimate may
/// be made without it.
fn far(model: &Model, estimate: &Estimate) -> Vec<usize> {
    let sigma = estimate.sigma();
    let off = estimate.vector() - model.prior_mean;
    let far = |&i: &usize| {
        let prior = model.prior_sigma[i];
        prior > 0.0 && off[i].abs() > CONTRADICTS * prior.hypot(sigma[i])
    };
    estimate.estimated().filter(far).collect()
}

fn causes(far: &[usize], triads: &PerSensor<Triad>) -> Vec<PriorCause> {
    let of = |sensor: Sensor, kind: ParameterKind| {
        let is = |&&i: &&usize| {
            let (of, parameter) = sensor_and_parameter(i);
            of == sensor && Triad::kind(parameter) == kind
        };
        far.iter().filter(is).count()
    };
    let mut causes = Vec::new();
    for sensor in Sensor::ALL {
        let name = sensor.name();
        let scale = triads.get(sensor).scale;
        let reversed: Vec<char> = (0..3)
            .filter(|&axis| scale[axis] < 0.0 && far.contains(&parameter(sensor, axis)))
            .map(|axis| AXES[axis])
            .collect();
        let off = scale.add_scalar(-1.0);
        if !reversed.is_empty() {
            causes.push(PriorCause::Reversed {
                sensor: name,
                axes: reversed,
            });
        } else if of(sensor, ParameterKind::Scale) == 3 && alike(&off, &Vector3::repeat(off.mean()))
        {
            causes.push(PriorCause::Unit {
                sensor: name,
                off_ppm: off.mean() / PPM,
            });
        } else if of(sensor, ParameterKind::Scale) > 0 {
            causes.push(PriorCause::Scale { sensor: name });
        }
    }
    causes.extend(of_installation(
        triads,
        PerSensor::from_fn(|sensor| of(sensor, ParameterKind::Installation) > 0),
    ));
    for sensor in Sensor::ALL {
        if of(sensor, ParameterKind::Bias) > 0 {
            causes.push(PriorCause::Bias {
                sensor: sensor.name(),
            });
        }
    }
    causes
}

/// Whether a vector is near another by the measure of that.
fn alike(one: &Vector3<f64>, other: &Vector3<f64>) -> bool {
    (one - other).norm() < ALIKE * other.norm()
}

fn of_installation(triads: &PerSensor<Triad>, far: PerSensor<bool>) -> Vec<PriorCause> {
    // To first order the halves of installation that are a rotation, and what is left.
    let turn = |sensor: Sensor| {
        let c = triads.get(sensor).installation();
        let half = (c - c.transpose()) * 0.5;
        Vector3::new(half[(2, 1)], half[(0, 2)], half[(1, 0)])
    };
    let skew = |sensor: Sensor| {
        let c = triads.get(sensor).installation();
        Vector3::new(
            c[(2, 1)] + c[(1, 2)],
            c[(0, 2)] + c[(2, 0)],
            c[(1, 0)] + c[(0, 1)],
        ) * 0.5
    };
    let [of_gyro, of_accel] = Sensor::ALL.map(turn);
    let common = (of_gyro + of_accel) * 0.5;
    if far.gyro && far.accel && alike(&of_gyro, &common) {
        return vec![PriorCause::Mount {
            angle_deg: common.norm() / DEGREE,
        }];
    }
    let of_triad = |sensor: Sensor| {
        let (turn, skew, name) = (turn(sensor).norm(), skew(sensor).norm(), sensor.name());
        match skew < ALIKE * turn {
            true => PriorCause::Turned {
                sensor: name,
                angle_deg: turn / DEGREE,
            },
            false => PriorCause::Skewed { sensor: name },
        }
    };
    let triads = Sensor::ALL.into_iter();
    triads
        .filter(|&sensor| *far.get(sensor))
        .map(of_triad)
        .collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;
    use crate::calibration::Options;
    use crate::imu::InstallationForm;
    use crate::simulation::Scenario;

    /// What is found of triads with this sensitivity, which are known to a part of the prior's σ.
    fn found(sensitivity: PerSensor<Matrix3<f64>>) -> Option<Vec<PriorCause>> {
        let run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
        let model = Model::new(&run, &Options::default());
        let triads = PerSensor::from_fn(|sensor| {
            let bias = run.instrument.prior.get(sensor).bias;
            Triad::from_sensitivity(InstallationForm::General, sensitivity.get(sensor), bias)
        });
        let covariance = ParameterMatrix::from_diagonal(&(model.prior_sigma * 0.01).map(|s| s * s));
        match far_from_prior(&model, &Estimate { triads, covariance }) {
            Some(Finding::FarFromPrior { causes, .. }) => Some(causes),
            _ => None,
        }
    }

    fn one_degree() -> Matrix3<f64> {
        crate::attitude::exp(Vector3::new(0.0, 0.0, DEGREE))
    }

    #[test]
    fn what_lies_within_the_prior_is_not_named() {
        assert_eq!(found(PerSensor::from_fn(|_| Matrix3::identity())), None);
    }

    #[test]
    fn an_axis_that_senses_against_its_body_axis_is_reversed() {
        let mut gyro = Matrix3::identity();
        gyro[(1, 1)] = -1.0;
        let accel = Matrix3::identity();
        let reversed = PriorCause::Reversed {
            sensor: "gyro",
            axes: vec!['y'],
        };
        assert_eq!(found(PerSensor { gyro, accel }), Some(vec![reversed]));
    }

    #[test]
    fn triads_turned_alike_are_the_mount_and_one_turned_is_itself() {
        let causes = found(PerSensor::from_fn(|_| one_degree())).unwrap();
        assert!(
            matches!(causes[..], [PriorCause::Mount { angle_deg }] if (angle_deg - 1.0).abs() < 1e-3)
        );
        let accel = Matrix3::identity();
        let causes = found(PerSensor {
            gyro: one_degree(),
            accel,
        })
        .unwrap();
        assert!(
            matches!(causes[..], [PriorCause::Turned { sensor: "gyro", .. }]),
            "{causes:?}"
        );
    }

    #[test]
    fn scale_factors_off_alike_are_a_unit() {
        let accel = Matrix3::identity() * 1.5;
        let gyro = Matrix3::identity();
        let causes = found(PerSensor { gyro, accel }).unwrap();
        assert!(
            matches!(
                causes[..],
                [PriorCause::Unit {
                    sensor: "accel",
                    ..
                }]
            ),
            "{causes:?}"
        );
    }
}
