//! Standstills in what the instrument itself says.

use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

use nalgebra::Vector3;

use super::{Dwell, STILL_RATE};
use crate::earth::ROTATION_RATE;
use crate::imu::Sensor;
use crate::run::Run;
use crate::statistics::{SIGMA_OF_MEDIAN, chi_square_limit, median, median_of_axes};

/// Length of the windows whose means are compared, s.
const WINDOW: f64 = 0.25;
/// Windows in a row that make a standstill: after a hand has let go a sensor still swings.
const FEWEST: usize = 4;
/// A standstill of so many seconds between two moves is found wherever it lies: a window may lie across either end
/// of it, the next one has not the same beside it, and the one after that is left out as too gentle a move.
pub const LONG_ENOUGH: f64 = (1 + 2 * 2 + FEWEST) as f64 * WINDOW;
/// Means of a window at rest differ by less than this many σ of their noise …
const STILL_SIGMAS: f64 = 6.0;
/// … and specific force by this much more, m/s²: a turn of 0.02°.
const STILL_FORCE: f64 = 3e-3;
/// False-alarm rate of the test that ends a standstill where a window differs from the windows beside it: an axis
/// has begun to turn, or still settles. A false alarm costs a window.
const SETTLED: f64 = 0.01;
/// Windows beside it.
const BESIDE: usize = 2 * FEWEST;
/// A bias is within this many σ of its prior.
const BIAS_SIGMAS: f64 = 6.0;

/// Mean output of a triad over each window.
struct Windows {
    /// Not a number where samples are missing, so that nothing is at rest or steady there.
    means: Vec<Vector3<f64>>,
    /// 1σ per axis of their noise.
    sigma: f64,
}

impl Windows {
    /// Of these many samples each.
    fn of(run: &Run, sensor: Sensor, length: usize) -> Self {
        let samples = run.recording.imu.of(sensor);
        let duration = length as f64 * run.recording.imu.period;
        let sums = samples.sums(0..samples.len(), length);
        let mut means: Vec<_> = sums.map(|sum| sum / duration).collect();
        for missing in run.recording.imu.missing() {
            let windows = missing.start / length..missing.end.div_ceil(length).min(means.len());
            means[windows].fill(Vector3::repeat(f64::NAN));
        }
        // Most windows are at rest or turn evenly, so the median sees noise alone; noise figures may
        // know nothing of a laboratory's shaking.
        let mut changes: Vec<f64> = means
            .windows(2)
            .flat_map(|pair| <[f64; 3]>::from((pair[1] - pair[0]).abs()))
            .filter(|change| !change.is_nan())
            .collect();
        let found = median(&mut changes).unwrap_or(0.0);
        let stated = run.instrument.noise.get(sensor).random_walk / duration.sqrt();
        let pulse = run.recording.imu.pulse.get(sensor) / duration;
        Self {
            means,
            sigma: (SIGMA_OF_MEDIAN * std::f64::consts::FRAC_1_SQRT_2 * found)
                .max(stated)
                .max(pulse),
        }
    }

    fn missing(&self, window: usize) -> bool {
        self.means[window].x.is_nan()
    }

    /// The part of a standstill at whose ends the output is what it is beside them.
    fn settled(&self, standstill: Range<usize>) -> Range<usize> {
        let Range { mut start, mut end } = standstill;
        let limit = chi_square_limit(3.0, SETTLED);
        // A median of n normal numbers has a variance of π/2n.
        let variance = self.sigma.powi(2) * (1.0 + FRAC_PI_2 / BESIDE as f64);
        let moves = |window: usize, beside: Range<usize>| {
            let rest = median_of_axes(&self.means[beside]);
            rest.is_some_and(|rest| (self.means[window] - rest).norm_squared() > limit * variance)
        };
        while end.saturating_sub(start) > BESIDE && moves(start, start + 1..start + 1 + BESIDE) {
            start += 1;
        }
        while end.saturating_sub(start) > BESIDE && moves(end - 1, end - 1 - BESIDE..end - 1) {
            end -= 1;
        }
        start..end
    }
}

/// Stretches during which the gyros say what they say at rest and the accelerometers do not change.
pub fn standstills(run: &Run) -> Vec<Dwell> {
    let length = ((WINDOW / run.recording.imu.period).round() as usize).max(1);
    let gyro = Windows::of(run, Sensor::Gyro, length);
    let accel = Windows::of(run, Sensor::Accel, length);
    let Some(rest) = output_at_rest(run, &gyro) else {
        return Vec::new();
    };
    let rate = STILL_SIGMAS * gyro.sigma + STILL_RATE;
    let force = STILL_SIGMAS * std::f64::consts::SQRT_2 * accel.sigma + STILL_FORCE;
    let steady = |k: usize| (accel.means[k + 1] - accel.means[k]).norm() < force;
    let count = gyro.means.len();
    // The record, or what is known of it, begins or ends here.
    let begins = |k: usize| k == 0 || accel.missing(k - 1);
    let ends = |k: usize| k == count || accel.missing(k);
    let is_still = |k: usize| {
        (gyro.means[k] - rest).norm() < rate
            && (begins(k) || steady(k - 1))
            && (ends(k + 1) || steady(k))
    };
    let mut dwells = Vec::new();
    let mut first = 0;
    for k in 0..=count {
        if k < count && is_still(k) {
            continue;
        }
        // A move begins and ends too gently for the windows at its ends to show it.
        let settled = gyro.settled(first..k);
        let begin = settled.start + usize::from(!begins(settled.start));
        let end = settled.end.saturating_sub(usize::from(!ends(settled.end)));
        if end >= begin + FEWEST {
            let end = match end == count {
                true => run.recording.imu.len(),
                false => end * length,
            };
            dwells.push(Dwell::of(begin * length..end));
        }
        first = k + 1;
    }
    dwells
}

/// What the gyros say at rest: what most of the windows say that a bias could make. None if no
/// window does.
fn output_at_rest(run: &Run, gyro: &Windows) -> Option<Vector3<f64>> {
    let prior = &run.instrument.prior.gyro;
    let limit = (prior.bias_sigma * BIAS_SIGMAS)
        .add_scalar(ROTATION_RATE + STILL_RATE + STILL_SIGMAS * gyro.sigma);
    let could_rest = |mean: &Vector3<f64>| {
        let off = (mean - prior.bias).abs();
        off.iter().zip(&limit).all(|(off, limit)| off <= limit)
    };
    let means = gyro.means.iter().copied();
    median_of_axes(&means.filter(could_rest).collect::<Vec<_>>())
}
