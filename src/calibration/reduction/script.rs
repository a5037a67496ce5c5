//! A pass with the linearisation held, of which navigation is done once and the filter as often as noise is tried or a
//! variance is changed.

use super::Reduction;
use crate::calibration::error::CalibrationError;
use crate::calibration::filter::columns::Columns;
use crate::calibration::layout::Layout;
use crate::calibration::linearisation::{AttitudePrior, Linearisation};
use crate::calibration::model::Model;
use crate::calibration::pass::{
    DwellFilters, Filter, Innovations, ObservationJudge, PriorErrors, ScalarInnovation, Seen,
    Taken, Verdict, begin,
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
#[derive(Default)]
pub struct Replay {
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
        let mut replay = Replay::default();
        let model = &problem.model;
        let filter = Filter::new(model, &PriorErrors::at(model, self.at));
        self.follow(problem, accepted, filter, |_| {}, Some(&mut replay))?;
        Ok(replay)
    }

    /// What such a pass says of the constants.
    pub fn reduce(
        &self,
        problem: &Problem,
        accepted: &[bool],
    ) -> Result<Reduction, CalibrationError> {
        let mut dwells = Vec::new();
        let take = |filter: &mut Filter| {
            dwells.extend(filter.columns.as_mut().map(Columns::take_rows));
        };
        let filter = Filter::reduced(&problem.model, problem.one_gravity());
        let filter = self.follow(problem, accepted, filter, take, None)?;
        let columns = filter.columns.as_ref();
        Ok(Reduction {
            constants: filter.layout.columns().to_vec(),
            squares: columns.map_or(0.0, |columns| columns.squares),
            log_determinant: columns.map_or(0.0, |columns| columns.log_determinant),
            dwells,
        })
    }

    fn follow(
        &self,
        problem: &Problem,
        accepted: &[bool],
        mut filter: Filter,
        mut after_dwell: impl FnMut(&mut Filter),
        mut replay: Option<&mut Replay>,
    ) -> Result<Filter, CalibrationError> {
        let model = &problem.model;
        let mut dwells = DwellFilters::of(&filter);
        let mut accepted = accepted.iter();
        let mut before = None;
        let stretches = problem.stretches().iter().zip(self.priors);
        let of_each = self.events.iter().zip(&self.at.initial_attitudes);
        for ((stretch, prior), (events, initial)) in stretches.zip(of_each) {
            let start = stretch.start(prior, initial);
            begin(&mut filter, model, before, stretch, &start, self.at);
            before = Some(stretch);
            let mut decided = Decided {
                model,
                stretch,
                accepted: &mut accepted,
                replay: replay.as_deref_mut(),
            };
            for event in events {
                let of = (&mut filter, &mut dwells);
                let taken = event.take_in(of, (model, stretch), &mut decided);
                if taken != Taken::Whole || !decided.is_finite() {
                    return Err(CalibrationError::Diverged { time: event.end() });
                }
                if matches!(event, Event::Rest(rest) if rest.last) {
                    after_dwell(&mut filter);
                }
            }
        }
        Ok(filter)
    }
}

/// Lets in what was decided before.
struct Decided<'a, 'b> {
    model: &'a Model,
    stretch: &'a Stretch<'a>,
    accepted: &'a mut std::slice::Iter<'b, bool>,
    /// Where innovations go; none where they are not asked for.
    replay: Option<&'a mut Replay>,
}

impl Decided<'_, '_> {
    fn verdict(&mut self) -> Verdict {
        match self.accepted.next() {
            Some(false) => Verdict::Rejected,
            _ => Verdict::Accepted,
        }
    }

    /// Whether the last innovation is.
    fn is_finite(&self) -> bool {
        let replay = self.replay.as_deref();
        let last = replay.and_then(|replay| replay.distances.last());
        last.is_none_or(|distance| distance.is_finite())
    }
}

impl ObservationJudge for Decided<'_, '_> {
    fn variance(&self, seen: &Seen) -> f64 {
        self.stretch
            .observation_variance(self.model, seen.kind, seen.readings)
    }

    fn verdicts_are_known(&self) -> bool {
        self.replay.is_none()
    }

    fn known_verdict(&mut self) -> Verdict {
        self.verdict()
    }

    fn judge(&mut self, innovations: Innovations) -> Verdict {
        let verdict = self.verdict();
        if let Some(replay) = &mut self.replay {
            let three = innovations.scalars;
            let squares = three.map(|s| s.innovation.powi(2) / s.variance);
            replay.distances.push(squares.iter().sum());
            if verdict == Verdict::Accepted {
                replay.scalars.extend(three);
            }
        }
        verdict
    }
}
