//! Application of a calibration: from outputs to angular rate and specific force.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};
use thiserror::Error;

use crate::calibration::result::Calibration;
use crate::imu::{
    AXES, PerSensor, Sensed, Sensor, TERM_PARAMETERS, Term, TermVector, thermal_state,
};
use crate::recording::{Near, TEMPERATURE_SPACING};
use crate::run::Run;

/// The correction `u = (K C)⁻¹ (N − D) − t(q)` from a calibration file, in the file's quantity per second.
#[derive(Debug, Clone, PartialEq)]
pub struct Correction {
    /// `K C` of each triad: the file's quantity per second for one rad/s or m/s² along the right, front and up axes.
    pub sensitivity: PerSensor<Matrix3<f64>>,
    /// `(K C)⁻¹`.
    pub matrix: PerSensor<Matrix3<f64>>,
    /// `D`, the file's quantity per second.
    pub bias: PerSensor<Vector3<f64>>,
    /// Parameters `q` of the error terms, in SI units; zero if the calibration file has none.
    pub terms: TermVector,
    /// The record, if it depends on temperature.
    changing: Option<Box<Calibration>>,
}

/// One calibrated sample, along the right, front and up axes of the body frame of the calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibrated {
    /// Time at which the sample begins, s.
    pub start: f64,
    /// Time at which the sample ends, s.
    pub end: f64,
    /// Mean angular rate against inertial space, rad/s.
    pub rate: Vector3<f64>,
    /// Mean specific force, m/s².
    pub force: Vector3<f64>,
    /// Whether the temperature of the sample is within the range of the calibration.
    pub in_range: bool,
}

/// Largest ratio between scale factors of an instrument and their nominal values.
const SCALE_FACTOR: f64 = 2.0;

/// Axes that enclose less than this fraction of the volume of a cube do not span the space.
const SMALLEST_VOLUME: f64 = 1e-6;

/// A term changes its own input by at most a hundredth, so three iterations leave a millionth.
const ROUNDS: usize = 3;

/// Errors in applying a calibration.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CorrectionError {
    /// The matrix has no inverse.
    #[error(
        "the sensitivity matrix scale * installation of the {} has no inverse because its axes lie in one plane. \
         Correct scale and installation in the calibration, or calibrate again", .0.name()
    )]
    Singular(Sensor),
    /// Gyros and accelerometers were not calibrated.
    #[error(
        "the calibration has only a magnetometer, but gyros and accelerometers are needed here. Export it as c, text, \
         mat, px4, ardupilot, betaflight, inav or imu-filter-madgwick, or use `turncal apply`"
    )]
    MagnetometerAlone,
    /// A program cannot apply a magnetometer, and there is nothing else to export.
    #[error("the magnetometer cannot be exported: {0}")]
    MagnetometerUnsuitable(String),
    /// An unknown constant.
    #[error(
        "`{0}` in terms is not a parameter of a known error term. Calibrate again with this version, or remove the \
         entry to ignore it"
    )]
    UnknownTerm(String),
    /// The unit of the calibration differs from that of the run.
    #[error(
        "the calibration is for {} output in `{calibration}`, but the run uses `{run}`. Give the calibration of this \
         instrument, or correct {}_unit in run.toml", .sensor.name(), .sensor.name()
    )]
    Unit {
        /// The triad.
        sensor: Sensor,
        /// Unit of the calibration.
        calibration: String,
        /// Unit of the run.
        run: String,
    },
    /// The scale of the calibration differs from that of the run.
    #[error(
        "{} {axis}: the calibration has {calibration:.6e} per {}, but the nominal scale of the run is {run:.6e}. \
         They must have the same sign and agree within a factor of two. Give the calibration of this \
         instrument, or correct scale in [imu.prior.{0}], output or body_axes in run.toml",
        .sensor.name(),
        match .sensor { Sensor::Gyro => "rad/s", Sensor::Accel => "m/s²" }
    )]
    Scale {
        /// The triad.
        sensor: Sensor,
        /// The axis.
        axis: char,
        /// Diagonal of `K C`, in the file's quantity per second.
        calibration: f64,
        /// Nominal scale of the run.
        run: f64,
    },
}

