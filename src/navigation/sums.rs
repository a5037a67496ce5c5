//! Samples of a body at rest, summed once for any calibration.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::increments::{Increments, Motion};
use crate::imu::PerSensor;
use crate::recording::ImuSamples;

/// Sums over consecutive samples of a body at rest, of what the triads give as it stands in the record: with
/// them its motion follows to second order for any calibration, without the samples.
///
/// At rest what is not noise or unrest is the same in every sample, so that products are taken of the
/// deviations from the mean. A calibration `u = A N − b` acts on the sums exactly:
/// `A x × A y = cof(A)(x × y)`, and `Σ (A x)(B y)ᵀ = A (Σ x yᵀ) Bᵀ`.
#[derive(Debug, Clone, PartialEq)]
pub struct Sums {
    /// Number of samples.
    pub samples: usize,
    /// Σ N of both triads.
    total: PerSensor<Vector3<f64>>,
    /// Σ (2k − n − 1)/2 Ñ_k + (Ñ_n − Ñ_0)/12 of both triads: how much later than on average it came. Sample 0
    /// is the one before the first.
    later: PerSensor<Vector3<f64>>,
    /// ½ Σ_{j<k} Ñ_j × Ñ_k + Σ Ñ_{k−1} × Ñ_k / 12 of the gyros.
    coning: Vector3<f64>,
    /// ½ Σ_{j<k} (g_j a_kᵀ − g_k a_jᵀ) + Σ (g_{k−1} a_kᵀ − g_k a_{k−1}ᵀ)/12 with the deviations g of the gyros
    /// and a of the accelerometers.
    sculling: Matrix3<f64>,
}

impl Sums {
    /// Of these samples of a record.
    pub fn new(imu: &ImuSamples, samples: Range<usize>) -> Self {
        let n = samples.len() as f64;
        let first = samples.start.saturating_sub(1);
        let all = PerSensor::from_fn(|sensor| imu.of(sensor).part(first..samples.end));
        let total = PerSensor::from_fn(|sensor| {
            let of_sensor = &all.get(sensor)[samples.start - first..];
            of_sensor.iter().sum::<Vector3<f64>>()
        });
        let mean = PerSensor::from_fn(|sensor| total.get(sensor) / n);
        let deviation = |k: usize| PerSensor {
            gyro: all.gyro[k - first] - mean.gyro,
            accel: all.accel[k - first] - mean.accel,
        };
        let mut sums = Self {
            samples: samples.len(),
            total,
            later: PerSensor::default(),
            coning: Vector3::zeros(),
            sculling: Matrix3::zeros(),
        };
        // Of those before it half, of the one next to it a twelfth.
        let mut past = PerSensor::<Vector3<f64>>::default();
        let mut before = samples.start.checked_sub(1).map(deviation);
        for (number, k) in samples.enumerate() {
            let now = deviation(k);
            let beside = before.unwrap_or_default();
            let weigh = |sensor| past.get(sensor) * 0.5 + beside.get(sensor) / 12.0;
            let PerSensor { gyro, accel } = PerSensor::from_fn(weigh);
            sums.coning += gyro.cross(&now.gyro);
            sums.sculling += gyro * now.accel.transpose() - now.gyro * accel.transpose();
            let later = number as f64 - 0.5 * (n - 1.0);
            for sensor in crate::imu::Sensor::ALL {
                let (now, beside) = (now.get(sensor), beside.get(sensor));
                *sums.later.get_mut(sensor) += now * later + (now - beside) / 12.0;
                *past.get_mut(sensor) += now;
            }
            before = Some(now);
        }
        sums
    }

    /// Integrals of angular rate and specific force along body axes, `A Σ N` with these matrices A less
    /// these biases over all samples.
    pub fn increments(
        &self,
        correction: &PerSensor<Matrix3<f64>>,
        bias: &PerSensor<Vector3<f64>>,
    ) -> Increments {
        let of = |sensor| correction.get(sensor) * self.total.get(sensor) - bias.get(sensor);
        let PerSensor { gyro, accel } = PerSensor::from_fn(of);
        Increments {
            angle: gyro,
            velocity: accel,
        }
    }

    /// Rotation and velocity change where the integrals are these: second order from the sums.
    ///
    /// Source: as for [`Increments::motion`], whose terms of neighbouring samples are in the sums.
    pub fn motion(&self, increments: &Increments, correction: &PerSensor<Matrix3<f64>>) -> Motion {
        let n = self.samples as f64;
        let Increments { angle, velocity } = increments;
        let later = PerSensor::from_fn(|sensor| correction.get(sensor) * self.later.get(sensor));
        let PerSensor { gyro, accel } = correction;
        let w = gyro * self.sculling * accel.transpose();
        let sculling = Vector3::new(
            w[(1, 2)] - w[(2, 1)],
            w[(2, 0)] - w[(0, 2)],
            w[(0, 1)] - w[(1, 0)],
        );
        let (mean_angle, mean_velocity) = (angle / n, velocity / n);
        let across = angle.cross(velocity);
        Motion {
            rotation: angle + cofactors(gyro) * self.coning + mean_angle.cross(&later.gyro),
            velocity: velocity
                + across * 0.5
                + angle.cross(&across) / 6.0
                + sculling
                + mean_angle.cross(&later.accel)
                + mean_velocity.cross(&later.gyro),
        }
    }
}

/// `cof(A)`, with `A x × A y = cof(A) (x × y)`.
fn cofactors(a: &Matrix3<f64>) -> Matrix3<f64> {
    let rows = [0, 1, 2].map(|k| a.row(k).transpose());
    Matrix3::from_rows(&[
        rows[1].cross(&rows[2]).transpose(),
        rows[2].cross(&rows[0]).transpose(),
        rows[0].cross(&rows[1]).transpose(),
    ])
}
