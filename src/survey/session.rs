//! A calibration in progress that uses samples in memory.

use nalgebra::Vector3;

use super::{Evaluator, Status};
use crate::calibration::{Options, UNWATCHED};
use crate::earth::Site;
use crate::imu::Instrument;
use crate::lot::Specification;
use crate::recording::{Recording, SampleError};
use crate::run::Run;

/// Interval between evaluations, s.
const EVERY: f64 = 1.0;

/// A calibration in progress, whose samples are pushed as they arrive. The session has no thread of its own.
///
/// Rates are in rad/s and specific forces in m/s², along right-front-up body axes, one sample per period.
#[derive(Debug, Clone)]
pub struct Session {
    instrument: Instrument,
    site: Site,
    period: f64,
    evaluator: Evaluator,
    gyro: Vec<Vector3<f64>>,
    accel: Vec<Vector3<f64>>,
    evaluated: usize,
}

impl Session {
    /// A session without samples, for an instrument with this sample period in s.
    pub fn new(instrument: Instrument, site: Site, period: f64) -> Self {
        Self {
            instrument,
            site,
            period,
            evaluator: Evaluator::default(),
            gyro: Vec::new(),
            accel: Vec::new(),
            evaluated: 0,
        }
    }

    /// Sets the limits that the calibration must decide.
    pub fn to_decide(self, specification: Specification) -> Self {
        Self {
            evaluator: Evaluator::new(Options::default(), Some(specification)),
            ..self
        }
    }

    /// Adds samples; returns `None` until another second of samples has arrived. An evaluation takes some tens of
    /// milliseconds, and as long as a calibration once the specification seems to be met.
    ///
    /// # Errors
    /// Returns [`SampleError`] if a number is not finite, the triads differ in length, or the period is not positive.
    /// If there is an error, the samples are not added.
    pub fn push(
        &mut self,
        gyro: &[Vector3<f64>],
        accel: &[Vector3<f64>],
    ) -> Result<Option<Status>, SampleError> {
        if gyro.is_empty() && accel.is_empty() {
            return Ok(None);
        }
        Recording::from_samples("", 0.0, self.period, gyro.to_vec(), accel.to_vec())?;
        let integral = |of: &Vector3<f64>| of * self.period;
        self.gyro.extend(gyro.iter().map(integral));
        self.accel.extend(accel.iter().map(integral));
        let new = (self.gyro.len() - self.evaluated) as f64 * self.period;
        (new >= EVERY).then(|| self.status()).transpose()
    }

    /// The state with all samples so far.
    ///
    /// # Errors
    /// Returns [`SampleError`] if there are no samples.
    pub fn status(&mut self) -> Result<Status, SampleError> {
        self.evaluated = self.gyro.len();
        let run = self.run()?;
        Ok(self.evaluator.status(&run, UNWATCHED))
    }

    /// The run of all samples so far, ready for calibration.
    ///
    /// # Errors
    /// Returns [`SampleError`] if there are no samples.
    pub fn run(&self) -> Result<Run, SampleError> {
        let (gyro, accel) = (self.gyro.clone(), self.accel.clone());
        let recording = Recording::from_samples("session", 0.0, self.period, gyro, accel)?;
        Ok(Run::new(recording, self.instrument.clone(), self.site))
    }
}
