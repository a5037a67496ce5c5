//! Detection of standstills in the output of the instrument.

use std::collections::VecDeque;
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, SQRT_2};
use std::ops::Range;

use nalgebra::Vector3;

use crate::earth::ROTATION_RATE;
use crate::imu::{Sensor, rounding_error};
use crate::navigation::samples_of;
use crate::recording::ImuSamples;
use crate::recording::faults::ranges;
use crate::run::Run;
use crate::statistics::{SIGMA_OF_MEDIAN, chi_square_limit, median, median_of_axes};
use crate::units::DEG_PER_H;

/// Length of the windows whose means are compared, s.
const WINDOW: f64 = 0.25;
/// Minimum length of a standstill in windows, because a released sensor still swings.
const FEWEST: usize = 4;
/// A standstill of this many seconds between two moves is always found. At its ends, up to one window in total is lost.
/// At each end, the next window differs from its neighbour, and the window after that is dropped because it may contain
/// a gentle move.
pub const LONG_ENOUGH: f64 = (1 + 2 * 2 + FEWEST) as f64 * WINDOW;
/// Output at rest varies by less than this many σ of its noise, plus a rate and a force.
pub const STILL_SIGMAS: f64 = 6.0;
/// Rate, rad/s: the drift of the worst bias within seconds.
pub const STILL_RATE: f64 = 100.0 * DEG_PER_H;
/// Force, m/s²: the change of force in a turn by 0.02°.
pub const STILL_FORCE: f64 = 3e-3;
/// False-alarm rate of the test that ends a standstill at a window that differs from its neighbours: an axis
/// has started to turn, or still settles. A false alarm costs a window.
const SETTLED: f64 = 0.01;
/// Number of successive windows with which it is compared.
const BESIDE: usize = 2 * FEWEST;
/// During warm-up, a bias changes by less than [`STILL_RATE`] in this time, s.
const WARMING: f64 = 20.0;
/// A bias is within this many σ of its prior.
const BIAS_SIGMAS: f64 = 6.0;

/// Windows that slide over a recording by single samples, so that standstills do not depend on where it begins.
#[derive(Clone, Copy)]
struct Slide {
    /// Samples per window.
    length: usize,
    /// Samples from one window to the next.
    step: usize,
}

/// Mean output of a triad over each window.
struct Windows {
    slide: Slide,
    /// NaN if samples are missing, so that the window does not count as at rest or steady.
    means: Vec<Vector3<f64>>,
    /// 1σ per axis of the noise of the means.
    sigma: f64,
}

impl Slide {
    fn of(imu: &ImuSamples) -> Self {
        let length = samples_of(WINDOW, imu.period);
        // Storing the means of a packed recording would need the memory that packing saves.
        let step = if imu.is_packed() { length } else { 1 };
        Self { length, step }
    }

    /// Number of windows to the next one without common samples.
    fn apart(self) -> usize {
        self.length / self.step
    }

    /// The windows with some of these samples.
    fn with(self, samples: &Range<usize>, count: usize) -> Range<usize> {
        let first = (samples.start + 1).saturating_sub(self.length);
        first.div_ceil(self.step).min(count)..samples.end.div_ceil(self.step).min(count)
    }
}

