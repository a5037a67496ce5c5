//! Prior knowledge of an instrument.

use super::triad::INSTALLATION;
use super::{
    BodyFrame, InstallationForm, MotionNoise, Noise, Nominal, PerSensor, Prior, Term, TermVector,
    Triad, TriadVector,
};

/// An instrument, described by the knowledge from its data sheet and from experience.
#[derive(Debug, Clone, PartialEq)]
pub struct Instrument {
    /// Nominal scale of each triad: the file's quantity per second for one rad/s or m/s².
    pub nominal: PerSensor<Nominal>,
    /// The file's quantity, such as `count`.
    pub unit: PerSensor<String>,
    /// Prior of each triad.
    pub prior: PerSensor<Prior>,
    /// Noise of each triad.
    pub noise: PerSensor<Noise>,
    /// Whether the white noise is stated; if not, it is estimated from the quieter part of the recording.
    pub noise_is_stated: PerSensor<bool>,
    /// Noise added during moves.
    pub motion_noise: PerSensor<MotionNoise>,
    /// Prior 1σ of each parameter of an error term, whose prior mean is zero; 0 if the term is off.
    pub term_sigma: TermVector,
    /// Error terms that are stated to be absent.
    pub absent_terms: Vec<Term>,
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
            noise_is_stated: PerSensor::from_fn(|_| true),
            motion_noise: PerSensor::default(),
            term_sigma: TermVector::zeros(),
            absent_terms: Vec::new(),
        }
    }

    /// Prior mean of both triads.
    pub fn prior_mean(&self, form: InstallationForm) -> PerSensor<Triad> {
        PerSensor::from_fn(|sensor| self.prior.get(sensor).mean(form))
    }

    /// 1σ of each parameter before calibration; zero if the form lacks the parameter or the body frame fixes it.
    ///
    /// [`Prior`] refers to the mounting face. The accelerometer frame is rotated relative to the mounting face by the
    /// accelerometers' angles above the diagonal. Each of these angles is added to the angle across the diagonal and to
    /// the gyros' angles for the same pair of axes, so the variances add up (first order in the angles; the correlation
    /// of these sums is neglected).
    pub fn prior_sigma(
        &self,
        form: InstallationForm,
        body_frame: BodyFrame,
    ) -> PerSensor<TriadVector> {
        let mut sigma = PerSensor::from_fn(|sensor| self.prior.get(sensor).sigma(form));
        if body_frame == BodyFrame::Table {
            return sigma;
        }
        let of_accel = self.prior.accel.installation_sigma;
        for (angle, &(row, column)) in form.angle_names().iter().enumerate() {
            let turned = of_accel[row.min(column)];
            let above = column > row;
            for (of_triad, held) in [(&mut sigma.gyro, false), (&mut sigma.accel, above)] {
                let own = &mut of_triad[INSTALLATION + angle];
                *own = if held { 0.0 } else { own.hypot(turned) };
            }
        }
        sigma
    }
}
