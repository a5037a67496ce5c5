use super::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const ROWS: usize = 20_000;
const NONE: [Range<usize>; 0] = [];

/// White noise of a σ in steps, about a level.
fn noise(seed: u64, sigma: f64, level: f64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = |_| {
        let normal: f64 = StandardNormal.sample(&mut random);
        level + sigma * normal
    };
    (0..ROWS).map(&mut draw).collect()
}

fn rounded(values: &[f64]) -> Vec<f64> {
    values.iter().map(|value| value.round()).collect()
}

/// Whole pulses, the rest carried.
fn pulses(values: &[f64]) -> Vec<f64> {
    let mut sum = 0.0f64;
    let mut count = |value: &f64| {
        let before = sum.round();
        sum += value;
        sum.round() - before
    };
    values.iter().map(&mut count).collect()
}

fn find(values: &[f64], pulses: bool) -> Vec<Range<usize>> {
    let facts = ColumnFacts::of("", values, 1.0);
    Axis::of(values, &facts, 1.0, pulses).stuck(Limit::of_rows(values.len()))
}

fn hold(values: &mut [f64], rows: Range<usize>) {
    let value = values[rows.start];
    values[rows].fill(value);
}

#[track_caller]
fn assert_found(values: &[f64], pulses: bool, rows: Range<usize>) {
    let found = find(values, pulses);
    let [run] = found.as_slice() else {
        panic!("{found:?}");
    };
    // Equal values beside belong to it.
    assert!(run.start.abs_diff(rows.start + 1) <= 5, "{run:?}");
    assert!((rows.end..rows.end + 5).contains(&run.end), "{run:?}");
}

#[test]
fn an_axis_without_its_noise_is_found() {
    for sigma in [0.7, 1.0, 10.0, 1000.0] {
        let sound = rounded(&noise(5, sigma, 0.3));
        assert_eq!(find(&sound, false), NONE, "σ {sigma}");
        let mut values = sound.clone();
        hold(&mut values, 7000..7100);
        assert_found(&values, false, 7000..7100);
    }
}

#[test]
fn a_grid_coarser_than_noise_repeats_as_it_likes() {
    for (seed, sigma) in [0.0, 0.05, 0.1, 0.2, 0.3, 0.5].into_iter().enumerate() {
        for level in [0.0, 0.1, 0.25, 0.5] {
            // Dwells at many levels, one of them in the middle of a step.
            let drift = |k: usize| (k / 2000) as f64 * 1.37;
            let truth = noise(seed as u64, sigma, level);
            let dwells: Vec<f64> = (0..ROWS).map(|k| truth[k] + drift(k)).collect();
            assert_eq!(find(&rounded(&dwells), false), NONE, "σ {sigma} {level}");
            assert_eq!(find(&pulses(&dwells), true), NONE, "σ {sigma} {level}");
        }
    }
}

#[test]
fn noise_that_is_correlated_repeats_longer() {
    let mut values = noise(3, 1.0, 0.2);
    for k in 1..ROWS {
        values[k] = 0.95 * values[k - 1] + 0.05 * 6.0 * values[k];
    }
    assert_eq!(find(&rounded(&values), false), NONE);
}

#[test]
fn pulses_of_a_rate_near_a_whole_number_are_sound_and_others_do_not_repeat() {
    for rate in [2.0, 2.003, 2.02, 2.34] {
        let sound = pulses(&noise(7, 0.02, rate));
        assert_eq!(find(&sound, true), NONE, "{rate}");
    }
    let mut values = pulses(&noise(7, 0.02, 2.34));
    hold(&mut values, 7000..7100);
    assert_found(&values, true, 7000..7100);
}

#[test]
fn a_rate_that_drifts_through_a_step_or_touches_it_is_sound() {
    for truth in [
        &(|k: usize| 10.0 + 4e-6 * (k as f64 - 10_000.0)) as &dyn Fn(usize) -> f64,
        &|k| 10.0 + 1e-8 * (k as f64 - 10_000.0).powi(2),
        &|k| 10.0 + 1e-6 * (k as f64 - 10_000.0).powi(2),
        &|k| 10.0 + 1e-4 * (k as f64 - 10_000.0).powi(2),
    ] {
        let truth: Vec<f64> = (0..ROWS).map(truth).collect();
        assert_eq!(find(&pulses(&truth), true), NONE);
        assert_eq!(find(&rounded(&truth), false), NONE);
    }
}

#[test]
fn a_quiet_dwell_between_turns_is_no_fault() {
    for dwell in [20, 100, 400] {
        for back in [-1.0, 1.0] {
            let truth = |k: usize| match k {
                0..9800 => 9800.0 - k as f64,
                k if k < 9800 + dwell => 0.0,
                k => back * (k - 9800 - dwell) as f64,
            };
            let values: Vec<f64> = (0..ROWS).map(truth).collect();
            assert_eq!(find(&values, true), NONE, "{dwell} {back}");
        }
    }
}

#[test]
fn an_axis_that_stops_within_a_smooth_motion_is_found() {
    // A component of gravity while a table turns at 45 °/s, 100 Hz.
    let truth = |k: usize| 9800.0 * (0.0079 * k as f64).sin();
    let mut values: Vec<f64> = (0..ROWS).map(truth).collect();
    values = pulses(&values);
    assert_eq!(find(&values, true), NONE);
    for length in [20, 50] {
        let mut values = values.clone();
        hold(&mut values, 7010..7010 + length);
        assert_found(&values, true, 7010..7010 + length);
    }
}
