//! Events of a recording at one linearisation point: navigation runs once, and the filter runs for every trial of noise
//! or of a variance.

use super::{Part, Smoothed, folded};
use crate::calibration::filter::{DwellFilters, Filter, Gate, Judge, Since, Taken, dwell_filters};
use crate::calibration::record::{Event, Rest, events};
use crate::calibration::{
    AttitudePrior, CalibrationError, Known, Layout, Linearisation, Prior, Problem, Reduction,
    Stretch,
};
use crate::imu::{PerSensor, Sensor};

/// Rows of a dwell are kept separately for each second …
const APART: f64 = 1.0;
/// … or for each of this many parts of a recording, if these are longer.
const EPOCHS: f64 = 3600.0;

/// Events at one linearisation point, independent of the noise.
pub struct Script<'a> {
    pub at: &'a Linearisation,
    pub priors: &'a [AttitudePrior],
    /// Events of each stretch.
    pub events: Vec<Vec<Event>>,
}

/// Quantities that scale the noise in moves, over all moves.
#[derive(Debug, Clone, Copy, Default)]
pub struct Moves {
    /// Duration, s.
    pub duration: f64,
    /// ∫|ω − ω_ie|² dt and ∫|f + g|² dt.
    pub motion: PerSensor<f64>,
}

impl<'a> Script<'a> {
    /// Navigates once through all stretches of a problem, linearised at this point.
    pub fn new(
        problem: &Problem,
        priors: &'a [AttitudePrior],
        at: &'a Linearisation,
    ) -> Result<Self, CalibrationError> {
        let layout = Layout::new(&problem.model, problem.one_gravity());
        let stretches = problem.stretches().iter().zip(&at.initial_attitudes);
        let events =
            stretches.map(|(stretch, initial)| events((problem, stretch), &layout, (at, initial)));
        Ok(Self {
            at,
            priors,
            events: events.collect::<Result<_, _>>()?,
        })
    }

    /// The parts of dwells of a stretch.
    pub fn parts(&self, stretch: usize) -> impl Iterator<Item = &Rest> {
        let events = self.events.get(stretch).into_iter().flatten();
        events.filter_map(|event| match event {
            Event::Rest(rest) => Some(&**rest),
            Event::Move(_) => None,
        })
    }

