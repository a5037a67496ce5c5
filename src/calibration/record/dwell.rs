//! A part of a dwell: error models, steps and observations.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::schedule::{AtRest, Step};
use crate::attitude::{log, to_tilt_and_heading};
use crate::calibration::{Observation, Problem, Stretch};
use crate::navigation::{Block, Navigator, State};
use crate::recording::MagneticMean;
use crate::turntable::AxisResponse;

/// Dwell steps processed at once, of the length of the first: 10 s, during which even a hand-held body keeps its
/// attitude.
const STEPS: usize = 100;

/// A part of a dwell, modelled with one constant attitude.
#[derive(Debug, Clone)]
pub struct Rest {
    /// Whether this is the first part of the dwell.
    pub first: bool,
    /// Whether the body moved before this part.
    pub new_position: bool,
    /// Computed state before the start of the part.
    pub from: State,
    /// Linearisation state at the start of the part.
    pub begin: State,
    /// Rotation of the table attitude for a unit error of each axis, if the angles are known.
    pub axes: Option<Arc<AxisResponse>>,
    /// Error models of the steps in the part; equal steps share one model.
    pub models: Vec<Block>,
    pub steps: Vec<Standing>,
    /// Observations, step by step.
    pub seen: Vec<Seen>,
    /// Mean output of the magnetometer, if any.
    pub magnetic: Option<MagneticMean>,
}

/// A step of a dwell.
#[derive(Debug, Clone)]
pub struct Standing {
    /// Time at the end of the step, s.
    pub time: f64,
    /// Index of the error model of the step in the part.
    pub model: usize,
    /// Change in the errors of attitude, velocity and position before the step; it occurs because the errors then refer
    /// to a different computed state.
    pub referred: [Vector3<f64>; 3],
    /// Indices of the observations at the end of the step.
    pub seen: Range<usize>,
}

/// An observation of three components with equal variance.
#[derive(Debug, Clone, Copy)]
pub struct Seen {
    pub kind: Observation,
    /// Computed − observed, East-North-Up.
    pub residual: Vector3<f64>,
    /// Number of averaged readings.
    pub readings: usize,
}

/// Number of these steps that together form a part of at most this many samples; the first step is in a dwell.
pub fn part_of(steps: &[Step], longest: usize) -> usize {
    let end = steps.first().map_or(0, |step| step.samples.start + longest);
    let belongs = |step: &&Step| {
        let at_rest = step.at_rest.as_ref();
        at_rest.is_some_and(|at_rest| !at_rest.first) && step.samples.end <= end
    };
    let others = steps.iter().skip(1).take(STEPS - 1);
    1 + others.take_while(belongs).count()
}

/// Maximum number of samples in a part of a dwell that begins with this step.
pub fn longest(first: &Step) -> usize {
    STEPS * first.samples.len()
}

impl Rest {
    /// Navigates through these steps from the current state. Each step starts from the same state at rest, to which the
    /// result of the previous step is referred; `held` is the attitude that was computed when the body came to rest.
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
        // Each model comes with its number of samples, and whether some of them are interpolated.
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
            new_position: false,
            from: begin,
            begin,
            axes,
            models: models.into_iter().map(|(.., model)| model).collect(),
            steps,
            seen,
            magnetic: stretch.magnetic(&whole),
        }
    }

    /// Time at the end of the step, s.
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

/// Index of the model of a step with this many samples, some of which may be interpolated. If no earlier step is equal,
/// a new model is made, from scratch or from one that differs only in interpolated samples.
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

/// The samples of successive steps.
pub fn samples_of(steps: &[Step]) -> Range<usize> {
    let ends = steps.first().zip(steps.last());
    ends.map_or(0..0, |(first, last)| first.samples.start..last.samples.end)
}

/// Change of the errors of attitude, velocity and position if they are referred to another computed state at the same
/// time. This change is of first order, like all terms in a pass, so the filter stays linear and its result does not
/// depend on the order of the observations.
pub fn between(from: &State, to: &State) -> [Vector3<f64>; 3] {
    [
        to_tilt_and_heading(&(from.attitude * to.attitude.transpose())),
        to.velocity - from.velocity,
        to.position - from.position,
    ]
}
