//! What raw samples of unknown unit show of the motion: where they rest, how large gravity is, and by gravity's
//! direction how far the gyros turn.

use std::ops::Range;

use nalgebra::Vector3;

use crate::imu::PerSensor;
use crate::units::DEGREE;

/// Length of the windows whose means are compared, s.
const WINDOW: f64 = 0.25;
/// Windows at rest differ by less than this many σ of their noise …
const SIGMAS: f64 = 6.0;
/// … and this part of gravity or of the fastest turn.
const PART: f64 = 1e-3;
/// σ of a normal distribution over the median of its absolute deviations.
const SIGMA_OF_MEDIAN: f64 = 1.482_602;
/// Length of the windows over which gravity's direction is followed, s.
const STEP: f64 = 0.08;
/// Specific force within this part of gravity shows its direction.
const NEAR_GRAVITY: f64 = 0.1;
/// Turns in all that tell the unit of the gyros, rad.
const ENOUGH: f64 = 20.0 * DEGREE;
/// How well gravity's direction must follow the gyros.
const CORRELATION: f64 = 0.9;
/// Samples on either side of a cut …
const BESIDE: usize = 8;
/// … between which gravity's direction changes by this much at once, rad …
const CUT: f64 = 30.0 * DEGREE;
/// … though it stays within this on each side.
const STEADY: f64 = 5.0 * DEGREE;
/// Samples that are added up to tell pulses, whose fractions are carried, from readings.
const SUM: usize = 16;

/// What the samples show.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Motion {
    /// The longest stretch at rest.
    pub longest_rest: Range<usize>,
    /// Specific force at rest, the file's quantity a row.
    pub gravity: f64,
    /// Gyros at rest.
    pub rest: Vector3<f64>,
    /// Angle in rad of one unit of the gyros in one row, where turns show it; negative where the triads have
    /// opposite signs.
    pub angle: Option<f64>,
    /// Places where gravity's direction jumps: sections laid end to end.
    pub cuts: usize,
    /// Variance of sums of samples at rest over that of as many independent ones, least of the axes.
    pub sum_variance: Option<f64>,
}

/// The middle of some numbers.
pub(super) fn median(values: &mut [f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

fn mean(samples: &[Vector3<f64>]) -> Vector3<f64> {
    samples.iter().sum::<Vector3<f64>>() / samples.len().max(1) as f64
}

fn means(samples: &[Vector3<f64>], length: usize) -> Vec<Vector3<f64>> {
    samples.chunks_exact(length).map(mean).collect()
}

/// Median of each axis.
fn level<'a>(vectors: impl Iterator<Item = &'a Vector3<f64>> + Clone) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| {
        let mut values: Vec<f64> = vectors.clone().map(|v| v[axis]).collect();
        median(&mut values).unwrap_or(0.0)
    })
}

/// 1σ of the noise of means of windows, from how they differ from one to the next.
fn noise(means: &[Vector3<f64>]) -> f64 {
    let differences = means.windows(2).map(|pair| pair[1] - pair[0]);
    let mut changes: Vec<f64> = differences
        .flat_map(|d| <[f64; 3]>::from(d.abs()))
        .collect();
    SIGMA_OF_MEDIAN * std::f64::consts::FRAC_1_SQRT_2 * median(&mut changes).unwrap_or(0.0)
}

impl Motion {
    pub fn find(samples: &PerSensor<Vec<Vector3<f64>>>, period: f64) -> Self {
        let length = ((WINDOW / period).round() as usize).clamp(1, samples.gyro.len().div_ceil(8));
        let gyro = means(&samples.gyro, length);
        let accel = means(&samples.accel, length);
        let mut sizes: Vec<f64> = accel.iter().map(|f| f.norm()).collect();
        let usual = median(&mut sizes).unwrap_or(0.0);
        let force = SIGMAS * noise(&accel) + PART * usual;
        let steady = |k: usize| {
            let near =
                |other: Option<&Vector3<f64>>| other.is_none_or(|f| (f - accel[k]).norm() < force);
            near(k.checked_sub(1).and_then(|k| accel.get(k))) && near(accel.get(k + 1))
        };
        let standing: Vec<usize> = (0..accel.len()).filter(|&k| steady(k)).collect();
        let rest = level(standing.iter().map(|&k| &gyro[k]));
        let fastest = gyro
            .iter()
            .map(|rate| (rate - rest).norm())
            .fold(0.0, f64::max);
        let rate = SIGMAS * noise(&gyro) + PART * fastest;
        let at_rest: Vec<bool> = (0..gyro.len())
            .map(|k| steady(k) && (gyro[k] - rest).norm() <= rate)
            .collect();
        let mut sizes: Vec<f64> = (0..accel.len())
            .filter(|&k| at_rest[k])
            .map(|k| accel[k].norm())
            .collect();
        let stretches = stretches(&at_rest);
        let longest = stretches
            .iter()
            .max_by_key(|stretch| stretch.len())
            .cloned()
            .unwrap_or(0..0);
        Self {
            longest_rest: longest.start * length..longest.end * length,
            gravity: median(&mut sizes).unwrap_or(usual),
            rest,
            angle: angle(samples, rest, usual, period),
            cuts: cuts(&samples.accel),
            sum_variance: sum_variance(samples, &stretches, length),
        }
    }
}

