//! Size of the gyro unit, determined from the gravity direction before, during and after moves.

use std::f64::consts::TAU;

use nalgebra::{Rotation3, Vector3};

use turncal::units::DEGREE;

/// Changes of the gravity direction smaller than this angle are not used, rad.
pub const ENOUGH: f64 = 20.0 * DEGREE;
/// The shortest move that changes the gravity direction is at most two turns.
const MOST: f64 = 2.0 * TAU;
/// Moves longer by this factor are not used, because in them a small error of the unit causes a large angle error.
const LONG: f64 = 4.0;
/// Successive trials differ by this factor.
const STEP: f64 = 1.03;
/// Number of subdivisions of this factor that are tried around the best.
const FINER: i32 = 20;
/// Trials within this factor of the best count as the best.
const SAME: f64 = 1.25;
/// Largest accepted squared error of a unit, relative to the error without rotation.
pub const GOOD: f64 = 0.1;
/// Factor by which other units fit worse.
const TOLD_APART: f64 = 3.0;

/// A short interval of a log.
pub struct Interval {
    /// Rotation angle, in the unit of the gyros times rows.
    pub rotation: Vector3<f64>,
    /// Direction of gravity, if the specific force has the same magnitude as gravity.
    pub up: Option<Vector3<f64>>,
    pub is_at_rest: bool,
    /// Whether rows are missing before the end of the interval.
    pub is_broken: bool,
}

/// A move from a dwell to the next.
struct Move<'a> {
    /// Gravity direction before the move.
    up: Vector3<f64>,
    /// Intervals up to the first one of the next dwell.
    intervals: &'a [Interval],
}

impl Move<'_> {
    /// Total rotation along the path.
    fn length(&self) -> f64 {
        self.intervals.iter().map(|of| of.rotation.norm()).sum()
    }

    /// Whether the gravity direction changes enough to be used.
    fn is_turned(&self) -> bool {
        let after = self.intervals.last().and_then(|of| of.up);
        after.is_some_and(|after| after.angle(&self.up) > ENOUGH)
    }

    /// Square error of the gravity direction if gyros turn by this angle in rad per unit and row.
    fn error(&self, angle: f64) -> f64 {
        let (mut up, mut error) = (self.up, 0.0);
        for of in self.intervals {
            let half = Rotation3::new(of.rotation * (-0.5 * angle));
            up = half * up;
            error += of.up.map_or(0.0, |seen| (seen - up).norm_squared());
            up = half * up;
        }
        error
    }
}

/// Moves between dwells in which no rows are missing.
fn moves(intervals: &[Interval]) -> Vec<Move<'_>> {
    let (mut moves, mut begin) = (Vec::new(), None);
    for (k, of) in intervals.iter().enumerate() {
        if of.is_broken {
            begin = None;
        }
        if !of.is_at_rest {
            continue;
        }
        if let Some((before, up)) = begin.filter(|(before, _)| before + 1 < k) {
            let intervals = &intervals[before + 1..=k];
            moves.push(Move { up, intervals });
        }
        begin = of.up.map(|up| (k, up));
    }
    moves
}

/// Angle in rad for one gyro unit in one row; negative if the triads have opposite signs, `None` if the moves do not
/// determine it.
pub fn angle(intervals: &[Interval]) -> Option<f64> {
    let mut moves = moves(intervals);
    let turned = moves.iter().filter(|of| of.is_turned());
    let least = turned.map(Move::length).reduce(f64::min)?;
    moves.retain(|of| of.length() <= LONG * least);
    let error = |angle: f64| moves.iter().map(|of| of.error(angle)).sum::<f64>();
    let trials = ((MOST / ENOUGH).ln() / STEP.ln()).ceil() as i32;
    let sizes = (0..=trials).map(|k| ENOUGH / least * STEP.powi(k));
    let tried = sizes.flat_map(|size| [size, -size]);
    let tried: Vec<(f64, f64)> = tried.map(|angle| (angle, error(angle))).collect();
    let &(best, _) = tried.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    let is_other = |angle: f64| !(SAME.recip()..SAME).contains(&(angle / best));
    let others = tried.iter().filter(|(angle, _)| is_other(*angle));
    let rival = others.map(|(_, error)| *error).fold(error(0.0), f64::min);
    let finer = (-FINER..=FINER).map(|k| best * STEP.powf(f64::from(k) / f64::from(FINER)));
    let finer = finer.map(|angle| (angle, error(angle)));
    let (angle, found) = finer.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let is_shown = found < GOOD * error(0.0) && TOLD_APART * found < rival;
    is_shown.then_some(angle)
}
