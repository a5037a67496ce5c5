//! What a path cannot observe is said, and nothing is invented.

use turncal::calibration::PARAMETERS;
use turncal::calibration::parameter_name;
use turncal::imu::InstallationForm;
use turncal::simulation::Scenario;

use crate::simulated::{Trial, accurate_as_claimed, says, trial};

const FORM: InstallationForm = InstallationForm::General;

/// What turns about the vertical, with all dwells at one heading, cannot show. The gyros' inputs are
/// the turn along z and one constant vector of Earth rate, which their biases take up; all
/// accelerometers have one constant input, gravity along z, which biases take up but for the prior.
const UNOBSERVED: [&str; 15] = [
    "gyro.scale.x",
    "gyro.scale.y",
    "gyro.installation.xy",
    "gyro.installation.yx",
    "gyro.installation.zx",
    "gyro.installation.zy",
    "accel.scale.x",
    "accel.scale.y",
    "accel.installation.xy",
    "accel.installation.yx",
    "accel.installation.zx",
    "accel.installation.zy",
    "accel.bias.x",
    "accel.bias.y",
    "accel.bias.z",
];

fn name(index: usize) -> String {
    parameter_name(FORM, index).unwrap()
}

#[test]
fn turns_about_one_axis_say_in_words_what_they_did_not_observe() {
    let scenario = Scenario::load("single-axis").unwrap();
    let outcome = trial(&scenario, 0).outcome;
    let unobserved: Vec<String> = outcome.unobserved().into_iter().map(name).collect();
    for i in (0..PARAMETERS).filter(|&i| UNOBSERVED.contains(&&*name(i))) {
        let left = outcome.estimate.sigma()[i] / outcome.prior_sigma[i];
        // While it turns, the table modulates what level gyros sense of Earth rate; that is little.
        assert!(left > 0.9, "{} {left}", name(i));
    }
    assert_eq!(unobserved, UNOBSERVED);
    assert_eq!(outcome.observability.unobserved().count(), UNOBSERVED.len());
    assert!(says(
        &outcome,
        "gyro scale x, y; gyro misalignment xy, yx, zx, zy; accel scale x, y; \
         accel misalignment xy, yx, zx, zy; accel bias x, y, z"
    ));
}

#[test]
fn turns_about_one_axis_invent_nothing_and_get_right_what_they_observe() {
    about_one_axis(3);
}

#[test]
#[ignore = "statistical: 20 runs"]
fn turns_about_one_axis_invent_nothing_over_many_runs() {
    about_one_axis(20);
}

fn about_one_axis(runs: u64) {
    let scenario = Scenario::load("single-axis").unwrap();
    let trials = accurate_as_claimed(runs, |stream| trial(&scenario, stream));
    for Trial {
        normalised,
        outcome,
        ..
    } in &trials
    {
        let sigma = outcome.estimate.sigma();
        let moved = outcome.estimate.vector() - outcome.model.prior_mean;
        for i in 0..PARAMETERS {
            // What was learnt is how far the estimate may have left the prior's mean.
            let prior = outcome.prior_sigma[i];
            let learnt = (prior.powi(2) - sigma[i].powi(2)).max(0.0).sqrt();
            let limit = 4.5 * learnt + 0.01 * prior;
            assert!(moved[i].abs() < limit, "{} moved", name(i));
            assert!(
                normalised[i].abs() < 4.5,
                "{} is off by {:.2} σ",
                name(i),
                normalised[i]
            );
        }
    }
}
