//! Propagation of errors at rest, and the inputs of the filter of a part of a dwell.

use nalgebra::DMatrix;

use super::Filter;
use super::columns::Linear;
use super::gain_cache::StepModel;
use super::input_prior::InputPrior;
use super::propagation::{effect_of, of_moving, own};
use crate::calibration::record::Rest;
use crate::calibration::{
    ATTITUDE, Constant, DisturbanceKind, Known, NAVIGATION, POSITION, VELOCITY,
};
use crate::navigation::Block;

/// Number of rates and specific forces that are constant in a dwell.
const CONSTANTS: usize = 6;

/// Map from the errors to the quantities of a filter of a part of a dwell.
pub struct Map {
    pub given: Linear,
    /// Attitude error of the table, East, North and Up.
    pub table: Linear,
}

/// The moving states in `g`, of this number; in a dwell, nothing depends on position.
pub fn begins(moving: usize) -> Vec<usize> {
    let is_position = |place: &usize| (POSITION..POSITION + 3).contains(place);
    (0..moving).filter(|place| !is_position(place)).collect()
}

impl Filter {
    /// The states that move in a dwell: navigation errors, rotation at rest, varying biases.
    pub fn moving(&self) -> Vec<usize> {
        let varying = self.layout.varying_biases.iter().map(|of| of.0);
        self.moving_in_moves().into_iter().chain(varying).collect()
    }

    /// `g`, of this size: the moving states at the start except position, and the rates and specific forces through
    /// which constants drive the attitude and velocity errors.
    ///
    /// Attitude errors are relative to the table, `φ − τ`, as observed by its readings; the effect of Earth rate and
    /// gravity on τ is also constant.
    pub fn map(&self, rest: &Rest, block: &Block, size: usize) -> Map {
        let mut given = self.none(size);
        let table = self.table_map(rest);
        let moving = self.moving();
        for (component, place) in begins(moving.len()).into_iter().enumerate() {
            given.states[(component, moving[place])] = 1.0;
        }
        let first = size - CONSTANTS;
        let drive = |to: &mut DMatrix<f64>, by: usize, column: &[f64; NAVIGATION]| {
            for (k, rate) in rates(block, column).into_iter().enumerate() {
                to[(first + k, by)] = rate;
            }
        };
        for (state, column) in self.driving_columns(block).iter().enumerate() {
            if !moving.contains(&state) {
                drive(&mut given.states, state, column);
            }
        }
        for (k, column) in self.constant_effects(block).enumerate() {
            drive(&mut given.columns, k, &column);
        }
        // What the table's attitude does to `g`.
        let mut shift = DMatrix::zeros(size, 3);
        for axis in 0..3 {
            let itself = |row| f64::from(row == ATTITUDE + axis);
            let change = |row| block.navigation[(row, ATTITUDE + axis)] - itself(row);
            drive(&mut shift, axis, &std::array::from_fn(change));
            shift[(ATTITUDE + axis, axis)] = -1.0;
        }
        given.add(0, &table.combined(&shift));
        Map { given, table }
    }

    /// Attitude error of the table.
    fn table_map(&self, rest: &Rest) -> Linear {
        let mut table = self.none(3);
        let response = rest.axes.as_deref();
        for axis in 0..3 {
            if let Some(position) = self.layout.table_position {
                table.states[(axis, position + axis)] = 1.0;
            }
            for (k, constant) in self.layout.constants.iter().enumerate() {
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

    /// Prior of `g`, from its covariance with all states and the knowledge of the constants.
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

    /// Propagation of the moving states in a step of a dwell, with noise and the effect of constants.
    pub fn step_model<const M: usize>(&self, block: &Block) -> StepModel<M> {
        // The last states are varying biases, which drive navigation errors as those that are constant do.
        let first = M - self.varying.len();
        let navigation = block.navigation.column_iter();
        let navigation = navigation.map(|column| std::array::from_fn(|row| column[row]));
        let turn = std::iter::repeat_n([0.0; NAVIGATION], first - NAVIGATION);
        let varying = self.layout.varying_biases.iter();
        let varying = varying.map(|&(_, sensor, constant)| effect_of(block, sensor, constant));
        let columns: Vec<_> = navigation.chain(turn).chain(varying).collect();
        let constants = driven_at_rest(block);
        let of_navigation = self.noise_of(block);
        let (mut transition, mut driven) = (Vec::new(), Vec::new());
        let mut noise = [[0.0; M]; M];
        for row in 0..first {
            for (k, column) in columns.iter().enumerate() {
                let itself = f64::from(row >= NAVIGATION && k == row);
                transition.push((row, k, of_moving(column, row, k) + itself));
            }
            for (k, column) in constants.iter().enumerate() {
                driven.push((row, M - 3 + k, column[own(row)]));
            }
            for (column, noise) in noise[row].iter_mut().enumerate().take(first) {
                let of_block = (&of_navigation, block.duration);
                *noise = self.noise_of_moving(of_block, row, column);
            }
        }
        for (k, &(state, sigma, correlation_time)) in self.varying.iter().enumerate() {
            let (place, keep) = (first + k, (-block.duration / correlation_time).exp());
            transition.push((place, place, keep));
            noise[place][place] = sigma.powi(2) * self.weight_of(state) * (1.0 - keep * keep);
        }
        transition.retain(|&(.., phi)| phi != 0.0);
        driven.retain(|&(.., by)| by != 0.0);
        StepModel {
            noise,
            transition,
            driven,
        }
    }
}

/// Effect of three constant rates and three specific forces on the navigation errors at rest.
fn driven_at_rest(block: &Block) -> [[f64; NAVIGATION]; CONSTANTS] {
    let t = block.duration;
    std::array::from_fn(|constant| {
        let (axis, is_rate) = (constant % 3, constant < 3);
        std::array::from_fn(|row| {
            // A rate tilts evenly while force acts on the tilt.
            let tilting = block.navigation[(VELOCITY + row % 3, axis)];
            let here = f64::from(row % 3 == axis);
            match (row / 3, is_rate) {
                (0, true) => t * here,
                (0, false) => 0.0,
                (1, true) => 0.5 * t * tilting,
                (1, false) => t * here,
                (_, true) => t * t / 6.0 * tilting,
                (_, false) => 0.5 * t * t * here,
            }
        })
    })
}

/// Rate in rad/s and specific force in m/s² that have this effect on a block at rest.
fn rates(block: &Block, column: &[f64; NAVIGATION]) -> [f64; CONSTANTS] {
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
