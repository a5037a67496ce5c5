//! Labelled sections against what the record shows.

use std::fmt;
use std::ops::Range;

use nalgebra::Vector3;
use serde::Serialize;

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
        /// The samples of it in which it stands, where it turns in the others by more than a position
        /// that is set by hand may be off.
        turns_beside: Option<Range<usize>>,
    },
    /// It is a turn.
    Turn {
        /// Found about the axis of the label, rad.
        angle: f64,
        /// Angle between the axis found and the label's, rad.
        off: f64,
        /// Whether it begins or ends while it turns.
        cut: bool,
        /// Found up to the rests around it, rad.
        to_rests: f64,
        /// Its samples up to there.
        whole: Range<usize>,
        /// A turn whose angle differs from the label's by more than this part of it is another one.
        tolerance: f64,
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

impl LabelCheck {
    /// Whether label and record agree.
    pub fn agrees(&self) -> bool {
        match (&self.verdict, self.segment.motion) {
            (
                Verdict::Position {
                    off,
                    moving,
                    turns_beside,
                },
                _,
            ) => {
                let duration = self.segment.end - self.segment.start;
                *off < OTHER_AXIS && *moving <= MOVING * duration && turns_beside.is_none()
            }
            (
                Verdict::Turn {
                    angle,
                    cut,
                    tolerance,
                    ..
                },
                Some(LabelledMotion::Turns { angle: said, .. }),
            ) => (angle / said - 1.0).abs() < *tolerance && !cut,
            _ => false,
        }
    }

    /// The samples in which the record does what the label says, if there are any.
    pub fn as_labelled(&self) -> Option<Range<usize>> {
        let all = self.segment.samples.clone();
        match (&self.verdict, self.segment.motion) {
            (
                Verdict::Position {
                    off, turns_beside, ..
                },
                _,
            ) => (*off < OTHER_AXIS).then(|| turns_beside.clone().unwrap_or(all)),
            (
                Verdict::Turn {
                    cut,
                    angle,
                    to_rests,
                    whole,
                    tolerance,
                    ..
                },
                Some(LabelledMotion::Turns { angle: said, .. }),
            ) => {
                let as_said = |angle: f64| (angle / said - 1.0).abs() < *tolerance;
                match cut {
                    false => as_said(*angle).then_some(all),
                    true => (as_said(*to_rests) && *whole != all).then(|| whole.clone()),
                }
            }
            _ => None,
        }
    }

    /// What label and record disagree in, after `section … `.
    pub fn disagreement(&self) -> Option<String> {
        if self.agrees() {
            return None;
        }
        Some(match (&self.verdict, self.segment.motion) {
            (Verdict::Position { off, .. }, _) if *off >= OTHER_AXIS => format!(
                "is {:.0}° off the plumb line: another axis is up; correct the label or body_axes",
                off / DEGREE
            ),
            (Verdict::Position { moving, .. }, _) => {
                format!("moves for {moving:.1} s of its time: draw its borders closer")
            }
            (Verdict::Turn { cut: true, .. }, _) => {
                "begins or ends within the turn: draw its borders wider, to where it is stationary"
                    .to_owned()
            }
            (Verdict::Turn { angle, .. }, Some(LabelledMotion::Turns { angle: said, .. })) => {
                format!(
                    "turns by {:+.0}° about its axis, not {:+.0}°: correct axis, sign or angle of the \
                     label, or the gyros' scale",
                    angle / DEGREE,
                    said / DEGREE
                )
            }
            (Verdict::Turn { .. }, _) => "is no turn".to_owned(),
            (Verdict::Unknown, _) => {
                "is no position (x_up … z_down) and no turn (rot_x+360): it has no effect"
                    .to_owned()
            }
        })
    }
}

/// Every labelled section against what the record does at these rests.
pub fn checks(run: &Run, rests: &[Rest]) -> Vec<LabelCheck> {
    let standstills = run.standstills_of_imu();
    let check = |segment: &Segment| LabelCheck {
        segment: segment.clone(),
        verdict: verdict(run, rests, &standstills, segment),
    };
    run.recording.segments.iter().map(check).collect()
}

fn verdict(run: &Run, rests: &[Rest], standstills: &[Dwell], segment: &Segment) -> Verdict {
    let samples = segment.samples.clone();
    match segment.motion {
        None => Verdict::Unknown,
        Some(LabelledMotion::Stands { up }) => {
            let standing = run.standing_in(&samples, standstills);
            let section = Dwell {
                samples: standing.clone().unwrap_or_else(|| samples.clone()),
                position: None,
            };
            let force = mean(run, &section, Sensor::Accel) - run.instrument.prior.accel.bias;
            Verdict::Position {
                off: force.angle(&up),
                moving: moving(run, rests, &samples),
                turns_beside: standing,
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
            let to_rests = angle(run, whole.clone(), &zero).dot(&axis);
            let lost = to_rests - within;
            let found = turn.axis * turn.angle.signum();
            let off = found.angle(&axis);
            Verdict::Turn {
                angle: within,
                off: off.min(std::f64::consts::PI - off),
                cut: at_ends && (!run.recording.imu.continuous || lost.abs() > LOST),
                to_rests,
                whole,
                tolerance: OTHER_ANGLE
                    .max(SCALE_SIGMAS * run.instrument.prior.gyro.scale_sigma.max()),
            }
        }
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
