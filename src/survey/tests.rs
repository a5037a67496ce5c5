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

/// A sensor that is held and turned by hand: attitudes are off by degrees, as a person's are.
mod by_hand {
    use rand::seq::SliceRandom;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rayon::prelude::*;

    use super::*;
    use crate::attitude::exp;
    use crate::calibration::{Method, NoisePolicy, UNWATCHED, parameter};
    use crate::imu::Sensor;
    use crate::models;
    use crate::turntable::{BodyStep, Moves, Path, Rotation};

    struct Person {
        scenario: Scenario,
        rng: ChaCha8Rng,
        seed: u64,
    }

    impl Person {
        fn new(seed: u64) -> Self {
            let mut scenario = Scenario::load("mems").unwrap();
            scenario.integrator.lever_arm = Vector3::zeros();
            scenario.path = Path {
                first_dwell: 6.0,
                moves: Moves::Body {
                    start: exp(Vector3::new(0.05, -0.08, 0.3)),
                    steps: Vec::new(),
                },
            };
            let rng = ChaCha8Rng::seed_from_u64(seed);
            Self {
                scenario,
                rng,
                seed,
            }
        }

        /// Does it, within 6° (1σ), and holds the sensor still.
        fn does(&mut self, next: Move) {
            let mut off = || self.rng.random_range(-0.2..0.2);
            let off = Vector3::new(off(), off(), off());
            let rotation = match next {
                Move::Up(up) => Rotation::Point {
                    axis: exp(off) * up,
                    along: Vector3::z(),
                },
                Move::HalfTurn { axis, is_negative } => {
                    let angle = if is_negative { -PI } else { PI };
                    Rotation::By(exp(off) * Vector3::ith(axis, angle))
                }
            };
            let Moves::Body { steps, .. } = &mut self.scenario.path.moves else {
                return;
            };
            steps.push(BodyStep {
                rotation,
                duration: 5.5,
                acceleration: PI / 2.0,
                dwell: 6.0,
            });
        }

        fn run(&self) -> Run {
            let mut run = self.scenario.simulate(self.seed, 0).unwrap().run;
            run.recording.table = None;
            run
        }
    }

    fn specification() -> crate::lot::Specification {
        models::specification(std::path::Path::new("mems-by-hand")).unwrap()
    }

    fn evaluator() -> Evaluator {
        Evaluator::new(Options::default(), Some(specification()))
    }

    /// Dwells that a random order needs: the first at whose end every limit can be decided.
    fn random_order(seed: u64, order: u64) -> Option<usize> {
        let mut moves: Vec<Move> = Move::all().collect();
        moves.shuffle(&mut ChaCha8Rng::seed_from_u64(order));
        let mut person = Person::new(seed);
        // The best need half as many.
        moves
            .into_iter()
            .take(14)
            .for_each(|next| person.does(next));
        let run = person.run();
        let bound = bound_of_record(&run, &Options::default()).unwrap();
        let specification = specification();
        let is_met = |end: f64| {
            let epoch = bound.history.iter().rfind(|epoch| epoch.time <= end + 0.5);
            epoch.is_some_and(|epoch| {
                let mut limits = specification.limits.iter();
                limits.all(|of| epoch.sigma[of.parameter] < specification.deciding_sigma(of.within))
            })
        };
        let rests = crate::run::motion::rests(&run);
        let first = rests
            .iter()
            .position(|rest| is_met(rest.dwell.times(&run)[1]))?;
        Some(first + 1)
    }

    #[test]
    fn a_session_gives_what_the_whole_record_gives_and_refuses_what_is_no_number() {
        let mut person = Person::new(3);
        for up in [
            Vector3::x(),
            -Vector3::x(),
            Vector3::y(),
            -Vector3::y(),
            -Vector3::z(),
        ] {
            person.does(Move::Up(up));
        }
        let run = person.run();
        let imu = &run.recording.imu;
        let rates = |of: Vec<Vector3<f64>>| -> Vec<Vector3<f64>> {
            of.into_iter().map(|sample| sample / imu.period).collect()
        };
        let [gyro, accel] = [&imu.gyro, &imu.accel].map(|of| rates(of.iter().collect()));
        let mut session = Session::new(run.instrument.clone(), run.site, imu.period);
        let mut told = 0;
        for (gyro, accel) in gyro.chunks(70).zip(accel.chunks(70)) {
            told += usize::from(session.push(gyro, accel).unwrap().is_some());
        }
        let seconds = imu.duration();
        assert!(
            (0.6..=1.0).contains(&(told as f64 / seconds)),
            "{told} in {seconds} s"
        );
        assert!(
            session
                .push(&[Vector3::repeat(f64::NAN)], &[Vector3::z()])
                .is_err()
        );
        let [live, whole] = [
            session.status().unwrap(),
            Evaluator::default().status(&run, UNWATCHED),
        ];
        assert_eq!(live.survey.rests.len(), 6);
        assert_eq!(live.survey.rests.len(), whole.survey.rests.len());
        let [live, whole] = [live, whole].map(|of| of.expected.unwrap().bound.estimate.sigma());
        assert!((live - whole).amax() <= 1e-6 * whole.amax());
    }

