//! Input sensed by an ideal IMU on a moving table, computed as exact integrals in steps finer than the samples.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::earth::Site;
use crate::imu::{self, PerSensor, Sensor, TermVector};
use crate::turntable::Motion;

/// Settings of the integration of increments.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Integrator {
    /// Length of a sample, s.
    pub period: f64,
    /// Lever arm from the table's centre, where its axes meet, to the IMU, along body axes, m.
    pub lever_arm: Vector3<f64>,
    /// Number of integration steps in a sample, each with two Gauss–Legendre points.
    pub steps: u32,
}

/// The integrals of `ω_ib` (rad) and of the specific force (m/s) along body axes over each sample:
///
/// `ω_ib = ω_nb + C_n_b ω_ie`, `f = −C_n_b g + ω̇_ib × r + ω_ib × (ω_ib × r)`, with r the lever arm.
///
/// to which the instrument's error terms with these parameters are added. While the table is at rest, both quantities
/// are constant and are computed only once.
pub fn true_increments(
    motion: &Motion,
    site: &Site,
    integrator: &Integrator,
    terms: &TermVector,
) -> PerSensor<Vec<Vector3<f64>>> {
    let &Integrator { period, .. } = integrator;
    let samples = (motion.duration() / period + 1e-6) as usize;
    let sensed = Sensed::new(motion, site, integrator.lever_arm, *terms);
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
    terms: TermVector,
}

impl<'a> Sensed<'a> {
    fn new(motion: &'a Motion, site: &Site, lever_arm: Vector3<f64>, terms: TermVector) -> Self {
        Self {
            motion,
            earth_rate_n: site.earth_rate_n(),
            gravity_n: site.gravity_n(),
            lever_arm,
            terms,
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
        if self.terms == TermVector::zeros() {
            return (rate, force);
        }
        let sensed = imu::Sensed {
            rate,
            rate_over_earth: state.rate,
            angular_acceleration: acceleration,
            force,
        };
        let added = |sensor| sensed.added(sensor, &self.terms);
        (rate + added(Sensor::Gyro), force + added(Sensor::Accel))
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

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use nalgebra::Matrix3;

    use super::*;
    use crate::attitude::exp;
    use crate::earth::ROTATION_RATE;
    use crate::simulation::Scenario;
    use crate::turntable::Imperfection;
    use crate::units::MILLISECOND;

    const PERIOD: f64 = 0.01;

    fn demo() -> (Motion, Site) {
        let scenario = Scenario::load("demo").unwrap();
        let imperfection = Imperfection::none(&scenario.table);
        let motion = Motion::new(&scenario.table, &scenario.path, &imperfection).unwrap();
        (motion, scenario.site)
    }

    fn integrator(lever_arm: Vector3<f64>, steps: u32) -> Integrator {
        Integrator {
            period: PERIOD,
            lever_arm,
            steps,
        }
    }

    fn sample(time: f64) -> usize {
        (time / PERIOD).round() as usize
    }

    #[test]
    fn standing_still_senses_earth_rate_and_gravity_upwards() {
        let (motion, site) = demo();
        let ideal = true_increments(
            &motion,
            &site,
            &integrator(Vector3::zeros(), 4),
            &TermVector::zeros(),
        );
        for (start, end) in motion.dwells() {
            let still = sample(start) + 1..sample(end) - 1;
            let time = still.len() as f64 * PERIOD;
            let attitude = motion.at(start).attitude;
            let angle = ideal.gyro[still.clone()].iter().sum::<Vector3<f64>>();
            let velocity = ideal.accel[still].iter().sum::<Vector3<f64>>();
            let up = Vector3::new(0.0, 0.0, site.gravity * time);
            assert_relative_eq!(attitude * velocity, up, epsilon = 1e-10 * time);
            assert_relative_eq!(angle.norm(), ROTATION_RATE * time, max_relative = 1e-10);
            assert_relative_eq!(
                attitude * angle,
                site.earth_rate_n() * time,
                epsilon = 1e-14 * time
            );
        }
    }

    /// Attitude and velocity from strapdown integration over samples of 1 ms, relative to the inertial
    /// frame that is East-North-Up at the start. Samples are so short that coning and sculling beyond
    /// the second order are negligible.
    fn integrated(
        motion: &Motion,
        site: &Site,
        lever_arm: Vector3<f64>,
        samples: usize,
    ) -> (Matrix3<f64>, Vector3<f64>) {
        let fine = Integrator {
            period: MILLISECOND,
            ..integrator(lever_arm, 2)
        };
        let ideal = true_increments(motion, site, &fine, &TermVector::zeros());
        let mut attitude = motion.at(0.0).attitude;
        let mut velocity = Vector3::zeros();
        let (mut last_angle, mut last_force) = (Vector3::zeros(), Vector3::zeros());
        for k in 0..samples {
            let (angle, force) = (ideal.gyro[k], ideal.accel[k]);
            let sculling = angle.cross(&force) / 2.0
                + angle.cross(&angle.cross(&force)) / 6.0
                + (last_angle.cross(&force) + last_force.cross(&angle)) / 12.0;
            let time = (k as f64 + 0.5) * fine.period;
            let gravity = exp(site.earth_rate_n() * time) * site.gravity_n();
            velocity += attitude * (force + sculling) + gravity * fine.period;
            attitude *= exp(angle + last_angle.cross(&angle) / 12.0);
            (last_angle, last_force) = (angle, force);
        }
        (attitude, velocity)
    }

    /// The number of milliseconds until the table stands after this number of moves.
    fn until_after(motion: &Motion, moves: usize) -> usize {
        let (start, _) = motion.dwells().nth(moves).unwrap();
        ((start + 1.0) / MILLISECOND) as usize
    }

    #[test]
    fn the_increments_of_a_full_turn_integrate_back_to_the_start() {
        let (motion, site) = demo();
        // The first move is whole turns.
        let samples = until_after(&motion, 1);
        let (attitude, _) = integrated(&motion, &site, Vector3::zeros(), samples);
        let earth = exp(site.earth_rate_n() * (samples as f64 * MILLISECOND));
        let start = motion.at(0.0).attitude;
        assert_relative_eq!(attitude, earth * start, epsilon = 1e-11);
    }

    #[test]
    fn a_lever_arm_leaves_no_velocity_after_a_move_but_the_earth_s() {
        let (motion, site) = demo();
        let samples = until_after(&motion, 3);
        let arm = Vector3::new(0.3, -0.2, 0.1);
        let (attitude, centre) = integrated(&motion, &site, Vector3::zeros(), samples);
        let (_, off) = integrated(&motion, &site, arm, samples);
        assert!(centre.norm() < 1e-8);
        let carried = (attitude - motion.at(0.0).attitude) * arm;
        assert_relative_eq!(
            off - centre,
            site.earth_rate_n().cross(&carried),
            epsilon = 1e-9
        );
    }

    #[test]
    fn increments_do_not_depend_on_the_step() {
        let (motion, site) = demo();
        let arm = Vector3::new(0.3, -0.2, 0.1);
        let coarse = true_increments(&motion, &site, &integrator(arm, 4), &TermVector::zeros());
        let fine = true_increments(&motion, &site, &integrator(arm, 16), &TermVector::zeros());
        for (coarse, fine) in coarse.gyro.iter().zip(&fine.gyro) {
            assert!((coarse - fine).norm() < 1e-14);
        }
        for (coarse, fine) in coarse.accel.iter().zip(&fine.accel) {
            assert!((coarse - fine).norm() < 1e-12);
        }
    }
}
