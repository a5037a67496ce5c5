//! Labelled sections: σ hold what a hand and an unknown heading leave open.

use turncal::calibration::{
    Options, Problem, in_general_form, mean_square_interval, parameter_name, six_position,
    to_vector,
};
use turncal::simulation::Scenario;
use turncal::units::{ARCSEC, DEGREE};

use crate::closed_form::{OUTSIDE, by_hand};

/// Mean square of errors over σ of some parameters, over runs turned by hand.
fn mean_square(scenario: &str, tilt: f64, runs: u64, parameters: [&str; 3]) -> f64 {
    let scenario = Scenario::load(scenario).unwrap();
    let mut sum = 0.0;
    for seed in 0..runs {
        let made = by_hand(&scenario, tilt, seed);
        let closed_form = six_position(&Problem::new(&made.run, &Options::default())).unwrap();
        let estimate = &closed_form.estimate;
        let truth = to_vector(&in_general_form(&made.truth));
        let (error, sigma) = (estimate.vector() - truth, estimate.sigma());
        let named = |&k: &usize| {
            let name = parameter_name(estimate.form(), k);
            name.is_some_and(|name| parameters.contains(&name.as_str()))
        };
        let squares = estimate.estimated().filter(named);
        sum += squares.map(|k| (error[k] / sigma[k]).powi(2)).sum::<f64>();
    }
    sum / (3 * runs) as f64
}

#[test]
fn turns_by_hand_are_off_at_both_ends_and_earth_rate_acts_through_misalignment() {
    let scales = ["gyro.scale.x", "gyro.scale.y", "gyro.scale.z"];
    let biases = ["gyro.bias.x", "gyro.bias.y", "gyro.bias.z"];
    let (low, high) = mean_square_interval(36, OUTSIDE);
    let of_scales = mean_square("mems", DEGREE, 12, scales);
    assert!((low..=high).contains(&of_scales), "{of_scales}");
    let of_biases = mean_square("demo", ARCSEC, 12, biases);
    assert!(of_biases < high, "{of_biases}");
}