    /// Quantities that scale the noise in moves.
    pub fn moves(&self) -> Moves {
        let mut moves = Moves::default();
        for event in self.events.iter().flatten() {
            if let Event::Move(block) = event {
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

    /// Information of the recording about the constants, without innovations. `accepted` flags each observation of
    /// three components; those beyond its end are accepted.
    pub fn reduce(
        &self,
        problem: &Problem,
        accepted: &[bool],
    ) -> Result<Reduction, CalibrationError> {
        let mut judge = Judge::new(Gate::As(accepted), f64::INFINITY);
        self.follow(problem, &mut judge, Keeping::Parts)
    }

    /// The same as one triangle, if no dwell is evaluated separately; memory does not grow with the recording.
    pub fn fold(
        &self,
        problem: &Problem,
        accepted: &[bool],
    ) -> Result<Reduction, CalibrationError> {
        let mut judge = Judge::new(Gate::As(accepted), f64::INFINITY);
        let reduction = self.follow(problem, &mut judge, Keeping::Folded)?;
        Ok(reduction.folded())
    }

    /// Runs a filter over the recording, with or without innovations.
    pub fn follow(
        &self,
        problem: &Problem,
        judge: &mut Judge,
        keeping: Keeping,
    ) -> Result<Reduction, CalibrationError> {
        let filter = Filter::new(&problem.model, problem.one_gravity());
        let prior = Prior::new(&filter.layout.constants, &problem.model, self.at);
        let mut follower = Follower {
            dwells: dwell_filters(&filter),
            known: (keeping == Keeping::Innovations).then(|| Known::new(prior)),
            filter,
            parts: Vec::new(),
            keeping,
            dwell: 0,
        };
        let (mut attitudes, mut own) = (Vec::new(), Vec::new());
        let mut before = None;
        let stretches = problem.stretches();
        for (number, (stretch, events)) in stretches.iter().zip(&self.events).enumerate() {
            self.begin(&mut follower.filter, problem, before, (stretch, number));
            before = Some(stretch);
            follower.through(events, stretch, judge)?;
            let filter = &follower.filter;
            attitudes.push(Smoothed::of(filter, filter.layout.initial_attitude, 3));
            let next = stretches.get(number + 1);
            if next.is_none_or(|next| next.recording != stretch.recording) {
                own.extend(Smoothed::of_recording(filter));
            }
        }
        let Follower { filter, parts, .. } = follower;
        Ok(Reduction {
            constants: filter.layout.constants.clone(),
            parts,
            squares: filter.columns.squares,
            log_determinant: filter.columns.log_determinant,
            attitudes,
            own,
            gravity: filter
                .layout
                .gravity
                .map(|state| Smoothed::of(&filter, state, 1)),
        })
    }

    /// Starts a stretch after another: states of another recording or site are reset.
    fn begin(
        &self,
        filter: &mut Filter,
        problem: &Problem,
        before: Option<&Stretch>,
        (stretch, number): (&Stretch, usize),
    ) {
        let model = &problem.model;
        let start = stretch.start(&self.priors[number], &self.at.initial_attitudes[number]);
        let own = self.at.own(stretch.recording);
        let turned = (model.day_to_day.mounting > 0.0).then(|| own.response(&self.at.triads));
        let since = match before.filter(|before| before.recording == stretch.recording) {
            Some(before) => Since::Lost(before.time_until(stretch)),
            None => Since::Anew(&own, turned.as_ref()),
        };
        let moved = before.is_none_or(|before| before.run.site != stretch.run.site);
        let gravity = moved.then_some(stretch.run.site.gravity_sigma);
        filter.begin(&start, since, gravity);
    }
}

/// Rows are reduced when they are this many times as many as columns.
const FOLDED: usize = 4;

/// Data stored by a filter during a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Keeping {
    /// The rows of each part of a dwell.
    Parts,
    /// The same, plus current information about the constants for innovations.
    Innovations,
    /// One triangle.
    Folded,
}

/// A filter during a pass.
struct Follower {
    filter: Filter,
    dwells: Box<dyn DwellFilters>,
    /// Current information on the constants, if innovations are computed.
    known: Option<Known>,
    parts: Vec<Part>,
    keeping: Keeping,
    /// Number of dwells that have ended.
    dwell: usize,
}

impl Follower {
    fn through(
        &mut self,
        events: &[Event],
        stretch: &Stretch,
        judge: &mut Judge,
    ) -> Result<(), CalibrationError> {
        let apart = APART.max(stretch.run.recording.imu.duration() / EPOCHS);
        // Where a dwell begins, to go back to: after a turn the innovations' covariance is wide, and an outlier that
        // it lets in closes the gate to the good observations that follow.
        let mut begin: Option<(usize, usize, Filter, Known)> = None;
        let mut next = 0;
        while let Some(event) = events.get(next) {
            next += 1;
            let rest = match event {
                Event::Move(block) => {
                    self.filter.propagate(block);
                    continue;
                }
                Event::Rest(rest) => rest,
            };
            if rest.first && begin.as_ref().is_none_or(|&(event, ..)| event + 1 != next) {
                judge.begin(rest.new_position);
                begin = self.known.clone().map(|known| {
                    let filter = self.filter.clone();
                    (next - 1, self.parts.len(), filter, known)
                });
            }
            self.filter.begin_rest(rest, stretch);
            self.learn();
            let (filter, known) = (&mut self.filter, self.known.as_ref());
            match (
                self.dwells
                    .take_in(filter, (&**rest, stretch), known, judge),
                &begin,
            ) {
                (Taken::Whole, _) => self.keep(rest, apart)?,
                (Taken::Abandoned, Some((event, parts, filter, known))) => {
                    judge.begin_again();
                    self.parts.truncate(*parts);
                    self.filter = filter.clone();
                    self.known = Some(known.clone());
                    next = *event;
                }
                _ => return Err(CalibrationError::Diverged { time: rest.end() }),
            }
        }
        Ok(())
    }

    fn learn(&mut self) {
        if let Some(known) = &mut self.known {
            known.learn(&self.filter.columns.new_rows());
        }
    }

    /// Stores the rows of a part, combined with those of the next one unless that is a second later.
    fn keep(&mut self, rest: &Rest, apart: f64) -> Result<(), CalibrationError> {
        self.learn();
        let time = rest.end();
        let before = self.parts.last().filter(|part| part.dwell == self.dwell);
        if !rest.last && before.is_some_and(|before| time - before.time < apart) {
            return Ok(());
        }
        let rows = self.filter.columns.take_rows();
        if !rows.iter().all(|value| value.is_finite()) {
            return Err(CalibrationError::Diverged { time });
        }
        self.parts.push(Part {
            dwell: self.dwell,
            time,
            rows,
        });
        self.dwell += usize::from(rest.last);
        let rows: usize = self.parts.iter().map(|part| part.rows.nrows()).sum();
        let columns = self.filter.layout.constants.len() + 1;
        if self.keeping == Keeping::Folded && rows > FOLDED * columns {
            self.parts = folded(&self.parts).into_iter().collect();
        }
        Ok(())
    }
}
