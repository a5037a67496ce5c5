//! Effect of states and constants on the navigation errors over a block.

use nalgebra::{DMatrix, SMatrix};

use super::states::{ATTITUDE, NAVIGATION, States, VELOCITY};
use crate::calibration::several::day_to_day::{OwnState, Turned};
use crate::calibration::{Constant, ParameterVector, parameter, sensor_and_parameter};
use crate::imu::{PARAMETERS as PER_TRIAD, Sensor};
use crate::magnetic::MagneticVector;
use crate::navigation::{Block, ErrorVector};

/// Number of rates and specific forces that are constant in a part of a dwell.
pub const CONSTANTS: usize = 6;

/// The states and constants of a problem, and the mounting of the instrument in a recording.
pub struct Dynamics<'a> {
    pub states: &'a States,
    pub constants: &'a [Constant],
    /// Effect of the mounting of the recording on the parameters, if any.
    pub turned: Option<Turned>,
    /// The magnetometer, if it is observed.
    pub magnetic: Option<MagneticVector>,
}

impl Dynamics<'_> {
    /// Navigation errors at the end of a block for a unit value of each state at its beginning, one column per state.
    pub fn by_states(&self, block: &Block) -> DMatrix<f64> {
        let mut by = DMatrix::zeros(NAVIGATION, self.states.count);
        by.columns_mut(0, NAVIGATION)
            .copy_from(block.navigation.as_ref());
        for sensor in Sensor::ALL {
            let first = *self.states.biases.get(sensor);
            let biases = block
                .parameters
                .get(sensor)
                .fixed_columns::<3>(PER_TRIAD - 3);
            by.fixed_columns_mut::<3>(first).copy_from(&biases);
        }
        if let Some(first) = self.states.earth_rate {
            (0..3).for_each(|axis| by.set_column(first + axis, &of_earth_rate(block, axis)));
        }
        if let Some(state) = self.states.gravity {
            by.set_column(state, &block.gravity);
        }
        for &(state, own) in &self.states.own {
            let column = match own {
                OwnState::Parameter(index) => self.effect(block, Constant::Parameter(index)),
                OwnState::Mounting(axis) => {
                    let turned = self.turned.as_ref();
                    turned.map_or_else(ErrorVector::zeros, |turned| {
                        of_parameters(block, &turned.by_mounting.column(axis).into_owned())
                    })
                }
            };
            by.set_column(state, &column);
        }
        by
    }

    /// Navigation errors at the end of a block for a unit value of each constant, one column per constant.
    pub fn by_constants(&self, block: &Block) -> DMatrix<f64> {
        let mut by = DMatrix::zeros(NAVIGATION, self.constants.len());
        for (k, &constant) in self.constants.iter().enumerate() {
            by.set_column(k, &self.effect(block, constant));
        }
        by
    }

    fn effect(&self, block: &Block, constant: Constant) -> ErrorVector {
        match constant {
            Constant::Parameter(index) => match &self.turned {
                Some(turned) => {
                    of_parameters(block, &turned.by_parameters.column(index).into_owned())
                }
                None => {
                    let (sensor, parameter) = sensor_and_parameter(index);
                    block.parameters.get(sensor).column(parameter).into_owned()
                }
            },
            Constant::Term(index) => {
                let term = block.terms.iter().find(|term| term.parameter == index);
                term.map_or_else(ErrorVector::zeros, |term| term.column)
            }
            Constant::Thermal(coefficient) => {
                let weight = block.thermal.as_ref();
                let weight = weight.map_or(0.0, |state| coefficient.weight(state));
                let columns = block.parameters.get(coefficient.sensor);
                columns.column(coefficient.parameter) * weight
            }
            Constant::Gravity => block.gravity,
            Constant::EarthRate(axis) => of_earth_rate(block, axis),
            Constant::Base(_) | Constant::Axis(_) | Constant::Magnetic(_) => ErrorVector::zeros(),
        }
    }
}

/// Rates in rad/s and specific forces in m/s² that have the same effect on a block at rest as a navigation error at its
/// end.
pub fn rates(block: &Block) -> SMatrix<f64, CONSTANTS, NAVIGATION> {
    let t = block.duration;
    let mut rates = SMatrix::<f64, CONSTANTS, NAVIGATION>::zeros();
    for axis in 0..3 {
        rates[(axis, ATTITUDE + axis)] = 1.0 / t;
        rates[(3 + axis, VELOCITY + axis)] = 1.0 / t;
        for tilt in 0..3 {
            // A constant rate increases the tilt linearly, and specific force acts on this tilt.
            let of_tilt = block.navigation[(VELOCITY + axis, ATTITUDE + tilt)];
            rates[(3 + axis, ATTITUDE + tilt)] = -0.5 * of_tilt / t;
        }
    }
    rates
}

/// Navigation errors at the end of a block at rest, for unit rates and specific forces.
pub fn driven_at_rest(block: &Block) -> SMatrix<f64, NAVIGATION, CONSTANTS> {
    let t = block.duration;
    SMatrix::from_fn(|row, constant| {
        let (axis, is_rate) = (constant % 3, constant < 3);
        let tilting = block.navigation[(VELOCITY + row % 3, axis)];
        let here = f64::from(row % 3 == axis);
        match (row / 3, is_rate) {
            (0, true) | (1, false) => t * here,
            (0, false) => 0.0,
            (1, true) => 0.5 * t * tilting,
            (_, true) => t * t / 6.0 * tilting,
            (_, false) => 0.5 * t * t * here,
        }
    })
}

/// Effect of a change of Earth rate along East, North or Up.
fn of_earth_rate(block: &Block, axis: usize) -> ErrorVector {
    let mut column = ErrorVector::zeros();
    column[ATTITUDE + axis] = -block.duration;
    for row in VELOCITY..VELOCITY + 3 {
        column[row] = -0.5 * block.duration * block.navigation[(row, ATTITUDE + axis)];
    }
    column
}

/// Effect of a change of the parameters of both triads.
fn of_parameters(block: &Block, change: &ParameterVector) -> ErrorVector {
    let of = |sensor: Sensor| {
        let change = change.fixed_rows::<PER_TRIAD>(parameter(sensor, 0));
        block.parameters.get(sensor) * change
    };
    of(Sensor::Gyro) + of(Sensor::Accel)
}
