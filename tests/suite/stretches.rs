//! A record in parts: what breaks it costs the lost data and no more, and runs of one instrument add up.

use std::ops::Range;

use approx::assert_relative_eq;
use nalgebra::{DMatrix, Vector3};
use turncal::calibration::{
    Estimate, Finding, NoisePolicy, Options, Outcome, PARAMETERS, ParameterVector, Problem,
    Together, UNWATCHED, bound, estimate, mean_square_interval, nees, to_vector,
};
use turncal::imu::{PARAMETERS as PER_TRIAD, ParameterKind, Sensor, Triad};
use turncal::recording::{Bridge, Recording, SampleError, Segment, Series, Stretch, TableLog};
use turncal::run::{Aiding, Run};
use turncal::simulation::{Given, Scenario, Simulated};

/// Fixed before the first run was made.
const SEED: u64 = 77;
/// Length of the break, s.
const BREAK: f64 = 10.0;

fn solved(problem: &Problem) -> Outcome {
    let outcome = estimate(problem, UNWATCHED).unwrap();
    assert!(outcome.converged);
    outcome
}

/// With the noise that the run states, and without terms that it does not state.
fn plain() -> Options {
    Options::default()
        .noise(NoisePolicy::Stated)
        .no_auto_terms()
}

/// Converged until rounding, so that two ways to one result may be compared.
fn exactly() -> Options {
    Options {
        converged_sigma: 2e-7,
        ..plain()
    }
}

/// Largest difference of estimates in σ of the first, and of σ as a part of it.
fn apart(a: &Estimate, b: &Estimate) -> (f64, f64) {
    let estimated: Vec<usize> = a.estimated().collect();
    let (sigma_a, sigma_b) = (a.sigma(), b.sigma());
    let shift = |&i: &usize| ((a.vector()[i] - b.vector()[i]) / sigma_a[i]).abs();
    let change = |&i: &usize| (sigma_b[i] / sigma_a[i] - 1.0).abs();
    let largest = |of: &dyn Fn(&usize) -> f64| estimated.iter().map(of).fold(0.0, f64::max);
    let (shift, change) = (largest(&shift), largest(&change));
    println!("{shift:.1e} σ, σ by {change:.1e}");
    (shift, change)
}

/// NEES/n within its 99.8 % interval.
fn assert_as_accurate_as_claimed(outcome: &Outcome, truth: &ParameterVector) {
    let error = outcome.estimate.vector() - truth;
    let all: Vec<usize> = (0..PARAMETERS).collect();
    let nees = nees(&error, &outcome.estimate.covariance, &all).unwrap();
    let (low, high) = mean_square_interval(nees.count, 0.002);
    println!("NEES/n {:.3} of {}", nees.mean, nees.count);
    assert!((low..high).contains(&nees.mean), "{}", nees.mean);
}

/// The samples of a break in the middle of the longest move.
fn in_the_longest_move(run: &Run) -> Range<usize> {
    let dwells = run.dwells(run.aiding());
    let moves = dwells.windows(2);
    let moves = moves.map(|pair| pair[0].samples.end..pair[1].samples.start);
    let longest = moves.max_by_key(Range::len).unwrap();
    let lost = (BREAK / run.recording.imu.period) as usize;
    assert!(longest.len() > lost + 2, "{longest:?}");
    let begin = longest.start + (longest.len() - lost) / 2;
    begin..begin + lost
}

/// The same run without these samples.
fn broken(run: &Run, lost: &Range<usize>) -> Run {
    let mut run = run.clone();
    let imu = &mut run.recording.imu;
    let after = Stretch {
        samples: lost.end..imu.len(),
        start: imu.time(lost.end),
    };
    imu.stretches[0].samples.end = lost.start;
    imu.stretches.push(after);
    // Whatever lies there, nothing may look at it.
    imu.gyro.to_mut()[lost.clone()].fill(Vector3::repeat(0.3));
    imu.accel.to_mut()[lost.clone()].fill(Vector3::repeat(-7.0));
    run
}

