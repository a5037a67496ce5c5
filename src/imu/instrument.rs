//! What is known of an instrument before it is calibrated.

use super::{InstallationForm, MotionNoise, Noise, Nominal, PerSensor, Prior, TermVector, Triad};

/// An instrument as data sheet and experience describe it.
#[derive(Debug, Clone, PartialEq)]
pub struct Instrument {
    /// Nominal scale of each triad: the file's quantity per second for one rad/s or m/s².
    pub nominal: PerSensor<Nominal>,
    /// The file's quantity, such as `count`.
    pub unit: PerSensor<String>,
    /// Knowledge of each triad before calibration.
    pub prior: PerSensor<Prior>,
    /// Noise of each triad.
    pub noise: PerSensor<Noise>,
    /// What moves add to it.
    pub motion_noise: PerSensor<MotionNoise>,
    /// 1σ of each parameter of the error terms before calibration, around zero; zero where a term is
    /// off.
    pub term_sigma: TermVector,
}

impl Instrument {
    /// An instrument whose outputs are rad/s and m/s², without error terms.
    pub fn new(prior: PerSensor<Prior>, noise: PerSensor<Noise>) -> Self {
        Self {
            nominal: PerSensor::from_fn(|_| Nominal(nalgebra::Vector3::repeat(1.0))),
            unit: PerSensor {
                gyro: "rad/s".to_owned(),
                accel: "m/s^2".to_owned(),
            },
            prior,
            noise,
            motion_noise: PerSensor::default(),
            term_sigma: TermVector::zeros(),
        }
    }

    /// Both triads as the prior has them.
    pub fn prior_mean(&self, form: InstallationForm) -> PerSensor<Triad> {
        PerSensor::from_fn(|sensor| self.prior.get(sensor).mean(form))
    }
}
