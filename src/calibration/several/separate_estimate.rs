//! What each of several recordings says alone.

use nalgebra::Matrix3;

use crate::calibration::estimate::Estimate;
use crate::calibration::linearisation::AttitudePrior;
use crate::calibration::parameters::ParameterVector;
use crate::imu::{PerSensor, ThermalState};

/// What a recording alone says.
#[derive(Debug, Clone)]
pub struct SeparateEstimate {
    /// Its name.
    pub name: String,
    /// Mean temperature of each axis, °C, and its rate, K/s, over its dwells; none where it is not known.
    pub temperature: Option<PerSensor<[f64; 3]>>,
    /// The span of its temperatures, K.
    pub span: f64,
    /// Calibration at that temperature, with the noise that is stated or, where it may be learnt and has to be, with
    /// that of its own; none where it gave none.
    pub estimate: Option<Estimate>,
    /// Where its temperature stands for all of it: the functions of temperature then.
    pub(in crate::calibration) state: Option<ThermalState>,
    pub(in crate::calibration) start: ParameterVector,
    pub(in crate::calibration) priors: Vec<AttitudePrior>,
    pub(in crate::calibration) initial_attitudes: Vec<Matrix3<f64>>,
}

impl SeparateEstimate {
    /// Mean temperature of all axes over its dwells, °C.
    pub fn mean_temperature(&self) -> Option<f64> {
        let PerSensor { gyro, accel } = self.temperature?;
        Some(gyro.iter().chain(&accel).sum::<f64>() / 6.0)
    }
}