/// These samples of a run and what the table read meanwhile, as a run of its own.
fn part(run: &Run, samples: Range<usize>) -> Run {
    let Recording {
        name, imu, table, ..
    } = &run.recording;
    let (begin, end) = (imu.time(samples.start), imu.time(samples.end));
    let of_part = |all: &Series| all.part(samples.clone()).to_vec();
    let (gyro, accel) = (of_part(&imu.gyro), of_part(&imu.accel));
    let mut recording = Recording::from_samples(name, begin, imu.period, gyro, accel).unwrap();
    recording.imu.pulse = imu.pulse;
    recording.table = table.as_ref().map(|table| {
        let first = table.time.partition_point(|&t| t < begin);
        let readings = first..table.time.partition_point(|&t| t <= end);
        TableLog {
            time: table.time[readings.clone()].to_vec(),
            attitude: table.attitude[readings.clone()].to_vec(),
            axes: table.axes.get(readings).unwrap_or_default().to_vec(),
        }
    });
    Run {
        recording,
        ..run.clone()
    }
}

#[test]
fn one_dwell_shows_the_bias_of_the_gyro_about_the_vertical_and_no_scale() {
    let Simulated { run, truth, .. } = Scenario::load("demo").unwrap().simulate(SEED, 0).unwrap();
    // z up.
    let first = run.dwells(run.aiding())[0].samples.clone();
    let duration = first.len() as f64 * run.recording.imu.period;
    let mut dwell = part(&run, first);
    dwell.recording.table = None;
    let problem = Problem::new(&dwell, &plain().aiding(Aiding::Velocity));
    let outcome = solved(&problem);
    let (sigma, prior) = (outcome.estimate.sigma(), outcome.prior_sigma);
    let error = outcome.estimate.vector() - to_vector(&truth);
    // gyro.scale.z, gyro.installation.zx, gyro.bias.z
    let [scale, angle, bias] = [2, 7, 11];
    // Random walk over the dwell, and Earth rate by a scale and an angle that are not known.
    let walk = run.instrument.noise.gyro.random_walk / duration.sqrt();
    let earth_rate = run.site.earth_rate_n();
    let along = prior[scale] * earth_rate.z;
    let expected = walk.hypot(along).hypot(prior[angle] * earth_rate.y);
    println!("σ {:.2e} rad/s, expected {expected:.2e}", sigma[bias]);
    assert!(
        (sigma[bias] / expected - 1.0).abs() < 0.2,
        "{}",
        sigma[bias]
    );
    assert!(error[bias].abs() < 4.0 * sigma[bias]);
    for hidden in [0, 1, 2, 12, 13] {
        assert!(sigma[hidden] > 0.5 * prior[hidden], "{hidden}");
    }
}

#[test]
fn one_dwell_does_not_show_the_level_biases_of_accelerometers() {
    let run = Scenario::load("mems")
        .unwrap()
        .simulate(SEED, 0)
        .unwrap()
        .run;
    let dwell = part(&run, run.dwells(run.aiding())[0].samples.clone());
    let problem = Problem::new(&dwell, &plain().aiding(Aiding::Velocity));
    let outcome = solved(&problem);
    let (sigma, prior) = (outcome.estimate.sigma(), outcome.prior_sigma);
    // A tilt makes up for any of them; the one along the plumb line is seen to what the scale factor leaves.
    let [_, _, scale, .., bias_x, bias_y, bias_z] =
        std::array::from_fn::<_, PER_TRIAD, _>(|k| PER_TRIAD + k);
    let left = |index: usize| sigma[index] / prior[index];
    assert!(left(bias_x) > 0.99 && left(bias_y) > 0.99);
    let by_scale = (prior[scale] * run.site.gravity).powi(-2);
    let expected = (by_scale + prior[bias_z].powi(-2)).sqrt().recip();
    assert_relative_eq!(sigma[bias_z], expected, max_relative = 0.02);
}

#[test]
fn one_dwell_leaves_the_bias_of_a_gyro_to_where_north_is() {
    let run = Scenario::load("demo")
        .unwrap()
        .simulate(SEED, 0)
        .unwrap()
        .run;
    let mut dwell = part(&run, run.dwells(run.aiding())[0].samples.clone());
    dwell.recording.table = None;
    let level = run.site.earth_rate_n().y;
    // Earth rate is within what the bias may be, so it tells no heading.
    dwell.instrument.prior.gyro.bias_sigma.fill(100.0 * level);
    let problem = Problem::new(&dwell, &plain().aiding(Aiding::Velocity));
    let outcome = solved(&problem);
    let sigma = outcome.estimate.sigma();
    let [_, _, _, _, _, _, _, _, _, bias_x, bias_y, _] =
        std::array::from_fn::<_, PER_TRIAD, _>(|k| k);
    // Earth rate may be any point of a circle, whose mean square in both axes together is that of its radius.
    let apart = sigma[bias_x].hypot(sigma[bias_y]) / level;
    assert!((0.95..1.05).contains(&apart), "{apart}");
}

