use super::*;
use crate::calibration::parameters::from_vector;
use crate::calibration::parameters::{ParameterMatrix, parameter};
use crate::imu::Sensor;

const FORM: InstallationForm = InstallationForm::General;

/// What is left after measuring combinations of parameters, each given by its components in
/// units of the prior σ, a hundred times as well as they were known.
fn observed(combinations: &[&[(usize, f64)]]) -> Observability {
    let prior = ParameterVector::from_fn(|i, _| 1e-3 * (1.0 + i as f64));
    let mut information = ParameterMatrix::identity();
    for combination in combinations {
        let mut h = ParameterVector::zeros();
        for &(index, component) in *combination {
            h[index] = component;
        }
        information += 1e4 * h * h.transpose();
    }
    let scale = ParameterMatrix::from_diagonal(&prior);
    let estimate = Estimate {
        triads: from_vector(FORM, &ParameterVector::zeros()),
        covariance: scale * information.try_inverse().unwrap() * scale,
    };
    let mut attitude = AttitudeCovariance::zeros();
    attitude[(0, 2)] = -0.8 * prior[0];
    Observability::new(&estimate, &prior, &attitude)
}

fn index(name: &str) -> usize {
    (0..PARAMETERS)
        .find(|&i| parameter_name(FORM, i).as_deref() == Some(name))
        .unwrap()
}

#[test]
fn what_only_a_sum_shows_is_unobserved_as_a_difference() {
    let (xy, yx) = (index("gyro.installation.xy"), index("gyro.installation.yx"));
    let alone: Vec<[(usize, f64); 1]> = (1..PARAMETERS)
        .filter(|i| ![xy, yx].contains(i))
        .map(|i| [(i, 1.0)])
        .collect();
    let mut combinations: Vec<&[(usize, f64)]> = alone.iter().map(|c| &c[..]).collect();
    let sum = [(xy, 1.0), (yx, 1.0)];
    combinations.push(&sum);
    let observability = observed(&combinations);
    let mut words: Vec<String> = observability
        .unobserved()
        .map(|d| d.words.clone())
        .collect();
    words.sort();
    assert_eq!(
        words,
        [
            "gyro misalignment xy against gyro misalignment yx",
            "gyro scale x with heading"
        ]
    );
    assert!(observability.directions[1].remaining > 0.999);
    assert!(observability.directions[2].remaining < 0.011);
}

#[test]
fn many_parameters_that_were_not_observed_are_each_a_direction_of_its_own() {
    let seen = [(parameter(Sensor::Gyro, 2), 1.0)];
    let observability = observed(&[&seen]);
    let unobserved: Vec<_> = observability.unobserved().collect();
    assert_eq!(unobserved.len(), PARAMETERS - 1);
    assert!(
        unobserved
            .iter()
            .all(|d| d.parts.len() == 1 && !d.words.ends_with("others"))
    );
}

#[test]
fn a_combination_of_observed_parameters_that_was_not_observed_is_named() {
    // Of six parameters all differences are known: each alone is left with 1/√6 of its σ.
    let six: Vec<usize> = (12..18).collect();
    let mut combinations: Vec<Vec<(usize, f64)>> = (0..PARAMETERS)
        .filter(|i| !six.contains(i))
        .map(|i| vec![(i, 1.0)])
        .collect();
    combinations.extend(six.windows(2).map(|w| vec![(w[0], 1.0), (w[1], -1.0)]));
    let combinations: Vec<&[(usize, f64)]> = combinations.iter().map(|c| &c[..]).collect();
    let warnings = observed(&combinations).combinations(&[]);
    assert_eq!(warnings.len(), 1);
    assert!(
        warnings[0].contains("accel scale x with") || warnings[0].contains("with accel scale x"),
        "{warnings:?}"
    );
}
