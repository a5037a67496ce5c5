//! The parameters of both triads as one vector: first the gyros, then the accelerometers, each in the order of
//! [`crate::imu::TriadVector`]. Parameter errors δθ are true − estimated.

pub mod auxiliary;
pub mod error_term;
pub mod group;

use nalgebra::{SMatrix, SVector};

use crate::imu::{
    InstallationForm, Nominal, PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad, TriadVector,
};

/// Number of parameters of both triads.
pub const PARAMETERS: usize = 2 * PER_TRIAD;

/// A vector of the parameters of both triads.
pub type ParameterVector = SVector<f64, PARAMETERS>;
/// A matrix of the parameters of both triads.
pub type ParameterMatrix = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// Converts the index of a parameter of one triad to its index among the parameters of both triads.
pub fn parameter(sensor: Sensor, of_triad: usize) -> usize {
    match sensor {
        Sensor::Gyro => of_triad,
        Sensor::Accel => PER_TRIAD + of_triad,
    }
}

/// The triad, and the index within the triad, of a parameter of both triads.
pub fn sensor_and_parameter(index: usize) -> (Sensor, usize) {
    if index < PER_TRIAD {
        (Sensor::Gyro, index)
    } else {
        (Sensor::Accel, index - PER_TRIAD)
    }
}

/// Values of the parameters of each triad as one vector.
pub fn stacked(each: &PerSensor<TriadVector>) -> ParameterVector {
    ParameterVector::from_iterator(each.gyro.iter().chain(&each.accel).copied())
}

/// The parameters of both triads as one vector.
pub fn to_vector(triads: &PerSensor<Triad>) -> ParameterVector {
    stacked(&PerSensor::from_fn(|sensor| triads.get(sensor).to_vector()))
}

/// Both triads from one vector of parameters.
pub fn from_vector(form: InstallationForm, v: &ParameterVector) -> PerSensor<Triad> {
    PerSensor::from_fn(|sensor| {
        Triad::from_vector(
            form,
            &v.fixed_rows::<PER_TRIAD>(parameter(sensor, 0)).into_owned(),
        )
    })
}

/// The name of a parameter in files; `None` if the form does not have it.
pub fn parameter_name(form: InstallationForm, index: usize) -> Option<String> {
    let (sensor, of_triad) = sensor_and_parameter(index);
    Triad::parameter_name(sensor, form, of_triad)
}

/// The index of a parameter by its name in files; `None` if the form does not have it.
pub fn parameter_index(form: InstallationForm, name: &str) -> Option<usize> {
    (0..PARAMETERS).find(|&index| parameter_name(form, index).as_deref() == Some(name))
}

/// The factor that converts a normalised parameter to the file's quantity, from the nominal scales.
pub fn factor(nominal: &PerSensor<Nominal>, index: usize) -> f64 {
    let (sensor, of_triad) = sensor_and_parameter(index);
    nominal.get(sensor).factor(of_triad)
}

/// A parameter counts as observed if less than this fraction of its prior σ remains.
pub const OBSERVED_BELOW: f64 = 0.5;

/// Both triads in the general form.
pub fn in_general_form(triads: &PerSensor<Triad>) -> PerSensor<Triad> {
    PerSensor::from_fn(|sensor| triads.get(sensor).in_form(InstallationForm::General))
}

/// Derivatives of a smooth function with arguments of order one, by central differences of sixth order; truncation and
/// rounding errors are both about 1e-14.
pub fn derivatives<const M: usize, const N: usize>(
    at: &SVector<f64, N>,
    of: impl Fn(&SVector<f64, N>) -> SVector<f64, M>,
) -> SMatrix<f64, M, N> {
    const STEP: f64 = 1e-2;
    const WEIGHTS: [f64; 3] = [45.0, -9.0, 1.0];
    let column = |k: usize| {
        let moved = |by: f64| {
            of(&SVector::from_fn(|i, _| {
                at[i] + if i == k { by } else { 0.0 }
            }))
        };
        let differences = WEIGHTS.iter().zip([1.0, 2.0, 3.0]);
        let weighted = differences
            .map(|(weight, steps)| (moved(steps * STEP) - moved(-steps * STEP)) * *weight);
        weighted.sum::<SVector<f64, M>>() / (60.0 * STEP)
    };
    SMatrix::from_columns(&std::array::from_fn::<_, N, _>(column))
}
/// Values and 1σ of the parameters before a recording.
#[derive(Debug, Clone, Copy)]
pub struct Before<'a> {
    pub mean: &'a ParameterVector,
    pub sigma: &'a ParameterVector,
}