#[test]
fn a_break_of_ten_seconds_in_a_move_costs_no_more_than_what_is_lost() {
    let Simulated {
        run, truth, terms, ..
    } = Scenario::load("demo").unwrap().simulate(SEED, 0).unwrap();
    let lost = in_the_longest_move(&run);
    let cut = broken(&run, &lost);
    assert_eq!(
        cut.dwells(cut.aiding()),
        run.dwells(run.aiding()),
        "what stands is as it was"
    );
    let problem = Problem::new(&cut, &plain());
    let outcome = solved(&problem);
    assert_eq!(outcome.prior_attitudes.len(), 2);
    assert_as_accurate_as_claimed(&outcome, &to_vector(&truth));

    // No estimator has less σ of the same data, and this one has no more.
    let least = bound(&problem, &truth, &terms).unwrap().estimate;
    let (_, change) = apart(&least, &outcome.estimate);
    assert!(change < 0.01, "{change}");

    // The same samples with an error without bound, and no break: attitude and velocity after them are
    // as unknown, by another way through the filter.
    let mut bridged = run.clone();
    let axes = Sensor::ALL
        .into_iter()
        .flat_map(|sensor| [0, 1, 2].map(|axis| (sensor, axis)));
    let bridge = axes.fold(Bridge::new(lost.clone()), |bridge, (sensor, axis)| {
        bridge.with(sensor, axis, [1.0, 1e4][sensor as usize])
    });
    bridged.recording.imu.bridges = vec![bridge];
    let bridged = Problem::new(&bridged, &plain());
    let without = bound(&bridged, &truth, &terms).unwrap().estimate;
    let (_, change) = apart(&without, &least);
    assert!(change < 0.002, "{change}");

    let whole = Problem::new(&run, &plain());
    let whole = bound(&whole, &truth, &terms).unwrap().estimate;
    let more = least.sigma().component_div(&whole.sigma());
    println!("σ against all data: {:.4} to {:.4}", more.min(), more.max());
    assert!(more.min() > 0.9999, "lost samples told something");
}

#[test]
fn parts_of_a_record_are_runs_of_one_instrument() {
    let mut run = Scenario::load("demo")
        .unwrap()
        .simulate(SEED, 0)
        .unwrap()
        .run;
    // Else each run finds its own in its dwells.
    run.standstill.sigma.accel = Some(2e-6);
    let lost = in_the_longest_move(&run);
    let cut = broken(&run, &lost);
    let before = part(&run, 0..lost.start);
    let after = part(&run, lost.end..run.recording.imu.len());
    let broken = solved(&Problem::new(&cut, &exactly()));
    let joint = solved(&Problem::new(&before, &exactly()).and(&after));
    let (shift, change) = apart(&broken.estimate, &joint.estimate);
    assert!(shift < 1e-6 && change < 1e-6);
}

#[test]
fn a_recording_without_a_dwell_is_left_out_of_a_campaign_and_named() {
    let run = Scenario::load("demo")
        .unwrap()
        .simulate(SEED, 0)
        .unwrap()
        .run;
    let moving = in_the_longest_move(&run);
    let before = part(&run, 0..moving.start);
    let after = part(&run, moving.end..run.recording.imu.len());
    let mut turn = part(&run, moving);
    turn.recording.name = "turn".to_owned();
    let together = |runs: &[&Run]| {
        let together = Together {
            temperature: None,
            ..Together::default()
        };
        solved(&Problem::together(runs, &exactly(), &together).unwrap())
    };
    let (with, without) = (
        together(&[&before, &turn, &after]),
        together(&[&before, &after]),
    );
    assert_eq!(with.estimate, without.estimate);
    let says = |outcome: &Outcome| {
        let named = |finding: &Finding| finding.to_string().starts_with("turn: turncal excluded");
        outcome
            .findings
            .iter()
            .filter(|finding| named(finding))
            .count()
    };
    assert_eq!((says(&with), says(&without)), (1, 0));
}

