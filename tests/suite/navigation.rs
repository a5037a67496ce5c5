//! Navigation over the ellipsoid and its linear error model, against closed forms, against each other
//! and against an independent program.

mod error_model;
mod flight;

use approx::assert_abs_diff_eq;
use flight::{Course, Flight};
use nalgebra::{SVector, Vector3};
use serde_json::Value;
use turncal::attitude::from_pitch_roll_heading;
use turncal::earth::Curvature;
use turncal::navigation::error_model::INPUTS;
use turncal::navigation::{Height, Increments, Instant, NavigationError, Solution, Strapdown};
use turncal::units::{ARCSEC, DEGREE, NAUTICAL_MILE};

use crate::shared::shared;

const HOUR: f64 = 3600.0;

fn standing(latitude: f64) -> Solution {
    Solution {
        attitude: from_pitch_roll_heading(0.0, 0.0, 0.0),
        velocity: Vector3::zeros(),
        latitude,
        longitude: 0.0,
        height: 0.0,
    }
}

/// Errors of sensed rate (rad/s) and specific force (m/s²) along body axes.
#[derive(Clone, Copy)]
struct Sensed {
    gyro: Vector3<f64>,
    accel: Vector3<f64>,
}

impl Sensed {
    fn input(&self) -> SVector<f64, INPUTS> {
        SVector::from_fn(|i, _| {
            if i < 3 {
                self.gyro[i]
            } else {
                self.accel[i - 3]
            }
        })
    }
}

/// Navigation errors after each hour from none on, of a body that keeps velocity and attitude and does
/// not move over the Earth.
fn hourly(
    truth: &Solution,
    start: &Solution,
    error: Sensed,
    step: f64,
    hours: usize,
) -> Vec<NavigationError> {
    let Instant { rate, force, .. } = truth.steady();
    let increments = Increments {
        angle: (rate + error.gyro) * step,
        velocity: (force + error.accel) * step,
    };
    let held = Height::Held {
        height: truth.height,
        velocity: 0.0,
    };
    let mut navigation = Strapdown::new(*start, step).unwrap();
    let mut errors = vec![NavigationError::of(navigation.solution(), truth)];
    for _ in 0..hours {
        for _ in 0..(HOUR / step).round() as usize {
            navigation.advance(&increments, held).unwrap();
        }
        errors.push(NavigationError::of(navigation.solution(), truth));
    }
    errors
}

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().unwrap();
    list.iter().map(|v| v.as_f64().unwrap()).collect()
}

#[test]
fn forty_hours_agree_with_an_independent_program_hour_by_hour() {
    let Some(directory) = shared("../reference") else {
        return;
    };
    let file = std::fs::File::open(directory.join("nav_cases.json")).unwrap();
    let document: Value = serde_json::from_reader(file).unwrap();
    for case in document["cases"].as_array().unwrap() {
        let truth = standing(case["latitude_deg"].as_f64().unwrap() * DEGREE);
        let of = |name: &str| Vector3::from_column_slice(&numbers(&case["applied_error_SI"][name]));
        let error = Sensed {
            gyro: of("gyro"),
            accel: of("accel"),
        };
        let found = hourly(&truth, &truth, error, 10.0, 40);
        let expected = case["nonlinear"].as_array().unwrap();
        assert_eq!(found.len(), expected.len());
        // Largest differences: attitude in degrees, velocity in m/s, position in nautical miles.
        let mut apart = [0f64; 3];
        for (found, expected) in found.iter().zip(expected) {
            let row = numbers(expected);
            let differences = [
                (found.attitude / DEGREE - Vector3::new(row[1], row[2], row[3])).amax(),
                (found.velocity - Vector3::new(row[4], row[5], 0.0)).amax(),
                (found.horizontal_position() / NAUTICAL_MILE - row[9]).abs(),
            ];
            apart
                .iter_mut()
                .zip(differences)
                .for_each(|(a, d)| *a = a.max(d));
        }
        println!("{}: ° m/s nmile {apart:?}", case["name"]);
        let expected = &case["linear_pitch_roll_heading_vel_pos"];
        let apart = error_model::apart_from(expected, &truth, error);
        println!("linear: {apart:?}");
        assert!(
            apart[0] < 1e-9 && apart[1] < 1e-7 && apart[2] < 1e-7,
            "{apart:?}"
        );
        // Asked for are 1e-6°, 1e-3 m/s and 1e-3 nmile.
        assert!(
            apart[0] < 1e-8 && apart[1] < 1e-5 && apart[2] < 1e-6,
            "{apart:?}"
        );
    }
}

#[test]
fn an_ideal_instrument_that_stands_stays_where_it_is_for_forty_hours() {
    for latitude in [-55.0, 0.0, 34.0, 80.0] {
        let truth = Solution {
            attitude: from_pitch_roll_heading(0.5, -1.0, 2.5),
            height: 1200.0,
            ..standing(latitude * DEGREE)
        };
        let none = Sensed {
            gyro: Vector3::zeros(),
            accel: Vector3::zeros(),
        };
        let end = hourly(&truth, &truth, none, 1.0, 40)[40];
        println!("{latitude}°: {end:?}");
        assert!(end.attitude.amax() < 1e-11, "{latitude}°: {end:?}");
        assert!(end.velocity.amax() < 1e-8, "{latitude}°: {end:?}");
        // Of latitude and longitude 1e-11 rad.
        assert!(end.horizontal_position() < 6e-5, "{latitude}°: {end:?}");
    }
}

