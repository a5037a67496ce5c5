//! How errors go on at rest, and what a filter of a part of a dwell is given.

use nalgebra::DMatrix;

use super::Filter;
use super::gain_cache::StepModel;
use super::input_prior::InputPrior;
use super::linear::Linear;
use crate::calibration::constants::{Constant, DisturbanceKind, Known};
use crate::calibration::layout::{ATTITUDE, NAVIGATION, POSITION, VELOCITY};
use crate::calibration::record::segment::Segment;
use crate::navigation::Block;

/// Rates and specific forces that are constant in a dwell.
const CONSTANTS: usize = 6;

/// How the errors make what a filter of a part of a dwell is about.
pub struct Map {
    pub given: Linear,
    /// By how much the attitude of the table is off, East, North and Up.
    pub table: Linear,
}

impl Filter {
    /// The states that move in a dwell: navigation errors, the turn at rest, varying biases.
    pub fn moving(&self) -> Vec<usize> {
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
    pub fn map(&self, segment: &Segment, block: &Block, moving: &[usize], size: usize) -> Map {
        let mut given = self.none(size);
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
        for (k, column) in self.constant_effects(block).enumerate() {
            for (row, rate) in rates(block, &column).into_iter().enumerate() {
                given.columns[(first + row, k)] = rate;
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
        let mut table = self.none(3);
        let response = segment.axes.as_deref();
        for axis in 0..3 {
            if let Some(position) = self.layout.table_position() {
                table.states[(axis, position + axis)] = 1.0;
            }
            for (k, constant) in self.layout.constants().iter().enumerate() {
                table.columns[(axis, k)] = match constant {
                    Constant::Base(of) => f64::from(*of == axis),
                    Constant::Axis(of) => response.map_or(0.0, |response| response[(axis, *of)]),
                    Constant::Disturbance(of, component) => {
                        let is_position = of.kind == DisturbanceKind::Position;
                        f64::from(is_position && self.is_in(of.dwell) && *component == axis)
                    }
                    _ => 0.0,
                };
            }
        }
        table
    }

    /// What is known of `g` before, given its covariance with all states and what is known of the constants.
    pub fn given<const G: usize>(
        &self,
        rows: &Linear,
        across: &DMatrix<f64>,
        known: &Known,
    ) -> InputPrior<G> {
        let by_constants = &rows.states * self.columns.of_states.transpose() + &rows.columns;
        let (of_constants, root) = known.through(&by_constants);
        let mean = &rows.states * &self.x + of_constants;
        let covariance = across * rows.states.transpose() + &root * root.transpose();
        InputPrior::new(
            std::array::from_fn(|i| mean[i]),
            std::array::from_fn(|i| std::array::from_fn(|j| covariance[(i, j)])),
        )
    }

    /// How the states that move go on in a step of a dwell, and what noise and constants add to them.
    pub fn step_model<const M: usize>(&self, block: &Block, moving: &[usize]) -> StepModel<M> {
        let mut model = StepModel {
            transition: Vec::new(),
            driven: Vec::new(),
            noise: [[0.0; M]; M],
        };
        at_rest(block, moving.len() - 3, &mut model);
        self.biases_vary(block, &mut model);
        let turn = self.layout.turn_at_rest().map(|_| NAVIGATION);
        if let Some(turn) = turn {
            turns(block, (turn, moving.len() - 3), &mut model);
        }
        let of_navigation = self.noise_of(block);
        let own = |place: usize| match turn {
            Some(turn) if (turn..turn + 3).contains(&place) => Some(ATTITUDE + place - turn),
            _ => (place < NAVIGATION).then_some(place),
        };
        for (row, of_row) in model.noise.iter_mut().enumerate() {
            for (column, noise) in of_row.iter_mut().enumerate() {
                if let (Some(i), Some(j)) = (own(row), own(column)) {
                    *noise = of_navigation[(i, j)];
                }
                if row == column && row >= NAVIGATION && own(row).is_some() {
                    *noise += self.rotation_at_rest.powi(2) * block.duration;
                }
            }
        }
        model.transition.retain(|&(.., phi)| phi != 0.0);
        model.driven.retain(|&(.., by)| by != 0.0);
        model
    }

    /// Varying biases, the last states that move, drive navigation errors as those that are constant do.
    fn biases_vary<const M: usize>(&self, block: &Block, model: &mut StepModel<M>) {
        let first = M - self.varying.len();
        for (k, (_, sensor, constant)) in self.layout.varying_biases().enumerate() {
            let column = block.parameters.get(sensor).column(constant);
            for row in 0..NAVIGATION {
                model.transition.push((row, first + k, column[row]));
            }
            let (state, sigma, correlation_time) = self.varying[k];
            let keep = (-block.duration / correlation_time).exp();
            model.transition.push((first + k, first + k, keep));
            let driven = sigma.powi(2) * self.weight_of(state);
            model.noise[first + k][first + k] = driven * (1.0 - keep * keep);
        }
    }
}

/// Navigation errors at rest, driven by constant rates and specific forces, of which the first has this place in `g`.
fn at_rest<const M: usize>(block: &Block, constants: usize, model: &mut StepModel<M>) {
    let t = block.duration;
    for row in 0..NAVIGATION {
        for column in 0..NAVIGATION {
            let phi = block.navigation[(row, column)];
            model.transition.push((row, column, phi));
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
            model.driven.push((row, constants + axis, rate));
            model.driven.push((row, constants + 3 + axis, force));
        }
    }
}

/// The turn at rest becomes more by as much as the attitude error does.
fn turns<const M: usize>(
    block: &Block,
    (turn, constants): (usize, usize),
    model: &mut StepModel<M>,
) {
    for axis in 0..3 {
        let of_attitude: Vec<_> = model
            .transition
            .iter()
            .filter(|&&(row, ..)| row == ATTITUDE + axis)
            .map(|&(row, column, phi)| (turn + axis, column, phi - f64::from(column == row)))
            .collect();
        model.transition.extend(of_attitude);
        model.transition.push((turn + axis, turn + axis, 1.0));
        model
            .driven
            .push((turn + axis, constants + axis, block.duration));
    }
}

/// Which component of `g` each moving state is when a part begins, if any.
pub fn begins<const M: usize>(moving: &[usize]) -> [Option<usize>; M] {
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
