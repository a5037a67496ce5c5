//! The state vector of the filter: where each block lives. No other file knows an index.
//!
//! | block | size | meaning |
//! |---|---|---|
//! | attitude | 3 | φ, `C_computed = (I − [φ×]) C_true`, East-North-Up, rad |
//! | velocity | 3 | δV = computed − true, East-North-Up, m/s |
//! | position | 3 | δp = computed − true, East-North-Up, m |
//! | gyro | 12 | δθ = true − estimated, see [`crate::imu::TriadVector`] |
//! | accel | 12 | the same for the accelerometers |
//! | table | 3 | τ, error of the current table position, `C_table = (I − [τ×]) C_true`, rad |
//! | initial attitude | 3 | φ at the first sample, kept as constants, rad |
//! | drift | 6 | what the biases of gyros, then accelerometers, are off D now, rad/s and m/s²; only where noise figures state an instability |
//! | base | 3 | ε, error of the table's level and north, `C_table = (I − [ε×]) C_true`, rad; only where the run states σ of them |
//! | axes | 4 | tilts of the table's axes across themselves, see [`crate::run::TableRecord`], rad |
//! | further terms | 22 | true − estimated, see [`crate::imu::Term`]; only where one is on |

use nalgebra::{SMatrix, SVector};

use crate::imu::{FURTHER, PARAMETERS as PER_TRIAD, Sensor};
use crate::run::AXIS_TILTS;

/// Attitude error φ.
pub const ATTITUDE: usize = 0;
/// Velocity error δV.
pub const VELOCITY: usize = 3;
/// Position error δp.
pub const POSITION: usize = 6;
/// Number of navigation states, the only ones that move.
pub const NAVIGATION: usize = 9;
/// First parameter state.
pub const PARAMETER: usize = NAVIGATION;
/// Number of parameter states of both triads.
pub const PARAMETERS: usize = 2 * PER_TRIAD;
/// Error of the current table position τ.
pub const TABLE: usize = PARAMETER + PARAMETERS;
/// Initial attitude error φ₀.
pub const INITIAL_ATTITUDE: usize = TABLE + 3;
/// Number of states of an instrument whose biases stay and that has no further terms.
pub const STATES: usize = INITIAL_ATTITUDE + 3;
/// Wandering of the biases of both triads.
pub const DRIFT: usize = STATES;
/// Number of states with those of wandering biases.
pub const STATES_WITH_DRIFT: usize = DRIFT + 6;
/// Error of the table's base ε.
pub const BASE: usize = STATES_WITH_DRIFT;
/// Tilts of the table's axes.
pub const AXES: usize = BASE + 3;
/// Number of states with those of the table's own errors.
pub const STATES_WITH_TABLE: usize = AXES + AXIS_TILTS;
/// First parameter of further terms.
pub const FURTHER_PARAMETER: usize = STATES_WITH_TABLE;
/// Number of states with those of further terms.
pub const ALL_STATES: usize = FURTHER_PARAMETER + FURTHER;

/// A vector of the parameters of both triads.
pub type ParameterVector = SVector<f64, PARAMETERS>;
/// A matrix of the parameters of both triads.
pub type ParameterMatrix = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// Index of a triad's parameter among the parameters of both.
pub fn parameter(sensor: Sensor, of_triad: usize) -> usize {
    match sensor {
        Sensor::Gyro => of_triad,
        Sensor::Accel => PER_TRIAD + of_triad,
    }
}

/// The triad and the parameter of it at an index among the parameters of both.
pub fn sensor_and_parameter(index: usize) -> (Sensor, usize) {
    if index < PER_TRIAD {
        (Sensor::Gyro, index)
    } else {
        (Sensor::Accel, index - PER_TRIAD)
    }
}