    #[test]
    fn sigma_shown_are_those_of_a_calibration_also_where_noise_is_larger_than_stated() {
        let mut person = Person::new(4);
        for next in Move::all().take(9).chain(Move::all().skip(26)) {
            person.does(next);
        }
        let mut run = person.run();
        run.instrument.noise.gyro.random_walk /= 5.0;
        let status = Evaluator::default().status(&run, UNWATCHED);
        let shown = status.expected.unwrap().history.pop().unwrap().sigma;

        let problem = Problem::new(&run, &Options::default());
        let solution = problem.solve(Method::Ekf, UNWATCHED).unwrap();
        solution.assess(&problem).unwrap();
        let found = by_group(&solution.estimate().sigma(), solution.estimate());
        for ((group, shown), (_, found)) in shown.into_iter().zip(found) {
            let (shown, found) = (shown.unwrap(), found.unwrap());
            // The last epoch is that of the last dwell's end.
            assert!(
                (shown / found - 1.0).abs() < 0.02,
                "{group:?}: {shown} {found}"
            );
        }
        let expected = bound_of_record(&run, &Options::default()).unwrap();
        let by_stated = expected.estimate.sigma()[parameter(Sensor::Gyro, 0)];
        assert!(solution.estimate().sigma()[parameter(Sensor::Gyro, 0)] > 2.0 * by_stated);
    }

    #[test]
    fn who_turns_a_sensor_only_about_the_vertical_is_told_what_is_missing() {
        let mut person = Person::new(11);
        for k in 0..8 {
            person.does(Move::HalfTurn {
                axis: 2,
                is_negative: k % 2 == 1,
            });
        }
        let status = evaluator().status(&person.run(), UNWATCHED);
        assert!(!status.is_met());
        let attained = status.expected.unwrap();
        let is_open = |name| {
            attained.checks.iter().any(|check| {
                check.verdict != crate::lot::Verdict::Pass
                    && parameter_name(FORM, check.limit.parameter).as_deref() == Some(name)
            })
        };
        let missing = [
            "gyro.scale.x",
            "gyro.scale.y",
            "accel.scale.x",
            "accel.scale.y",
        ];
        assert!(missing.into_iter().all(is_open), "{:?}", attained.checks);
        let is_tried = |of: Move| match of {
            Move::Up(up) => up.z > 0.9,
            Move::HalfTurn { axis, .. } => axis == 2,
        };
        assert!(!is_tried(status.next.unwrap()), "{:?}", status.next);
    }

    #[test]
    fn limits_are_decided_by_a_calibration_and_not_by_a_prediction() {
        let mut person = Person::new(4);
        Move::all().take(4).for_each(|next| person.does(next));
        let early = person.run();
        let rest = Move::all().skip(26).chain(Move::all().take(12));
        rest.for_each(|next| person.does(next));
        let run = person.run();
        // Limits that the early rows do not decide and all rows are predicted to decide.
        let cases = [1.0, 1.5, 2.0, 3.0, 4.0].into_iter().map(|wider| {
            let mut limits = specification();
            let all = limits.limits.iter_mut();
            all.for_each(|limit| limit.within *= wider);
            let mut evaluator = Evaluator::new(Options::default(), Some(limits));
            let status = evaluator.outlook(&early);
            let due = evaluator.due(&early, &status).unwrap();
            evaluator.take(due.calibrate(UNWATCHED));
            let is_early = evaluator.outlook(&early).is_met();
            let status = evaluator.outlook(&run);
            (evaluator, is_early, status)
        });
        let is_predicted = |status: &Status| status.expected.as_ref().unwrap().is_met();
        let mut cases = cases.filter(|(_, is_early, status)| !is_early && is_predicted(status));
        let (mut evaluator, _, status) = cases.next().unwrap();
        assert!(!status.is_met() && status.next.is_some());
        let due = evaluator.due(&run, &status).unwrap();
        evaluator.take(None);
        assert!(!evaluator.outlook(&run).is_met());
        evaluator.take(due.calibrate(UNWATCHED));
        let status = evaluator.outlook(&run);
        assert!(status.is_met() && status.next.is_none());
    }

    #[test]
    #[ignore = "statistical"]
    fn who_does_what_is_said_needs_hardly_more_dwells_than_the_best_of_fifty_orders() {
        let mut ratios = Vec::new();
        for seed in 0..4 {
            // As orders are judged: by what motion and stated noise tell.
            let options = Options::default()
                .noise(NoisePolicy::Stated)
                .no_auto_terms();
            let mut evaluator = Evaluator::new(options, Some(specification()));
            let mut person = Person::new(seed);
            let mut dwells = 1;
            loop {
                let status = evaluator.status(&person.run(), UNWATCHED);
                let Some(next) = status.next else { break };
                assert!(dwells < 40, "seed {seed}: {:?}", status.expected);
                person.does(next);
                dwells += 1;
            }
            let orders = (0..50).into_par_iter();
            let best = orders.filter_map(|order| random_order(seed, order)).min();
            ratios.push((dwells, best));
        }
        println!("{ratios:?}");
        // With four dwells one more is a quarter: all persons together.
        let dwells: usize = ratios.iter().map(|of| of.0).sum();
        let best: usize = ratios.iter().map(|of| of.1.unwrap_or(33)).sum();
        assert!(
            dwells as f64 <= 1.3 * best as f64,
            "{dwells} against {best}"
        );
    }
}