/// Two runs of one instrument along different paths.
fn two_runs() -> (Simulated, Simulated) {
    let scenario = Scenario::load("demo").unwrap();
    let first = scenario.simulate(SEED, 0).unwrap();
    let mut other = scenario.with_path("nineteen-position").unwrap();
    for sensor in Sensor::ALL {
        let triad = first.truth.get(sensor);
        *other.given.get_mut(sensor) = Given {
            scale: Some(triad.scale.add_scalar(-1.0)),
            angles: Some(triad.angles),
            bias: Some(triad.bias),
        };
    }
    let second = other.simulate(SEED, 1).unwrap();
    let apart = to_vector(&second.truth) - to_vector(&first.truth);
    assert!(apart.amax() < 1e-15, "{apart}");
    (first, second)
}

/// Covariance and its inverse are made in σ of the first estimate, where they invert without loss.
fn information(estimate: &Estimate, unit: &ParameterVector) -> DMatrix<f64> {
    let n = PARAMETERS;
    let covariance = DMatrix::from_fn(n, n, |i, j| {
        estimate.covariance[(i, j)] / (unit[i] * unit[j])
    });
    covariance.cholesky().unwrap().inverse()
}

#[test]
fn two_runs_of_one_instrument_hold_the_information_of_both_in_either_order() {
    let (first, second) = two_runs();
    for aiding in [Aiding::Table, Aiding::Velocity] {
        let options = exactly().aiding(aiding);
        let a = Problem::new(&first.run, &options);
        let b = Problem::new(&second.run, &options);
        let joint = solved(&a.and(&second.run));
        let reverse = solved(&b.and(&first.run));
        let (shift, change) = apart(&joint.estimate, &reverse.estimate);
        // Attitudes are referred to the table's, or level, at the mean so far, which in the first turns of
        // a run knows scale factors no better than the prior: of second order, and of the order of runs.
        assert!(
            shift < 0.05 && change < 1e-3,
            "{aiding:?}: {shift} {change}"
        );
        let truth = first.truth;
        if aiding == Aiding::Table {
            assert_as_accurate_as_claimed(&joint, &to_vector(&truth));
            let bounds = [&a, &b, &a.and(&second.run)]
                .map(|problem| bound(problem, &truth, &first.terms).unwrap().estimate);
            let unit = bounds[2].sigma();
            let [of_a, of_b, of_both] = bounds.map(|bound| information(&bound, &unit));
            let prior = a.model.prior_sigma;
            let prior = DMatrix::from_fn(PARAMETERS, PARAMETERS, |i, j| {
                if i == j {
                    (unit[i] / prior[i]).powi(2)
                } else {
                    0.0
                }
            });
            let off = (&of_a + &of_b - prior - &of_both).amax() / of_both.amax();
            println!("information off by {off:.1e}");
            assert!(off < 1e-6, "{off}");
        }
    }
}

#[test]
fn a_break_where_a_table_is_crooked_leaves_the_claimed_accuracy_true() {
    let Simulated { run, truth, .. } = Scenario::load("real-table")
        .unwrap()
        .simulate(SEED, 0)
        .unwrap();
    assert!(run.table.geometry.base.amin() > 0.0);
    let lost = in_the_longest_move(&run);
    let cut = broken(&run, &lost);
    let problem = Problem::new(&cut, &plain());
    let outcome = solved(&problem);
    assert_as_accurate_as_claimed(&outcome, &to_vector(&truth));
}

#[test]
fn a_run_whose_table_is_not_observed_is_a_run_without_a_table() {
    let run = Scenario::load("demo")
        .unwrap()
        .simulate(SEED, 0)
        .unwrap()
        .run;
    let unobserved = Problem::new(&run, &plain().aiding(Aiding::Velocity));
    let mut without = run.clone();
    without.recording.table = None;
    let without = Problem::new(&without, &plain());
    assert_eq!(
        solved(&unobserved).estimate,
        solved(&without).estimate,
        "a reading went in"
    );
}

