//! What an ideal IMU on a moving table senses: exact integrals, finer than its samples.

use nalgebra::Vector3;

use crate::earth::Site;
use crate::imu::PerSensor;
use crate::turntable::Motion;

/// How increments are integrated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Integrator {
    /// Length of a sample, s.
    pub period: f64,
    /// From the table's centre, where its axes meet, to the IMU, along body axes, m.
    pub lever_arm: Vector3<f64>,
    /// Steps in a sample, each with two Gauss–Legendre points.
    pub steps: u32,
}

/// The integrals of `ω_ib` (rad) and of the specific force (m/s) along body axes over each sample:
///
/// `ω_ib = ω_nb + C_n_b ω_ie`, `f = −C_n_b g + ω̇_ib × r + ω_ib × (ω_ib × r)`, with r the lever arm.
///
/// While the table stands both are constant and computed once.
pub fn true_increments(
    motion: &Motion,
    site: &Site,
    integrator: &Integrator,
) -> PerSensor<Vec<Vector3<f64>>> {
    let &Integrator { period, .. } = integrator;
    let samples = (motion.duration() / period + 1e-6) as usize;
    let sensed = Sensed::new(motion, site, integrator.lever_arm);
    let mut gyro = Vec::with_capacity(samples);
    let mut accel = Vec::with_capacity(samples);
    let mut push = |(angle, velocity): (Vector3<f64>, Vector3<f64>)| {
        gyro.push(angle);
        accel.push(velocity);
    };
    let mut breaks = motion.breaks();
    let mut k = 0;
    for (start, end) in motion.dwells() {
        let first = ((start / period).ceil() as usize).clamp(k, samples);
        let last = ((end / period).floor() as usize).clamp(first, samples);
        while k < first {
            push(sensed.sample(k, integrator, &mut breaks));
            k += 1;
        }
        if first < last {
            let (rate, force) = sensed.at(0.5 * (start + end));
            let still = (rate * period, force * period);
            while k < last {
                push(still);
                k += 1;
            }
        }
    }
    while k < samples {
        push(sensed.sample(k, integrator, &mut breaks));
        k += 1;
    }
    PerSensor { gyro, accel }
}

struct Sensed<'a> {
    motion: &'a Motion,
    earth_rate_n: Vector3<f64>,
    gravity_n: Vector3<f64>,
    lever_arm: Vector3<f64>,
}

impl<'a> Sensed<'a> {
    fn new(motion: &'a Motion, site: &Site, lever_arm: Vector3<f64>) -> Self {
        Self {
            motion,
            earth_rate_n: site.earth_rate_n(),
            gravity_n: site.gravity_n(),
            lever_arm,
        }
    }

    /// Angular rate and specific force along body axes.
    fn at(&self, time: f64) -> (Vector3<f64>, Vector3<f64>) {
        let state = self.motion.at(time);
        let earth = state.attitude.tr_mul(&self.earth_rate_n);
        let rate = state.rate + earth;
        let acceleration = state.acceleration - state.rate.cross(&earth);
        let r = self.lever_arm;
        let force = acceleration.cross(&r) + rate.cross(&rate.cross(&r))
            - state.attitude.tr_mul(&self.gravity_n);
        (rate, force)
    }

    /// The integrals over sample `k`, in parts that do not reach across a break.
    fn sample(
        &self,
        k: usize,
        integrator: &Integrator,
        breaks: &mut &[f64],
    ) -> (Vector3<f64>, Vector3<f64>) {
        let start = k as f64 * integrator.period;
        let end = (k + 1) as f64 * integrator.period;
        let passed = breaks.partition_point(|&time| time <= start);
        *breaks = &breaks[passed..];
        let inside = breaks.partition_point(|&time| time < end);
        let (mut angle, mut velocity) = (Vector3::zeros(), Vector3::zeros());
        let mut from = start;
        for &to in breaks[..inside].iter().chain([&end]) {
            let step = (to - from) / f64::from(integrator.steps);
            for i in 0..integrator.steps {
                let middle = from + (f64::from(i) + 0.5) * step;
                let offset = 0.5 * step / 3f64.sqrt();
                for time in [middle - offset, middle + offset] {
                    let (rate, force) = self.at(time);
                    angle += rate * (0.5 * step);
                    velocity += force * (0.5 * step);
                }
            }
            from = to;
        }
        (angle, velocity)
    }
}
