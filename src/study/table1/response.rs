//! Effect of constant sensor errors on the navigation of a body at rest.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::paper::ByQuantity;
use crate::imu::{PerSensor, Sensor};
use crate::navigation::error_model::{INPUTS, STATES};
use crate::navigation::{NavigationError, Sensitivity, Solution};

/// Longest output step in s. The largest of a Schuler swing of 84 min lies within half a step of an
/// output, and is at most 1.7e-4 above it.
const STEP: f64 = 30.0;
/// Pitch, roll, heading; velocity and position, east and north.
const OUTPUTS: usize = 7;
/// Their indices in [`NavigationError::to_vector`].
const ROWS: [usize; OUTPUTS] = [0, 1, 2, 3, 4, 6, 7];

/// Mean and standard deviation (`n − 1`), rad, m/s or m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moments {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub std: f64,
}

impl Moments {
    /// Moments of some values; NaN for fewer than two.
    pub(super) fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let n = values.clone().count() as f64;
        let mean = values.clone().sum::<f64>() / n;
        let squares: f64 = values.map(|x| (x - mean).powi(2)).sum();
        Self {
            mean,
            std: (squares / (n - 1.0)).sqrt(),
        }
    }
}

/// A body at rest on the ellipsoid, level and heading north.
pub fn standing(latitude: f64) -> Solution {
    Solution {
        attitude: Matrix3::identity(),
        velocity: Vector3::zeros(),
        latitude,
        longitude: 0.0,
        height: 0.0,
    }
}

/// Navigation errors per each of the three errors of a triad, at evenly spaced times.
///
/// At rest under constant sensor errors, the linear error model has constant coefficients: its
/// response to each unit error is computed once, exactly at each output, and every sample is a linear
/// combination of the responses.
pub struct Response {
    step: f64,
    by_sensor: PerSensor<Vec<SMatrix<f64, OUTPUTS, 3>>>,
}

impl Response {
    /// Response over a time in s, with height held and perfect alignment; `None` if roll and heading of the
    /// body are not distinguishable.
    pub(super) fn new(truth: &Solution, duration: f64) -> Option<Self> {
        let steps = (duration / STEP).ceil().max(1.0);
        let step = duration / steps;
        let transition = truth.steady().linear_model().over(step);
        let by_state = NavigationError::by_state(truth)?;
        let outputs = SMatrix::<f64, OUTPUTS, STATES>::from_fn(|i, j| by_state[(ROWS[i], j)]);
        let mut sensitivity = Sensitivity::<INPUTS>::zeros();
        let mut by_sensor = PerSensor::<Vec<_>>::default();
        for _ in 0..=steps as usize {
            let response = outputs * sensitivity;
            for (place, sensor) in Sensor::ALL.into_iter().enumerate() {
                let of_triad = response.fixed_columns::<3>(3 * place).into_owned();
                by_sensor.get_mut(sensor).push(of_triad);
            }
            sensitivity = transition.errors * sensitivity + transition.input;
        }
        Some(Self { step, by_sensor })
    }

    /// Largest absolute error over the run.
    pub(super) fn largest(&self, sensor: Sensor, sensed: &Vector3<f64>) -> ByQuantity<f64> {
        let mut largest = [0.0; 5];
        for response in self.by_sensor.get(sensor) {
            let sizes = sizes(&(response * sensed));
            for (largest, size) in largest.iter_mut().zip(sizes) {
                *largest = f64::max(*largest, size);
            }
        }
        let [pitch, roll, heading, velocity, position] = largest;
        [pitch, roll, heading, velocity.sqrt(), position.sqrt()]
    }

    /// Indices of about this many outputs, evenly spaced from the first on.
    pub(super) fn thinned(&self, outputs: usize) -> impl Iterator<Item = usize> {
        let count = self.by_sensor.gyro.len();
        (0..count).step_by(count.div_ceil(outputs.max(1)))
    }

    /// Time of an output, s.
    pub(super) fn time(&self, output: usize) -> f64 {
        self.step * output as f64
    }

    /// Errors at an output: attitude with sign, velocity and position as norms.
    pub(super) fn errors(
        &self,
        sensor: Sensor,
        output: usize,
        sensed: &Vector3<f64>,
    ) -> ByQuantity<f64> {
        let outputs = self.by_sensor.get(sensor)[output] * sensed;
        let [.., velocity, position] = sizes(&outputs);
        let [pitch, roll, heading] = [0, 1, 2].map(|angle| outputs[angle]);
        [pitch, roll, heading, velocity.sqrt(), position.sqrt()]
    }
}

/// Magnitudes of the angles, squared norms of velocity and position.
#[inline]
fn sizes(outputs: &SVector<f64, OUTPUTS>) -> ByQuantity<f64> {
    let square = |first: usize| outputs[first].powi(2) + outputs[first + 1].powi(2);
    [
        outputs[0].abs(),
        outputs[1].abs(),
        outputs[2].abs(),
        square(3),
        square(5),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::{DEG_PER_H, DEGREE, MICRO_G};

    #[test]
    fn an_accelerometer_error_tilts_by_twice_its_share_of_gravity_within_a_swing() {
        let truth = standing(45.0 * DEGREE);
        let force = truth.steady().force;
        let response = Response::new(&truth, 3.0 * 3600.0).unwrap();
        let error = 100.0 * MICRO_G;
        let largest = response.largest(Sensor::Accel, &(Vector3::y() * error));
        // Level at first, the tilt swings about that which hides the error: from 0 to 2 ∇/g.
        let expected = 2.0 * error / force.z;
        assert!((largest[0] / expected - 1.0).abs() < 0.02, "{largest:?}");
    }

    #[test]
    fn a_coarser_output_would_not_have_lost_the_largest_error() {
        let truth = standing(45.78 * DEGREE);
        let response = Response::new(&truth, 40.0 * 3600.0).unwrap();
        let mut sparse = Response::new(&truth, 40.0 * 3600.0).unwrap();
        for sensor in Sensor::ALL {
            let mut keep = (0..).map(|k| k % 2 == 0);
            let rows = sparse.by_sensor.get_mut(sensor);
            rows.retain(|_| keep.next() == Some(true));
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
