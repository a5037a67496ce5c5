//! How far one unit of the gyros turns, by gravity's direction.

use std::ops::Range;

use nalgebra::Vector3;

use super::motion::{is_broken, mean, means};
use crate::attitude::exp;
use crate::imu::PerSensor;
use crate::units::DEGREE;

/// Length of the steps over which gravity's direction is followed, s.
pub(super) const STEP: f64 = 0.08;
/// Specific force within this part of gravity shows its direction.
const NEAR_GRAVITY: f64 = 0.1;
/// Changes of direction below this tell nothing, rad.
const ENOUGH: f64 = 20.0 * DEGREE;
/// How well gravity's direction must follow the gyros.
const CORRELATION: f64 = 0.98;
/// Turns from rest to rest that tell the same.
const FEWEST: usize = 3;
/// What they may be off by, RMS, rad.
const NEAR: f64 = 8.0 * DEGREE;
/// Scales within this factor are the same, and others must be worse by …
const SAME: f64 = 1.25;
/// … this factor.
const RIVAL: f64 = 2.0;
/// A first guess may be wrong by this factor, for a hand shakes more than it turns.
const SEARCHED: f64 = 8.0;
/// Steps of the search in a factor of e.
const FINE: f64 = 100.0;

/// Angle in rad of one unit of the gyros in one row: step by step where nothing but gravity is sensed, else
/// from rest to rest. Negative where the triads have opposite signs.
pub(super) fn angle(
    samples: &PerSensor<Vec<Vector3<f64>>>,
    breaks: &[usize],
    rests: &[Range<usize>],
    zero: Vector3<f64>,
    gravity: f64,
    period: f64,
) -> Option<f64> {
    let length = ((STEP / period).round() as usize).max(1);
    let (first, correlation) = step_by_step(samples, breaks, zero, gravity, length)?;
    if correlation.abs() > CORRELATION {
        return Some(first);
    }
    from_rest_to_rest(samples, breaks, rests, first, length.div_ceil(4))
}

fn is_near(force: &Vector3<f64>, gravity: f64) -> bool {
    (force.norm() / gravity - 1.0).abs() < NEAR_GRAVITY
}

/// Whether gravity's direction changes by enough to tell something.
pub(super) fn is_turned(forces: &[Vector3<f64>], gravity: f64) -> bool {
    let mut shown = forces.iter().filter(|force| is_near(force, gravity));
    let first = shown.next();
    first.is_some_and(|first| shown.any(|force| force.angle(first) > ENOUGH))
}

/// By least squares of `ḟ = f × ω`, wherever |f| is that of gravity; with the correlation of both sides.
fn step_by_step(
    samples: &PerSensor<Vec<Vector3<f64>>>,
    breaks: &[usize],
    zero: Vector3<f64>,
    gravity: f64,
    length: usize,
) -> Option<(f64, f64)> {
    let gyro = means(&samples.gyro, length);
    let accel = means(&samples.accel, length);
    let (mut both, mut turned, mut seen) = (0.0, 0.0, 0.0);
    for (k, (rate, force)) in gyro.windows(3).zip(accel.windows(3)).enumerate() {
        let at = k * length..(k + 3) * length;
        if !force.iter().all(|f| is_near(f, gravity)) || is_broken(breaks, &at) {
            continue;
        }
        let angle = (0.5 * (rate[0] + rate[2]) + rate[1] - 2.0 * zero) * length as f64;
        let expected = force[1].normalize().cross(&angle);
        let change = force[2].normalize() - force[0].normalize();
        both += expected.dot(&change);
        turned += expected.norm_squared();
        seen += change.norm_squared();
    }
    let correlation = both / (turned * seen).sqrt();
    (correlation.is_finite() && seen.sqrt() > 0.1 * ENOUGH).then(|| (both / turned, correlation))
}

/// A motion between two rests.
struct Carry {
    before: Vector3<f64>,
    after: Vector3<f64>,
    /// Sums of gyro rows.
    steps: Vec<Vector3<f64>>,
}

impl Carry {
    /// What gravity is off by after it, if a unit is this angle, rad.
    fn off(&self, angle: f64) -> f64 {
        let turn = |up: Vector3<f64>, step: &Vector3<f64>| exp(-step * angle) * up;
        self.steps.iter().fold(self.before, turn).angle(&self.after)
    }
}

fn from_rest_to_rest(
    samples: &PerSensor<Vec<Vector3<f64>>>,
    breaks: &[usize],
    rests: &[Range<usize>],
    first: f64,
    length: usize,
) -> Option<f64> {
    let carry = |pair: &[Range<usize>]| {
        let zero = mean(&samples.gyro[pair[0].clone()]);
        let step =
            |rows: &[Vector3<f64>]| rows.iter().sum::<Vector3<f64>>() - zero * rows.len() as f64;
        Carry {
            before: mean(&samples.accel[pair[0].clone()]),
            after: mean(&samples.accel[pair[1].clone()]),
            steps: samples.gyro[pair[0].end..pair[1].start]
                .chunks(length)
                .map(step)
                .collect(),
        }
    };
    let unbroken = |pair: &&[Range<usize>]| !is_broken(breaks, &(pair[0].start..pair[1].end));
    let moves: Vec<Carry> = rests.windows(2).filter(unbroken).map(carry).collect();
    let telling = moves
        .iter()
        .filter(|carry| carry.before.angle(&carry.after) > ENOUGH)
        .count();
    if telling < FEWEST {
        return None;
    }
    let off = |angle: f64| {
        let squares: f64 = moves.iter().map(|carry| carry.off(angle).powi(2)).sum();
        (squares / moves.len() as f64).sqrt()
    };
    let reach = (SEARCHED.ln() * FINE) as i32;
    let factors = (-reach..=reach).map(|k| (f64::from(k) / FINE).exp());
    let angles = factors.flat_map(|factor| [first * factor, -first * factor]);
    let tried: Vec<(f64, f64)> = angles.map(|angle| (angle, off(angle))).collect();
    let &(best, least) = tried.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    // Quarter turns look alike after four more.
    let other = |angle: f64| !(SAME.recip()..SAME).contains(&(angle / best));
    let rivals = tried.iter().filter(|(angle, _)| other(*angle));
    let rival = rivals.map(|(_, off)| *off).fold(f64::INFINITY, f64::min);
    (least < NEAR && rival > RIVAL * least).then_some(best)
}
