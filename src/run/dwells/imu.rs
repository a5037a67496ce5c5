//! Standstills in the output of the instrument.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, SQRT_2};
use std::ops::Range;

use nalgebra::Vector3;

use crate::earth::ROTATION_RATE;
use crate::imu::Sensor;
use crate::navigation::samples_of;
use crate::recording::faults::ranges;
use crate::run::Run;
use crate::statistics::{SIGMA_OF_MEDIAN, chi_square_limit, median, median_of_axes};
use crate::units::DEG_PER_H;

/// Length of the windows whose means are compared, s.
const WINDOW: f64 = 0.25;
/// Minimum number of consecutive windows of a standstill, because a released sensor still swings.
const FEWEST: usize = 4;
/// A standstill of this many seconds between two moves is always found. Its ends cut up to one window in all; at each
/// end, the next window differs from its neighbour, and the one after is dropped because it may be a gentle move.
pub const LONG_ENOUGH: f64 = (1 + 2 * 2 + FEWEST) as f64 * WINDOW;
/// Output at rest is within this many σ of its noise …
pub const STILL_SIGMAS: f64 = 6.0;
/// … and angular rate within the drift of the worst bias in seconds, rad/s …
pub const STILL_RATE: f64 = 100.0 * DEG_PER_H;
/// … and specific force within this, m/s²: a turn of 0.02°.
const STILL_FORCE: f64 = 3e-3;
/// False-alarm rate of the test that ends a standstill at a window that differs from its neighbours: an axis
/// has started to turn, or still settles. A false alarm costs a window.
const SETTLED: f64 = 0.01;
/// Number of neighbouring windows it is compared with.
const BESIDE: usize = 2 * FEWEST;
/// During warm-up, a bias changes by less than [`STILL_RATE`] in this time, s.
const WARMING: f64 = 20.0;
/// A bias is within this many σ of its prior.
const BIAS_SIGMAS: f64 = 6.0;

/// Mean output of a triad over each window.
struct Windows {
    /// NaN if samples are missing, so that the window does not count as at rest or steady.
    means: Vec<Vector3<f64>>,
    /// 1σ per axis of their noise.
    sigma: f64,
}

impl Windows {
    /// Number of samples per window.
    fn of(run: &Run, sensor: Sensor, length: usize) -> Self {
        let imu = &run.recording.imu;
        let duration = length as f64 * imu.period;
        let sums = imu.of(sensor).sums(0..imu.len(), length);
        let mut means: Vec<_> = sums.map(|sum| sum / duration).collect();
        for missing in imu.missing() {
            let windows = missing.start / length..missing.end.div_ceil(length).min(means.len());
            means[windows].fill(Vector3::repeat(f64::NAN));
        }
        // Most windows are at rest or turn evenly, so the median sees noise alone; noise figures may
        // know nothing of a laboratory's shaking.
        let changes = means.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let known = changes.filter(|change| !change.x.is_nan());
        let mut known: Vec<f64> = known.flat_map(<[f64; 3]>::from).collect();
        let found = SIGMA_OF_MEDIAN * FRAC_1_SQRT_2 * median(&mut known).unwrap_or(0.0);
        let stated = run.instrument.noise.get(sensor).random_walk / duration.sqrt();
        let pulse = imu.pulse.get(sensor) / duration;
        Self {
            means,
            sigma: found.max(stated).max(pulse),
        }
    }

    /// Whether the gyros are at rest in each candidate window. Their output at rest is the median of windows that a
    /// bias could explain; from the window nearest to it, its drift with warm-up is tracked in both directions.
    fn at_rest(&self, run: &Run, rate: f64, may_be: impl Fn(usize) -> bool) -> Vec<bool> {
        let prior = &run.instrument.prior.gyro;
        let limit = (prior.bias_sigma * BIAS_SIGMAS).add_scalar(ROTATION_RATE + rate);
        let could_rest = |mean: &Vector3<f64>| (mean - prior.bias).abs() <= limit;
        let all: Vec<_> = self.means.iter().copied().filter(could_rest).collect();
        let mut still = vec![false; self.means.len()];
        let Some(most) = median_of_axes(&all) else {
            return still;
        };
        let off = |k: usize| (self.means[k] - most).norm();
        let may_begin = (0..still.len()).filter(|&k| may_be(k));
        let Some(begin) = may_begin.min_by(|&a, &b| off(a).total_cmp(&off(b))) else {
            return still;
        };
        let mut follow = |windows: &mut dyn Iterator<Item = usize>| {
            let mut rest = most;
            for k in windows.filter(|&k| may_be(k)) {
                let off = self.means[k] - rest;
                still[k] = off.norm() < rate;
                if still[k] {
                    rest += off * (WINDOW / WARMING);
                }
            }
        };
        follow(&mut (begin..self.means.len()));
        follow(&mut (0..begin).rev());
        still
    }

    /// The part of a standstill at whose ends the output agrees with its neighbouring windows.
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

/// Samples during which the gyros give their output at rest and the accelerometers do not change.
pub fn standstills(run: &Run) -> Vec<Range<usize>> {
    let imu = &run.recording.imu;
    let length = samples_of(WINDOW, imu.period);
    let [gyro, accel] = Sensor::ALL.map(|sensor| Windows::of(run, sensor, length));
    let rate = STILL_SIGMAS * gyro.sigma + STILL_RATE;
    let force = STILL_SIGMAS * SQRT_2 * accel.sigma + STILL_FORCE;
    // Beyond the recording, or what is known of it.
    let unknown = |k: usize| accel.means.get(k).is_none_or(|mean| mean.x.is_nan());
    let steady = |k: usize, beside: usize| {
        unknown(beside) || (accel.means[k] - accel.means[beside]).norm() < force
    };
    let is_steady = |k: usize| steady(k, k.wrapping_sub(1)) && steady(k, k + 1);
    let still = gyro.at_rest(run, rate, is_steady);
    let count = gyro.means.len();
    let still = ranges(count, |k| still[k]).into_iter();
    let standstills = still.filter_map(|still| {
        // A move begins and ends too gently for the windows at its ends to show it.
        let Range { start, end } = gyro.settled(still);
        let begin = start + usize::from(!unknown(start.wrapping_sub(1)));
        let end = end - usize::from(!unknown(end));
        let samples = if end == count {
            begin * length..imu.len()
        } else {
            begin * length..end * length
        };
        (end >= begin + FEWEST).then_some(samples)
    });
    standstills.collect()
}
