//! A part of a dwell at once.

use nalgebra::DMatrix;

use super::super::courses::{Courses, StepModel};
use super::super::given::Given;
use super::super::local::{Local, Observed, Outcome};
use super::super::measurement::ScalarInnovation;
use super::super::segment::{Seen, Segment, Standing};
use super::Filter;
use super::update::Linear;
use crate::calibration::innovation::Observation;
use crate::calibration::layout::{ATTITUDE, NAVIGATION, POSITION, VELOCITY};
use crate::navigation::Block;

/// Rates and specific forces that are constant in a dwell.
const CONSTANTS: usize = 6;

/// What is done with an innovation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::calibration) enum Verdict {
    Accepted,
    Rejected,
    /// The whole part is given up.
    Abandoned,
}

/// An innovation: three scalars, one after the other.
#[derive(Debug, Clone, Copy)]
pub(in crate::calibration) struct Innovations {
    pub time: f64,
    pub kind: Observation,
    pub scalars: [ScalarInnovation; 3],
}

/// Who decides on innovations, and what variance the observations have.
pub(in crate::calibration) trait Observer {
    /// Of each component.
    fn variance(&self, seen: &Seen) -> f64;
    fn judge(&mut self, innovations: Innovations) -> Verdict;
}

/// What a part of a dwell did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::calibration) enum Taken {
    Whole,
    Abandoned,
    /// A covariance is not positive definite any more.
    Diverged,
}

/// How the errors make what a filter of a part of a dwell is about.
struct Map {
    given: Linear,
    /// By how much the attitude of the table is off, East, North and Up.
    table: Linear,
}

impl Filter {
    /// Takes in a part of a dwell.
    pub(super) fn stand<const M: usize, const G: usize>(
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
        let mut local = Local::new(self.given(&map.given, &across), courses);
        match self.through(&mut local, (segment, &models), observer, &mut |_| {}) {
            Taken::Whole => {}
            other => return other,
        }
        let outcome = local.outcome();
        if !outcome.values.is_empty() {
            let measured = map.given.combined(&outcome.measured);
            let across = &outcome.measured * across;
            self.take((&measured, across), &outcome.values, 1.0);
        }
        self.end(&outcome, &map, &moving);
        Taken::Whole
    }

    /// Numbers of a segment's models.
    pub(super) fn models<const M: usize, const G: usize>(
        &self,
        segment: &Segment,
        courses: &mut Courses<M, G>,
    ) -> Vec<usize> {
        let moving = self.moving();
        let models = segment.models.iter();
        let numbers = models.map(|block| courses.number(self.step_model(block, &moving)));
        numbers.collect()
    }

    /// A filter of a part alone through all of it, given the numbers of its models; `done` is told of each thing
    /// that it does.
    pub(super) fn through<'a, const M: usize, const G: usize>(
        &self,
        local: &mut Local<M, G>,
        (segment, models): (&'a Segment, &[usize]),
        observer: &mut impl Observer,
        done: &mut impl FnMut(Done<'a>),
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
            done(Done::Step(*model));
            for seen in seen {
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
                let Some(look) = local.look(&observed) else {
                    return Taken::Diverged;
                };
                let innovations = Innovations {
                    time: *time,
                    kind: seen.kind,
                    scalars: look.scalars,
                };
                match observer.judge(innovations) {
                    Verdict::Accepted => {
                        local.take(&look);
                        done(Done::Observed {
                            state,
                            seen,
                            point: look.to,
                        });
                    }
                    Verdict::Rejected => {}
                    Verdict::Abandoned => return Taken::Abandoned,
                }
            }
        }
        Taken::Whole
    }

    /// The states that move in a dwell: navigation errors, the turn at rest, varying biases.
    pub(super) fn moving(&self) -> Vec<usize> {
        let turn = self.layout.turn_at_rest();
        let turn = turn.into_iter().flat_map(|turn| turn..turn + 3);
        let varying = self.layout.varying_biases().map(|(state, ..)| state);
        (0..NAVIGATION).chain(turn).chain(varying).collect()
    }

