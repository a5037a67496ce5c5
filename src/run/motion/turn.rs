//! What the instrument does between two rests.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::rest::Rest;
use crate::attitude::{exp, log};
use crate::imu::Sensor;
use crate::navigation::samples_of;
use crate::recording::LabelledMotion;
use crate::run::Run;
use crate::run::turning::{SMALLEST, STEP};
use crate::units::DEGREE;

/// Turns about one axis go along it for this part of their way at least …
const ALONG: f64 = 0.95;
/// … and do what their integrals do at once, within this, rad …
const ONE_AXIS: f64 = 1.0 * DEGREE;
/// … and this part of the way.
const APART: f64 = 0.02;
/// Turns about an axis within this angle of a body axis are about that.
const NEAR_AXIS: f64 = 15.0 * DEGREE;

/// A turn, by nominal scales, with the gyros' output at the rest before as zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Turn {
    /// Its samples.
    pub samples: Range<usize>,
    /// Unit vector along body axes, in their positive half.
    pub axis: Vector3<f64>,
    /// rad, right-handed about the axis; over a turn about several axes, of the one that does the same.
    pub angle: f64,
    /// Integrals of the rates about each body axis, rad.
    pub sum: Vector3<f64>,
    /// Whether it is about one axis all the way.
    pub single: bool,
    /// Fastest rate about any body axis, rad/s.
    pub fastest: f64,
    /// `C` from the body axes after to those before.
    pub rotation: Matrix3<f64>,
    /// The rest before it, by its place among the rests; the next one comes after.
    pub from: Option<usize>,
}

impl Turn {
    /// What these samples turn by, with this output as zero, rad/s; the rest before is not said.
    pub fn of(run: &Run, samples: Range<usize>, zero: &Vector3<f64>) -> Self {
        let period = run.recording.imu.period;
        let length = samples_of(STEP, period);
        let mut attitude = Matrix3::identity();
        let (mut sum, mut way, mut fastest) = (Vector3::zeros(), 0.0, 0.0f64);
        for step in run.recording.imu.gyro.parts(samples.clone(), length) {
            let turned = step.iter().sum::<Vector3<f64>>() - zero * (step.len() as f64 * period);
            for increment in step.iter() {
                attitude *= exp(increment - zero * period);
            }
            sum += turned;
            way += turned.norm();
            fastest = fastest.max(turned.amax() / (step.len() as f64 * period));
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
        }
    }

    /// Angle between up as the gyros carry it over the turn and as the accelerometers see it after, rad.
    pub fn off_gravity(&self, rests: &[Rest]) -> Option<f64> {
        let from = self.from?;
        let carried = self.rotation.tr_mul(&rests.get(from)?.force);
        Some(carried.angle(&rests.get(from + 1)?.force))
    }

    /// Angle between the turn by the gyros and by the table, rad.
    pub fn off_table(&self, rests: &[Rest]) -> Option<f64> {
        let from = self.from?;
        let attitude = |rest: usize| Some(rests.get(rest)?.dwell.position.as_ref()?.attitude);
        let said = attitude(from)?.tr_mul(&attitude(from + 1)?);
        Some(log(&(self.rotation * said.transpose())).norm())
    }

    /// The body axis that it is about, if it is about one.
    pub fn body_axis(&self) -> Option<usize> {
        let axis = self.axis.iamax();
        (self.single && self.axis[axis] > NEAR_AXIS.cos()).then_some(axis)
    }
}

/// Gyros at rest near a sample, rad/s.
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

/// What turns from rest to rest, or in sections labelled as turns.
pub fn turns(run: &Run, rests: &[Rest]) -> Vec<Turn> {
    let imu = &run.recording.imu;
    let between = rests.windows(2).enumerate().map(|(from, pair)| {
        let samples = pair[0].dwell.samples.end..pair[1].dwell.samples.start;
        (Some(from), samples)
    });
    let segments = run.recording.segments.iter();
    let labelled = segments.filter(|of| matches!(of.motion, Some(LabelledMotion::Turns { .. })));
    let labelled = labelled.map(|segment| (None, segment.samples.clone()));
    let all: Vec<(Option<usize>, Range<usize>)> = match imu.continuous {
        true => between.collect(),
        false => labelled.collect(),
    };
    let turns = all.into_iter().filter_map(|(from, samples)| {
        // What was lost on the way may be any turn.
        let known = !samples.is_empty() && !imu.is_lost(&samples);
        let zero = zero(run, rests, samples.start);
        known.then(|| Turn {
            from,
            ..Turn::of(run, samples, &zero)
        })
    });
    turns
        .filter(|turn| turn.angle.abs() > SMALLEST || turn.fastest > SMALLEST)
        .collect()
}