impl Correction {
    /// The correction from a calibration file, without the constants of the table (`table.…`).
    pub fn of_record(record: &Calibration) -> Result<Self, CorrectionError> {
        let sensitivity = PerSensor::from_fn(|sensor| record.triad(sensor).sensitivity());
        let inverse = |sensor: Sensor| {
            let sensitivity = sensitivity.get(sensor);
            let volume = sensitivity.determinant()
                / sensitivity.row_iter().map(|r| r.norm()).product::<f64>();
            let inverse = sensitivity
                .try_inverse()
                .filter(|_| volume.abs() > SMALLEST_VOLUME);
            inverse.ok_or(CorrectionError::Singular(sensor))
        };
        let mut terms = TermVector::zeros();
        for (name, term) in &record.terms {
            if name.starts_with("table.") {
                continue;
            }
            let known = Term::parameter_named(name);
            let known = known.ok_or_else(|| CorrectionError::UnknownTerm(name.clone()))?;
            terms[known] = term.value;
        }
        Ok(Self {
            matrix: PerSensor::try_from_fn(inverse)?,
            bias: PerSensor::from_fn(|sensor| Vector3::from(record.triad(sensor).bias)),
            sensitivity,
            terms,
            changing: record
                .temperature
                .is_some()
                .then(|| Box::new(record.clone())),
        })
    }

    /// The correction, after a check that the calibration belongs to the instrument of the run: units and nominal
    /// scales must agree.
    pub fn for_run(record: &Calibration, run: &Run) -> Result<Self, CorrectionError> {
        let correction = Self::of_record(record)?;
        for sensor in Sensor::ALL {
            let expected = run.instrument.unit.get(sensor);
            let unit = record.unit.as_ref().map(|unit| unit.get(sensor));
            if let Some(unit) = unit.filter(|&unit| unit != expected) {
                return Err(CorrectionError::Unit {
                    sensor,
                    calibration: unit.clone(),
                    run: expected.clone(),
                });
            }
            let scales = correction.sensitivity.get(sensor).diagonal();
            let nominal = &run.instrument.nominal.get(sensor).0;
            let near = 1.0 / SCALE_FACTOR..=SCALE_FACTOR;
            let other = (0..3).find(|&axis| !near.contains(&(scales[axis] / nominal[axis])));
            if let Some(axis) = other {
                return Err(CorrectionError::Scale {
                    sensor,
                    axis: AXES[axis],
                    calibration: scales[axis],
                    run: nominal[axis],
                });
            }
        }
        Ok(correction)
    }

