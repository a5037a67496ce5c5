//! Claims of the error terms.

use nalgebra::Vector3;

use super::*;
use crate::units::{DEG_PER_H, STANDARD_GRAVITY};

/// With nothing special about it.
fn any() -> Sensed {
    Sensed {
        rate: Vector3::new(0.1, -0.2, 0.3),
        rate_over_earth: Vector3::new(0.3, -0.2, 0.1),
        angular_acceleration: Vector3::new(1.0, 2.0, 3.0),
        force: Vector3::new(4.0, -5.0, 6.0),
    }
}

#[test]
fn every_parameter_has_a_term_a_name_and_a_triad_that_responds() {
    let sensed = any();
    let mut names: Vec<String> = (0..TERM_PARAMETERS)
        .map_while(Term::parameter_name)
        .collect();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), TERM_PARAMETERS);
    assert_eq!(Term::parameter_name(TERM_PARAMETERS), None);
    let q = TermVector::zeros();
    for parameter in 0..TERM_PARAMETERS {
        let sensor = Term::of(parameter).unwrap().entry().sensor;
        for of in Sensor::ALL {
            let responds = sensed.response(of, &q).column(parameter).norm() > 0.0;
            assert_eq!(responds, of == sensor, "{parameter}");
        }
    }
}

#[test]
fn an_accelerometer_on_an_arm_senses_centripetal_and_tangential_acceleration() {
    // 2 rad/s about z, faster by 3 rad/s², accelerometer x at 0.1 m along x and 0.2 m along y.
    let sensed = Sensed {
        rate: Vector3::new(0.0, 0.0, 2.0),
        rate_over_earth: Vector3::new(0.0, 0.0, 2.0),
        angular_acceleration: Vector3::new(0.0, 0.0, 3.0),
        force: Vector3::new(1.0, 0.0, 0.0),
    };
    let mut q = TermVector::zeros();
    q[Term::SizeEffect.parameters().start] = 0.1;
    q[Term::SizeEffect.parameters().start + 1] = 0.2;
    let added = sensed.added(Sensor::Accel, &q);
    // −ω² x − ω̇ y along x, nothing along y for the accelerometer x.
    assert!((added - Vector3::new(-4.0 * 0.1 - 3.0 * 0.2, 0.0, 0.0)).norm() < 1e-15);
}

#[test]
fn samples_of_a_later_time_sense_gravity_turned_more() {
    let rate = Vector3::new(0.0, 0.4, 0.0);
    let up = |t: f64| crate::attitude::exp(-rate * t) * Vector3::new(0.0, 0.0, 9.8);
    let sensed = Sensed {
        rate,
        rate_over_earth: rate,
        angular_acceleration: Vector3::zeros(),
        force: up(1.0),
    };
    let offset = 0.02;
    let mut q = TermVector::zeros();
    q[Term::TimeOffset.parameters().start] = offset;
    let added = sensed.added(Sensor::Accel, &q);
    assert!((up(1.0 + offset) - up(1.0) - added).norm() < 1e-13);
}

#[test]
fn the_response_is_the_derivative_of_what_is_added() {
    let sensed = any();
    let q = TermVector::from_fn(|k, _| 1e-3 * (k as f64 - 7.0));
    for sensor in Sensor::ALL {
        let response = sensed.response(sensor, &q);
        for k in 0..TERM_PARAMETERS {
            let mut step = TermVector::zeros();
            step[k] = 1e-5;
            let difference = sensed.added(sensor, &(q + step)) - sensed.added(sensor, &(q - step));
            // The offset turns its own response by q ω, which is left out.
            let off = (response.column(k) - difference / 2e-5).norm();
            assert!(off < 1e-2, "{k}: {off}");
        }
    }
}

#[test]
fn an_asymmetry_adds_the_same_in_both_senses_of_turn_and_a_nonlinearity_the_opposite() {
    let turning = |rate: f64| Sensed {
        rate: Vector3::new(rate, 0.0, 0.0),
        ..any()
    };
    let added = |term: Term, k: usize, rate: f64| {
        let mut q = TermVector::zeros();
        q[term.parameters().start + k] = 1e-6;
        turning(rate).added(Sensor::Gyro, &q).x
    };
    for rate in [0.5 * REFERENCE_RATE, -0.5 * REFERENCE_RATE] {
        let scaled = |factor: f64| 1e-6 * factor * REFERENCE_RATE;
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-18, "{a} {b}");
        close(added(Term::GyroAsymmetry, 0, rate), scaled(0.5));
        close(added(Term::GyroSecondOrder, 0, rate), scaled(0.25));
        let sense = rate.signum();
        close(added(Term::GyroNonlinearity, 0, rate), sense * scaled(0.25));
        close(
            added(Term::GyroNonlinearity, 3, rate),
            sense * scaled(0.125),
        );
    }
}

#[test]
fn a_gyro_that_yields_under_load_drifts_by_as_much_up_as_down_and_not_across() {
    let mut q = TermVector::zeros();
    let [deg_per_h_per_g2, g] = [Term::G2Sensitivity.entry().unit.1, STANDARD_GRAVITY];
    q[Term::G2Sensitivity.parameters().start + 2] = 0.3 * deg_per_h_per_g2;
    let drift = |force: Vector3<f64>| Sensed { force, ..any() }.added(Sensor::Gyro, &q);
    for (force, drifts) in [
        (Vector3::z() * g, 0.3),
        (Vector3::z() * -g, 0.3),
        (Vector3::x() * g, 0.0),
        (Vector3::new(0.6, 0.0, 0.8) * g, 0.3 * 0.64),
    ] {
        let expected = Vector3::z() * drifts * DEG_PER_H;
        assert!((drift(force) - expected).norm() < 1e-18, "{force}");
    }
}

#[test]
fn a_parameter_of_an_accelerometer_adds_the_product_or_the_power_that_its_name_says() {
    let force = Vector3::new(3.0, -5.0, 7.0);
    let added = |term: Term, name: &str| {
        let mut parameters = term.parameters();
        let named = parameters.find(|&k| {
            let of = Term::parameter_name(k);
            of.is_some_and(|of| of.ends_with(name))
        });
        let mut q = TermVector::zeros();
        q[named.unwrap()] = 1e-6;
        Sensed { force, ..any() }.added(Sensor::Accel, &q) / 1e-6
    };
    let x = Vector3::x();
    for (name, product) in [(".x.xy", -15.0), (".x.xz", 21.0), (".x.yz", -35.0)] {
        let expected = x * product;
        assert!(
            (added(Term::AccelCrossCoupling, name) - expected).norm() < 1e-9,
            "{name}"
        );
    }
    let y = Vector3::y();
    assert!((added(Term::AccelThirdOrder, ".y") - y * -125.0).norm() < 1e-9);
    assert!((added(Term::AccelSecondOrder, ".y") - y * 25.0).norm() < 1e-9);
    assert!((added(Term::AccelAsymmetry, ".y") - y * 5.0).norm() < 1e-9);
}
