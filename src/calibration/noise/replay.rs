//! A pass with the linearisation held, of which navigation is done once and the filter as often as noise
//! is tried.

use nalgebra::Matrix3;

use super::super::error::CalibrationError;
use super::super::layout::Layout;
use super::super::linearisation::{AttitudePrior, Linearisation};
use super::super::parameters::to_vector;
use super::super::pass::{Filter, Measurement, ScalarInnovation, begin, navigator};
use super::super::problem::{Problem, Stretch};
use super::super::schedule::{AtRest, Step};
use crate::imu::{PerSensor, Sensor};
use crate::navigation::{Block, Navigator, State};

/// What a pass does at one point of linearisation, whatever the noise.
pub(super) struct Script<'a> {
    at: &'a Linearisation,
    priors: &'a [AttitudePrior],
    /// Of each stretch.
    events: Vec<Vec<Event<'a>>>,
}

enum Event<'a> {
    Move(Box<Block>),
    Rest(Box<Rest<'a>>),
}

/// A step of a dwell.
struct Rest<'a> {
    time: f64,
    at_rest: &'a AtRest,
    new_position: bool,
    /// Computed state at its begin, and where the pass linearises instead.
    from: State,
    to: State,
    /// The attitude that the dwell holds without a table.
    held: Matrix3<f64>,
    block: Block,
}

/// What the noise of moves grows with, over all moves.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Moves {
    /// s
    pub duration: f64,
    /// ∫|ω − ω_ie|² dt and ∫|f + g|² dt.
    pub motion: PerSensor<f64>,
}

/// A replay's innovations.
pub(super) struct Replay {
    /// Of observations that were let in, in order.
    pub scalars: Vec<ScalarInnovation>,
    /// Squared whitened innovation of every observation of three components, let in or not.
    pub distances: Vec<f64>,
}

impl Replay {
    /// −2 ln of the likelihood of the noise, but for a constant.
    pub fn deviance(&self) -> f64 {
        let each = |s: &ScalarInnovation| s.innovation.powi(2) / s.variance + s.variance.ln();
        self.scalars.iter().map(each).sum()
    }
}

impl<'a> Script<'a> {
    /// Navigates once through all stretches of a problem, linearised at this point.
    pub fn new(
        problem: &'a Problem<'a>,
        priors: &'a [AttitudePrior],
        at: &'a Linearisation,
    ) -> Result<Self, CalibrationError> {
        let layout = Layout::new(&problem.model);
        let stretches = problem.stretches().iter().zip(&at.initial_attitudes);
        let events = stretches.map(|(stretch, initial)| {
            let mut navigator = navigator(stretch, at, initial, &layout)?;
            let steps: &'a [Step] = &stretch.steps;
            let mut held = *initial;
            let number = steps.iter().enumerate();
            Ok(number
                .map(|(k, step)| event(&mut navigator, &mut held, stretch, at, step, k > 0))
                .collect())
        });
        Ok(Self {
            at,
            priors,
            events: events.collect::<Result<_, CalibrationError>>()?,
        })
    }

    /// What noise of moves grows with.
    pub fn moves(&self) -> Moves {
        let mut moves = Moves::default();
        for event in self.events.iter().flatten() {
            if let Event::Move(block) = event {
                moves.duration += block.noise.moving;
                for sensor in Sensor::ALL {
                    *moves.motion.get_mut(sensor) += block.noise.motion.get(sensor);
                }
            }
        }
        moves
    }

    /// The filter's pass with the noise of a problem's model. `accepted` tells of each observation of
    /// three components whether it is let in; those beyond its end are.
    pub fn replay(&self, problem: &Problem, accepted: &[bool]) -> Result<Replay, CalibrationError> {
        let model = &problem.model;
        let parameters = model.prior_mean - to_vector(&self.at.triads);
        let mut pass = Pass {
            problem,
            accepted,
            filter: Filter::new(model, &parameters, &-self.at.terms),
            replay: Replay {
                scalars: Vec::new(),
                distances: Vec::new(),
            },
        };
        let mut before = None;
        let stretches = problem.stretches().iter().zip(self.priors);
        let of_each = self.events.iter().zip(&self.at.initial_attitudes);
        for ((stretch, prior), (events, initial)) in stretches.zip(of_each) {
            let start = stretch.start(prior, initial);
            begin(&mut pass.filter, model, before, stretch, &start);
            before = Some(stretch);
            for event in events {
                match event {
                    Event::Move(block) => pass.filter.propagate(block),
                    Event::Rest(rest) => pass.rest(stretch, rest)?,
                }
            }
        }
        Ok(pass.replay)
    }
}

fn event<'a>(
    navigator: &mut Navigator,
    held: &mut Matrix3<f64>,
    stretch: &Stretch,
    at: &Linearisation,
    step: &'a Step,
    later: bool,
) -> Event<'a> {
    let Some(at_rest) = &step.at_rest else {
        return Event::Move(Box::new(navigator.advance(step.samples.clone())));
    };
    let from = navigator.state;
    let to = at_rest.tied(&from, &at.triads.accel);
    navigator.state = to;
    if at_rest.first {
        *held = to.attitude;
    }
    Event::Rest(Box::new(Rest {
        time: stretch.run.recording.imu.time(step.samples.end),
        at_rest,
        new_position: at_rest.first && later,
        from,
        to,
        held: *held,
        block: navigator.advance_standing(step.samples.clone()),
    }))
}

struct Pass<'a> {
    problem: &'a Problem<'a>,
    accepted: &'a [bool],
    filter: Filter,
    replay: Replay,
}

impl Pass<'_> {
    fn rest(&mut self, stretch: &Stretch, rest: &Rest) -> Result<(), CalibrationError> {
        let (model, variance) = (&self.problem.model, stretch.variance);
        let filter = &mut self.filter;
        if rest.at_rest.first {
            filter.come_to_rest(&rest.from);
        }
        filter.refer(&rest.from, &rest.to);
        if rest.at_rest.first {
            filter.begin_to_hold();
        }
        filter.propagate(&rest.block);
        let state = &rest.block.state;
        if rest.new_position {
            filter.redraw_table(model.position_sigma);
            filter.update(&Measurement::position(state, variance.position));
        }
        let of_stretch = (stretch, model, &self.filter.layout);
        for (_, measurement) in Measurement::of_rest(of_stretch, rest.at_rest, state, &rest.held) {
            self.observe(rest.time, &measurement)?;
        }
        Ok(())
    }

    fn observe(&mut self, time: f64, measurement: &Measurement) -> Result<(), CalibrationError> {
        let diverged = CalibrationError::Diverged { time };
        let Replay { scalars, distances } = &mut self.replay;
        let accepted = self.accepted.get(distances.len()).copied().unwrap_or(true);
        let distance = if accepted {
            // One scalar after the other is the Cholesky factorisation of all three.
            let three = self.filter.update(measurement);
            scalars.extend(three);
            three
                .iter()
                .map(|s| s.innovation.powi(2) / s.variance)
                .sum()
        } else {
            let whitened = self.filter.whitened(measurement);
            whitened.map_or(f64::NAN, |(whitened, _)| whitened.norm_squared())
        };
        if !distance.is_finite() || distance < 0.0 {
            return Err(diverged);
        }
        distances.push(distance);
        Ok(())
    }
}
