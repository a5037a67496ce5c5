//! Motion computed from raw samples of unknown unit: dwells, magnitude of gravity, and gyro rotation compared with the
//! gravity direction.

use std::ops::Range;

use nalgebra::Vector3;
use statrs::statistics::Statistics;

use super::turns::{self, ENOUGH, Interval};
use turncal::imu::PerSensor;
use turncal::statistics::{FALSE_ALARM, SIGMA_OF_MEDIAN, median, median_of_axes, student_limit};
use turncal::units::DEGREE;

/// Length of the compared windows, s.
pub const WINDOW: f64 = 0.25;
/// Windows at rest differ by less than this many σ of their noise, plus a fraction.
const SIGMAS: f64 = 6.0;
/// Fraction of gravity, or of the fastest turn, that is added to this limit.
const PART: f64 = 1e-3;
/// Number of samples compared on either side of a cut.
const BESIDE: usize = 8;
/// The gravity direction jumps by this much at a cut, rad.
const CUT: f64 = 30.0 * DEGREE;
/// The gravity direction varies by less than this on each side of a cut, rad.
const STEADY: f64 = 5.0 * DEGREE;
/// Most windows that a jump, or an end of the rows, disturbs: its own and the neighbours.
const AT_CUT: usize = 3;
/// Step of the integration of the gravity direction, s.
pub const FOLLOWED: f64 = 0.08;
/// Specific force gives the direction of gravity if its magnitude is within this fraction of gravity.
const NEAR_GRAVITY: f64 = 0.1;
/// Tolerance of scale factors stated in data sheets.
pub const TOLERANCE: f64 = 0.03;
/// Number of samples summed to distinguish pulses, which carry fractions, from readings.
const SUM: usize = 16;

/// Motion detected in the samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// The longest stretch at rest.
    pub longest_rest: Range<usize>,
    /// Specific force at rest, in the file's quantity per row.
    pub gravity: f64,
    /// Mean gyro output when the sensor is at rest.
    pub rest: Vector3<f64>,
    /// Whether the gravity direction changes.
    pub is_turned: bool,
    /// Whether the sensor is always at rest, apart from jumps of the gravity direction.
    pub stands: bool,
    /// Angle in rad for one gyro unit in one row, if the turns determine it; negative if the triads have opposite
    /// signs.
    pub angle: Option<f64>,
    /// Samples before which the gravity direction jumps, as in concatenated sections.
    pub cuts: Vec<usize>,
    /// Variance of sums of samples at rest, relative to that of independent samples; the smallest value of all axes.
    pub sum_variance: Option<f64>,
}

pub fn mean(samples: &[Vector3<f64>]) -> Vector3<f64> {
    samples.iter().sum::<Vector3<f64>>() / samples.len().max(1) as f64
}

fn means(samples: &[Vector3<f64>], length: usize) -> Vec<Vector3<f64>> {
    samples.chunks_exact(length).map(mean).collect()
}

/// 1σ noise of window means, from successive differences.
fn noise(means: &[Vector3<f64>]) -> f64 {
    let differences = means.windows(2).map(|pair| pair[1] - pair[0]);
    let changes = differences.flat_map(|d| <[f64; 3]>::from(d.abs()));
    let mut changes: Vec<f64> = changes.collect();
    SIGMA_OF_MEDIAN * std::f64::consts::FRAC_1_SQRT_2 * median(&mut changes).unwrap_or(0.0)
}

impl Motion {
    /// Computes the motion from samples; rows are missing before the samples in `breaks`.
    pub fn find(samples: &PerSensor<Vec<Vector3<f64>>>, breaks: &[usize], period: f64) -> Self {
        let length = ((WINDOW / period).round() as usize).clamp(1, samples.gyro.len().div_ceil(8));
        let gyro = means(&samples.gyro, length);
        let accel = means(&samples.accel, length);
        let mut sizes: Vec<f64> = accel.iter().map(|f| f.norm()).collect();
        let usual = median(&mut sizes).unwrap_or(0.0);
        let force = SIGMAS * noise(&accel) + PART * usual;
        let near = |k: usize| (accel[k] - accel[k - 1]).norm() <= force;
        let steady = |k: usize| (k == 0 || near(k)) && (k + 1 == accel.len() || near(k + 1));
        let standing = (0..accel.len()).filter(|&k| steady(k));
        let standing: Vec<Vector3<f64>> = standing.map(|k| gyro[k]).collect();
        let rest = median_of_axes(&standing).unwrap_or_default();
        let turned = |k: usize| (gyro[k] - rest).norm();
        let fastest = (0..gyro.len()).map(turned).fold(0.0, f64::max);
        let rate = SIGMAS * noise(&gyro) + PART * fastest;
        let at_rest = (0..gyro.len()).map(|k| steady(k) && turned(k) <= rate);
        let at_rest: Vec<bool> = at_rest.collect();
        let standing = (0..accel.len()).filter(|&k| at_rest[k]);
        let mut sizes: Vec<f64> = standing.map(|k| accel[k].norm()).collect();
        let stretches = stretches(&at_rest);
        let longest = stretches.iter().max_by_key(|of| of.len());
        let longest = longest.cloned().unwrap_or(0..0);
        // The ends of a rest interval still contain motion.
        let long = stretches.iter().filter(|of| of.len() > 3);
        let settled = long.map(|of| (of.start + 1) * length..(of.end - 1) * length);
        let settled: Vec<Range<usize>> = settled.collect();
        let cuts = cuts(samples, breaks);
        let step = ((FOLLOWED / period).round() as usize).max(1);
        let windows = (&at_rest[..], length);
        let angle = turns::angle(&intervals(samples, breaks, (rest, usual), windows, step));
        Self {
            longest_rest: longest.start * length..longest.end * length,
            gravity: median(&mut sizes).unwrap_or(usual),
            rest,
            is_turned: is_turned(&accel, usual),
            stands: at_rest.iter().filter(|rest| !**rest).count() <= AT_CUT * (cuts.len() + 1),
            angle: angle.filter(|_| cuts.is_empty()),
            cuts,
            sum_variance: sum_variance(samples, &settled),
        }
    }
}

