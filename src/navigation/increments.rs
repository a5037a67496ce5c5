//! Coning and sculling: from increments to the rotation and the velocity change of one sample.

use nalgebra::Vector3;

/// Integrals of angular rate and specific force over one sample, along body axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Increments {
    /// ∫ω_ib dt, rad.
    pub angle: Vector3<f64>,
    /// ∫f dt, m/s.
    pub velocity: Vector3<f64>,
}

/// What a sample's increments amount to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Rotation vector of the body over the sample, rad.
    pub rotation: Vector3<f64>,
    /// Velocity change along the body axes as they stood when the sample began, m/s.
    pub velocity: Vector3<f64>,
}

impl Increments {
    /// Coning and sculling over this sample and the one before, exact to third order in the period;
    /// the rotation term keeps `α×(α×Δv)/6`, without which a steady turn at 20°/s and 100 Hz makes
    /// specific force 2 ppm too small while it lasts.
    ///
    /// Source: Savage 1998, "Strapdown inertial navigation integration algorithm design", part 1
    /// (coning `Δα_{m−1} × Δα_m / 12`) and part 2 (velocity rotation compensation and sculling).
    #[inline]
    pub fn motion(&self, before: &Self) -> Motion {
        let coning = before.angle.cross(&self.angle) / 12.0;
        let sculling =
            (before.angle.cross(&self.velocity) + before.velocity.cross(&self.angle)) / 12.0;
        let across = self.angle.cross(&self.velocity);
        let rotation = across * 0.5 + self.angle.cross(&across) / 6.0;
        Motion {
            rotation: self.angle + coning,
            velocity: self.velocity + rotation + sculling,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::{exp, log};
    use nalgebra::Matrix3;

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
