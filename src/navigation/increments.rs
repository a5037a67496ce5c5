//! Coning and sculling: conversion of increments to the rotation and the velocity change of one sample, or of many
//! samples at rest.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::instrument::Instrument;
use crate::imu::{PerSensor, Sensor};
use crate::recording::ImuSamples;

/// Integrals of angular rate and specific force over one sample, along body axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Increments {
    /// ∫ω_ib dt, rad.
    pub angle: Vector3<f64>,
    /// ∫f dt, m/s.
    pub velocity: Vector3<f64>,
}

/// Motion that results from the increments of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Rotation vector of the body over the sample, rad.
    pub rotation: Vector3<f64>,
    /// Velocity change along the body axes at the start of the sample, m/s.
    pub velocity: Vector3<f64>,
}

impl Increments {
    /// Coning and sculling over this sample and the previous one, exact to third order in the sample period. The
    /// rotation term includes `α×(α×Δv)/6`; without this term, specific force would be 2 ppm too small in a steady turn
    /// at 20°/s and 100 Hz.
    ///
    /// Source: Savage 1998, "Strapdown inertial navigation integration algorithm design", part 1
    /// (coning `Δα_{m−1} × Δα_m / 12`) and part 2 (velocity rotation compensation and sculling).
    #[inline]
    pub fn motion(&self, before: &Self) -> Motion {
        let coning = before.angle.cross(&self.angle) / 12.0;
        let sculling =
            (before.angle.cross(&self.velocity) + before.velocity.cross(&self.angle)) / 12.0;
        self.motion_with(&coning, &sculling)
    }

    #[inline]
    fn motion_with(&self, coning: &Vector3<f64>, sculling: &Vector3<f64>) -> Motion {
        let across = self.angle.cross(&self.velocity);
        let rotation = across * 0.5 + self.angle.cross(&across) / 6.0;
        Motion {
            rotation: self.angle + coning,
            velocity: self.velocity + rotation + sculling,
        }
    }
}

/// Sums of the uncalibrated outputs of the triads over consecutive samples of a body at rest. For any calibration, the
/// motion follows from these sums to second order, without the samples.
///
/// At rest, everything except noise and vibration is the same in every sample, so the products are computed from the
/// deviations from the mean. A calibration `u = A N − b` acts on the sums exactly: `A x × A y = cof(A)(x × y)`, and
/// `Σ (A x)(B y)ᵀ = A (Σ x yᵀ) Bᵀ`.
#[derive(Debug, Clone, PartialEq)]
pub struct Sums {
    /// Number of samples.
    pub samples: usize,
    /// Σ N of both triads.
    total: PerSensor<Vector3<f64>>,
    /// Σ (2k − n − 1)/2 Ñ_k + (Ñ_n − Ñ_0)/12 of both triads: first moments of arrival time. Sample 0 is the one before
    /// the first.
    later: PerSensor<Vector3<f64>>,
    /// ½ Σ_{j<k} Ñ_j × Ñ_k + Σ Ñ_{k−1} × Ñ_k / 12 of the gyros.
    coning: Vector3<f64>,
    /// ½ Σ_{j<k} (g_j a_kᵀ − g_k a_jᵀ) + Σ (g_{k−1} a_kᵀ − g_k a_{k−1}ᵀ)/12 with the deviations g of the gyros
    /// and a of the accelerometers.
    sculling: Matrix3<f64>,
}

impl Sums {
    /// Sums over these samples of a record.
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
        // Half of the sum before the sample, and a twelfth of the adjacent sample.
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
            for sensor in Sensor::ALL {
                let (now, beside) = (now.get(sensor), beside.get(sensor));
                *sums.later.get_mut(sensor) += now * later + (now - beside) / 12.0;
                *past.get_mut(sensor) += now;
            }
            before = Some(now);
        }
        sums
    }

    /// Integrals of angular rate and specific force along body axes, `A Σ N − n b` with the corrections A and
    /// biases b of the triads.
    pub fn increments(&self, instrument: &PerSensor<Instrument>) -> Increments {
        let PerSensor { gyro, accel } = PerSensor::from_fn(|sensor| {
            let triad = instrument.get(sensor);
            triad.correction * self.total.get(sensor) - triad.bias * self.samples as f64
        });
        Increments {
            angle: gyro,
            velocity: accel,
        }
    }

    /// Rotation and velocity change for these integrals, with second-order terms from the sums.
    ///
    /// The source is that of [`Increments::motion`]; the sums contain the terms of that function with neighbouring
    /// samples.
    pub fn motion(&self, increments: &Increments, instrument: &PerSensor<Instrument>) -> Motion {
        let [gyro, accel] = [&instrument.gyro, &instrument.accel].map(|triad| &triad.correction);
        let (later_angle, later_velocity) = (gyro * self.later.gyro, accel * self.later.accel);
        let n = self.samples as f64;
        let (mean_angle, mean_velocity) = (increments.angle / n, increments.velocity / n);
        let coning = cofactors(gyro) * self.coning + mean_angle.cross(&later_angle);
        let w = gyro * self.sculling * accel.transpose();
        let deviations = Vector3::new(
            w[(1, 2)] - w[(2, 1)],
            w[(2, 0)] - w[(0, 2)],
            w[(0, 1)] - w[(1, 0)],
        );
        let of_means = mean_angle.cross(&later_velocity) + mean_velocity.cross(&later_angle);
        increments.motion_with(&coning, &(deviations + of_means))
    }
}