/// Runs of windows at rest.
fn stretches(at_rest: &[bool]) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    let mut begin = 0;
    for stretch in at_rest.chunk_by(|a, b| a == b) {
        if stretch.first() == Some(&true) {
            found.push(begin..begin + stretch.len());
        }
        begin += stretch.len();
    }
    found
}

/// By least squares of `ḟ = f × ω` over short steps, wherever |f| is that of gravity.
fn angle(
    samples: &PerSensor<Vec<Vector3<f64>>>,
    rest: Vector3<f64>,
    gravity: f64,
    period: f64,
) -> Option<f64> {
    let length = ((STEP / period).round() as usize).max(1);
    let gyro = means(&samples.gyro, length);
    let accel = means(&samples.accel, length);
    let (mut both, mut turned, mut seen) = (0.0, 0.0, 0.0);
    for (rate, force) in gyro.windows(3).zip(accel.windows(3)) {
        let near = |f: &Vector3<f64>| (f.norm() / gravity - 1.0).abs() < NEAR_GRAVITY;
        if !force.iter().all(near) {
            continue;
        }
        let angle = (0.5 * (rate[0] + rate[2]) + rate[1] - 2.0 * rest) * length as f64;
        let expected = force[1].normalize().cross(&angle);
        let change = force[2].normalize() - force[0].normalize();
        // What changes more is no turn but a border between sections.
        if change.norm() < 0.5 {
            both += expected.dot(&change);
            turned += expected.norm_squared();
            seen += change.norm_squared();
        }
    }
    let correlation = both / (turned * seen).sqrt();
    (seen.sqrt() > 0.1 * ENOUGH && correlation.abs() > CORRELATION).then(|| both / turned)
}

fn cuts(accel: &[Vector3<f64>]) -> usize {
    let (mut cuts, mut next) = (0, 2 * BESIDE);
    while next + 2 * BESIDE <= accel.len() {
        let part = |from: usize| mean(&accel[from..from + BESIDE]);
        let (before, after) = (part(next - BESIDE), part(next));
        let cut = before.angle(&after) > CUT
            && part(next - 2 * BESIDE).angle(&before) < STEADY
            && after.angle(&part(next + BESIDE)) < STEADY;
        cuts += usize::from(cut);
        next += if cut { 2 * BESIDE } else { 1 };
    }
    cuts
}

fn sum_variance(
    samples: &PerSensor<Vec<Vector3<f64>>>,
    stretches: &[Range<usize>],
    length: usize,
) -> Option<f64> {
    let mut least: Option<f64> = None;
    for triad in [&samples.gyro, &samples.accel] {
        for axis in 0..3 {
            let (mut of_sums, mut of_one, mut count) = (0.0, 0.0, 0.0);
            for stretch in stretches {
                let values: Vec<f64> = triad[stretch.start * length..stretch.end * length]
                    .iter()
                    .map(|sample| sample[axis])
                    .collect();
                // Differences of neighbours are free of what wanders.
                let sums: Vec<f64> = values
                    .chunks_exact(SUM)
                    .map(|part| part.iter().sum())
                    .collect();
                of_sums += sums
                    .windows(2)
                    .map(|pair| (pair[1] - pair[0]).powi(2))
                    .sum::<f64>();
                count += sums.len().saturating_sub(1) as f64;
                let middle = values.iter().sum::<f64>() / values.len().max(1) as f64;
                let spread = values.iter().map(|v| (v - middle).powi(2)).sum::<f64>();
                of_one += spread / values.len().max(1) as f64 * sums.len().saturating_sub(1) as f64;
            }
            if count > 0.0 && of_one > 0.0 {
                let ratio = of_sums / (2.0 * SUM as f64 * of_one);
                least = Some(least.map_or(ratio, |least| least.min(ratio)));
            }
        }
    }
    least
}
