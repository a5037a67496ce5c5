//! A pass with the linearisation held, of which navigation is done once and the filter as often as noise
//! is tried.

use crate::calibration::error::CalibrationError;
use crate::calibration::layout::Layout;
use crate::calibration::linearisation::{AttitudePrior, Linearisation};
use crate::calibration::model::Model;
use crate::calibration::parameters::ParameterMatrix;
use crate::calibration::pass::{
    Dwells, Filter, Innovations, Observer, PriorErrors, ScalarInnovation, Seen, Taken, Verdict,
    begin,
};
use crate::calibration::problem::{Problem, Stretch};
use crate::calibration::record::events::{Event, Events};
use crate::imu::{PerSensor, Sensor};

/// What a pass does at one point of linearisation, whatever the noise.
pub struct Script<'a> {
    at: &'a Linearisation,
    priors: &'a [AttitudePrior],
    /// Of each stretch.
    events: Vec<Vec<Event>>,
}

/// What the noise of moves grows with, over all moves.
#[derive(Debug, Clone, Copy, Default)]
pub struct Moves {
    /// s
    pub duration: f64,
    /// ∫|ω − ω_ie|² dt and ∫|f + g|² dt.
    pub motion: PerSensor<f64>,
}

/// A replay's innovations.
pub struct Replay {
    /// Of observations that were let in, in order.
    pub scalars: Vec<ScalarInnovation>,
    /// Squared whitened innovation of every observation of three components, let in or not.
    pub distances: Vec<f64>,
    /// Of the parameters of both triads at the end.
    pub covariance: ParameterMatrix,
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
            let of = (problem, stretch);
            Ok(Events::new(of, &layout, (at, initial), true)?.collect())
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
            if let Event::Move(block, _) = event {
                for part in &block.noise.parts {
                    moves.duration += part.moving;
                    for sensor in Sensor::ALL {
                        *moves.motion.get_mut(sensor) += part.motion.get(sensor);
                    }
                }
            }
        }
        moves
    }

    /// The filter's pass with the noise of a problem's model. `accepted` tells of each observation of
    /// three components whether it is let in; those beyond its end are.
    pub fn replay(&self, problem: &Problem, accepted: &[bool]) -> Result<Replay, CalibrationError> {
        let model = &problem.model;
        let filter = Filter::new(model, &PriorErrors::at(model, self.at));
        let mut pass = Pass {
            model,
            accepted,
            dwells: Dwells::of(&filter),
            filter,
            replay: Replay {
                scalars: Vec::new(),
                distances: Vec::new(),
                covariance: ParameterMatrix::zeros(),
            },
        };
        let mut before = None;
        let stretches = problem.stretches().iter().zip(self.priors);
        let of_each = self.events.iter().zip(&self.at.initial_attitudes);
        for ((stretch, prior), (events, initial)) in stretches.zip(of_each) {
            let start = stretch.start(prior, initial);
            begin(&mut pass.filter, model, before, stretch, &start, self.at);
            before = Some(stretch);
            for event in events {
                pass.take_in(stretch, event)?;
            }
        }
        pass.replay.covariance = pass.filter.parameter_covariance();
        Ok(pass.replay)
    }
}

/// A replay of one stretch after the other.
struct Pass<'a> {
    model: &'a Model,
    accepted: &'a [bool],
    filter: Filter,
    dwells: Dwells,
    replay: Replay,
}

impl Pass<'_> {
    fn take_in(&mut self, stretch: &Stretch, event: &Event) -> Result<(), CalibrationError> {
        let mut decided = Decided {
            stretch,
            model: self.model,
            accepted: self.accepted,
            replay: &mut self.replay,
        };
        let filter = (&mut self.filter, &mut self.dwells);
        let taken = event.take_in(filter, (self.model, stretch), &mut decided);
        let last = self.replay.distances.last();
        match taken {
            Taken::Whole if last.is_none_or(|distance| distance.is_finite()) => Ok(()),
            _ => Err(CalibrationError::Diverged { time: event.end() }),
        }
    }
}

/// Lets in what was decided before.
struct Decided<'a> {
    stretch: &'a Stretch<'a>,
    model: &'a Model,
    accepted: &'a [bool],
    replay: &'a mut Replay,
}

impl Observer for Decided<'_> {
    fn variance(&self, seen: &Seen) -> f64 {
        self.stretch
            .observation_variance(self.model, seen.kind, seen.readings)
    }

    fn judge(&mut self, innovations: Innovations) -> Verdict {
        let Replay {
            scalars, distances, ..
        } = &mut *self.replay;
        let accepted = self.accepted.get(distances.len()).copied().unwrap_or(true);
        let three = innovations.scalars;
        let squares = three.map(|s| s.innovation.powi(2) / s.variance);
        distances.push(squares.iter().sum());
        match accepted {
            true => {
                scalars.extend(three);
                Verdict::Accepted
            }
            false => Verdict::Rejected,
        }
    }
}
