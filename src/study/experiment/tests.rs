use approx::assert_relative_eq;
use nalgebra::Vector2;

use super::budget::Budget;
use super::*;
use crate::calibration::{Group, Options, ParameterMatrix, Problem, in_general_form, six_position};
use crate::imu::{GaussMarkov, Noise};
use crate::models::{Place, trajectory};
use crate::study::navigation::Pair;
use crate::units::{DEG_PER_H, MICRO_G, MICRO_G_PER_SQRT_HZ, NAUTICAL_MILE};

/// The experiment at a low sample rate.
fn study(minutes: u32) -> ExperimentStudy {
    let mut scenario = Scenario::load("experiment").unwrap();
    scenario.integrator.period = 0.1;
    let (trajectory, trajectory_name) = trajectory("flight", &Place::Embedded).unwrap();
    ExperimentStudy {
        seed: scenario.seed,
        scenario,
        trajectory,
        trajectory_name,
        intervals: minutes,
        samples: 2,
    }
}

#[test]
fn what_exposure_says_of_a_closed_form_calibration_is_what_nonlinear_navigation_does() {
    exposure_against_navigation(&[(InstallationForm::General, 180, 0.02)]);
}

#[test]
#[ignore = "long: 20 h of navigation"]
fn what_exposure_says_is_what_nonlinear_navigation_does_for_many_hours() {
    exposure_against_navigation(&[
        (InstallationForm::General, 1200, 0.02),
        (InstallationForm::ThreeAngle, 600, 0.04),
    ]);
}

/// Misalignment form, minutes, and allowed difference of positions relative to the largest.
fn exposure_against_navigation(cases: &[(InstallationForm, u32, f64)]) {
    // Scale factors differ by a few parts in a thousand from those of the simulated instrument, and
    // half a degree of attitude or a hundred miles are no longer small.
    for &(form, minutes, within) in cases {
        let study = study(minutes);
        let scenario = study.scenario.clone().with_path(method::POSITIONS).unwrap();
        let simulated = scenario.simulate(3, 0).unwrap();
        let estimate = six_position(&Problem::new(
            &simulated.run,
            &Options::default().installation(form),
        ))
        .unwrap()
        .estimate;
        let pair = Pair {
            truth: in_general_form(&simulated.truth),
            calibration: estimate.in_general_form().triads,
            covariance: None,
        };
        let error = crate::calibration::to_vector(&pair.truth)
            - crate::calibration::to_vector(&pair.calibration);
        for situation in Situation::ALL {
            let mission = study.mission(situation);
            let start = match (&mission.motion, situation) {
                (Motion::Standing(at), Situation::SelfAligned) => {
                    let sensed = SensedErrors::new(&pair.truth).unwrap().at(&at.steady());
                    noise::by_itself(at) * sensed * error
                }
                _ => Default::default(),
            };
            let actual = mission.errors_from(&start, &pair).unwrap();
            let way = study.way(situation).unwrap();
            let position = |moment: usize| actual[moment].error.unwrap().position.xy();
            let last = actual.len() - 1;
            let largest = (0..=last).map(|k| position(k).norm()).fold(0.0, f64::max);
            for k in (0..=last).step_by(60) {
                let linear: Vector2<f64> = way.minutes[k].1 * error * NAUTICAL_MILE;
                let apart = (linear - position(k)).norm() / largest;
                assert!(apart < within, "{situation:?}, {form:?}, {k} min: {apart}");
            }
        }
    }
}

#[test]
fn a_gyro_bias_to_the_east_is_taken_for_heading_and_leaves_no_drift() {
    let drift = |situation, axis: usize| {
        let way = study(2400).way(situation).unwrap();
        let bias = parameter(Sensor::Gyro, 9 + axis);
        (way.end().column(bias) * (0.01 * DEG_PER_H)).norm() * NAUTICAL_MILE
    };
    let north = drift(Situation::SelfAligned, 1);
    let east = drift(Situation::SelfAligned, 0);
    assert!(north > 10e3, "{north} m");
    assert!(east < 1e-3 * north, "{east} m");
    assert!(drift(Situation::Aligned, 0) > 1e3);
}

#[test]
fn shares_of_a_budget_add_up_to_one_and_are_squares_of_what_groups_make_alone_without_correlations()
{
    let by_parameter = ByParameter::from_fn(|i, j| ((3 * i + 5 * j) as f64).sin());
    let root = ParameterMatrix::from_fn(|i, j| ((7 * i + 3 * j) as f64).cos());
    let calibrated = |covariance| Calibrated {
        error: ParameterVector::repeat(1.0),
        covariance,
        converged: true,
        rejects_form: false,
    };
    let correlated = calibrated(root * root.transpose());
    let diagonal = calibrated(ParameterMatrix::from_diagonal(
        &correlated.covariance.diagonal(),
    ));
    for (of, independent) in [(correlated, false), (diagonal, true)] {
        let budget = Budget::new(by_parameter, &[&of]);
        let sum: f64 = budget.parts.iter().map(|part| part.share).sum();
        assert_relative_eq!(sum, 1.0, epsilon = 1e-12);
        assert_eq!(budget.parts.len(), Group::all().count());
        for part in budget.parts {
            let square = (part.alone / budget.claimed).powi(2);
            let equal = (square - part.share).abs() < 1e-12;
            assert_eq!(equal, independent, "{part:?}");
        }
    }
}

#[test]
fn velocity_random_walk_and_a_constant_bias_grow_as_they_do_without_schuler() {
    let mission = study(2).mission(Situation::Aligned);
    let time: f64 = 120.0;
    let walk = MICRO_G_PER_SQRT_HZ;
    let noise = PerSensor {
        gyro: Noise::default(),
        accel: Noise {
            random_walk: walk,
            gauss_markov: None,
        },
    };
    let variance = noise::position(&mission, None, &noise).unwrap();
    // The Schuler motion has turned by 0.15 rad.
    let expected = walk * walk * time.powi(3) / 3.0;
    assert_relative_eq!(variance[(0, 0)], expected, max_relative = 0.02);

    let bias = 10.0 * MICRO_G;
    let wandering = PerSensor {
        gyro: Noise::default(),
        accel: Noise {
            random_walk: 0.0,
            gauss_markov: Some(GaussMarkov {
                sigma: bias,
                correlation_time: 1e9,
            }),
        },
    };
    let variance = noise::position(&mission, None, &wandering).unwrap();
    let expected = 0.5 * bias * time * time;
    assert_relative_eq!(variance[(1, 1)].sqrt(), expected, max_relative = 0.01);
}
