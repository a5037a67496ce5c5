//! Tests of the means and their σ.

use super::*;
use approx::assert_relative_eq;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Dwells of 10 s at 50 Hz whose noise is kept for `held` values, and the errors of their means over σ.
fn normalised(held: usize) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut series = Magnetometer::new("uT", 1e6);
    let mut noise = Vector3::zeros();
    for k in 0..200 * 500 {
        if k % held == 0 {
            noise = Vector3::from_fn(|_, _| StandardNormal.sample(&mut rng));
        }
        series.push(3.0 + f64::from(k as u32) * 0.02, 0.3 * noise);
    }
    let dwell = |k: u32| 3.0 + 10.0 * f64::from(k)..13.0 + 10.0 * f64::from(k);
    let found = series.noise((0..200).map(dwell));
    let each = (0..200).filter_map(|k| series.mean(&dwell(k), &found));
    let squares = each.map(|of| of.output.component_div(&of.sigma).norm_squared() / 3.0);
    squares.sum::<f64>() / 200.0
}

#[test]
fn the_sigma_of_means_holds_for_white_and_for_repeated_values() {
    // 600 squares: 1σ is 0.06.
    for held in [1, 5, 40] {
        let square = normalised(held);
        assert!((0.8..1.3).contains(&square), "{held}: {square}");
    }
}

#[test]
fn values_within_one_step_are_uncertain_by_the_step() {
    let mut series = Magnetometer::new("count", MAGNETIC_COUNT);
    (0..100).for_each(|k| series.push(0.1 * f64::from(k), Vector3::repeat(37.0)));
    series.step = Vector3::repeat(1.0 / MAGNETIC_COUNT);
    let mean = series
        .mean(&(0.0..10.0), &MagneticNoise::default())
        .unwrap();
    let uniform = series.step.x / 12f64.sqrt();
    assert_relative_eq!(mean.sigma.x, uniform, max_relative = 0.1);
    assert_relative_eq!(mean.output.x, 37.0 / MAGNETIC_COUNT, max_relative = 1e-12);
    assert_eq!(series.mean(&(20.0..30.0), &MagneticNoise::default()), None);
}

#[test]
fn a_slower_clock_moves_the_spans() {
    let mut series = Magnetometer::new("T", 1.0);
    (0..100).for_each(|k| series.push(2.0 + 0.1 * f64::from(k), Vector3::repeat(f64::from(k))));
    series.slower(2.0);
    let values: Vec<(f64, Vector3<f64>)> = series.values().collect();
    assert_relative_eq!(values[0].0, 4.1, epsilon = 1e-9);
    assert_relative_eq!(values[99].0, 4.1 + 0.2 * 99.0, epsilon = 1e-9);
    assert_eq!(values[99].1.x, 99.0);
}
