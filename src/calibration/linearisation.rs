//! Linearisation point of a pass, and priors of the attitudes.

use std::f64::consts::{PI, SQRT_2};
use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use crate::attitude::{exp, log};
use crate::calibration::{CalibrationError, Difference, Model, from_vector, parameter, to_vector};
use crate::earth::Site;
use crate::imu::{
    PARAMETERS as PER_TRIAD, ParameterKind, PerSensor, Sensor, TermVector, ThermalCoefficients,
    Triad, thermal_state,
};
use crate::magnetic::MagneticVector;
use crate::run::Run;
use crate::turntable::TableAccuracy;
use crate::units::DEGREE;

/// The point at which a pass linearises.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearisation {
    /// The instrument.
    pub triads: PerSensor<Triad>,
    /// Parameters of its error terms.
    pub terms: TermVector,
    /// Temperature dependence; zero if there is none.
    pub thermal: PerSensor<ThermalCoefficients>,
    /// Deviation of each recording from the common parameters; zero for recordings that are not in the list.
    pub own: Vec<Difference>,
    /// The magnetometer and its field; `None` if there is none, or if the dwells do not determine it.
    pub magnetic: Option<MagneticVector>,
    /// `C_b_n` at the first sample of each stretch.
    pub initial_attitudes: Vec<Matrix3<f64>>,
    /// `C_b_n` at the beginning of each dwell, regardless of the table reading; empty in the first pass.
    pub dwells: Vec<Matrix3<f64>>,
}

impl Linearisation {
    /// A linearisation point without temperature dependence and without differences between recordings.
    pub fn new(
        triads: PerSensor<Triad>,
        terms: TermVector,
        initial_attitudes: Vec<Matrix3<f64>>,
    ) -> Self {
        Self {
            triads,
            terms,
            thermal: PerSensor::default(),
            own: Vec::new(),
            magnetic: None,
            initial_attitudes,
            dwells: Vec::new(),
        }
    }

    /// The instrument in a recording, at its reference temperature.
    pub fn in_recording(&self, recording: usize) -> PerSensor<Triad> {
        match self.own.get(recording) {
            Some(own) => own.applied(&self.triads),
            None => self.triads,
        }
    }

    /// The instrument in a recording, given by its number, at the temperature in the middle of these samples.
    pub(in crate::calibration) fn instrument(
        &self,
        model: &Model,
        (run, recording): (&Run, usize),
        samples: &Range<usize>,
    ) -> PerSensor<Triad> {
        let triads = self.in_recording(recording);
        let imu = &run.recording.imu;
        let (Some(thermal), Some(temperature)) = (&model.thermal, &imu.temperature) else {
            return triads;
        };
        let middle = 0.5 * (imu.time(samples.start) + imu.time(samples.end));
        let (at, rate) = (temperature.at(middle), temperature.rate(middle));
        let state = thermal_state(&thermal.range, &at, &rate);
        PerSensor::from_fn(|sensor| {
            let coefficients = self.thermal.get(sensor);
            triads.get(sensor).warmed(coefficients, state.get(sensor))
        })
    }

    /// Deviation of a recording from the common parameters.
    pub(in crate::calibration) fn own(&self, recording: usize) -> Difference {
        self.own.get(recording).copied().unwrap_or_default()
    }

    /// The point a fraction of the way to another.
    pub(in crate::calibration) fn towards(&self, other: &Self, fraction: f64) -> Self {
        let from = to_vector(&self.triads);
        let turned = |from: &[Matrix3<f64>], to: &[Matrix3<f64>]| {
            let pairs = from.iter().zip(to);
            let turned =
                pairs.map(|(from, to)| exp(log(&(to * from.transpose())) * fraction) * from);
            turned.collect()
        };
        Self {
            triads: from_vector(
                self.triads.gyro.form,
                &(from + (to_vector(&other.triads) - from) * fraction),
            ),
            terms: self.terms + (other.terms - self.terms) * fraction,
            thermal: PerSensor::from_fn(|sensor| {
                let (from, to) = (self.thermal.get(sensor), other.thermal.get(sensor));
                from + (to - from) * fraction
            }),
            own: (0..self.own.len().max(other.own.len()))
                .map(|k| self.own(k).towards(&other.own(k), fraction))
                .collect(),
            magnetic: (self.magnetic.zip(other.magnetic))
                .map(|(from, to)| from + (to - from) * fraction),
            initial_attitudes: turned(&self.initial_attitudes, &other.initial_attitudes),
            dwells: if self.dwells.is_empty() {
                other.dwells.clone()
            } else {
                turned(&self.dwells, &other.dwells)
            },
        }
    }
}

/// The first triad whose sensitivity cannot be inverted.
pub fn not_invertible(triads: &PerSensor<Triad>) -> Option<Sensor> {
    let singular = |&sensor: &Sensor| triads.get(sensor).correction().is_none();
    Sensor::ALL.into_iter().find(singular)
}

