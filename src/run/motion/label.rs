//! Labelled sections against what the record shows.

use std::fmt;
use std::ops::Range;

use nalgebra::Vector3;
use serde::Serialize;

use super::rest::Rest;
use super::turn::{Turn, zero};
use crate::imu::Sensor;
use crate::recording::{LabelledMotion, Segment};
use crate::run::dwells::imu::standstills;
use crate::run::{Dwell, Run};
use crate::units::DEGREE;

/// A label's axis further than this from the plumb line is another one, rad.
const OTHER_AXIS: f64 = 30.0 * DEGREE;
/// A turn that differs from its label by more than this part of it is another one.
const OTHER_ANGLE: f64 = 0.1;
/// … or that many σ of the gyros' scale.
const SCALE_SIGMAS: f64 = 5.0;
/// A section of a position may move for this part of its time.
const MOVING: f64 = 0.05;
/// A section that begins or ends at a faster rate begins or ends within a turn, rad/s …
const TURNING: f64 = 15.0 * DEGREE;
/// … unless hardly more of the turn is beyond, up to the rests around it, rad.
const LOST: f64 = 3.0 * DEGREE;
/// Length of its ends, s.
const END: f64 = 0.1;

/// A section and what was found in it.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelCheck {
    /// The section.
    pub segment: Segment,
    /// What the record says of it.
    pub verdict: Verdict,
    /// What label and record disagree in, after `section … `.
    pub disagreement: Option<String>,
    /// The samples in which the record does what the label says, if there are any.
    pub as_labelled: Option<Range<usize>>,
}

/// What the record says of a section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Verdict {
    /// The label is no position and no turn.
    Unknown,
    /// It is a position.
    Position {
        /// Angle between up and what the label says, rad.
        off: f64,
        /// Time for which it moves, s.
        moving: f64,
    },
    /// It is a turn.
    Turn {
        /// Found about the axis of the label, rad.
        angle: f64,
        /// Angle between the axis found and the label's, rad.
        off: f64,
    },
}

/// A section whose label the record contradicts, and what was made of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ContradictedLabel {
    /// Its label.
    pub label: String,
    /// When it begins, s.
    pub start: f64,
    /// What the record says, after `section … `.
    pub said: String,
    /// Whether it was used, as far as the record does what the label says.
    pub used: bool,
}

impl fmt::Display for ContradictedLabel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            label,
            start,
            said,
            used,
        } = self;
        let used = if *used {
            "used with other borders"
        } else {
            "not used"
        };
        write!(f, "`{label}` at {start:.1} s {said} ({used})")
    }
}

/// Every labelled section against what the record does at these rests.
pub fn checks(run: &Run, rests: &[Rest]) -> Vec<LabelCheck> {
    let standstills = standstills(run);
    let check = |segment: &Segment| match segment.motion {
        Some(LabelledMotion::Stands { up }) => position(run, rests, &standstills, segment, &up),
        Some(LabelledMotion::Turns { axis, angle }) => turn(run, rests, segment, &axis, angle),
        None => LabelCheck {
            segment: segment.clone(),
            verdict: Verdict::Unknown,
            disagreement: Some(
                "is neither a position (x_up … z_down) nor a turn (rot_x+360), so it has no effect"
                    .to_owned(),
            ),
            as_labelled: None,
        },
    };
    run.recording.segments.iter().map(check).collect()
}

/// A section that is labelled as a position.
fn position(
    run: &Run,
    rests: &[Rest],
    standstills: &[Dwell],
    segment: &Segment,
    up: &Vector3<f64>,
) -> LabelCheck {
    // Samples of it in which it stands, where it turns in the others.
    let standing = run.standing_in(&segment.samples, standstills);
    let samples = standing.clone().unwrap_or_else(|| segment.samples.clone());
    let section = Dwell::of(samples.clone());
    let force = section.mean(Sensor::Accel, run).output - run.instrument.prior.accel.bias;
    let (off, moving) = (force.angle(up), moving(run, rests, &segment.samples));
    let is_still = moving <= MOVING * (segment.end - segment.start) && standing.is_none();
    LabelCheck {
        segment: segment.clone(),
        verdict: Verdict::Position { off, moving },
        disagreement: match off < OTHER_AXIS {
            true if is_still => None,
            true => Some(format!("is not still for {moving:.1} s: shorten it")),
            false => Some(format!(
                "has another axis up, {:.0}° off the label's: correct the label or body_axes",
                off / DEGREE
            )),
        },
        as_labelled: (off < OTHER_AXIS).then_some(samples),
    }
}

