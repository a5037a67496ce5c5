//! Turns of the instrument between two dwells.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::rest::Rest;
use crate::attitude::{exp, log};
use crate::imu::Sensor;
use crate::recording::LabelledMotion;
use crate::run::Run;
use crate::run::turning::{SMALLEST, steps};
use crate::units::DEGREE;

/// A turn counts as single-axis if the integrals of the rates reach this fraction of the total angle.
const ALONG: f64 = 0.95;
/// The rotation must also agree with the single rotation by these integrals within this angle, rad.
const ONE_AXIS: f64 = 1.0 * DEGREE;
/// Fraction of the total angle that is added to this tolerance.
const APART: f64 = 0.02;
/// A turn about an axis within this angle of a body axis is assigned to that body axis.
const NEAR_AXIS: f64 = 15.0 * DEGREE;

/// A turn, evaluated with nominal scales; the gyro zero is the output in the previous dwell.
#[derive(Debug, Clone, PartialEq)]
pub struct Turn {
    /// Samples.
    pub samples: Range<usize>,
    /// Unit vector of the rotation axis, along body axes; its largest component is positive.
    pub axis: Vector3<f64>,
    /// Angle about the axis, right-handed, rad; for a turn about several axes, the angle of the equivalent single
    /// rotation.
    pub angle: f64,
    /// Integrals of the rates about each body axis, rad.
    pub sum: Vector3<f64>,
    /// Whether the turn is about one axis throughout.
    pub single: bool,
    /// Maximum rate about any body axis, rad/s.
    pub fastest: f64,
    /// `C` from the body axes after the turn to the body axes before it.
    pub rotation: Matrix3<f64>,
    /// Index of the dwell before the turn; the next dwell follows the turn.
    pub from: Option<usize>,
    /// Angle between the up direction propagated by the gyros and that of the accelerometers after the turn, rad.
    pub off_gravity: Option<f64>,
    /// Angle between the turns according to the gyros and to the table, rad.
    pub off_table: Option<f64>,
}

impl Turn {
    /// The turn over these samples, where `zero` is the gyro output at rest, rad/s.
    pub fn of(run: &Run, samples: Range<usize>, zero: &Vector3<f64>) -> Self {
        let imu = &run.recording.imu;
        let mut attitude = Matrix3::identity();
        for increment in imu.gyro.within(samples.clone()) {
            attitude *= exp(increment - zero * imu.period);
        }
        let (mut sum, mut way, mut fastest) = (Vector3::zeros(), 0.0, 0.0f64);
        for (_, duration, turned) in steps(imu, samples.clone(), *zero) {
            sum += turned;
            way += turned.norm();
            fastest = fastest.max(turned.amax() / duration);
        }
        let off = log(&(exp(sum) * attitude.transpose())).norm();
        let single = sum.norm() > ALONG * way && off < ONE_AXIS + APART * way;
        let turn = if single { sum } else { log(&attitude) };
        let axis = turn.try_normalize(1e-12).unwrap_or(Vector3::z());
        let sign = if axis[axis.iamax()] < 0.0 { -1.0 } else { 1.0 };
        Self {
            samples,
            axis: axis * sign,
            angle: turn.norm() * sign,
            sum,
            single,
            fastest,
            rotation: attitude,
            from: None,
            off_gravity: None,
            off_table: None,
        }
    }

    /// The body axis of the turn, if the turn is about a body axis.
    pub fn body_axis(&self) -> Option<usize> {
        let axis = self.axis.iamax();
        (self.single && self.axis[axis] > NEAR_AXIS.cos()).then_some(axis)
    }
}

/// Gyro output at rest near a sample, rad/s.
pub fn zero(run: &Run, rests: &[Rest], sample: usize) -> Vector3<f64> {
    let apart = |rest: &&Rest| {
        let Range { start, end } = rest.dwell.samples;
        start.saturating_sub(sample).max(sample.saturating_sub(end))
    };
    let nearest = rests.iter().min_by_key(apart);
    nearest.map_or(run.instrument.prior.gyro.bias, |rest| {
        rest.dwell.mean(Sensor::Gyro, run).output
    })
}

/// The turns from one dwell to the next, or the turns in sections that are labelled as turns.
pub fn turns(run: &Run, rests: &[Rest]) -> Vec<Turn> {
    let imu = &run.recording.imu;
    let turn = |samples: Range<usize>| {
        // Lost samples may contain any turn.
        let known = !samples.is_empty() && !imu.is_lost(&samples);
        let zero = zero(run, rests, samples.start);
        let turn = known.then(|| Turn::of(run, samples, &zero));
        turn.filter(|turn| turn.angle.abs() > SMALLEST || turn.fastest > SMALLEST)
    };
    let between = rests.windows(2).enumerate().filter_map(|(from, pair)| {
        let turn = turn(pair[0].dwell.samples.end..pair[1].dwell.samples.start)?;
        let attitude = |rest: &Rest| Some(rest.dwell.position.as_ref()?.attitude);
        let by_table = attitude(&pair[0]).zip(attitude(&pair[1]));
        let carried = turn.rotation.tr_mul(&pair[0].force);
        Some(Turn {
            from: Some(from),
            off_gravity: Some(carried.angle(&pair[1].force)),
            off_table: by_table
                .map(|(before, after)| log(&(turn.rotation * after.tr_mul(&before))).norm()),
            ..turn
        })
    });
    let segments = run.recording.segments.iter();
    let labelled = segments.filter_map(|segment| match segment.motion {
        Some(LabelledMotion::Turns { .. }) => turn(segment.samples.clone()),
        _ => None,
    });
    if imu.continuous {
        between.collect()
    } else {
        labelled.collect()
    }
}
