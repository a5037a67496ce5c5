//! Quantities that are given to a part of a dwell, and the states that result from them.

use nalgebra::DMatrix;

use super::rows::Rows;
use super::transition::Transition;
use crate::calibration::Constant;
use crate::calibration::chain::dynamics::{Dynamics, rates};
use crate::calibration::chain::part::{Part, begins};
use crate::calibration::chain::states::{ATTITUDE, POSITION};
use crate::calibration::record::Rest;
use crate::navigation::Block;

/// The quantities given to a part, as linear functions of states and constants: first the states that change within the
/// part, at its beginning and without position, then rates and forces.
#[derive(Debug, Clone)]
pub struct Given {
    pub states: DMatrix<f64>,
    pub constants: DMatrix<f64>,
    /// Attitude error of the table.
    table_states: DMatrix<f64>,
    table_constants: DMatrix<f64>,
}

impl Given {
    /// Attitude errors are relative to the table, `φ − τ`, as its readings observe them; the effect of Earth rate and
    /// gravity on τ is constant too.
    pub fn new(dynamics: &Dynamics, rest: &Rest, block: &Block, size: usize) -> Self {
        let (states, constants) = (dynamics.states, dynamics.constants);
        let first = size - 6;
        let mut given = Self {
            states: DMatrix::zeros(size, states.count),
            constants: DMatrix::zeros(size, constants.len()),
            table_states: DMatrix::zeros(3, states.count),
            table_constants: DMatrix::zeros(3, constants.len()),
        };
        for (place, state) in begins(states.moving).into_iter().enumerate() {
            given.states[(place, state)] = 1.0;
        }
        let rates = rates(block);
        let mut by_states = dynamics.by_states(block);
        by_states.columns_mut(0, states.moving).fill(0.0);
        given
            .states
            .rows_mut(first, 6)
            .copy_from(&(rates * by_states));
        let by_constants = rates * dynamics.by_constants(block);
        given.constants.rows_mut(first, 6).copy_from(&by_constants);
        given.set_table(dynamics, rest);
        let mut shift = DMatrix::zeros(size, 3);
        let mut change = block.navigation.fixed_columns::<3>(ATTITUDE).into_owned();
        for axis in 0..3 {
            change[(ATTITUDE + axis, axis)] -= 1.0;
            shift[(ATTITUDE + axis, axis)] = -1.0;
        }
        shift.rows_mut(first, 6).copy_from(&(rates * change));
        given.states += &shift * &given.table_states;
        given.constants += &shift * &given.table_constants;
        given
    }

    fn set_table(&mut self, dynamics: &Dynamics, rest: &Rest) {
        let response = rest.axes.as_deref();
        for axis in 0..3 {
            if let Some(table) = dynamics.states.table {
                self.table_states[(axis, table + axis)] = 1.0;
            }
            if let Some([mount, base]) = dynamics.states.slips {
                let row = rest.begin.attitude.fixed_view::<1, 3>(axis, 0).into_owned();
                self.table_states
                    .fixed_view_mut::<1, 3>(axis, mount)
                    .copy_from(&row);
                self.table_states[(axis, base + axis)] = 1.0;
            }
            for (k, constant) in dynamics.constants.iter().enumerate() {
                self.table_constants[(axis, k)] = match constant {
                    Constant::Base(of) => f64::from(*of == axis),
                    Constant::Axis(of) => response.map_or(0.0, |response| response[(axis, *of)]),
                    _ => 0.0,
                };
            }
        }
    }

    pub fn rows(&self, part: &Part) -> Rows {
        Rows {
            states: &part.measured * &self.states,
            constants: &part.measured * &self.constants,
            values: part.values.clone(),
        }
    }

    /// The states at the end of the part.
    pub fn end(&self, part: &Part, moving: usize, to: &mut Transition) {
        let of_given = part.of_given.rows(0, moving);
        let mut states = of_given * &self.states;
        let mut constants = of_given * &self.constants;
        for axis in 0..3 {
            states[(POSITION + axis, POSITION + axis)] += 1.0;
            let mut row = states.row_mut(ATTITUDE + axis);
            row += self.table_states.row(axis);
            let mut row = constants.row_mut(ATTITUDE + axis);
            row += self.table_constants.row(axis);
        }
        to.states.rows_mut(0, moving).copy_from(&states);
        to.constants.rows_mut(0, moving).copy_from(&constants);
        to.offset
            .rows_mut(0, moving)
            .copy_from(&part.offset.rows(0, moving));
        let mut covariance = to.covariance.view_mut((0, 0), (moving, moving));
        covariance.copy_from(&part.covariance.view((0, 0), (moving, moving)));
    }
}
