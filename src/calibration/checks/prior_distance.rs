//! Parameters that contradict their prior, and the likely causes.

use nalgebra::Vector3;
use serde_json::{Value, json};

use crate::calibration::start::mounting::is_beyond_tolerance;
use crate::calibration::{
    Estimate, Finding, FindingKind as Kind, Model, ParameterMatrix, from_vector, parameter,
    parameter_name, sensor_and_parameter,
};
use crate::imu::{AXES, ParameterKind, PerSensor, Sensor, Triad};
use crate::statistics::{FALSE_ALARM, chi_square_limit};
use crate::units::{DEGREE, PPM};

/// Parameters farther from their prior than this many prior σ contradict it.
const CONTRADICTS: f64 = 5.0;
/// Fraction of the prior variance by which rounding changes unobserved parameters.
const ROUNDING: f64 = 1e-9;
/// Two vectors are similar if they differ by less than this fraction of their common part.
const ALIKE: f64 = 0.5;

/// The finding on parameters of an estimate that are too far from their prior, if any.
pub fn far_from_prior(model: &Model, estimate: &Estimate) -> Option<Finding> {
    let far = far(model, estimate);
    let off = estimate.vector() - model.prior_mean;
    let named = far.iter().filter_map(|&i| {
        let name = parameter_name(estimate.form(), i)?;
        Some((name, off[i] / model.prior_sigma[i]))
    });
    let (names, distances): (Vec<String>, Vec<f64>) = named.unzip();
    let each = names.iter().zip(&distances);
    let each: Vec<String> = each
        .map(|(name, by)| format!("{name} by {by:+.0} σ"))
        .collect();
    let (words, causes): (Vec<String>, Vec<Value>) =
        causes(&far, &estimate.triads).into_iter().unzip();
    let text = format!(
        "These parameters are more than {CONTRADICTS} prior σ from their prior values in [imu.prior]: {}. Likely cause: {}.",
        each.join(", "),
        words.join("; ")
    );
    let figures = json!({
        "sigmas": CONTRADICTS, "parameters": names, "distances": distances, "causes": causes
    });
    let kind = if far.iter().any(|&i| is_another_scale(model, estimate, i)) {
        Kind::PriorContradicted
    } else {
        Kind::FarFromPrior
    };
    (!far.is_empty()).then(|| Finding::new(kind, text, figures))
}

/// Whether a parameter is a scale factor whose distance from the prior cannot be explained by a careless prior.
fn is_another_scale(model: &Model, estimate: &Estimate, index: usize) -> bool {
    let (_, of_triad) = sensor_and_parameter(index);
    let factor = estimate.vector()[index] / model.prior_mean[index];
    Triad::kind(of_triad) == ParameterKind::Scale
        && is_beyond_tolerance(factor, model.prior_sigma[index])
}

/// The finding on parameters for which the data alone contradict the prior, if the estimate includes the prior.
///
/// If the prior is too tight, it constrains the estimate, so the distance of this estimate from the prior is not
/// informative. With `P⁻¹ = S⁻¹ + V⁻¹` (S for the prior, V for the data), the distance of the estimate is `P V⁻¹` times
/// that of the data. For a correct prior, its covariance is `P S⁻¹ P V⁻¹ = S − P`. Normalised, it thus equals the
/// distance between data and prior relative to both σ.
pub fn far_by_data(model: &Model, estimate: &Estimate) -> Option<Finding> {
    let mut by_data = estimate.vector();
    let mut sigma = estimate.sigma();
    for i in estimate.estimated() {
        let (off, prior) = (by_data[i] - model.prior_mean[i], model.prior_sigma[i]);
        let share = 1.0 - (sigma[i] / prior).powi(2);
        if off == 0.0 || share.is_nan() || share <= ROUNDING {
            continue;
        }
        by_data[i] = model.prior_mean[i] + off / share;
        // Both σ together equal that of the distance, divided by the weight of the data in the estimate.
        sigma[i] = prior * (share.recip() - 1.0).max(0.0).sqrt();
    }
    let by_data = Estimate {
        triads: from_vector(estimate.form(), &by_data),
        covariance: ParameterMatrix::from_diagonal(&sigma.map(|sigma| sigma.powi(2))),
    };
    far_from_prior(model, &by_data)
}

/// The model with a prior widened so that its estimate does not contradict it: σ of every parameter is at least its
/// distance. `None` if no parameter contradicts the prior. With a wrong prior, correct observations would become
/// outliers, and the error of the prior would be taken for noise.
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

