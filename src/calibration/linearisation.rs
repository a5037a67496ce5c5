//! Where a pass linearises, and what is known of attitudes before it.

use nalgebra::{Matrix3, Vector3};

use super::error::CalibrationError;
use super::parameters::{from_vector, to_vector};
use crate::attitude::{exp, log};
use crate::imu::{PerSensor, Sensor, TermVector, Triad};
use crate::turntable::TableAccuracy;
use crate::units::{ARCSEC, DEGREE};

/// The point at which a pass linearises.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearisation {
    /// The instrument.
    pub triads: PerSensor<Triad>,
    /// Parameters of its error terms.
    pub terms: TermVector,
    /// `C_b_n` at the first sample of each stretch.
    pub initial_attitudes: Vec<Matrix3<f64>>,
}

impl Linearisation {
    /// The point a fraction of the way to another.
    pub(super) fn towards(&self, other: &Self, fraction: f64) -> Self {
        let from = to_vector(&self.triads);
        let attitudes = self.initial_attitudes.iter().zip(&other.initial_attitudes);
        Self {
            triads: from_vector(
                self.triads.gyro.form,
                &(from + (to_vector(&other.triads) - from) * fraction),
            ),
            terms: self.terms + (other.terms - self.terms) * fraction,
            initial_attitudes: attitudes
                .map(|(from, to)| exp(log(&(to * from.transpose())) * fraction) * from)
                .collect(),
        }
    }
}

/// The error that names the triad whose sensitivity is singular.
pub(super) fn singular(triads: &PerSensor<Triad>) -> CalibrationError {
    let sensor = Sensor::ALL
        .into_iter()
        .find(|&sensor| triads.get(sensor).correction().is_none())
        .unwrap_or(Sensor::Gyro);
    CalibrationError::Singular { sensor }
}

/// What is known of the attitude at the first sample of a stretch before the filter runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AttitudePrior {
    /// `C_b_n`: a reading of the table or, without, the coarse alignment.
    pub mean: Matrix3<f64>,
    /// 1σ about East, North and Up, rad; the last is that of the heading.
    pub sigma: Vector3<f64>,
}

/// 1σ of the initial attitude before anything is known of it but one reading, rad.
const READ_ATTITUDE: f64 = 60.0 * ARCSEC;
/// 1σ of the initial level without a table, rad. What gave it is in the observations, too, so this is
/// far wider than it is wrong.
const LEVEL: f64 = 0.2 * DEGREE;
/// 1σ of the initial heading without a table, rad, if Earth rate shows it well; else …
const HEADING: f64 = 15.0 * DEGREE;
/// … so many times what Earth rate leaves of it.
const HEADING_SIGMAS: f64 = 3.0;
/// A heading less known than this, rad, is hidden: it may be in any quadrant, and …
const HIDDEN: f64 = 45.0 * DEGREE;
/// … within one, has the standard deviation of a uniform distribution, rad.
const IN_QUADRANT: f64 = 90.0 * DEGREE / 3.464_101_615_137_754_6;

impl AttitudePrior {
    /// From a reading of a table.
    pub(super) fn of_reading(table: &TableAccuracy, mean: Matrix3<f64>) -> Self {
        // The one reading that gave it has all errors.
        let known = table.position_sigma.hypot(table.reading_sigma);
        let known = known.hypot(table.geometry.base.max());
        Self {
            mean,
            sigma: Vector3::repeat(READ_ATTITUDE.max(10.0 * known)),
        }
    }

    /// From a coarse alignment that knows its heading to this 1σ.
    pub(super) fn of_alignment(mean: Matrix3<f64>, heading_sigma: f64) -> Self {
        let heading = (HEADING_SIGMAS * heading_sigma).max(HEADING);
        let heading = if heading > HIDDEN {
            IN_QUADRANT
        } else {
            heading
        };
        Self {
            mean,
            sigma: Vector3::new(LEVEL, LEVEL, heading),
        }
    }

    /// Whether noise of the gyros hides a heading of this 1σ, so that it may be any.
    pub(super) fn hides(heading_sigma: f64) -> bool {
        HEADING_SIGMAS * heading_sigma > HIDDEN
    }
}

/// Uncertainty at the first sample of a stretch, 1σ, and the mean of its attitude error.
#[derive(Debug, Clone, Copy)]
pub(super) struct Start {
    /// Mean of φ₀, rad.
    pub attitude: Vector3<f64>,
    /// East, North and Up, rad.
    pub attitude_sigma: Vector3<f64>,
    /// m/s
    pub velocity_sigma: f64,
    /// m
    pub position_sigma: f64,
}