    /// `g`: what moves when it begins but for the position, which nothing in a dwell depends on; rates
    /// and specific forces by which constants drive the errors of attitude and velocity.
    ///
    /// Attitude errors are those from the attitude of the table, `φ − τ`, which its readings show: what the
    /// Earth's rate and gravity make of τ is constant, too.
    fn map(&self, segment: &Segment, block: &Block, moving: &[usize], size: usize) -> Map {
        let mut given = Linear::zeros(size, self);
        let table = self.table_map(segment);
        for (component, &state) in given_at_begin(moving).enumerate() {
            given.states[(component, state)] = 1.0;
        }
        let first = size - CONSTANTS;
        let phi = self.driving_columns(block);
        let varying: Vec<usize> = self
            .layout
            .varying_biases()
            .map(|(state, ..)| state)
            .collect();
        for (state, column) in phi.iter().enumerate().skip(NAVIGATION) {
            if !varying.contains(&state) {
                let rates = rates(block, column);
                for (k, rate) in rates.into_iter().enumerate() {
                    given.states[(first + k, state)] = rate;
                }
            }
        }
        let on = self.layout.terms().count();
        for ((k, _), term) in self.layout.tried_terms().zip(&block.terms[on..]) {
            let column = std::array::from_fn(|row| term.column[row]);
            for (row, rate) in rates(block, &column).into_iter().enumerate() {
                given.tried[(first + row, k)] = rate;
            }
        }
        // What the table's attitude does to `g`.
        let mut shift = DMatrix::zeros(size, 3);
        for axis in 0..3 {
            let itself = |row| f64::from(row == ATTITUDE + axis);
            let change = |row| block.navigation[(row, ATTITUDE + axis)] - itself(row);
            let rates = rates(block, &std::array::from_fn(change));
            for (k, rate) in rates.into_iter().enumerate() {
                shift[(first + k, axis)] = rate;
            }
            shift[(ATTITUDE + axis, axis)] = -1.0;
        }
        given.add(0, &table.combined(&shift));
        Map { given, table }
    }

    /// By how much the attitude of the table is off.
    fn table_map(&self, segment: &Segment) -> Linear {
        let mut table = Linear::zeros(3, self);
        let errors = self.layout.table_position().into_iter();
        for error in errors.chain(self.layout.table_base()) {
            for axis in 0..3 {
                table.states[(axis, error + axis)] = 1.0;
            }
        }
        let response = segment.axes.as_deref();
        for axis in 0..3 {
            if let Some(response) = response {
                for (state, k) in self.layout.table_axes() {
                    table.states[(axis, state)] = response[(axis, k)];
                }
            }
            for (number, index) in self.layout.tried_of_table() {
                table.tried[(axis, number)] = match index.checked_sub(3) {
                    None => f64::from(index == axis),
                    Some(k) => response.map_or(0.0, |response| response[(axis, k)]),
                };
            }
        }
        table
    }

    /// What is known of `g` before, given its covariance with all states.
    fn given<const G: usize>(&self, rows: &Linear, across: &DMatrix<f64>) -> Given<G> {
        let mean = &rows.states * &self.x;
        let covariance = across * rows.states.transpose();
        Given::new(
            std::array::from_fn(|i| mean[i]),
            std::array::from_fn(|i| std::array::from_fn(|j| covariance[(i, j)])),
        )
    }