/// The parameters that contradict their prior. Their own σ is added to the prior σ, because the estimate may not
/// include the prior.
fn far(model: &Model, estimate: &Estimate) -> Vec<usize> {
    let sigma = estimate.sigma();
    let off = estimate.vector() - model.prior_mean;
    let far = |&i: &usize| {
        let prior = model.prior_sigma[i];
        prior > 0.0 && off[i].abs() > CONTRADICTS * prior.hypot(sigma[i])
    };
    estimate.estimated().filter(far).collect()
}

/// The likely cause of parameters that contradict their prior: text and figures.
type Cause = (String, Value);

fn causes(far: &[usize], triads: &PerSensor<Triad>) -> Vec<Cause> {
    let count = |sensor: Sensor, kind: ParameterKind| {
        let of = far.iter().map(|&i| sensor_and_parameter(i));
        of.filter(|&(of, i)| of == sensor && Triad::kind(i) == kind)
            .count()
    };
    let scales = Sensor::ALL.into_iter().filter_map(|sensor| {
        let count = count(sensor, ParameterKind::Scale);
        (count > 0).then(|| of_scales(sensor, &triads.get(sensor).scale, far, count))
    });
    let angles = PerSensor::from_fn(|sensor| count(sensor, ParameterKind::Installation) > 0);
    let biases = Sensor::ALL
        .into_iter()
        .filter(|&of| count(of, ParameterKind::Bias) > 0);
    let biases = biases.map(|sensor| {
        let sensor = sensor.name();
        let words = format!(
            "the stated {sensor} bias or bias_sigma does not fit the instrument (include a register offset in bias)"
        );
        (words, json!({ "cause": "bias", "sensor": sensor }))
    });
    let installation = of_installation(triads, angles);
    scales.chain(installation).chain(biases).collect()
}

/// Likely cause for the scale factors of a triad, of which `count` are far from their prior.
fn of_scales(of: Sensor, scale: &Vector3<f64>, far: &[usize], count: usize) -> Cause {
    let is_reversed = |&axis: &usize| scale[axis] < 0.0 && far.contains(&parameter(of, axis));
    let reversed: Vec<String> = (0..3)
        .filter(is_reversed)
        .map(|k| AXES[k].to_string())
        .collect();
    let (off, sensor) = (scale.add_scalar(-1.0), of.name());
    if !reversed.is_empty() {
        let axes = reversed.join(", ");
        let words = format!(
            "{sensor} {axes} is reversed (put a minus sign before the column name in columns of [imu])"
        );
        let figures = json!({ "cause": "reversed", "sensor": sensor, "axes": reversed });
        return (words, figures);
    }
    if count == 3 && alike(&off, &Vector3::repeat(off.mean())) {
        let off_ppm = off.mean() / PPM;
        let other = match of {
            Sensor::Gyro => "sample period",
            Sensor::Accel => "gravity",
        };
        let words = format!(
            "all three {sensor} scale factors are off by {off_ppm:+.0} ppm (check {sensor}_unit, scale and {other})"
        );
        let figures = json!({ "cause": "unit", "sensor": sensor, "off_ppm": off_ppm });
        return (words, figures);
    }
    let words = format!("the stated {sensor} scale or scale_sigma_ppm does not fit the instrument");
    (words, json!({ "cause": "scale", "sensor": sensor }))
}

/// Whether the difference of two vectors is small relative to the second.
fn alike(one: &Vector3<f64>, other: &Vector3<f64>) -> bool {
    (one - other).norm() < ALIKE * other.norm()
}