fn is_near(force: &Vector3<f64>, gravity: f64) -> bool {
    (force.norm() / gravity - 1.0).abs() < NEAR_GRAVITY
}

/// Whether the gravity direction changes enough to be used.
fn is_turned(forces: &[Vector3<f64>], gravity: f64) -> bool {
    let mut shown = forces.iter().filter(|force| is_near(force, gravity));
    let first = shown.next();
    first.is_some_and(|first| shown.any(|force| force.angle(first) > ENOUGH))
}

pub fn is_whole(samples: &[Vector3<f64>]) -> bool {
    let mut values = samples.iter().flat_map(|sample| sample.iter());
    values.all(|value| value.fract() == 0.0)
}

/// Intervals of this number of samples, with dwells by windows of `window` samples.
fn intervals(
    samples: &PerSensor<Vec<Vector3<f64>>>,
    breaks: &[usize],
    (rest, gravity): (Vector3<f64>, f64),
    (at_rest, window): (&[bool], usize),
    length: usize,
) -> Vec<Interval> {
    let (gyro, accel) = (means(&samples.gyro, length), means(&samples.accel, length));
    let both = gyro.iter().zip(&accel).enumerate();
    let interval = |(k, (rate, force)): (usize, (&Vector3<f64>, &Vector3<f64>))| Interval {
        rotation: (rate - rest) * length as f64,
        up: is_near(force, gravity).then(|| force.normalize()),
        is_at_rest: at_rest.get((k * length + length / 2) / window) == Some(&true),
        is_broken: is_broken(breaks, &((k * length).saturating_sub(1)..(k + 1) * length)),
    };
    both.map(interval).collect()
}

/// Sequences of windows at rest.
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

/// Whether samples are missing between these two.
fn is_broken(breaks: &[usize], samples: &Range<usize>) -> bool {
    let after = breaks.partition_point(|&next| next <= samples.start);
    breaks.get(after).is_some_and(|&next| next < samples.end)
}

/// Places where the gravity direction jumps without missing samples or gyro rotation.
fn cuts(samples: &PerSensor<Vec<Vector3<f64>>>, breaks: &[usize]) -> Vec<usize> {
    let accel = &samples.accel;
    let (mut cuts, mut next) = (Vec::new(), 2 * BESIDE);
    while next + 2 * BESIDE <= accel.len() {
        let part = |from: usize| mean(&accel[from..from + BESIDE]);
        let (before, after) = (part(next - BESIDE), part(next));
        let cut = before.angle(&after) > CUT
            && part(next - 2 * BESIDE).angle(&before) < STEADY
            && after.angle(&part(next + BESIDE)) < STEADY
            && !is_broken(breaks, &(next - BESIDE..next + BESIDE))
            && {
                let gyro = &samples.gyro[next - 2 * BESIDE..next + 2 * BESIDE];
                !turn_about(&before.cross(&after).normalize(), gyro)
            };
        cuts.extend(cut.then_some(next));
        next += if cut { 2 * BESIDE } else { 1 };
    }
    cuts
}

/// Whether gyros turn about an axis in the middle half of these samples, significantly relative to their scatter in the
/// others: at low rates a turn can be as short as a cut, but the gyros show it.
fn turn_about(axis: &Vector3<f64>, gyro: &[Vector3<f64>]) -> bool {
    let rates: Vec<f64> = gyro.iter().map(|rate| rate.dot(axis)).collect();
    let (before, others) = rates.split_at(BESIDE);
    let (between, after) = others.split_at(2 * BESIDE);
    let variance = 0.5 * (before.variance() + after.variance());
    // There are as many samples in the middle as on both sides together.
    let sigma = (2.0 * variance / (2 * BESIDE) as f64).sqrt();
    let change = between.mean() - 0.5 * (before.mean() + after.mean());
    let degrees = (2 * BESIDE - 2) as f64;
    change.abs() > student_limit(degrees, 0.5 * FALSE_ALARM) * sigma
}

/// Variance of sums of samples at rest, relative to that of independent samples; the smallest value of all axes.
fn sum_variance(samples: &PerSensor<Vec<Vector3<f64>>>, settled: &[Range<usize>]) -> Option<f64> {
    let ratio = |triad: &[Vector3<f64>], axis: usize| {
        let (mut of_sums, mut of_one) = (0.0, 0.0);
        for stretch in settled {
            let values: Vec<f64> = triad[stretch.clone()].iter().map(|row| row[axis]).collect();
            let sums = values.chunks_exact(SUM).map(|part| part.iter().sum());
            let sums: Vec<f64> = sums.collect();
            // Differences between neighbours do not contain slow drift.
            let differences = sums.windows(2).map(|pair| pair[1] - pair[0]);
            of_one += differences.len() as f64 * values.population_variance();
            of_sums += differences.map(|of| of.powi(2)).sum::<f64>();
        }
        of_sums / (2.0 * SUM as f64 * of_one)
    };
    let of_triad = |triad| (0..3).map(move |axis| ratio(triad, axis));
    let ratios = of_triad(&samples.gyro).chain(of_triad(&samples.accel));
    ratios.filter(|ratio| ratio.is_finite()).reduce(f64::min)
}