impl Windows {
    fn of(run: &Run, sensor: Sensor, slide: Slide) -> Self {
        let imu = &run.recording.imu;
        let duration = slide.length as f64 * imu.period;
        let sums = imu.of(sensor).sums(0..imu.len(), slide.step);
        let mut within = VecDeque::from([Vector3::zeros()]);
        let mut sum = Vector3::zeros();
        let means = sums.filter_map(|of_step| {
            sum += of_step;
            within.push_back(sum);
            let before = (within.len() > slide.apart()).then(|| within.pop_front())?;
            Some((sum - before?) / duration)
        });
        let mut means: Vec<_> = means.collect();
        for missing in imu.missing() {
            let windows = slide.with(&missing, means.len());
            means[windows].fill(Vector3::repeat(f64::NAN));
        }
        // Most windows are at rest or turn evenly, so the median contains only noise; the noise figures may not include
        // vibration in the laboratory.
        let pairs = means.iter().zip(means.iter().skip(slide.apart()));
        let changes = pairs.map(|(one, next)| (next - one).abs());
        let known = changes.filter(|change| !change.x.is_nan());
        let mut known: Vec<f64> = known.flat_map(<[f64; 3]>::from).collect();
        let found = SIGMA_OF_MEDIAN * FRAC_1_SQRT_2 * median(&mut known).unwrap_or(0.0);
        let stated = run.instrument.noise.get(sensor).random_walk / duration.sqrt();
        let pulse = imu.pulse.get(sensor) / duration;
        // A mean of rounded values lies anywhere within a step unless their noise is as large as the step.
        let step = imu.resolution(sensor).max();
        let noise = stated.powi(2) * slide.length as f64 - step.powi(2) / 12.0;
        let rounding = rounding_error(step, noise.max(0.0)).sqrt();
        Self {
            slide,
            means,
            sigma: found.max(stated).max(pulse).max(rounding),
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
        let drift = WINDOW / WARMING / self.slide.apart() as f64;
        let mut follow = |windows: &mut dyn Iterator<Item = usize>| {
            let mut rest = most;
            for k in windows.filter(|&k| may_be(k)) {
                let off = self.means[k] - rest;
                still[k] = off.norm() < rate;
                if still[k] {
                    rest += off * drift;
                }
            }
        };
        follow(&mut (begin..self.means.len()));
        follow(&mut (0..begin).rev());
        still
    }

    /// The samples of a standstill that consists of these windows, without windows at its ends that differ from their
    /// neighbours.
    fn settled(&self, windows: Range<usize>) -> Range<usize> {
        let Slide { length, step } = self.slide;
        let (mut first, mut last) = (windows.start, windows.end - 1);
        let limit = chi_square_limit(3.0, SETTLED);
        // A median of n normal numbers has a variance of π/2n.
        let variance = self.sigma.powi(2) * (1.0 + FRAC_PI_2 / BESIDE as f64);
        let apart = self.slide.apart();
        let moves = |window: usize, beside: Range<usize>| {
            let beside: Vec<_> = beside.step_by(apart).map(|k| self.means[k]).collect();
            let rest = median_of_axes(&beside);
            rest.is_some_and(|rest| (self.means[window] - rest).norm_squared() > limit * variance)
        };
        let reach = BESIDE * apart;
        while last - first >= reach && moves(first, first + apart..first + reach + 1) {
            first += 1;
        }
        while last - first >= reach && moves(last, last - reach..last) {
            last -= 1;
        }
        first * step..last * step + length
    }
}

/// Samples during which the gyros give their output at rest and the accelerometers do not change.
pub fn standstills(run: &Run) -> Vec<Range<usize>> {
    let imu = &run.recording.imu;
    let slide = Slide::of(imu);
    let [gyro, accel] = Sensor::ALL.map(|sensor| Windows::of(run, sensor, slide));
    let rate = STILL_SIGMAS * gyro.sigma + STILL_RATE;
    let force = STILL_SIGMAS * SQRT_2 * accel.sigma + STILL_FORCE;
    // A window beyond the recording, or beyond its known part, gives no information.
    let steady = |k: usize, beside: usize| {
        let beside = accel.means.get(beside);
        beside.is_none_or(|beside| beside.x.is_nan() || (accel.means[k] - beside).norm() < force)
    };
    let apart = slide.apart();
    let is_steady = |k: usize| steady(k, k.wrapping_sub(apart)) && steady(k, k + apart);
    let still = gyro.at_rest(run, rate, is_steady);
    let still = ranges(gyro.means.len(), |k| still[k]).into_iter();
    // Without gyros, gravity shows where a move begins and ends.
    let shows = if imu.has(Sensor::Gyro) { &gyro } else { &accel };
    let standstills = still.filter_map(|still| {
        let Range { mut start, mut end } = shows.settled(still);
        // A move begins and ends too gently to be visible in the windows at its ends.
        let is_known = |sample: usize| !imu.is_lost(&(sample..sample + 1));
        if start.checked_sub(1).is_some_and(is_known) {
            start += slide.length;
        }
        if end + slide.step > imu.len() {
            end = imu.len();
        } else if is_known(end) {
            end -= slide.length;
        }
        (end >= start + FEWEST * slide.length).then_some(start..end)
    });
    standstills.collect()
}
