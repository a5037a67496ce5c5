//! A part of a dwell at once.

use nalgebra::DMatrix;

use super::super::local::{Given, Local, Look, Observed, Outcome, StepModel};
use super::super::measurement::ScalarInnovation;
use super::super::segment::{Seen, Segment, Standing};
use super::Filter;
use super::update::times;
use crate::calibration::innovation::Observation;
use crate::calibration::layout::{ATTITUDE, NAVIGATION, POSITION, VELOCITY};
use crate::navigation::Block;

/// Rates, specific forces and angles of the table that are constant in a dwell.
const CONSTANTS: usize = 9;

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

/// How the states make `g`: rows of it by state, and by parameter that is tried.
struct Map {
    states: DMatrix<f64>,
    tried: DMatrix<f64>,
}

impl Filter {
    /// Takes in a part of a dwell.
    pub fn stand(&mut self, segment: &Segment, observer: &mut impl Observer) -> Taken {
        let turn = self.layout.turn_at_rest().map_or(0, |_| 3);
        match turn + self.varying.len() {
            0 => self.stand_with::<9, 15>(segment, observer),
            3 => self.stand_with::<12, 18>(segment, observer),
            6 => self.stand_with::<15, 21>(segment, observer),
            _ => self.stand_with::<18, 24>(segment, observer),
        }
    }

    fn stand_with<const M: usize, const G: usize>(
        &mut self,
        segment: &Segment,
        observer: &mut impl Observer,
    ) -> Taken {
        let Some(first) = segment.models.first() else {
            return Taken::Whole;
        };
        let moving = self.moving();
        let map = self.map(segment, first, &moving, G);
        let mut local = Local::<M, G>::new(self.given(&map), begins(&moving));
        match self.through(&mut local, segment, observer, &mut |_| {}) {
            Taken::Whole => {}
            other => return other,
        }
        self.take_in::<M>(&local.outcome(), &map, &moving);
        Taken::Whole
    }

    /// A filter of a part alone through all of it; `done` is told of each thing that it does.
    pub(super) fn through<const M: usize, const G: usize>(
        &self,
        local: &mut Local<M, G>,
        segment: &Segment,
        observer: &mut impl Observer,
        done: &mut impl FnMut(Done<M, G>),
    ) -> Taken {
        let moving = self.moving();
        let models: Vec<StepModel<M>> = segment
            .models
            .iter()
            .map(|block| self.step_model(block, &moving))
            .collect();
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
            local.propagate(&models[*model]);
            done(Done::Step(*model));
            for seen in seen {
                let (state, minus) = match seen.kind {
                    Observation::Velocity => (VELOCITY, None),
                    Observation::Table => (ATTITUDE, Some(G - 3)),
                    Observation::Attitude => (turn.unwrap_or(ATTITUDE), None),
                };
                let observed = Observed {
                    state,
                    minus,
                    residual: seen.residual,
                    variance: observer.variance(seen),
                };
                let Some(look) = local.look(&observed) else {
                    return Taken::Diverged;
                };
                let innovations = Innovations {
                    time: *time,
                    kind: seen.kind,
                    scalars: look.scalars(),
                };
                match observer.judge(innovations) {
                    Verdict::Accepted => {
                        local.take(&look);
                        done(Done::Observed {
                            state,
                            seen,
                            look: &look,
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
    /// and specific forces by which constants drive the errors of attitude and velocity; what the table's
    /// attitude is less by.
    fn map(&self, segment: &Segment, block: &Block, moving: &[usize], size: usize) -> Map {
        let mut map = Map {
            states: DMatrix::zeros(size, self.x.len()),
            tried: DMatrix::zeros(size, self.layout.tried()),
        };
        for (component, &state) in given_at_begin(moving).enumerate() {
            map.states[(component, state)] = 1.0;
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
                    map.states[(first + k, state)] = rate;
                }
            }
        }
        let on = self.layout.terms().count();
        for ((k, _), term) in self.layout.tried_terms().zip(&block.terms[on..]) {
            let column = std::array::from_fn(|row| term.column[row]);
            for (row, rate) in rates(block, &column).into_iter().enumerate() {
                map.tried[(first + row, k)] = rate;
            }
        }
        let table = size - 3;
        let errors = self.layout.table_position().into_iter();
        for error in errors.chain(self.layout.table_base()) {
            for axis in 0..3 {
                map.states[(table + axis, error + axis)] = 1.0;
            }
        }
        let response = segment.axes.as_deref();
        for axis in 0..3 {
            if let Some(response) = response {
                for (state, k) in self.layout.table_axes() {
                    map.states[(table + axis, state)] = response[(axis, k)];
                }
            }
            for (number, index) in self.layout.tried_of_table() {
                map.tried[(table + axis, number)] = match index.checked_sub(3) {
                    None => f64::from(index == axis),
                    Some(k) => response.map_or(0.0, |response| response[(axis, k)]),
                };
            }
        }
        map
    }

    /// What is known of `g` before.
    fn given<const G: usize>(&self, map: &Map) -> Given<G> {
        let mean = &map.states * &self.x;
        let covariance = &map.states * &self.p * map.states.transpose();
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
        let given = moving.len() - 3;
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
                driven.push((row, given + axis, rate));
                driven.push((row, given + 3 + axis, force));
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
                    driven.push((turn + axis, given + column, t * f64::from(axis == column)));
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

    fn take_in<const M: usize>(&mut self, outcome: &Outcome, map: &Map, moving: &[usize]) {
        for (row, value) in &outcome.measured {
            let [states, tried] = [&map.states, &map.tried].map(|map| combined(row, map));
            self.take_scalar([&states, &tried], *value, 1.0);
        }
        self.mirror();
        let n = self.x.len();
        let mut phi = vec![[0.0; M]; n];
        let mut added = vec![[0.0; M]; map.tried.ncols()];
        for (place, row) in outcome.of_given.iter().enumerate() {
            for (phi, weight) in phi.iter_mut().zip(combined(row, &map.states)) {
                phi[place] = weight;
            }
            for (added, weight) in added.iter_mut().zip(combined(row, &map.tried)) {
                added[place] = weight;
            }
        }
        for axis in 0..3 {
            phi[POSITION + axis][POSITION + axis] += 1.0;
        }
        let noise = std::array::from_fn(|row| {
            std::array::from_fn(|column| outcome.covariance[row][column])
        });
        self.carry::<M>(&phi, moving, &noise, added.into_iter().enumerate());
        for (&state, offset) in moving.iter().zip(&outcome.offset) {
            self.x[state] += offset;
        }
    }
}

/// What a filter of a part alone has done.
pub(super) enum Done<'a, const M: usize, const G: usize> {
    /// It went on over a step, by this of the segment's models.
    Step(usize),
    /// It took in what is observed of three errors from a state on.
    Observed {
        state: usize,
        seen: &'a Seen,
        look: &'a Look<M, G>,
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

/// A row of `g` by state or parameter.
fn combined(row: &[f64], map: &DMatrix<f64>) -> Vec<f64> {
    let columns = map.as_slice().chunks_exact(row.len());
    columns.map(|column| times(row, column)).collect()
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
