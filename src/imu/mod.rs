//! The model of the instrument: the output of a triad of gyros or accelerometers as a function of its input.
//!
//! `N = K C u + D` (Zhao, Jiang, Li 2016, Eq. 6; in the second line of the printed Eq. 6, `N_g` means the
//! accelerometer). `u` is the angular rate in rad/s or the specific force in m/s² along the body axes, `K` diagonal,
//! `C` the misalignment matrix, `N` the output per second. Inside the crate `N` is divided by the nominal scale of its
//! axis, so that `K ≈ 1` and `D` is in rad/s or m/s²; [`Nominal`] converts back on input and output.

mod axis_order;
mod body_frame;
mod installation;
mod instrument;
mod noise_keys;
mod rounding;
mod signal;
mod terms;
mod thermal;
mod triad;

pub use axis_order::AxisOrder;
pub use body_frame::BodyFrame;
pub use installation::{ANGLES, InstallationForm};
pub use instrument::Instrument;
pub use noise_keys::NoiseKeys;
pub use rounding::rounding_error;
pub use signal::{GaussMarkov, MotionNoise, Noise, NoiseSource, Output, Pulses};
pub use terms::{
    REFERENCE_RATE, Sensed, TERM_PARAMETERS, Term, TermEntry, TermResponse, TermVector,
};
pub use thermal::{
    HIGHEST_ORDER, RATE, THERMAL_FUNCTIONS, ThermalCoefficients, ThermalModel, ThermalRange,
    ThermalState, ThermalValues, powers, thermal_state, thermal_state_everywhere,
};
pub use triad::{Nominal, PARAMETERS, ParameterKind, Prior, Triad, TriadVector};
pub use turncal_input::{PerSensor, Sensor};

/// Names of the body axes, in order.
pub const AXES: [char; 3] = ['x', 'y', 'z'];
