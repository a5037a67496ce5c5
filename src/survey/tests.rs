use std::f64::consts::PI;

use nalgebra::Vector3;

use crate::attitude::matrix;

use super::*;
use crate::recording::{LabelledMotion, Segment};
use crate::simulation::Scenario;
use crate::units::DEGREE;

fn demo() -> Run {
    Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run
}

fn segment(run: &Run, samples: std::ops::Range<usize>, motion: LabelledMotion) -> Segment {
    Segment {
        start: run.recording.imu.time(samples.start),
        end: run.recording.imu.time(samples.end),
        samples,
        label: "any".to_owned(),
        motion: Some(motion),
    }
}

#[test]
fn rests_say_which_axis_the_table_holds_up() {
    let run = demo();
    let survey = Survey::of(&run);
    assert_eq!(survey.rests.len(), 18);
    for rest in &survey.rests {
        let c = rest.dwell.position.as_ref().unwrap().attitude;
        let up = c[(2, rest.up.axis)];
        // Installation and biases of the instrument are arc minutes.
        assert!(((up.abs()).acos() - rest.up.tilt).abs() < 1.0 * DEGREE);
        assert_eq!(up < 0.0, rest.up.down);
    }
}

#[test]
fn turns_are_those_of_the_table_full_turns_too() {
    let run = demo();
    let survey = Survey::of(&run);
    let table = run.recording.table.as_ref().unwrap();
    assert_eq!(survey.turns.len(), 17);
    for turn in &survey.turns[..3] {
        let full = 4.0 * PI;
        assert!((turn.angle.abs() - full).abs() < 0.01 * full && turn.body_axis().is_some());
    }
    for (turn, pair) in survey.turns.iter().zip(survey.rests.windows(2)) {
        let attitude = |rest: &Rest| {
            matrix(&table.attitude[rest.dwell.position.as_ref().unwrap().readings.start])
        };
        let said = attitude(&pair[0]).transpose() * attitude(&pair[1]);
        let found = crate::attitude::exp(turn.axis * turn.angle);
        let off = crate::attitude::log(&(found * said.transpose())).norm();
        // Scale factors are 0.7 % off at most.
        let limit = 1.0 * DEGREE + 0.01 * turn.angle.abs();
        assert!(off < limit, "{}°", off / DEGREE);
    }
}

#[test]
fn a_label_is_held_against_axis_angle_sign_and_borders() {
    let mut run = demo();
    let found = Survey::of(&run);
    let (rest, turn) = (&found.rests[0], &found.turns[0]);
    let up = rest.force.normalize();
    let standing = rest.dwell.samples.clone();
    let turning = turn.samples.clone();
    let middle = turning.start + turning.len() / 2;
    let turns = |angle| LabelledMotion::Turns {
        axis: turn.axis,
        angle,
    };
    let stands = |up: Vector3<f64>| LabelledMotion::Stands { up };
    let cases = [
        (standing.clone(), stands(up), true),
        (standing.clone(), stands(-up), false),
        (
            standing.clone(),
            stands(Vector3::ith(up.iamin(), 1.0)),
            false,
        ),
        (standing.start..middle, stands(up), false),
        (turning.clone(), turns(turn.angle), true),
        (turning.clone(), turns(-turn.angle), false),
        (turning.clone(), turns(0.5 * turn.angle), false),
        (turning.start..middle, turns(0.5 * turn.angle), false),
    ];
    run.recording.segments = cases
        .iter()
        .map(|(samples, motion, _)| segment(&run, samples.clone(), *motion))
        .collect();
    for (check, (.., agrees)) in Survey::of(&run).labels.iter().zip(cases) {
        assert_eq!(check.disagreement.is_none(), agrees, "{:?}", check.verdict);
    }
}

#[test]
fn what_a_run_lacks_is_not_promised() {
    let run = demo();
    let of = |run: &Run, path| {
        let survey = Survey::of(run);
        let mut methods = survey.methods.into_iter();
        methods.find(|(of, _)| *of == path).unwrap().1
    };
    assert!(of(&run, Path::TableAiding).unwrap().unobserved.is_empty());
    let mut alone = run.clone();
    alone.recording.table = None;
    assert!(of(&alone, Path::TableAiding).is_err());
    // The first turns are about one axis, level: gravity shows neither the others nor their up.
    let few = 2 * run.recording.imu.len() / 10;
    let mut short = alone.clone();
    short.recording.imu.gyro.to_mut().truncate(few);
    short.recording.imu.accel.to_mut().truncate(few);
    short.recording.imu.stretches[0].samples.end = few;
    let expected = of(&short, Path::VelocityAiding).unwrap();
    assert!(
        expected
            .unobserved
            .iter()
            .any(|name| name.starts_with("gyro.scale")),
        "{expected:?}"
    );
    assert!(
        expected
            .unobserved
            .iter()
            .any(|name| name.starts_with("accel.scale")),
        "{expected:?}"
    );
    // Of sections laid end to end nothing is known between dwells, so no turn is observed; and by Earth
    // rate alone these gyros do not show their scale.
    let mut sections = alone;
    sections.instrument.noise.gyro.random_walk *= 100.0;
    sections.recording.imu.continuous = false;
    let unobserved = of(&sections, Path::VelocityAiding).unwrap().unobserved;
    for axis in ["x", "y", "z"] {
        let name = format!("gyro.scale.{axis}");
        assert!(unobserved.contains(&name), "{unobserved:?}");
    }
}