/// Likely causes for the misalignment angles of triads with some angles far from their prior.
fn of_installation(triads: &PerSensor<Triad>, far: PerSensor<bool>) -> Vec<Cause> {
    // To first order the antisymmetric half of installation is a rotation, the symmetric half a skew.
    let half = |sensor: Sensor, sign: f64| {
        let c = triads.get(sensor).installation();
        let of = |i, j| 0.5 * (c[(i, j)] + sign * c[(j, i)]);
        Vector3::new(of(2, 1), of(0, 2), of(1, 0))
    };
    let turn = |sensor| half(sensor, -1.0);
    let common = (turn(Sensor::Gyro) + turn(Sensor::Accel)) * 0.5;
    if far.gyro && far.accel && alike(&turn(Sensor::Gyro), &common) {
        let angle_deg = common.norm() / DEGREE;
        let words = format!(
            "both triads are rotated together by {angle_deg:.3}° (check how the instrument is mounted, the zero, \
             level and north of the table, and the labels)"
        );
        return vec![(words, json!({ "cause": "mount", "angle_deg": angle_deg }))];
    }
    let of_triad = |of: Sensor| {
        let (turn, sensor) = (turn(of).norm(), of.name());
        if half(of, 1.0).norm() >= ALIKE * turn {
            let words = format!(
                "the {sensor} axes are not orthogonal (check the stated positions and labels; if these are correct, \
                 installation_sigma_arcsec is too small)"
            );
            return (words, json!({ "cause": "skewed", "sensor": sensor }));
        }
        let angle_deg = turn / DEGREE;
        let words = format!(
            "the {sensor} triad is rotated by {angle_deg:.3}° (check how it is mounted in the instrument or, for \
             gyros, whether there is a time offset)"
        );
        let figures = json!({ "cause": "turned", "sensor": sensor, "angle_deg": angle_deg });
        (words, figures)
    };
    let triads = Sensor::ALL.into_iter().filter(|&sensor| *far.get(sensor));
    triads.map(of_triad).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;
    use crate::calibration::{Options, Verdict, Word};
    use crate::imu::InstallationForm;
    use crate::run::Run;
    use crate::simulation::Scenario;

    /// The finding for a run of triads with this sensitivity, known to a fraction of the prior σ.
    fn found_in(run: &Run, sensitivity: PerSensor<Matrix3<f64>>) -> Option<Finding> {
        let model = Model::new(run, &Options::default());
        let triads = PerSensor::from_fn(|sensor| {
            let bias = run.instrument.prior.get(sensor).bias;
            Triad::from_sensitivity(InstallationForm::General, sensitivity.get(sensor), bias)
        });
        let covariance = ParameterMatrix::from_diagonal(&(model.prior_sigma * 0.01).map(|s| s * s));
        far_from_prior(&model, &Estimate { triads, covariance })
    }

    fn demo() -> Run {
        Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run
    }

    fn found(sensitivity: PerSensor<Matrix3<f64>>) -> Option<Value> {
        let finding = found_in(&demo(), sensitivity)?;
        Some(finding.figures["causes"].clone())
    }

    #[test]
    fn a_scale_factor_that_no_careless_prior_explains_fails_the_calibration() {
        let mut run = demo();
        let mut word = |prior_sigma: f64, factor: f64| {
            run.instrument.prior.gyro.scale_sigma = Vector3::repeat(prior_sigma);
            let (mut gyro, accel) = (Matrix3::identity(), Matrix3::identity());
            gyro[(1, 1)] = factor;
            let finding = found_in(&run, PerSensor { gyro, accel })?;
            let contradicted = finding.is(Kind::PriorContradicted);
            assert_eq!(contradicted, !finding.is(Kind::FarFromPrior));
            let word = Verdict::of(&[finding]).word;
            assert_eq!(contradicted, word == Word::Failed);
            Some(word)
        };
        // Up to 10 % a tight prior is careless, beyond that by up to ten of its σ, and beyond 41 % it never is.
        assert_eq!(word(1e-3, 1.003), None);
        assert_eq!(word(1e-3, 1.09), Some(Word::UseWithCare));
        assert_eq!(word(1e-3, 1.12), Some(Word::Failed));
        assert_eq!(word(1e-3, 0.88), Some(Word::Failed));
        assert_eq!(word(0.03, 1.25), Some(Word::UseWithCare));
        assert_eq!(word(0.03, 1.4), Some(Word::Failed));
        assert_eq!(word(0.07, 1.4), Some(Word::UseWithCare));
        assert_eq!(word(0.07, 1.45), Some(Word::Failed));
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
        let reversed = json!([{ "cause": "reversed", "sensor": "gyro", "axes": ["y"] }]);
        assert_eq!(found(PerSensor { gyro, accel }), Some(reversed));
    }

    #[test]
    fn triads_turned_alike_are_the_mount_and_one_turned_is_itself() {
        let causes = found(PerSensor::from_fn(|_| one_degree())).unwrap();
        assert_eq!(causes[0]["cause"], "mount");
        assert!((causes[0]["angle_deg"].as_f64().unwrap() - 1.0).abs() < 1e-3);
        let accel = Matrix3::identity();
        let gyro = one_degree();
        let causes = found(PerSensor { gyro, accel }).unwrap();
        assert_eq!(causes[0]["cause"], "turned");
        assert_eq!(causes[0]["sensor"], "gyro");
        assert_eq!(causes.as_array().unwrap().len(), 1);
    }

    #[test]
    fn scale_factors_off_alike_are_a_unit() {
        let accel = Matrix3::identity() * 1.5;
        let gyro = Matrix3::identity();
        let causes = found(PerSensor { gyro, accel }).unwrap();
        assert_eq!(causes.as_array().unwrap().len(), 1);
        assert_eq!(causes[0]["cause"], "unit");
        assert_eq!(causes[0]["sensor"], "accel");
    }
}
