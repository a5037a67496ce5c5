use std::f64::consts::PI;

use approx::assert_relative_eq;
use nalgebra::{Matrix3, Vector3};

use super::*;
use crate::attitude::log;
use crate::turntable::{Rotation, TableErrors};

fn table(errors: TableErrors) -> Table {
    let axis = |name: &str, direction| Axis {
        name: name.into(),
        direction,
        max_rate: 1.0,
        max_acceleration: 1.0,
    };
    Table {
        axes: vec![
            axis("outer", Vector3::z()),
            axis("middle", Vector3::x()),
            axis("inner", Vector3::y()),
        ],
        mount: exp(Vector3::new(0.1, -0.2, 0.3)),
        errors,
    }
}

fn crooked() -> (Table, Imperfection) {
    let table = table(TableErrors {
        level: 0.01,
        north: 0.02,
        nonorthogonality: 0.03,
        wobble: 0.04,
        ..TableErrors::default()
    });
    let mut number = 0.3;
    let imperfection = Imperfection::draw(&table, || {
        number = (number * 7.3_f64).sin();
        number
    });
    (table, imperfection)
}

fn step(angles: [f64; 3]) -> AxesStep {
    AxesStep {
        angles: angles.to_vec(),
        rate: 0.5,
        acceleration: 0.4,
        dwell: 5.0,
    }
}

fn path(steps: &[[f64; 3]]) -> Path {
    Path {
        first_dwell: 2.0,
        moves: Moves::Axes {
            start: vec![0.2, 0.1, -0.3],
            steps: steps.iter().copied().map(step).collect(),
        },
    }
}

#[test]
fn rate_and_acceleration_are_the_derivatives_of_the_attitude_on_a_crooked_table() {
    let (table, imperfection) = crooked();
    let path = path(&[[1.0, -0.5, 0.7], [0.0, 2.0, 0.0], [-1.0, 0.0, 0.0]]);
    let motion = Motion::new(&table, &path, &imperfection).unwrap();
    let step = 1e-5;
    for k in 0..500 {
        let time = motion.duration() * (f64::from(k) + 0.3) / 500.0;
        let (before, at, after) = (
            motion.at(time - step),
            motion.at(time),
            motion.at(time + step),
        );
        let rate = log(&(before.attitude.tr_mul(&after.attitude))) / (2.0 * step);
        assert!((rate - at.rate).norm() < 1e-9);
        let acceleration = (after.rate - before.rate) / (2.0 * step);
        assert!((acceleration - at.acceleration).norm() < 2e-5);
        assert_eq!(motion.stands(time), at.rate == Vector3::zeros());
    }
}

#[test]
fn attitude_is_continuous_from_dwell_to_move_and_a_full_turn_closes() {
    let (table, imperfection) = crooked();
    let path = path(&[[2.0 * PI, 0.0, 0.0], [0.0, 0.0, 2.0 * PI], [0.3, 0.0, 0.1]]);
    let motion = Motion::new(&table, &path, &imperfection).unwrap();
    for &time in motion.breaks() {
        let jump = motion.at(time + 1e-9).attitude - motion.at(time - 1e-9).attitude;
        assert!(jump.amax() < 2e-9);
    }
    let dwells: Vec<_> = motion.dwells().map(|(start, _)| motion.at(start)).collect();
    assert_eq!(dwells.len(), 4);
    for turned in &dwells[1..3] {
        assert_relative_eq!(turned.attitude, dwells[0].attitude, epsilon = 1e-14);
    }
}

#[test]
fn a_position_begins_when_the_table_starts_to_move() {
    let (table, imperfection) = crooked();
    let motion = Motion::new(&table, &path(&[[1.0, 0.0, 0.0]; 2]), &imperfection).unwrap();
    assert_eq!(motion.position(1.999), 0);
    assert_eq!(motion.position(2.001), 1);
    assert!(!motion.stands(2.001));
    assert_eq!(motion.position(motion.duration()), 2);
}

#[test]
fn an_outer_axis_at_a_quarter_turn_swings_the_front_axis_from_north_to_west() {
    let mut table = table(TableErrors::default());
    table.mount = Matrix3::identity();
    let path = Path {
        first_dwell: 1.0,
        moves: Moves::Axes {
            start: vec![PI / 2.0, 0.0, 0.0],
            steps: Vec::new(),
        },
    };
    let motion = Motion::new(&table, &path, &Imperfection::none(&table)).unwrap();
    let front = motion.at(0.5).attitude * Vector3::y();
    assert_relative_eq!(front, -Vector3::x(), epsilon = 1e-15);
}

#[test]
fn pointing_brings_a_body_axis_along_its_direction_even_when_it_points_away() {
    let table = table(TableErrors::default());
    let along = Vector3::new(0.0, 0.8, 0.6);
    let point = |axis: Vector3<f64>| BodyStep {
        rotation: Rotation::Point { axis, along },
        duration: 20.0,
        acceleration: 0.5,
        dwell: 1.0,
    };
    let axes = [Vector3::x(), -Vector3::x(), Vector3::z(), -Vector3::z()];
    let path = Path {
        first_dwell: 0.0,
        moves: Moves::Body {
            start: Matrix3::identity(),
            steps: axes.map(point).to_vec(),
        },
    };
    let motion = Motion::new(&table, &path, &Imperfection::none(&table)).unwrap();
    for (axis, (start, _)) in axes.iter().zip(motion.dwells().skip(1)) {
        assert_relative_eq!(motion.at(start).attitude * axis, along, epsilon = 1e-14);
    }
}

#[test]
fn what_is_beyond_the_table_is_refused_by_name() {
    let (table, imperfection) = crooked();
    let refused = |path: &Path| {
        Motion::new(&table, path, &imperfection)
            .unwrap_err()
            .to_string()
    };
    let fast = |rate, acceleration| Path {
        first_dwell: 0.0,
        moves: Moves::Axes {
            start: vec![0.0; 3],
            steps: vec![AxesStep {
                rate,
                acceleration,
                ..step([0.0, 9.0, 0.0])
            }],
        },
    };
    assert!(refused(&fast(1.1, 1.0)).contains("the middle axis"));
    assert!(refused(&fast(1.0, 1.1)).contains("acceleration"));
    let two = Moves::Axes {
        start: vec![0.0; 2],
        steps: Vec::new(),
    };
    let two = Path {
        first_dwell: 0.0,
        moves: two,
    };
    assert!(refused(&two).contains("2 angles for a table with 3 axes"));
    let body = Path {
        first_dwell: 0.0,
        moves: Moves::Body {
            start: Matrix3::identity(),
            steps: Vec::new(),
        },
    };
    assert!(refused(&body).contains("body axes"));
}
