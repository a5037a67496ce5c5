//! Comparison of labelled sections with the recording.

use std::fmt;
use std::ops::Range;

use nalgebra::Vector3;

use super::rest::Rest;
use super::turn::{Turn, zero};
use crate::navigation::samples_of;
use crate::recording::{LabelledMotion, Segment};
use crate::run::Run;
use crate::run::dwell::{Dwell, common};
use crate::run::dwells::imu::standstills;
use crate::run::turning::tolerance;
use crate::units::DEGREE;

/// An axis farther than this from the vertical contradicts its label, rad.
const OTHER_AXIS: f64 = 30.0 * DEGREE;
/// Maximum fraction of time for which a section labelled as a position may move.
const MOVING: f64 = 0.05;
/// A section with a faster rate at its start or end starts or ends within a turn, rad/s.
const TURNING: f64 = 15.0 * DEGREE;
/// Angle of the turn that may lie outside the section, up to the neighbouring dwells, rad.
const LOST: f64 = 3.0 * DEGREE;
/// Length of the ends of a section, s.
const END: f64 = 0.1;

/// A section with the result of its check.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelCheck {
    /// The section.
    pub segment: Segment,
    /// Result of the comparison.
    pub verdict: Verdict,
    /// Description of the disagreement between label and recording, worded so that it can follow `section … `.
    pub disagreement: Option<String>,
    /// The samples that agree with the label, if there are any.
    pub as_labelled: Option<Range<usize>>,
}

/// Motion of a section according to the recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Verdict {
    /// The label is neither a position nor a turn.
    Unknown,
    /// The label is a position.
    Position {
        /// Angle between the measured and the labelled up direction, rad.
        off: f64,
        /// Time for which the instrument moves in the section, s.
        moving: f64,
    },
    /// The label is a turn.
    Turn {
        /// Measured angle about the labelled axis, rad.
        angle: f64,
        /// Angle between the measured and the labelled axis, rad.
        off: f64,
    },
}

impl fmt::Display for LabelCheck {
    /// The disagreement between label and recording, and whether the section is used.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Segment { label, start, .. } = &self.segment;
        let said = self.disagreement.as_deref().unwrap_or_default();
        let used = if self.as_labelled.is_some() {
            "used with corrected limits"
        } else {
            "not used"
        };
        write!(f, "`{label}` at {start:.1} s {said} ({used})")
    }
}

/// Checks every labelled section against the recording, given its dwells.
pub fn checks(run: &Run, rests: &[Rest]) -> Vec<LabelCheck> {
    let standstills = standstills(run);
    let record = Record {
        run,
        rests,
        standstills,
    };
    let check = |segment: &Segment| {
        let (verdict, disagreement, as_labelled) = match segment.motion {
            Some(LabelledMotion::Stands { up }) => record.position(segment, &up),
            Some(LabelledMotion::Turns { axis, angle }) => record.turn(segment, &axis, angle),
            None => {
                let nothing = "is neither a position (x_up … z_down) nor a turn (rot_x+360), so the label has no \
                effect";
                (Verdict::Unknown, Some(nothing.to_owned()), None)
            }
        };
        LabelCheck {
            segment: segment.clone(),
            verdict,
            disagreement,
            as_labelled,
        }
    };
    run.recording.segments.iter().map(check).collect()
}

/// The data with which labels are compared.
struct Record<'a> {
    run: &'a Run,
    rests: &'a [Rest],
    standstills: Vec<Range<usize>>,
}

/// Verdict, disagreement and matching samples of a [`LabelCheck`].
type Checked = (Verdict, Option<String>, Option<Range<usize>>);

impl Record<'_> {
    /// A section that is labelled as a position.
    fn position(&self, segment: &Segment, up: &Vector3<f64>) -> Checked {
        // The samples of the section at rest, if the instrument turns in the other samples.
        let standing = self.run.standing_in(&segment.samples, &self.standstills);
        let turns = standing.is_some();
        let section = Dwell::of(standing.unwrap_or_else(|| segment.samples.clone()));
        let off = section.force(self.run).angle(up);
        let moving = self.moving(&segment.samples);
        let verdict = Verdict::Position { off, moving };
        if off >= OTHER_AXIS {
            let words = format!(
                "has a different axis up, {:.0}° from the label: correct the label or body_axes",
                off / DEGREE
            );
            return (verdict, Some(words), None);
        }
        let is_still = moving <= MOVING * (segment.end - segment.start) && !turns;
        let words = (!is_still).then(|| format!("moves for {moving:.1} s: shorten it"));
        (verdict, words, Some(section.samples))
    }

    /// A section that is labelled as a turn by an angle.
    fn turn(&self, segment: &Segment, axis: &Vector3<f64>, labelled: f64) -> Checked {
        let (imu, samples) = (&self.run.recording.imu, segment.samples.clone());
        let zero = zero(self.run, self.rests, samples.start);
        let found = Turn::of(self.run, samples.clone(), &zero);
        let off = (found.axis * found.angle.signum()).angle(axis);
        let angle = |samples: &Range<usize>| {
            imu.gyro.sum(samples.clone()) - zero * (samples.len() as f64 * imu.period)
        };
        let within = angle(&samples).dot(axis);
        let verdict = Verdict::Turn {
            angle: within,
            off: off.min(std::f64::consts::PI - off),
        };
        let as_said = |angle: f64| (angle / labelled - 1.0).abs() < tolerance(self.run);
        let length = samples_of(END, imu.period).min(samples.len());
        let (first, last) = (samples.start + length, samples.end - length);
        let turns = |end: Range<usize>| angle(&end).norm() / length as f64 / imu.period > TURNING;
        // Outside concatenated sections, the data belong to something else.
        let whole = if imu.continuous {
            self.to_rests(&samples)
        } else {
            samples.clone()
        };
        let to_rests = angle(&whole).dot(axis);
        let is_more = !imu.continuous || (to_rests - within).abs() > LOST;
        if is_more && (turns(samples.start..first) || turns(last..samples.end)) {
            let words = "starts or ends during the turn: extend the section until the sensor is still at both ends";
            let as_labelled = (as_said(to_rests) && whole != samples).then_some(whole);
            return (verdict, Some(words.to_owned()), as_labelled);
        }
        if as_said(within) {
            return (verdict, None, Some(samples));
        }
        let words = format!(
            "turns by {:+.0}° about its axis, not {:+.0}°: correct the axis, sign or angle of the label, \
             or the gyros' scale",
            within / DEGREE,
            labelled / DEGREE
        );
        (verdict, Some(words), None)
    }

    /// Extends some samples to the dwells before and after.
    fn to_rests(&self, samples: &Range<usize>) -> Range<usize> {
        let mut dwells = self.rests.iter().map(|rest| &rest.dwell.samples);
        let before = dwells.clone().rfind(|dwell| dwell.start < samples.start);
        let after = dwells.find(|dwell| dwell.end > samples.end);
        before.map_or(samples.start, |dwell| dwell.end.min(samples.start))
            ..after.map_or(samples.end, |dwell| dwell.start.max(samples.end))
    }

    /// Time of some samples outside all dwells, s. In a recording of sections, the dwells are derived from labels.
    fn moving(&self, samples: &Range<usize>) -> f64 {
        let dwells = self.rests.iter().map(|rest| &rest.dwell.samples);
        let standing: usize = dwells.map(|dwell| common(dwell, samples).len()).sum();
        samples.len().saturating_sub(standing) as f64 * self.run.recording.imu.period
    }
}
