use super::*;
use crate::recording::faults::ranges;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const HOLES: usize = 300;

fn sound(each: impl Iterator<Item = bool>) -> Vec<bool> {
    each.collect()
}

fn fill(axis: &mut [f64], sound: &[bool], hole: &Range<usize>) -> Option<f64> {
    Hole::new(sound, hole.clone(), 1000).fill(axis, 0.0)
}

/// Mean square of the error over the mean variance stated, for gaps of this length in a signal.
fn consistency(signal: impl Fn(f64) -> f64, sigma: f64, length: usize) -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let apart = 10 * length + 500;
    let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
    let truth: Vec<f64> = (0..apart * HOLES)
        .map(|k| signal(k as f64) + sigma * normal())
        .collect();
    let (mut squares, mut variances) = (0.0, 0.0);
    for k in 0..HOLES {
        let hole = apart * k + apart / 2..apart * k + apart / 2 + length;
        let mut axis = truth.clone();
        axis[hole.clone()].fill(f64::NAN);
        let sound = sound(axis.iter().map(|value| !value.is_nan()));
        let variance = fill(&mut axis, &sound, &hole).unwrap();
        let error: f64 = hole.clone().map(|k| axis[k] - truth[k]).sum();
        squares += error * error;
        variances += variance;
    }
    squares / variances
}

#[test]
fn the_error_stated_is_the_error_made() {
    // 99 % of the means of 300 squares lie within 1 ± 0.21, and the variances scatter, too.
    for length in [1, 3, 20] {
        let still = consistency(|_| 7.0, 1.0, length);
        assert!((0.65..1.35).contains(&still), "{length}: {still}");
    }
    for length in [1, 3] {
        let swings = consistency(|t| 300.0 * (t / 40.0).sin(), 1.0, length);
        assert!((0.65..1.35).contains(&swings), "{length}: {swings}");
    }
}

#[test]
fn a_smooth_motion_is_followed_where_there_is_no_noise() {
    let truth = |k: usize| 100.0 * (k as f64 / 30.0).sin();
    let mut axis: Vec<f64> = (0..1000).map(truth).collect();
    axis[500] = f64::NAN;
    let sound = sound(axis.iter().map(|value| !value.is_nan()));
    let variance = fill(&mut axis, &sound, &(500..501)).unwrap();
    let error = axis[500] - truth(500);
    // Between two neighbours the parabola alone would leave 0.05.
    assert!(
        error.abs() < 1e-3 && variance.sqrt() < 1e-3,
        "{error} {variance}"
    );
}

#[test]
fn a_turn_that_began_in_the_hole_is_not_taken_for_known() {
    let signal = |k: usize| if k < 520 { 0.0 } else { 10.0 };
    let mut axis: Vec<f64> = (0..1000)
        .map(|k| signal(k) + (k % 7) as f64 * 1e-3)
        .collect();
    let truth: f64 = axis[500..600].iter().sum();
    let sound = sound((0..1000).map(|k| !(500..600).contains(&k)));
    let variance = fill(&mut axis, &sound, &(500..600)).unwrap();
    let error = axis[500..600].iter().sum::<f64>() - truth;
    assert!(error.abs() > 250.0, "{error}");
    assert!(error * error < 4.0 * variance, "{error} {variance}");
}

#[test]
fn a_hole_too_long_is_filled_but_not_vouched_for() {
    let mut axis: Vec<f64> = (0..1000).map(f64::from).collect();
    let sound = sound((0..1000).map(|k| !(500..600).contains(&k)));
    axis[500..600].fill(1e9);
    assert_eq!(Hole::new(&sound, 500..600, 99).fill(&mut axis, 0.0), None);
    assert!((axis[550] - 550.0).abs() < 1e-9);
}

/// Means over many single gaps of the error, its square and the stated variance, and the number of gaps. The data
/// are pulses of this mean rate per row with normal noise of `sigma` pulses per row; the remainder of each row is
/// carried into the next.
fn pulses(rate: f64, sigma: f64) -> ([f64; 3], f64) {
    const ROWS: usize = 120_000;
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
    let mut integral = 0.0;
    let mut counted = 0.0;
    let truth: Vec<f64> = (0..ROWS)
        .map(|_| {
            integral += rate + sigma * normal();
            let pulses = f64::round(integral - counted);
            counted += pulses;
            pulses
        })
        .collect();
    let sound = sound((0..ROWS).map(|_| random.random::<f64>() > 0.02));
    let mut axis = truth.clone();
    let holes = ranges(ROWS, |k| !sound[k]);
    let holes = holes
        .iter()
        .filter(|hole| hole.start > 0 && hole.end < ROWS);
    let (mut sums, mut count) = ([0.0; 3], 0.0);
    for hole in holes {
        axis[hole.clone()].fill(f64::NAN);
        let variance = Hole::new(&sound, hole.clone(), 1000).fill(&mut axis, 1.0);
        let error: f64 = hole.clone().map(|k| axis[k] - truth[k]).sum();
        for (sum, value) in sums
            .iter_mut()
            .zip([error, error * error, variance.unwrap()])
        {
            *sum += value;
        }
        count += 1.0;
    }
    (sums.map(|sum| sum / count), count)
}

#[test]
fn of_a_pulse_in_so_many_rows_a_missing_row_gets_its_share() {
    for rows in [2, 3, 5, 17, 37, 64] {
        let filled = |phase: usize| {
            let mut axis: Vec<f64> = (0..1000)
                .map(|k| f64::from(u8::from(k % rows == phase)))
                .collect();
            axis[500] = f64::NAN;
            let sound = sound((0..1000).map(|k| k != 500));
            Hole::new(&sound, 500..501, 1000).fill(&mut axis, 1.0);
            axis[500]
        };
        let sum: f64 = (0..rows).map(filled).sum();
        assert!((sum - 1.0).abs() < 1e-9, "{rows}: {sum}");
    }
}

#[test]
fn no_pulse_is_gained_or_lost_on_average_however_sparse_they_are() {
    for (rate, sigma) in [
        (0.003, 0.03),
        (0.03, 0.03),
        (0.97, 0.03),
        (0.3, 0.1),
        (0.03, 0.5),
    ] {
        let ([mean, square, stated], holes) = pulses(rate, sigma);
        let by_chance = (square / holes).sqrt();
        assert!(
            mean.abs() < 3.3 * by_chance,
            "{rate} {sigma}: {mean} ± {by_chance}"
        );
        // Where pulses are sparse few gaps make most of the squares.
        let ratio = square / stated;
        assert!((0.75..1.25).contains(&ratio), "{rate} {sigma}: {ratio}");
    }
}