/// The error for the triad whose sensitivity is singular.
pub fn singular(triads: &PerSensor<Triad>) -> CalibrationError {
    CalibrationError::Singular {
        sensor: not_invertible(triads).unwrap_or(Sensor::Gyro),
    }
}

/// Prior of the attitude at the first sample of a stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AttitudePrior {
    /// `C_b_n`: a table reading or, without a table, the coarse alignment.
    pub mean: Matrix3<f64>,
    /// 1σ about East, North and Up, rad; the last component is the σ of the heading.
    pub sigma: Vector3<f64>,
    /// 1σ of Earth rate along the East, North and Up axes of this attitude, rad/s. If the heading is unknown, the
    /// heading is fixed and Earth rate has any horizontal direction; if the site is unknown, any direction. Otherwise,
    /// zero.
    pub earth_rate_sigma: Vector3<f64>,
}

/// 1σ of an initial attitude known from only one reading (which may be wrong), rad.
const READ_ATTITUDE: f64 = DEGREE;
/// σ of the initial level without a table, divided by its σ from the accelerometer prior: the data that gave this level
/// are also observations and must determine it.
const LEVEL_SIGMAS: f64 = 10.0;
/// 1σ of the initial heading without a table, rad, if Earth rate determines the heading well.
const HEADING: f64 = 15.0 * DEGREE;
/// If it does not: 1σ of the initial heading without a table, divided by its σ from Earth rate.
const HEADING_SIGMAS: f64 = 3.0;
/// A heading with a larger σ than this, rad, is treated as unknown and fixed.
const HIDDEN: f64 = 45.0 * DEGREE;
/// σ of a fixed heading, rad: negligible, but a state needs a σ.
const FIXED: f64 = 1e-6;
/// 1σ of a uniformly distributed heading, rad.
pub const UNKNOWN_HEADING: f64 = PI / 1.732_050_807_568_877_2;

impl AttitudePrior {
    /// Whether the heading is fixed because it is unknown.
    pub fn heading_is_unknown(&self) -> bool {
        self.sigma.z == FIXED
    }

    /// Prior from a table reading.
    pub(in crate::calibration) fn of_reading(table: &TableAccuracy, mean: Matrix3<f64>) -> Self {
        // The single reading that gave the attitude contains all errors.
        let known = table.position_sigma.hypot(table.reading_sigma);
        let known = known.hypot(table.geometry.base.max());
        Self {
            mean,
            sigma: Vector3::repeat(READ_ATTITUDE.max(10.0 * known)),
            earth_rate_sigma: Vector3::zeros(),
        }
    }

    /// Prior from a coarse alignment with this 1σ of the heading, and the 1σ of the level from the accelerometers of
    /// this model.
    pub(in crate::calibration) fn of_alignment(
        mean: Matrix3<f64>,
        heading_sigma: f64,
        model: &Model,
        site: &Site,
    ) -> Self {
        let tilt = LEVEL_SIGMAS * known_level(model, site.gravity);
        let heading = (HEADING_SIGMAS * heading_sigma).max(HEADING);
        let level = site.earth_rate_n().xy().norm() / SQRT_2;
        let (heading, earth_rate_sigma) = match heading > HIDDEN {
            _ if !site.is_known => (FIXED, Vector3::repeat(site.earth_rate_sigma())),
            true => (FIXED, Vector3::new(level, level, 0.0)),
            false => (heading, Vector3::zeros()),
        };
        Self {
            mean,
            sigma: Vector3::new(tilt, tilt, heading),
            earth_rate_sigma,
        }
    }
}

/// 1σ of the level from uncalibrated accelerometers in one attitude, rad, for the axis with the largest
/// uncertainty.
fn known_level(model: &Model, gravity: f64) -> f64 {
    let mut variances = Vector3::<f64>::zeros();
    for of_triad in 0..PER_TRIAD {
        let per_g = match Triad::kind(of_triad) {
            ParameterKind::Bias => gravity,
            ParameterKind::Scale | ParameterKind::Installation => 1.0,
        };
        let sigma = model.prior_sigma[parameter(Sensor::Accel, of_triad)] / per_g;
        if let Some(axis) = Triad::axis(model.form, of_triad) {
            variances[axis] += sigma.powi(2);
        }
    }
    variances.max().sqrt()
}

/// Uncertainty at the first sample of a stretch, 1σ, and the mean of its attitude error.
#[derive(Debug, Clone, Copy)]
pub struct Start {
    /// Mean of φ₀, rad.
    pub attitude: Vector3<f64>,
    /// 1σ of φ₀, East, North and Up, rad.
    pub attitude_sigma: Vector3<f64>,
    /// 1σ of velocity, m/s.
    pub velocity_sigma: f64,
    /// 1σ of position, m.
    pub position_sigma: f64,
    /// Mean of the error of Earth rate along East, North and Up, rad/s.
    pub earth_rate: Vector3<f64>,
    /// 1σ of the error of Earth rate along East, North and Up, rad/s.
    pub earth_rate_sigma: Vector3<f64>,
}
