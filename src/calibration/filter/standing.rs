//! A part of a dwell at once.

use super::Filter;
use super::at_rest::Map;
use super::courses::Courses;
use super::local::{Local, Observed, Outcome};
use super::measurement::ScalarInnovation;
use crate::calibration::checks::innovation::Observation;
use crate::calibration::layout::{ATTITUDE, NAVIGATION, POSITION, VELOCITY};
use crate::calibration::record::segment::{Seen, Segment, Standing};

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

/// Who decides on innovations, and what variance the observations have.
pub trait Observer {
    /// Of each component.
    fn variance(&self, seen: &Seen) -> f64;
    fn judge(&mut self, innovations: Innovations) -> Verdict;

    /// Whether verdicts are known: innovations are not worked out then.
    fn knows(&self) -> bool {
        false
    }

    /// The verdict that is known on the next observation.
    fn foregone(&mut self) -> Verdict {
        Verdict::Accepted
    }
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
    /// Takes in a part of a dwell.
    pub fn stand<const M: usize, const G: usize>(
        &mut self,
        segment: &Segment,
        courses: &mut Courses<M, G>,
        observer: &mut impl Observer,
    ) -> Taken {
        let Some(first) = segment.models.first() else {
            return Taken::Whole;
        };
        let moving = self.moving();
        let map = self.map(segment, first, &moving, G);
        courses.tidy();
        let models = self.models(segment, courses);
        let across = &map.given.states * &self.p;
        let given = (!observer.knows()).then(|| self.given(&map.given, &across));
        let mut local = Local::new(given, courses);
        match self.through(&mut local, (segment, &models), observer) {
            Taken::Whole => {}
            other => return other,
        }
        let outcome = local.outcome();
        if let Some(columns) = &mut self.columns {
            columns.squares += outcome.squares;
            columns.log_determinant += outcome.log_determinant;
        }
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
        courses: &mut Courses<M, G>,
    ) -> Vec<usize> {
        let moving = self.moving();
        let models = segment.models.iter();
        let numbers = models.map(|block| courses.number(self.step_model(block, &moving)));
        numbers.collect()
    }

    /// A filter of a part alone through all of it, given the numbers of its models.
    fn through<const M: usize, const G: usize>(
        &self,
        local: &mut Local<M, G>,
        (segment, models): (&Segment, &[usize]),
        observer: &mut impl Observer,
    ) -> Taken {
        let turn = self.layout.turn_at_rest().map(|_| NAVIGATION);
        for step in &segment.steps {
            let Standing {
                time,
                model,
                referred,
                seen,
            } = step;
            let turned = turn.map(|turn| (turn, referred[0]));
            let errors = [ATTITUDE, VELOCITY, POSITION].into_iter().zip(*referred);
            for (first, by) in errors.chain(turned) {
                for axis in 0..3 {
                    local.refer(first + axis, by[axis]);
                }
            }
            local.propagate(models[*model]);
            for seen in &segment.seen[seen.clone()] {
                let state = match seen.kind {
                    Observation::Velocity => VELOCITY,
                    Observation::Table => ATTITUDE,
                    Observation::Attitude => turn.unwrap_or(ATTITUDE),
                };
                let observed = Observed {
                    state,
                    residual: seen.residual,
                    variance: observer.variance(seen),
                };
                if observer.knows() {
                    let accepted = observer.foregone() == Verdict::Accepted;
                    if accepted && local.tell(&observed).is_none() {
                        return Taken::Diverged;
                    }
                    continue;
                }
                let Some(look) = local.look(&observed) else {
                    return Taken::Diverged;
                };
                let innovations = Innovations {
                    time: *time,
                    kind: seen.kind,
                    scalars: look.scalars,
                };
                match observer.judge(innovations) {
                    Verdict::Accepted => local.take(&look),
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