#[test]
fn sections_without_an_order_hide_what_moves_would_have_shown() {
    let mut run = Scenario::load("demo")
        .unwrap()
        .simulate(SEED, 0)
        .unwrap()
        .run;
    run.recording.imu.continuous = false;
    let problem = Problem::new(&run, &plain());
    let outcome = solved(&problem);
    let dwells = problem.dwells().count();
    assert_eq!(outcome.prior_attitudes.len(), dwells);
    let hidden = |finding: &&Finding| finding.kind == "not-observed";
    let named = outcome.findings.iter().find(hidden).unwrap();
    let named: Vec<String> = serde_json::from_value(named.figures["parameters"].clone()).unwrap();
    let of_gyros = |name: &String| name.starts_with("gyro");
    assert!(named.len() > 3 && named.iter().all(of_gyros), "{named:?}");
    // Earth rate alone is too little for scale factors and installation of gyros, and accelerometers
    // need no order.
    run.recording.imu.continuous = true;
    let ordered = solved(&Problem::new(&run, &plain()));
    let sigma = outcome.estimate.sigma();
    let more = sigma.component_div(&ordered.estimate.sigma());
    for (index, more) in more.iter().enumerate() {
        let (triad, kind) = (index / PER_TRIAD, Triad::kind(index % PER_TRIAD));
        let limit = if triad == 0 && kind != ParameterKind::Bias {
            100.0
        } else {
            0.0
        };
        assert!(*more > limit, "{triad} {kind:?}: {more}");
    }
}

#[test]
fn a_section_whose_label_says_nothing_is_a_dwell_where_the_imu_stands() {
    let mut run = Scenario::load("demo")
        .unwrap()
        .simulate(SEED, 0)
        .unwrap()
        .run;
    run.recording.table = None;
    let standing: Vec<Range<usize>> = run
        .dwells(Aiding::Velocity)
        .into_iter()
        .take(4)
        .map(|dwell| dwell.samples)
        .collect();
    // The second section begins in a move.
    let sections = [standing[0].clone(), standing[1].end..standing[3].start];
    let imu = &run.recording.imu;
    let sections = sections.map(|samples| Segment {
        start: imu.time(samples.start),
        end: imu.time(samples.end),
        samples,
        label: "part".to_owned(),
        motion: None,
    });
    run.recording.segments = sections.to_vec();
    run.recording.imu.continuous = false;
    let found = run.dwells(Aiding::Velocity);
    let found: Vec<&Range<usize>> = found.iter().map(|dwell| &dwell.samples).collect();
    assert_eq!(found.len(), 2, "{found:?}");
    for (found, stood) in found.iter().zip([&standing[0], &standing[2]]) {
        assert!(found.start >= stood.start && found.end <= stood.end);
        assert!(found.len() as f64 > 0.9 * stood.len() as f64);
    }
}

#[test]
fn arrays_that_are_no_samples_are_refused_in_words() {
    let still = |n: usize| vec![Vector3::zeros(); n];
    let made =
        |start, period, gyro, accel| Recording::from_samples("x", start, period, gyro, accel);
    let sound = made(2.0, 0.01, still(5), still(5)).unwrap();
    assert_eq!(
        sound.imu.stretches,
        [Stretch {
            samples: 0..5,
            start: 2.0
        }]
    );
    assert_eq!((sound.imu.start(), sound.imu.end()), (2.0, 2.05));

    let lengths = made(0.0, 0.01, still(5), still(4)).unwrap_err();
    assert_eq!(lengths, SampleError::Lengths { gyro: 5, accel: 4 });
    assert_eq!(made(0.0, 0.01, vec![], vec![]), Err(SampleError::Empty));
    for (start, period) in [
        (0.0, 0.0),
        (0.0, -0.01),
        (0.0, f64::NAN),
        (0.0, f64::INFINITY),
        (f64::NAN, 0.01),
        (f64::INFINITY, 0.01),
    ] {
        let refused = made(start, period, still(5), still(5)).unwrap_err();
        assert!(matches!(refused, SampleError::Period { .. }), "{refused}");
    }
    for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for axis in 0..3 {
            let mut spoilt = still(5);
            spoilt[3][axis] = wrong;
            for (gyro, accel) in [(spoilt.clone(), still(5)), (still(5), spoilt)] {
                let refused = made(0.0, 0.01, gyro, accel).unwrap_err();
                assert_eq!(refused, SampleError::NotFinite { sample: 3 });
                assert!(refused.to_string().contains("split the recording"));
            }
        }
    }
}