/// A section that is labelled as a turn by an angle.
fn turn(
    run: &Run,
    rests: &[Rest],
    segment: &Segment,
    axis: &Vector3<f64>,
    labelled: f64,
) -> LabelCheck {
    let (imu, samples) = (&run.recording.imu, segment.samples.clone());
    let zero = zero(run, rests, samples.start);
    let length = ((END / imu.period).round() as usize)
        .max(1)
        .min(samples.len());
    let ends = [
        samples.start..samples.start + length,
        samples.end - length..samples.end,
    ];
    let turns =
        |end: Range<usize>| angle(run, end, &zero).norm() / length as f64 / imu.period > TURNING;
    // Beyond sections laid end to end lies something else.
    let whole = match imu.continuous {
        true => to_rests(rests, &samples),
        false => samples.clone(),
    };
    let within = angle(run, samples.clone(), &zero).dot(axis);
    let to_rests = angle(run, whole.clone(), &zero).dot(axis);
    let is_cut =
        ends.into_iter().any(turns) && (!imu.continuous || (to_rests - within).abs() > LOST);
    let tolerance = OTHER_ANGLE.max(SCALE_SIGMAS * run.instrument.prior.gyro.scale_sigma.max());
    let as_said = |angle: f64| (angle / labelled - 1.0).abs() < tolerance;
    let found = Turn::of(run, samples.clone(), &zero);
    let off = (found.axis * found.angle.signum()).angle(axis);
    LabelCheck {
        segment: segment.clone(),
        verdict: Verdict::Turn {
            angle: within,
            off: off.min(std::f64::consts::PI - off),
        },
        disagreement: match is_cut {
            true => Some(
                "starts or ends during the turn: extend it until the sensor is still at both ends"
                    .to_owned(),
            ),
            false if as_said(within) => None,
            false => Some(format!(
                "turns by {:+.0}° about its axis, not {:+.0}°: correct the axis, sign or angle of the label, \
                 or the gyros' scale",
                within / DEGREE,
                labelled / DEGREE
            )),
        },
        as_labelled: match is_cut {
            true => (as_said(to_rests) && whole != samples).then_some(whole),
            false => as_said(within).then_some(samples),
        },
    }
}

/// Sum of the gyros over some samples, rad.
fn angle(run: &Run, samples: Range<usize>, zero: &Vector3<f64>) -> Vector3<f64> {
    let imu = &run.recording.imu;
    imu.gyro.sum(samples.clone()) - zero * (samples.len() as f64 * imu.period)
}

/// Some samples and those between them and the rests before and after.
fn to_rests(rests: &[Rest], samples: &Range<usize>) -> Range<usize> {
    let dwells = || rests.iter().map(|rest| &rest.dwell.samples);
    let before = dwells().filter(|dwell| dwell.start < samples.start);
    let after = dwells().filter(|dwell| dwell.end > samples.end);
    let begin = before.map(|dwell| dwell.end.min(samples.start)).max();
    let end = after.map(|dwell| dwell.start.max(samples.end)).min();
    begin.unwrap_or(samples.start)..end.unwrap_or(samples.end)
}

/// Time of some samples that is in no dwell, s. In a record of sections dwells follow from labels.
fn moving(run: &Run, rests: &[Rest], samples: &Range<usize>) -> f64 {
    let of = |rest: &Rest| {
        let Range { start, end } = rest.dwell.samples;
        end.min(samples.end)
            .saturating_sub(start.max(samples.start))
    };
    let standing: usize = rests.iter().map(of).sum();
    samples.len().saturating_sub(standing) as f64 * run.recording.imu.period
}
