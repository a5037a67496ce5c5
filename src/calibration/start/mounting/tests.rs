use nalgebra::Vector3;

use super::*;
use crate::calibration::Options;
use crate::recording::{LabelledMotion, Segment};
use crate::run::Aiding;
use crate::simulation::Scenario;

/// One sign, two, three; each swap; a cycle; a quarter turn.
fn wrong() -> Vec<AxisOrder> {
    let order = |source, reversed| AxisOrder { source, reversed };
    vec![
        order([0, 1, 2], [true, false, false]),
        order([0, 1, 2], [false, true, true]),
        order([0, 1, 2], [true, true, true]),
        order([1, 0, 2], [false; 3]),
        order([2, 1, 0], [false; 3]),
        order([0, 2, 1], [false; 3]),
        order([1, 2, 0], [false; 3]),
        order([1, 0, 2], [false, true, false]),
    ]
}

fn simulated(scenario: &str) -> Run {
    let scenario = Scenario::load(scenario).unwrap();
    scenario.simulate(1, 0).unwrap().run
}

fn without_table(scenario: &str) -> Run {
    let mut run = simulated(scenario);
    run.recording.table = None;
    run
}

fn mounted(run: &Run, orders: &PerSensor<AxisOrder>) -> Run {
    let mut run = run.clone();
    let imu = &mut run.recording.imu;
    for (sensor, samples) in [
        (Sensor::Gyro, imu.gyro.to_mut()),
        (Sensor::Accel, imu.accel.to_mut()),
    ] {
        for sample in samples {
            *sample = orders.get(sensor).apply(sample);
        }
    }
    run
}

fn found_in(problem: &Problem) -> Option<Mounting> {
    match Contradiction::of(problem) {
        Some((_, Contradiction::Axes(mounting))) => Some(mounting),
        Some((_, other)) => panic!("{other}"),
        None => None,
    }
}

fn found(run: &Run) -> Option<Mounting> {
    found_in(&Problem::new(run, &Options::default()))
}

fn pair(gyro: AxisOrder, accel: AxisOrder) -> PerSensor<AxisOrder> {
    PerSensor { gyro, accel }
}

const SOUND: AxisOrder = AxisOrder::IDENTITY;

#[test]
fn a_sound_run_has_the_mounting_that_is_stated() {
    for scenario in [
        "demo",
        "mems",
        "nineteen-position",
        "real-table",
        "two-axis",
    ] {
        let run = simulated(scenario);
        for aiding in [Aiding::Table, Aiding::Velocity] {
            let problem = Problem::new(&run, &Options::default().aiding(aiding));
            assert_eq!(found_in(&problem), None, "{scenario} {aiding:?}");
        }
    }
}

#[test]
fn against_a_table_the_order_of_each_triad_is_found() {
    let run = simulated("mems");
    for order in wrong() {
        for orders in [pair(order, SOUND), pair(SOUND, order), pair(order, order)] {
            let found = found(&mounted(&run, &orders)).unwrap();
            let right = pair(orders.gyro.inverse(), orders.accel.inverse());
            assert_eq!(found.orders, right);
        }
    }
}

#[test]
fn without_a_table_one_triad_is_put_right_by_the_other() {
    let run = without_table("nineteen-position");
    for order in wrong() {
        for orders in [pair(order, SOUND), pair(SOUND, order)] {
            let found = found(&mounted(&run, &orders)).unwrap();
            // Where one triad is turned against the other, either may be turned back.
            let total = pair(
                orders.gyro.after(&found.orders.gyro),
                orders.accel.after(&found.orders.accel),
            );
            assert_eq!(total.gyro, total.accel, "{orders:?}: {found:?}");
            assert!(total.gyro.is_rotation());
            if !order.is_rotation() {
                assert_eq!(total.gyro, SOUND, "{orders:?}: {found:?}");
            }
        }
    }
}

#[test]
fn a_turn_of_both_triads_is_a_body_frame_but_left_handed_axes_are_none() {
    let run = without_table("nineteen-position");
    for order in wrong() {
        let found = found(&mounted(&run, &pair(order, order)));
        assert_eq!(found.is_none(), order.is_rotation(), "{found:?}");
    }
}

#[test]
fn a_record_that_does_not_tell_says_nothing() {
    // One dwell of a MEMS instrument has neither a move nor an Earth rate.
    let mut run = without_table("mems");
    run.recording.imu.gyro.to_mut().truncate(3000);
    run.recording.imu.accel.to_mut().truncate(3000);
    run.recording.imu.stretches[0].samples = 0..3000;
    for order in wrong() {
        assert_eq!(found(&mounted(&run, &pair(order, SOUND))), None);
        assert_eq!(found(&mounted(&run, &pair(SOUND, order))), None);
    }
}

#[test]
fn labels_say_what_gravity_alone_does_not() {
    let mut run = simulated("nineteen-position");
    let dwells = run.dwells(Aiding::Table);
    for dwell in dwells {
        let attitude = dwell.position.unwrap().attitude;
        let up = attitude.tr_mul(&Vector3::z());
        let axis = up.iamax();
        if up[axis].abs() < 0.999 {
            continue;
        }
        run.recording.segments.push(Segment {
            start: run.recording.imu.time(dwell.samples.start),
            end: run.recording.imu.time(dwell.samples.end),
            samples: dwell.samples,
            label: "position".to_owned(),
            motion: Some(LabelledMotion::Stands {
                up: Vector3::ith(axis, up[axis].signum()),
            }),
        });
    }
    run.recording.table = None;
    assert_eq!(found(&run), None);
    for order in wrong() {
        let right = order.inverse();
        for orders in [pair(SOUND, order), pair(order, order)] {
            let found = found(&mounted(&run, &orders)).unwrap();
            assert_eq!(found.orders.accel, right);
            assert_eq!(found.orders.gyro, orders.gyro.inverse());
        }
    }
}

#[test]
fn a_prior_far_from_the_instrument_is_no_mounting() {
    let mut run = simulated("demo");
    for sensor in Sensor::ALL {
        let prior = run.instrument.prior.get_mut(sensor);
        let off = prior.bias_sigma * 20.0;
        prior.bias += off;
        prior.scale_sigma /= 20.0;
        prior.installation_sigma /= 20.0;
    }
    assert_eq!(found(&run), None);
}

#[test]
fn a_table_of_another_run_is_no_mounting() {
    let mut run = simulated("demo");
    let other = simulated("nineteen-position");
    run.recording.table = other.recording.table;
    assert_eq!(found(&run), None);
}

#[test]
fn a_scale_below_zero_in_the_prior_counts_with_the_sign_of_its_column() {
    let mut run = simulated("demo");
    let scale = &mut run.instrument.nominal.gyro.0;
    scale.x = -scale.x;
    let swapped = AxisOrder {
        source: [1, 0, 2],
        reversed: [false; 3],
    };
    let line = line(&run, &pair(swapped, SOUND));
    assert!(
        line.contains("gyro = [\"-gyro.y\", \"-gyro.x\", \"gyro.z\"]"),
        "{line}"
    );
}
