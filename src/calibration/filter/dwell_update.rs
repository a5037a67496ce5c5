//! A part of a dwell at once.

use super::Filter;
use super::dwell_filter::{DwellFilter, Observed, Outcome};
use super::gain_cache::GainCache;
use super::measurement::ScalarInnovation;
use super::step_at_rest::Map;
use crate::calibration::checks::innovation::Observation;
use crate::calibration::constants::Known;
use crate::calibration::layout::{ATTITUDE, NAVIGATION, POSITION, VELOCITY};
use crate::calibration::model::Model;
use crate::calibration::problem::Stretch;
use crate::calibration::record::segment::{Segment, Standing};

/// What is done with an innovation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    Accepted,
    Rejected,
    /// The whole part is given up.
    Abandoned,
}

/// An innovation: three scalars, one after the other.
#[derive(Debug, Clone, Copy)]
pub struct Innovations {
    pub time: f64,
    pub kind: Observation,
    pub scalars: [ScalarInnovation; 3],
}

/// Who decides on observations.
pub trait ObservationJudge {
    /// By its innovation.
    fn judge(&mut self, innovations: Innovations) -> Verdict;

    /// Whether the next one is let in, where innovations are not worked out.
    fn is_let_in(&mut self) -> bool;

    /// A dwell begins, after a move or not.
    fn begin(&mut self, _after_move: bool) {}

    /// The dwell that has begun begins once more.
    fn begin_again(&mut self) {}
}

/// What a part of a dwell did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Taken {
    Whole,
    Abandoned,
    /// A covariance is not positive definite any more.
    Diverged,
}

impl Filter {
    /// Takes in a part of a dwell. Innovations are worked out where it is told what is `known` of the constants.
    pub fn update_dwell<const M: usize, const G: usize>(
        &mut self,
        (segment, gains): (&Segment, &mut GainCache<M, G>),
        of: (&Model, &Stretch),
        known: Option<&Known>,
        judge: &mut impl ObservationJudge,
    ) -> Taken {
        let Some(first) = segment.models.first() else {
            return Taken::Whole;
        };
        let moving = self.moving();
        let map = self.map(segment, first, &moving, G);
        gains.tidy();
        let models = self.models(segment, gains);
        let across = &map.given.states * &self.p;
        let given = known.map(|known| self.given(&map.given, &across, known));
        let mut dwell = DwellFilter::new(given, gains);
        match self.through(&mut dwell, (segment, &models), of, judge) {
            Taken::Whole => {}
            other => return other,
        }
        let outcome = dwell.outcome();
        self.columns.squares += outcome.squares;
        self.columns.log_determinant += outcome.log_determinant;
        if !outcome.values.is_empty() {
            let measured = map.given.combined(&outcome.measured);
            let across = &outcome.measured * across;
            self.take((&measured, across), &outcome.values, 1.0);
        }
        self.end(&outcome, &map, &moving);
        Taken::Whole
    }

    /// Numbers of a segment's models.
    fn models<const M: usize, const G: usize>(
        &self,
        segment: &Segment,
        gains: &mut GainCache<M, G>,
    ) -> Vec<usize> {
        let moving = self.moving();
        let models = segment.models.iter();
        let numbers = models.map(|block| gains.number(self.step_model(block, &moving)));
        numbers.collect()
    }

    /// A filter of a part alone through all of it, given the numbers of its models.
    fn through<const M: usize, const G: usize>(
        &self,
        dwell: &mut DwellFilter<M, G>,
        (segment, models): (&Segment, &[usize]),
        (model, stretch): (&Model, &Stretch),
        judge: &mut impl ObservationJudge,
    ) -> Taken {
        let turn = self.layout.turn_at_rest().map(|_| NAVIGATION);
        for step in &segment.steps {
            let Standing { time, referred, .. } = step;
            let turned = turn.map(|turn| (turn, referred[0]));
            let errors = [ATTITUDE, VELOCITY, POSITION].into_iter().zip(*referred);
            for (first, by) in errors.chain(turned) {
                for axis in 0..3 {
                    dwell.refer(first + axis, by[axis]);
                }
            }
            dwell.propagate(models[step.model]);
            for seen in &segment.seen[step.seen.clone()] {
                let state = match seen.kind {
                    Observation::Velocity => VELOCITY,
                    Observation::Table => ATTITUDE,
                    Observation::Attitude => turn.unwrap_or(ATTITUDE),
                };
                let observed = Observed {
                    state,
                    residual: seen.residual,
                    variance: stretch.observation_variance(model, seen.kind, seen.readings),
                };
                if !dwell.has_innovations() {
                    if judge.is_let_in() && dwell.update_unjudged(&observed).is_none() {
                        return Taken::Diverged;
                    }
                    continue;
                }
                let Some(prediction) = dwell.predict(&observed) else {
                    return Taken::Diverged;
                };
                let innovations = Innovations {
                    time: *time,
                    kind: seen.kind,
                    scalars: prediction.scalars,
                };
                match judge.judge(innovations) {
                    Verdict::Accepted => dwell.update(&prediction),
                    Verdict::Rejected => {}
                    Verdict::Abandoned => return Taken::Abandoned,
                }
            }
        }
        Taken::Whole
    }

    /// The states that move become what they are at the end of a part.
    fn end(&mut self, outcome: &Outcome, Map { given, table }: &Map, moving: &[usize]) {
        let mut end = given.combined(&outcome.of_given);
        end.add(ATTITUDE, table);
        for axis in 0..3 {
            end.states[(POSITION + axis, POSITION + axis)] += 1.0;
        }
        let added = end.columns.transpose();
        self.carry(moving, end.states, &outcome.covariance, &added);
        for (&state, offset) in moving.iter().zip(outcome.offset.iter()) {
            self.x[state] += offset;
        }
    }
}
