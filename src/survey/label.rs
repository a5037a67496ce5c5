//! Labelled sections against what the record shows.

use std::ops::Range;

use nalgebra::Vector3;

use super::rest::{Rest, mean};
use super::turn::{Turn, zero};
use crate::imu::Sensor;
use crate::recording::{LabelledMotion, Segment};
use crate::run::Dwell;
use crate::run::Run;
use crate::units::DEGREE;

/// A label's axis further than this from the plumb line is another one, rad.
const OTHER_AXIS: f64 = 30.0 * DEGREE;
/// A turn that differs from its label by more than this part of it is another one.
const OTHER_ANGLE: f64 = 0.1;
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
}

/// What the record says of a section.
#[derive(Debug, Clone, PartialEq)]
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
        /// Whether it begins or ends while it turns.
        cut: bool,
    },
}

impl LabelCheck {
    /// Whether label and record agree.
    pub fn agrees(&self) -> bool {
        match (&self.verdict, self.segment.motion) {
            (Verdict::Position { off, moving }, _) => {
                let duration = self.segment.end - self.segment.start;
                *off < OTHER_AXIS && *moving <= MOVING * duration
            }
            (Verdict::Turn { angle, cut, .. }, Some(LabelledMotion::Turns { angle: said, .. })) => {
                (angle / said - 1.0).abs() < OTHER_ANGLE && !cut
            }
            _ => false,
        }
    }
}

pub(super) fn checks(run: &Run, rests: &[Rest]) -> Vec<LabelCheck> {
    let check = |segment: &Segment| LabelCheck {
        segment: segment.clone(),
        verdict: verdict(run, rests, segment),
    };
    run.recording.segments.iter().map(check).collect()
}

fn verdict(run: &Run, rests: &[Rest], segment: &Segment) -> Verdict {
    let samples = segment.samples.clone();
    match segment.motion {
        None => Verdict::Unknown,
        Some(LabelledMotion::Stands { up }) => {
            let force = mean(run, &Dwell::of_segment(segment), Sensor::Accel)
                - run.instrument.prior.accel.bias;
            Verdict::Position {
                off: force.angle(&up),
                moving: moving(run, rests, &samples),
            }
        }
        Some(LabelledMotion::Turns { axis, .. }) => {
            let zero = zero(run, rests, samples.start);
            let turn = Turn::of(run, samples.clone(), &zero);
            let length = ((END / run.recording.imu.period).round() as usize)
                .max(1)
                .min(samples.len());
            let rate = |samples: Range<usize>| {
                angle(run, samples, &zero).norm() / length as f64 / run.recording.imu.period
            };
            let ends = [
                samples.start..samples.start + length,
                samples.end - length..samples.end,
            ];
            let at_ends = ends.into_iter().any(|end| rate(end) > TURNING);
            // Beyond sections laid end to end lies something else.
            let whole = if run.recording.imu.continuous {
                to_rests(rests, &samples)
            } else {
                samples.clone()
            };
            let within = angle(run, samples, &zero).dot(&axis);
            let lost = angle(run, whole, &zero).dot(&axis) - within;
            let found = turn.axis * turn.angle.signum();
            let off = found.angle(&axis);
            Verdict::Turn {
                angle: within,
                off: off.min(std::f64::consts::PI - off),
                cut: at_ends && (!run.recording.imu.continuous || lost.abs() > LOST),
            }
        }
    }
}

/// Sum of the gyros over some samples, rad.
fn angle(run: &Run, samples: Range<usize>, zero: &Vector3<f64>) -> Vector3<f64> {
    let section = &run.recording.imu.gyro[samples];
    section.iter().sum::<Vector3<f64>>() - zero * (section.len() as f64 * run.recording.imu.period)
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
