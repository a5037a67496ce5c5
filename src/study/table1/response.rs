//! Effect of constant sensor errors on the navigation of a body at rest.

use nalgebra::{SMatrix, Vector3};

use super::quantity::{ByQuantity, QUANTITIES};
use crate::calibration::parameter;
use crate::earth::Site;
use crate::imu::{InstallationForm, PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad};
use crate::navigation::error_model::STATES;
use crate::study::navigation::{Exposure, Mission, NavigationStudyError};

/// Longest output step in s. The peak of a Schuler oscillation of 84 min is within half a step of an output, and at
/// most 1.7e-4 above the output.
const STEP: f64 = 30.0;

/// A body at rest on the ellipsoid, which is level and heads north, for a time in s.
pub fn standing(latitude: f64, duration: f64) -> Mission {
    let steps = (duration / STEP).ceil().max(1.0);
    Mission {
        interval: duration / steps,
        ..Mission::standing_level(&Site::with_normal_gravity(latitude, 0.0, 0.0), steps as u32)
    }
}

/// Navigation errors due to constant errors of the sensed rate and specific force, at evenly spaced times.
///
/// At rest with constant sensor errors, the linear error model has constant coefficients. Its response to each unit
/// error (a unit bias of an otherwise ideal instrument) is computed once, and every sample is a linear combination of
/// these responses.
pub struct Response(Vec<Moment>);

/// Navigation errors at one time for unit errors sensed by each triad.
#[derive(Debug, Clone)]
pub struct Moment {
    /// Time, s.
    pub time: f64,
    by_sensed: PerSensor<SMatrix<f64, STATES, 3>>,
}

impl Response {
    pub fn new(mission: &Mission) -> Result<Self, NavigationStudyError> {
        let ideal = PerSensor::from_fn(|_| Triad::ideal(InstallationForm::General));
        let moment = |exposure: &Exposure| Moment {
            time: exposure.time,
            by_sensed: PerSensor::from_fn(|sensor| {
                let bias = parameter(sensor, PER_TRIAD - 3);
                exposure.by_parameter.fixed_columns::<3>(bias).into_owned()
            }),
        };
        Ok(Self(mission.exposure(&ideal)?.iter().map(moment).collect()))
    }

    /// Largest absolute error over the run.
    pub fn largest(&self, sensor: Sensor, sensed: &Vector3<f64>) -> ByQuantity<f64> {
        let mut largest = [0.0; 5];
        for moment in &self.0 {
            for (largest, error) in largest.iter_mut().zip(errors(moment, sensor, sensed)) {
                *largest = f64::max(*largest, error.abs());
            }
        }
        largest
    }

    /// Selects about this many moments, evenly spaced from the first on.
    pub fn thinned(&self, moments: usize) -> impl Iterator<Item = &Moment> {
        self.0.iter().step_by(self.0.len().div_ceil(moments.max(1)))
    }
}

/// Errors at one moment, with signed attitude errors and norms of velocity and position.
pub fn errors(moment: &Moment, sensor: Sensor, sensed: &Vector3<f64>) -> ByQuantity<f64> {
    let errors = moment.by_sensed.get(sensor) * sensed;
    QUANTITIES.map(|quantity| quantity.of(&errors))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::earth::normal_gravity;
    use crate::units::{DEG_PER_H, DEGREE, MICRO_G};

    #[test]
    fn an_accelerometer_error_tilts_by_twice_its_share_of_gravity_within_a_swing() {
        let response = Response::new(&standing(45.0 * DEGREE, 3.0 * 3600.0)).unwrap();
        let error = 100.0 * MICRO_G;
        let largest = response.largest(Sensor::Accel, &(Vector3::y() * error));
        // From level, the tilt oscillates about the value that cancels the error: from 0 to 2 ∇/g.
        let expected = 2.0 * error / normal_gravity(45.0 * DEGREE, 0.0) / DEGREE;
        assert!((largest[0] / expected - 1.0).abs() < 0.02, "{largest:?}");
    }

    #[test]
    fn a_coarser_output_would_not_have_lost_the_largest_error() {
        let mission = standing(45.78 * DEGREE, 40.0 * 3600.0);
        let response = Response::new(&mission).unwrap();
        let sparse = Response(response.0.iter().step_by(2).cloned().collect());
        for sensor in Sensor::ALL {
            let sensed = match sensor {
                Sensor::Gyro => Vector3::new(0.01, -0.02, 0.03) * DEG_PER_H,
                Sensor::Accel => Vector3::new(50.0, -70.0, 1.0) * MICRO_G,
            };
            let (fine, coarse) = (
                response.largest(sensor, &sensed),
                sparse.largest(sensor, &sensed),
            );
            for (fine, coarse) in fine.into_iter().zip(coarse) {
                assert!((coarse / fine - 1.0).abs() < 1e-3, "{fine} {coarse}");
            }
        }
    }
}