/// `cof(A)`, with `A x × A y = cof(A) (x × y)`.
fn cofactors(a: &Matrix3<f64>) -> Matrix3<f64> {
    let [x, y, z] = [0, 1, 2].map(|row| a.row(row));
    Matrix3::from_rows(&[y.cross(&z), z.cross(&x), x.cross(&y)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::{exp, log};

    /// Integrates ω(t) and f(t) in fine steps: (increments, true rotation, true velocity change).
    fn integrate(
        from: f64,
        period: f64,
        omega: impl Fn(f64) -> Vector3<f64>,
        force: impl Fn(f64) -> Vector3<f64>,
    ) -> (Increments, Motion) {
        let steps = 2000;
        let h = period / f64::from(steps);
        let mut increments = Increments::default();
        let mut c = Matrix3::identity();
        let mut velocity = Vector3::zeros();
        for k in 0..steps {
            let t = from + (f64::from(k) + 0.5) * h;
            let half = exp(omega(t) * (0.5 * h));
            velocity += c * half * force(t) * h;
            c = c * half * half;
            increments.angle += omega(t) * h;
            increments.velocity += force(t) * h;
        }
        let motion = Motion {
            rotation: log(&c),
            velocity,
        };
        (increments, motion)
    }

    #[test]
    fn a_coning_motion_leaves_a_drift_that_falls_with_the_fourth_power_of_the_period() {
        let (amplitude, frequency) = (0.01, 6.0);
        let omega = |t: f64| {
            let (s, c) = (frequency * t).sin_cos();
            Vector3::new(amplitude * frequency * c, -amplitude * frequency * s, 0.0)
        };
        let drift = |period: f64| {
            let (before, _) = integrate(-period, period, omega, |_| Vector3::zeros());
            let (now, truth) = integrate(0.0, period, omega, |_| Vector3::zeros());
            let error = now.motion(&before).rotation - truth.rotation;
            let without = now.angle - truth.rotation;
            (error.z.abs() / period, without.z.abs() / period)
        };
        let (coarse, plain) = drift(0.04);
        let (fine, _) = drift(0.02);
        assert!(coarse < plain / 50.0);
        let order = (coarse / fine).log2();
        assert!((order - 4.0).abs() < 0.3, "order {order}");
    }

    #[test]
    fn a_steady_turn_leaves_gravity_as_it_is() {
        // 20°/s about a level axis: gravity turns through the body axes, and nothing else happens.
        let rate = Vector3::new(0.35, 0.0, 0.0);
        let up = |t: f64| exp(-rate * t) * Vector3::new(0.0, 0.0, 9.8);
        let error = |period: f64| {
            let (before, _) = integrate(-period, period, |_| rate, up);
            let (now, _) = integrate(0.0, period, |_| rate, up);
            let expected = Vector3::new(0.0, 0.0, 9.8 * period);
            (now.motion(&before).velocity - expected).norm() / (9.8 * period)
        };
        assert!(error(0.01) < 2e-9, "{:e}", error(0.01));
        let order = (error(0.08) / error(0.04)).log2();
        assert!(order > 2.8, "order {order}");
    }

    #[test]
    fn velocity_error_falls_with_the_third_power_where_rate_and_force_change_linearly() {
        let omega = |t: f64| Vector3::new(0.2 + 0.1 * t, -0.3, 0.1 - 0.2 * t);
        let force = |t: f64| Vector3::new(1.0 - 3.0 * t, 2.0 * t, 9.8);
        let error = |period: f64| {
            let (before, _) = integrate(-period, period, omega, force);
            let (now, truth) = integrate(0.0, period, omega, force);
            (now.motion(&before).velocity - truth.velocity).norm() / period
        };
        let order = (error(0.04) / error(0.02)).log2();
        assert!(order > 2.8, "order {order}");
    }
}