#[test]
fn a_steady_flight_along_a_parallel_closes_the_circle() {
    // Everything is constant in East-North-Up: longitude grows by V / (R_N + h) cos L and nothing else
    // happens.
    for (latitude, speed) in [(-33.0, 250.0), (60.0_f64, -300.0_f64)] {
        let start = Solution {
            attitude: from_pitch_roll_heading(0.05, -0.2, speed.signum() * 1.5),
            velocity: Vector3::new(speed, 0.0, 0.0),
            height: 10_000.0,
            ..standing(latitude * DEGREE)
        };
        let Instant { rate, force, .. } = start.steady();
        let step = 10.0;
        let increments = Increments {
            angle: rate * step,
            velocity: force * step,
        };
        let held = Height::Held {
            height: start.height,
            velocity: 0.0,
        };
        let mut navigation = Strapdown::new(start, step).unwrap();
        let hours = 10.0;
        for _ in 0..(hours * HOUR / step) as usize {
            navigation.advance(&increments, held).unwrap();
        }
        let radius = Curvature::at(start.latitude).prime_vertical + start.height;
        let truth = Solution {
            longitude: speed * hours * HOUR / (radius * start.latitude.cos()),
            ..start
        };
        let error = NavigationError::of(navigation.solution(), &truth);
        assert!(error.attitude.amax() < 1e-9, "{error:?}");
        assert!(error.velocity.amax() < 1e-5, "{error:?}");
        assert!(error.horizontal_position() < 1e-2, "{error:?}");
    }
}

/// About 250 m/s with slow turns of heading, rolling, pitching and climbing.
fn flight(latitude: f64, north: f64, east: f64, turning: f64) -> Flight {
    let course = |start: f64, rate: f64, amplitude: f64, frequency: f64| Course {
        start,
        rate,
        amplitude,
        frequency,
    };
    Flight {
        latitude: course(latitude, north / 6.37e6, 2e-4, 0.011),
        longitude: course(0.3, east / 6.37e6 / latitude.cos(), -3e-4, 0.013),
        height: course(3000.0, 2.0, 400.0, 0.02),
        pitch: course(0.03, 0.0, 0.04, 0.5),
        roll: course(-0.1, 0.0, 0.25, 0.23),
        heading: course(1.0, turning, 0.3, 0.07),
    }
}

#[test]
fn a_flight_in_closed_form_is_followed_in_both_hemispheres_and_turning_both_ways() {
    for (latitude, north, east, turning) in [
        (0.8, 180.0, 170.0, 0.05),
        (-0.6, -200.0, 150.0, -0.05),
        (-0.05, 170.0, -180.0, 0.03),
    ] {
        let flight = flight(latitude, north, east, turning);
        let period = 0.02;
        let steps = 90_000;
        let computed = flight.navigate(period, steps, false);
        let error = NavigationError::of(&computed, &flight.truth(period * steps as f64));
        println!("half an hour: {error:?}");
        assert!(error.attitude.amax() < 1e-3 * ARCSEC, "{error:?}");
        assert!(error.horizontal_velocity() < 1e-5, "{error:?}");
        assert!(error.horizontal_position() < 1e-2, "{error:?}");
    }
}

#[test]
fn errors_fall_with_the_third_power_of_the_step() {
    let flight = flight(0.8, 180.0, 170.0, 0.05);
    let error = |period: f64| {
        let steps = (240.0 / period).round() as usize;
        let computed = flight.navigate(period, steps, true);
        NavigationError::of(&computed, &flight.truth(240.0))
    };
    let (coarse, fine) = (error(0.2), error(0.1));
    for (coarse, fine) in [
        (coarse.attitude, fine.attitude),
        (coarse.velocity, fine.velocity),
        (coarse.position, fine.position),
    ] {
        let order = (coarse.norm() / fine.norm()).log2();
        println!("order {order:.2}");
        assert!(order > 2.8, "order {order}: {coarse:?} {fine:?}");
    }
}

#[test]
fn a_free_height_runs_away_as_the_hyperbolic_cosine_of_five_hundred_and_seventy_seconds() {
    let truth = standing(0.7);
    let start = Solution {
        height: 1.0,
        ..truth
    };
    let Instant { rate, force, .. } = truth.steady();
    let increments = Increments {
        angle: rate,
        velocity: force,
    };
    let mut navigation = Strapdown::new(start, 1.0).unwrap();
    for _ in 0..2000 {
        navigation.advance(&increments, Height::Free).unwrap();
    }
    // κ² = 2g/R to the ellipsoid's flattening; Torge, Geodesy, 4th ed., §4.2.1: 0.3086 mGal/m.
    let growth = (2000.0 * 3.086e-6f64.sqrt()).cosh();
    assert_abs_diff_eq!(navigation.solution().height / growth, 1.0, epsilon = 0.01);
    assert_abs_diff_eq!(1.0 / 3.086e-6f64.sqrt(), 570.0, epsilon = 1.0);
}

#[test]
fn navigation_over_a_pole_is_refused_and_says_so() {
    let start = Solution {
        velocity: Vector3::new(0.0, 250.0, 0.0),
        ..standing(89.5 * DEGREE)
    };
    let increments = Increments {
        angle: Vector3::zeros(),
        velocity: Vector3::new(0.0, 0.0, 9.83),
    };
    let mut navigation = Strapdown::new(start, 1.0).unwrap();
    let held = Height::Held {
        height: 0.0,
        velocity: 0.0,
    };
    let refusal = (0..1000).find_map(|_| navigation.advance(&increments, held).err());
    assert!(refusal.unwrap().to_string().contains("pole"));
    assert!(navigation.solution().latitude < 89.91 * DEGREE);
    let blind = Increments {
        velocity: Vector3::repeat(f64::NAN),
        ..increments
    };
    assert!(navigation.advance(&blind, held).is_err());
    assert!(Strapdown::new(standing(90.0 * DEGREE), 1.0).is_err());
}