    /// Parameters of error terms that are not zero.
    pub fn terms(&self) -> impl Iterator<Item = usize> + '_ {
        (0..TERM_PARAMETERS).filter(|&k| self.terms[k] != 0.0)
    }

    /// Whether the correction has a parameter of this term.
    pub fn has(&self, term: Term) -> bool {
        self.terms().any(|k| term.parameters().contains(&k))
    }

    /// Calibrates these samples of a run, in sequence.
    ///
    /// Error terms are evaluated with the calibrated sample. The angular acceleration for the size effect is derived
    /// from the rates before and after the sample; it is zero if the recording is not continuous. The correction for
    /// the time offset uses the inertial rate instead of the rate relative to the Earth: with Earth rate, the error is
    /// 0.7 µg for an offset of 10 ms.
    pub fn samples<'a>(
        &'a self,
        run: &'a Run,
        samples: Range<usize>,
    ) -> impl Iterator<Item = Calibrated> + 'a {
        let imu = &run.recording.imu;
        let plain = self.terms().next().is_none();
        let second = |k| ((imu.time(k) - imu.start()) / TEMPERATURE_SPACING) as u64;
        // A calibration that changes with temperature is evaluated once per second, at the first sample of each second.
        let mut now: Option<(u64, Self, bool)> = None;
        let mut near = Near::new(imu);
        samples.map(move |k| {
            near.reach(&(k.saturating_sub(1)..k + 2));
            let this = second(k);
            if self.changing.is_some() && now.as_ref().is_none_or(|(of, ..)| *of != this) {
                let first = (0..k)
                    .rev()
                    .take_while(|&before| second(before) == this)
                    .last();
                let time = imu.time(first.unwrap_or(k)) + 0.5 * TEMPERATURE_SPACING;
                let (here, in_range) = self.at(run, time);
                now = Some((this, here, in_range));
            }
            let (here, in_range) = match &now {
                Some((_, here, in_range)) => (here, *in_range),
                None => (self, true),
            };
            let outputs = PerSensor::from_fn(|sensor| output(sensor, run, &near, k));
            let acceleration = if plain {
                Vector3::zeros()
            } else {
                here.angular_acceleration(run, &near, k)
            };
            let u = here.of_outputs(&outputs, &acceleration);
            Calibrated {
                in_range,
                start: imu.time(k),
                end: imu.time(k + 1),
                rate: u.gyro,
                force: u.accel,
            }
        })
    }

    /// Angular rate and specific force for one sample of outputs, in the file's quantity per second, with a given
    /// angular acceleration in rad/s² (used for size effect and time offset). The temperature dependence is not
    /// applied.
    pub fn of_outputs(
        &self,
        outputs: &PerSensor<Vector3<f64>>,
        angular_acceleration: &Vector3<f64>,
    ) -> PerSensor<Vector3<f64>> {
        let of_triads = PerSensor::from_fn(|sensor| self.of_triad(sensor, outputs.get(sensor)));
        match self.terms().next() {
            None => of_triads,
            Some(_) => self.without_terms(&of_triads, angular_acceleration),
        }
    }

    /// Whether the correction depends on temperature.
    pub fn changes(&self) -> bool {
        self.changing.is_some()
    }

    /// The correction at the temperature of a run at a time in s, and whether it is valid there. Without a temperature,
    /// or if a triad would be singular, the reference temperature is used.
    fn at(&self, run: &Run, time: f64) -> (Self, bool) {
        let temperature = run.recording.imu.temperature.as_ref();
        let known = self
            .changing
            .as_ref()
            .zip(temperature)
            .and_then(|(record, temperature)| {
                let thermal = record.temperature.as_ref()?;
                let (t, rate) = (temperature.at(time), temperature.rate(time));
                let there = record
                    .in_state(&thermal_state(&thermal.range, &t, &rate))
                    .ok()?;
                Some((Self::of_record(&there).ok()?, thermal.holds(&t)))
            });
        known.unwrap_or_else(|| (self.clone(), false))
    }

    /// `(K C)⁻¹ (N − D)`.
    pub fn of_triad(&self, sensor: Sensor, output: &Vector3<f64>) -> Vector3<f64> {
        self.matrix.get(sensor) * (output - self.bias.get(sensor))
    }

    fn angular_acceleration(&self, run: &Run, near: &Near, k: usize) -> Vector3<f64> {
        let first = k.saturating_sub(1);
        let last = (k + 1).min(run.recording.imu.len() - 1);
        if !run.recording.imu.continuous || first == last {
            return Vector3::zeros();
        }
        let rate = |k| self.of_triad(Sensor::Gyro, &output(Sensor::Gyro, run, near, k));
        (rate(last) - rate(first)) / ((last - first) as f64 * run.recording.imu.period)
    }

    fn without_terms(
        &self,
        of_triads: &PerSensor<Vector3<f64>>,
        angular_acceleration: &Vector3<f64>,
    ) -> PerSensor<Vector3<f64>> {
        let mut u = *of_triads;
        for _ in 0..ROUNDS {
            let sensed = Sensed {
                rate: u.gyro,
                rate_over_earth: u.gyro,
                angular_acceleration: *angular_acceleration,
                force: u.accel,
            };
            u = PerSensor::from_fn(|sensor| {
                of_triads.get(sensor) - sensed.added(sensor, &self.terms)
            });
        }
        u
    }
}
/// `N` of sample `k`, in the file's quantity per second.
fn output(sensor: Sensor, run: &Run, near: &Near, k: usize) -> Vector3<f64> {
    let increment = near.at(k).get(sensor).to_owned();
    increment.component_mul(&run.instrument.nominal.get(sensor).0) / run.recording.imu.period
}
