//! The closed form is as wrong as its σ say, on its own assumptions, and says so where they do not hold.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use turncal::attitude::{exp, log};
use turncal::calibration::{
    ClosedForm, Finding, Options, PARAMETERS, Problem, Reference, in_body_frame, in_general_form,
    mean_square_interval, nees, six_position, to_vector,
};
use turncal::imu::{GaussMarkov, PerSensor};
use turncal::recording::{LabelledMotion, Segment};
use turncal::run::{Aiding, Run};
use turncal::simulation::{Scenario, Simulated};
use turncal::turntable::{BodyStep, Moves, Path, Rotation};
use turncal::units::{ARCSEC, DEG_PER_H, DEGREE, MICRO_G};

/// Chance that a mean over right runs lies outside its interval.
const OUTSIDE: f64 = 2e-3;

/// NEES and what it is a sum of.
fn sum_of_squares(closed_form: &ClosedForm, made: &Simulated) -> (f64, usize) {
    let truth = in_body_frame(
        &in_general_form(&made.truth),
        closed_form.reference.body_frame(),
    );
    let estimate = &closed_form.estimate;
    let difference = estimate.vector() - to_vector(&truth);
    let all: Vec<usize> = (0..PARAMETERS).collect();
    let nees = nees(&difference, &estimate.covariance, &all).unwrap();
    (nees.mean * nees.count as f64, nees.count)
}

/// How residuals rang.
fn rings(closed_form: &ClosedForm) -> bool {
    let large = |finding: &Finding| matches!(finding, Finding::ResidualsLarge { .. });
    closed_form.findings.iter().any(large)
}

#[derive(Debug)]
struct Tried {
    nees: f64,
    interval: (f64, f64),
    /// The largest of one run.
    worst: f64,
    rang: usize,
}

/// Mean NEES/n of the closed form over so many runs.
fn tried(runs: u64, make: impl Fn(u64) -> Simulated) -> Tried {
    let (mut sum, mut count, mut worst, mut rang) = (0.0, 0, 0f64, 0);
    for seed in 0..runs {
        let made = make(seed);
        let closed_form = six_position(&Problem::new(&made.run, &Options::default())).unwrap();
        let (squares, n) = sum_of_squares(&closed_form, &made);
        sum += squares;
        count += n;
        worst = worst.max(squares / n as f64);
        rang += usize::from(rings(&closed_form));
    }
    Tried {
        nees: sum / count as f64,
        interval: mean_square_interval(count, OUTSIDE),
        worst,
        rang,
    }
}

fn normal(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| StandardNormal.sample(rng))
}

/// The instrument of a scenario turned by hand: six positions, and a full turn about each axis both ways, each
/// off by tilts of this σ. Without a table's log, and with labels.
fn by_hand(scenario: &Scenario, tilt: f64, seed: u64) -> Simulated {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let heading = exp(Vector3::z() * (normal(&mut rng).x * 10.0 * PI));
    let level = |up: Vector3<f64>| {
        let east = if up.z == 0.0 {
            Vector3::z()
        } else {
            Vector3::x()
        };
        Matrix3::from_rows(&[east, up.cross(&east), up].map(|row| row.transpose()))
    };
    let (mut steps, mut labels) = (Vec::new(), Vec::new());
    let mut go = |vector: Vector3<f64>| {
        steps.push(BodyStep {
            rotation: Rotation::By(vector),
            duration: (vector.norm() / (45.0 * DEGREE)).max(2.0),
            acceleration: 90.0 * DEGREE,
            dwell: 10.0,
        });
    };
    let (mut start, mut at) = (Matrix3::identity(), None);
    for k in 0..6 {
        let up = Vector3::ith(k / 2, if k % 2 == 0 { 1.0 } else { -1.0 });
        let here = heading * exp(normal(&mut rng) * tilt) * level(up);
        match at {
            None => start = here,
            Some(before) => go(log(&(Matrix3::transpose(&before) * here))),
        }
        labels.push(Some(LabelledMotion::Stands { up }));
        let turn = exp(normal(&mut rng) * tilt) * up * TAU + normal(&mut rng) * tilt;
        go(turn);
        let angle = TAU;
        labels.push(Some(LabelledMotion::Turns { axis: up, angle }));
        at = Some(here * exp(turn));
    }
    let mut made = Scenario {
        path: Path {
            first_dwell: 10.0,
            moves: Moves::Body { start, steps },
        },
        ..scenario.clone()
    }
    .simulate(seed, 0)
    .unwrap();
    // A dwell, the turn from the middle of it to that of the next, and the next position.
    let dwells = made.run.dwells(Aiding::Table);
    let middle = |k: usize| (dwells[k].samples.start + dwells[k].samples.end) / 2;
    assert_eq!(dwells.len(), 12);
    let imu = &made.run.recording.imu;
    let sections = labels.into_iter().enumerate().map(|(k, motion)| {
        let samples = match motion {
            Some(LabelledMotion::Turns { .. }) => middle(k - 1)..middle(k),
            _ => dwells[k].samples.start..middle(k),
        };
        Segment {
            start: imu.time(samples.start),
            end: imu.time(samples.end),
            samples,
            label: format!("{motion:?}"),
            motion,
        }
    });
    made.run.recording.segments = sections.collect();
    made.run.recording.table = None;
    made.run.segment_sigma = tilt;
    made
}

const SCENARIOS: [&str; 5] = [
    "demo-six-position",
    "mems",
    "real-table",
    "two-axis",
    "nineteen-position",
];

#[test]
#[ignore = "statistical: 200 runs"]
fn the_closed_form_is_as_wrong_as_its_sigma_say() {
    const RUNS: u64 = 20;
    let runs = std::env::var("RUNS").map_or(RUNS, |v| v.parse().unwrap());
    let of_hands = Scenario::load("mems").unwrap().table;
    for name in SCENARIOS {
        let scenario = Scenario::load(name).unwrap();
        let by_table = tried(runs, |seed| scenario.simulate(seed, 0).unwrap());
        let mut hand = scenario.clone();
        hand.table = of_hands.clone();
        let by_labels = tried(runs, |seed| by_hand(&hand, DEGREE, seed));
        for (from, tried) in [("table", by_table), ("labels", by_labels)] {
            println!("{name} {from}: {tried:.3?}");
        }
    }
}
