//! A part of a dwell: its error models, steps, and what is observed of them.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::schedule::{AtRest, Step};
use crate::attitude::{log, to_tilt_and_heading};
use crate::calibration::{Observation, Problem, Stretch};
use crate::navigation::{Block, Navigator, State};
use crate::turntable::AxisResponse;

/// Steps of a dwell that are taken in at once, of the length of its first: 10 s of them, in which a body that is
/// held by hand keeps its attitude, too.
const STEPS: usize = 100;

/// A part of a dwell, modelled with one constant attitude.
#[derive(Debug, Clone)]
pub struct Rest {
    /// Whether it is the dwell's first and its last.
    pub first: bool,
    pub last: bool,
    /// Whether the body was elsewhere before.
    pub new_position: bool,
    /// State that was computed until it begins …
    pub from: State,
    /// … and the one where the pass linearises.
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
    /// Which of the part's models is its own.
    pub model: usize,
    /// By how much errors of attitude, velocity and position become more before it, since they are referred to
    /// another computed state.
    pub referred: [Vector3<f64>; 3],
    /// Which of the part's observations are of its end.
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

/// How many of these steps, the first of which is in a dwell, make a part of it of at most this many samples.
pub fn part_of(steps: &[Step], longest: usize) -> usize {
    let end = steps.first().map_or(0, |step| step.samples.start + longest);
    let belongs = |step: &&Step| {
        let at_rest = step.at_rest.as_ref();
        at_rest.is_some_and(|at_rest| !at_rest.first) && step.samples.end <= end
    };
    let others = steps.iter().skip(1).take(STEPS - 1);
    1 + others.take_while(belongs).count()
}

/// Samples that a part has at most of a dwell with this first step.
pub fn longest(first: &Step) -> usize {
    STEPS * first.samples.len()
}

impl Rest {
    /// Navigates through these steps from where the navigator is. Each step begins at the same state of rest, and what
    /// the step before led to is referred to it; `held` is the attitude that was computed when the body came to rest.
    pub fn navigate(
        navigator: &mut Navigator,
        (problem, stretch): (&Problem, &Stretch),
        part: &[Step],
        held: &Matrix3<f64>,
    ) -> Self {
        let begin = navigator.state;
        let imu = &stretch.run.recording.imu;
        let whole = samples_of(part);
        let part = part
            .iter()
            .filter_map(|step| Some((step, step.at_rest.as_ref()?)));
        let axes = part
            .clone()
            .next()
            .and_then(|(_, at_rest)| at_rest.dwell.axes.clone());
        // With the number of samples that each is for, and whether some of these are interpolated.
        let mut models: Vec<(usize, bool, Block)> = Vec::new();
        let (mut steps, mut seen) = (Vec::new(), Vec::new());
        for (step, at_rest) in part {
            let referred = between(&navigator.state, &begin);
            navigator.state = begin;
            let bridged = imu.bridged(&step.samples).next().is_some();
            let model = model_of(
                &mut models,
                (step.samples.len(), bridged),
                |like| match like {
                    Some(model) => navigator.standing_like(model, &step.samples),
                    None => {
                        navigator.warm(&whole);
                        navigator.standing(&begin.attitude, step.samples.clone())
                    }
                },
            );
            navigator.warm(&step.samples);
            navigator.stand(&at_rest.sums);
            let first = seen.len();
            let kinds = problem.observed(step);
            seen.extend(kinds.filter_map(|kind| Seen::of(kind, &navigator.state, at_rest, held)));
            steps.push(Standing {
                time: imu.time(step.samples.end),
                model,
                referred,
                seen: first..seen.len(),
            });
        }
        steps.shrink_to_fit();
        seen.shrink_to_fit();
        Self {
            first: false,
            last: false,
            new_position: false,
            from: begin,
            begin,
            axes,
            models: models.into_iter().map(|(.., model)| model).collect(),
            steps,
            seen,
        }
    }

    /// When it ends, s.
    pub fn end(&self) -> f64 {
        self.steps.last().map_or(0.0, |step| step.time)
    }
}

impl Seen {
    fn of(
        kind: Observation,
        computed: &State,
        at_rest: &AtRest,
        held: &Matrix3<f64>,
    ) -> Option<Self> {
        let off = |attitude: &Matrix3<f64>| -log(&(computed.attitude * attitude.transpose()));
        let (residual, readings) = match kind {
            Observation::Velocity => (computed.velocity, 1),
            Observation::Attitude => (off(held), 1),
            Observation::Table => {
                let (reading, count) = at_rest.reading.as_ref()?;
                (off(reading), *count)
            }
        };
        Some(Self {
            kind,
            residual,
            readings,
        })
    }
}

/// The number of the model of a step of this many samples, some of which may be interpolated; `made` where no other step
/// is like it: anew, or after one that differs by its interpolated samples alone.
fn model_of(
    models: &mut Vec<(usize, bool, Block)>,
    (length, bridged): (usize, bool),
    made: impl FnOnce(Option<&Block>) -> Block,
) -> usize {
    let known = |of: &(usize, bool, Block)| !bridged && (of.0, of.1) == (length, false);
    models.iter().rposition(known).unwrap_or_else(|| {
        let like = models.iter().rfind(|of| bridged && of.0 == length);
        let model = made(like.map(|(.., model)| model));
        models.push((length, bridged, model));
        models.len() - 1
    })
}

/// The samples of steps that follow one another.
pub fn samples_of(steps: &[Step]) -> Range<usize> {
    let ends = steps.first().zip(steps.last());
    ends.map_or(0..0, |(first, last)| first.samples.start..last.samples.end)
}

/// Change of the errors of attitude, velocity and position when they are referred to another computed state of
/// the same moment. It is of first order, as everything in a pass: the filter stays linear, and its result does
/// not depend on the order of observations.
pub fn between(from: &State, to: &State) -> [Vector3<f64>; 3] {
    [
        to_tilt_and_heading(&(from.attitude * to.attitude.transpose())),
        to.velocity - from.velocity,
        to.position - from.position,
    ]
}
