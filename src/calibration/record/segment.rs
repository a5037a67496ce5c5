//! What navigation hands to the filter at once: blocks of moves, and parts of dwells with what is observed
//! of them.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use crate::attitude::{log, to_tilt_and_heading};
use crate::calibration::checks::innovation::Observation;
use crate::calibration::layout::Layout;
use crate::calibration::problem::{Problem, Stretch};
use crate::calibration::record::schedule::{AtRest, Step, cut, step_length};
use crate::navigation::{Block, Navigator, State};
use crate::recording::ImuSamples;
use crate::turntable::AxisResponse;

/// A part of a dwell, whose error model is that of one attitude.
#[derive(Debug, Clone)]
pub struct Segment {
    /// Computed state at its begin.
    pub begin: State,
    /// How the table's attitude turns with errors of its axes, where their angles are known.
    pub axes: Option<Arc<AxisResponse>>,
    /// Error models of its steps; one for all that are alike.
    pub models: Vec<Block>,
    pub steps: Vec<Standing>,
    /// What is observed, one step after the other.
    pub seen: Vec<Seen>,
}

/// A step of a dwell.
#[derive(Debug, Clone)]
pub struct Standing {
    /// When it ends, s.
    pub time: f64,
    /// Which of the segment's models is its own.
    pub model: usize,
    /// By how much errors of attitude, velocity and position become more before it, since they are referred to
    /// another computed state.
    pub referred: [Vector3<f64>; 3],
    /// Which of the segment's observations are of its end.
    pub seen: Range<usize>,
}

/// An observation of three components, alike in their variance.
#[derive(Debug, Clone, Copy)]
pub struct Seen {
    pub kind: Observation,
    /// Computed − observed, East-North-Up.
    pub residual: Vector3<f64>,
    /// Of how many readings it is the mean.
    pub readings: usize,
}

/// Steps of a dwell that are taken in at once, of the length of its first: 10 s of them, in which a body that is
/// held by hand keeps its attitude, too.
const STEPS: usize = 100;

/// The parts of a dwell, one after the other.
#[derive(Debug, Clone)]
pub struct Segments<'a> {
    /// From the next part's first on.
    steps: &'a [Step],
    begun: bool,
    /// Samples that a part has at most.
    longest: usize,
}

/// The parts of a dwell, given the steps from its first on.
pub fn segments(steps: &[Step]) -> Segments<'_> {
    Segments {
        steps,
        begun: false,
        longest: STEPS * steps.first().map_or(0, |step| step.samples.len()),
    }
}

impl Segments<'_> {
    /// Whether the dwell has no other part.
    pub fn is_done(&self) -> bool {
        let next = self.steps.first().and_then(|step| step.at_rest.as_ref());
        next.is_none_or(|at_rest| at_rest.first)
    }
}

impl<'a> Iterator for Segments<'a> {
    type Item = Vec<(&'a Step, &'a AtRest)>;

    fn next(&mut self) -> Option<Self::Item> {
        let end = self.steps.first()?.samples.start + self.longest;
        let of_dwell = self.steps.iter().enumerate().map_while(|(number, step)| {
            let at_rest = step.at_rest.as_ref()?;
            let begins = number == 0 && !self.begun;
            let within = number == 0 || step.samples.end <= end;
            ((begins || !at_rest.first) && within).then_some((step, at_rest))
        });
        let part: Vec<_> = of_dwell.take(STEPS).collect();
        self.steps = &self.steps[part.len()..];
        self.begun = true;
        (!part.is_empty()).then_some(part)
    }
}

/// The blocks that a filter of this layout takes of these samples of a move: all of them at once, unless
/// biases vary meanwhile.
pub fn moves(
    samples: Range<usize>,
    layout: &Layout,
    imu: &ImuSamples,
) -> impl Iterator<Item = Range<usize>> + use<> {
    let vary = layout.varying_biases().next().is_some();
    let length = match vary {
        true => step_length(imu.period),
        false => samples.len(),
    };
    cut(samples, length)
}