    pub(super) fn step_model<const M: usize>(
        &self,
        block: &Block,
        moving: &[usize],
    ) -> StepModel<M> {
        let constants = moving.len() - 3;
        let turn = self.layout.turn_at_rest().map(|_| NAVIGATION);
        let biases = M - self.varying.len();
        let mut transition = Vec::new();
        let mut driven = Vec::new();
        let mut noise = [[0.0; M]; M];
        let t = block.duration;
        for row in 0..NAVIGATION {
            for column in 0..NAVIGATION {
                transition.push((row, column, block.navigation[(row, column)]));
            }
            // A rate tilts evenly while force acts on the tilt.
            for axis in 0..3 {
                let tilting = block.navigation[(VELOCITY + row % 3, axis)];
                let here = f64::from(row % 3 == axis);
                let (rate, force) = match row / 3 {
                    0 => (t * here, 0.0),
                    1 => (0.5 * t * tilting, t * here),
                    _ => (t * t / 6.0 * tilting, 0.5 * t * t * here),
                };
                driven.push((row, constants + axis, rate));
                driven.push((row, constants + 3 + axis, force));
            }
        }
        for (k, (_, sensor, constant)) in self.layout.varying_biases().enumerate() {
            let column = block.parameters.get(sensor).column(constant);
            for row in 0..NAVIGATION {
                transition.push((row, biases + k, column[row]));
            }
            let (_, sigma, correlation_time) = self.varying[k];
            let keep = (-t / correlation_time).exp();
            transition.push((biases + k, biases + k, keep));
            noise[biases + k][biases + k] = sigma.powi(2) * (1.0 - keep * keep);
        }
        if let Some(turn) = turn {
            // By as much as the attitude error changes.
            for axis in 0..3 {
                let of_attitude: Vec<_> = transition
                    .iter()
                    .filter(|&&(row, ..)| row == ATTITUDE + axis)
                    .map(|&(row, column, phi)| {
                        let itself = f64::from(column == row);
                        (turn + axis, column, phi - itself)
                    })
                    .collect();
                transition.extend(of_attitude);
                transition.push((turn + axis, turn + axis, 1.0));
                for column in 0..3 {
                    driven.push((
                        turn + axis,
                        constants + column,
                        t * f64::from(axis == column),
                    ));
                }
            }
        }
        let of_navigation = block.noise.covariance(&self.noise);
        let own = |place: usize| match turn {
            Some(turn) if (turn..turn + 3).contains(&place) => Some(ATTITUDE + place - turn),
            _ => (place < NAVIGATION).then_some(place),
        };
        for (row, of_row) in noise.iter_mut().enumerate() {
            for (column, noise) in of_row.iter_mut().enumerate() {
                if let (Some(i), Some(j)) = (own(row), own(column)) {
                    *noise = of_navigation[(i, j)];
                }
                if row == column && row >= NAVIGATION && own(row).is_some() {
                    *noise += self.turning.powi(2) * t;
                }
            }
        }
        transition.retain(|&(.., phi)| phi != 0.0);
        driven.retain(|&(.., by)| by != 0.0);
        StepModel {
            transition,
            driven,
            noise,
        }
    }

    /// The states that move become what they are at the end of a part.
    fn end(&mut self, outcome: &Outcome, Map { given, table }: &Map, moving: &[usize]) {
        let mut end = given.combined(&outcome.of_given);
        end.add(ATTITUDE, table);
        for axis in 0..3 {
            end.states[(POSITION + axis, POSITION + axis)] += 1.0;
        }
        let added = end.tried.transpose();
        self.carry(moving, end.states, &outcome.covariance, &added);
        for (&state, offset) in moving.iter().zip(outcome.offset.iter()) {
            self.x[state] += offset;
        }
    }
}

/// What a filter of a part alone has done.
pub(super) enum Done<'a> {
    /// It went on over a step, by this of the segment's models.
    Step(usize),
    /// It took in what is observed of three errors from a state on, and came to this point of its course.
    Observed {
        state: usize,
        seen: &'a Seen,
        point: usize,
    },
}

/// Which component of `g` each moving state is when a part begins, if any.
pub(super) fn begins<const M: usize>(moving: &[usize]) -> [Option<usize>; M] {
    let mut begins = [None; M];
    for (component, &state) in given_at_begin(moving).enumerate() {
        if let Some(place) = moving.iter().position(|&moving| moving == state) {
            begins[place] = Some(component);
        }
    }
    begins
}

/// The moving states that are in `g`.
fn given_at_begin(moving: &[usize]) -> impl Iterator<Item = &usize> {
    let position = POSITION..POSITION + 3;
    moving.iter().filter(move |state| !position.contains(state))
}

/// Rate in rad/s and specific force in m/s² that make this of a block at rest.
fn rates(block: &Block, column: &[f64; NAVIGATION]) -> [f64; 6] {
    let t = block.duration;
    std::array::from_fn(|k| match k {
        0..3 => column[ATTITUDE + k] / t,
        _ => {
            let tilted: f64 = (0..3)
                .map(|axis| block.navigation[(VELOCITY + k - 3, axis)] * column[ATTITUDE + axis])
                .sum();
            (column[VELOCITY + k - 3] - 0.5 * tilted) / t
        }
    })
}