/// Error models of a segment's steps, and with their number of samples the last of which none is interpolated, and the
/// last of all.
#[derive(Default)]
struct Models {
    all: Vec<Block>,
    whole: Option<(usize, usize)>,
    last: Option<(usize, usize)>,
}

impl Models {
    /// The number of the model of a step of this length, `made` where no other step is like it: anew, or after one that
    /// differs by its interpolated samples alone.
    fn of_step(
        &mut self,
        length: usize,
        bridged: bool,
        made: impl FnOnce(Option<&Block>) -> Block,
    ) -> usize {
        let as_long = |model: Option<(usize, usize)>| {
            let (of, number) = model?;
            (of == length).then_some(number)
        };
        let number = as_long(self.whole).filter(|_| !bridged);
        let number = number.unwrap_or_else(|| {
            let like = as_long(self.last).filter(|_| bridged);
            let model = made(like.and_then(|number| self.all.get(number)));
            self.all.push(model);
            self.all.len() - 1
        });
        self.last = Some((length, number));
        if !bridged {
            self.whole = self.last;
        }
        number
    }
}

impl Segment {
    /// Navigates from where the navigator is. Each step begins at the same state of rest, and what the step before led
    /// to is referred to it; `held` is the attitude that was computed when the body came to rest.
    pub fn navigate(
        navigator: &mut Navigator,
        (problem, stretch): (&Problem, &Stretch),
        steps: &[(&Step, &AtRest)],
        held: &Matrix3<f64>,
    ) -> Self {
        let begin = navigator.state;
        let mut segment = Self {
            begin,
            axes: steps
                .first()
                .and_then(|(_, at_rest)| at_rest.dwell.axes.clone()),
            models: Vec::new(),
            steps: Vec::with_capacity(steps.len()),
            seen: Vec::new(),
        };
        let imu = &stretch.run.recording.imu;
        let ends = steps.first().zip(steps.last());
        let whole = ends.map_or(0..0, |((first, _), (last, _))| {
            first.samples.start..last.samples.end
        });
        let mut models = Models::default();
        for (step, at_rest) in steps {
            let mut referred = Default::default();
            if !segment.steps.is_empty() {
                let from = navigator.state;
                referred = between(&from, &begin);
                navigator.state = begin;
            }
            let bridged = imu.bridged(&step.samples).next().is_some();
            let model = models.of_step(step.samples.len(), bridged, |like| match like {
                Some(model) => navigator.standing_like(model, &step.samples),
                None => {
                    navigator.warm(&whole);
                    navigator.standing(&begin.attitude, step.samples.clone())
                }
            });
            navigator.warm(&step.samples);
            navigator.stand(&at_rest.sums);
            let computed = &navigator.state;
            let seen = problem.observed(step).filter_map(|kind| {
                let (residual, readings) = match kind {
                    Observation::Velocity => (computed.velocity, 1),
                    Observation::Attitude => (-log(&(computed.attitude * held.transpose())), 1),
                    Observation::Table => {
                        let (reading, count) = at_rest.reading.as_ref()?;
                        (-log(&(computed.attitude * reading.transpose())), *count)
                    }
                };
                Some(Seen {
                    kind,
                    residual,
                    readings,
                })
            });
            let first = segment.seen.len();
            segment.seen.extend(seen);
            segment.steps.push(Standing {
                time: imu.time(step.samples.end),
                model,
                referred,
                seen: first..segment.seen.len(),
            });
        }
        models.all.shrink_to_fit();
        segment.models = models.all;
        segment.seen.shrink_to_fit();
        segment
    }

    /// When it ends, s.
    pub fn end(&self) -> f64 {
        self.steps.last().map_or(0.0, |step| step.time)
    }
}

/// By how much errors of attitude, velocity and position become more when they are referred to another
/// computed state of the same moment, to first order as all of a pass: the filter stays linear, and what it
/// finds does not depend on the order of what it is told.
pub fn between(from: &State, to: &State) -> [Vector3<f64>; 3] {
    [
        to_tilt_and_heading(&(from.attitude * to.attitude.transpose())),
        to.velocity - from.velocity,
        to.position - from.position,
    ]
}
