//! How computed navigation departs from the truth: exact and nonlinear.
//!
//! True and computed solution obey the same equations (those of [`super::Strapdown`]). Their difference obeys
//! the difference of these, in which nothing is left out: with `E = Ĉ Cᵀ` (hats on what is computed)
//!
//! `Ė = E [C δω×] + E [ω_in×] − [ω̂_in×] E`, `δω = ω̂_ib − ω_ib`,
//!
//! `δV̇ = E C f̂ − C f + â − a`, `δL̇ = L̂̇ − L̇`, `δλ̇ = λ̂̇ − λ̇`,
//!
//! `a` what gravity and the turning frame add to specific force. All of it is slow beside the body's motion and
//! in proportion to the errors of the instrument, so steps of seconds keep more digits than navigating the
//! samples of any instrument and taking the truth away. E is kept as a quaternion, whose vector part has the
//! digits of a small turn.

use nalgebra::{Matrix3, SVector, Vector3};

use super::error_model::{ATTITUDE, ErrorVector, INPUTS, POSITION, VELOCITY};
use super::strapdown::{NearPole, Slow, Solution, within_reach};
use super::stride::Instant;
use crate::attitude::skew;

/// Errors of the sensed angular rate (rad/s), then of specific force (m/s²), computed − true, along body axes.
pub type InputError = SVector<f64, INPUTS>;

/// Computed minus true navigation, its height held to the true one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NonlinearError {
    /// Scalar and vector part of the quaternion of `E`, which takes East-North-Up to where it is computed.
    scalar: f64,
    vector: Vector3<f64>,
    /// East-North-Up, m/s.
    velocity: Vector3<f64>,
    /// rad.
    latitude: f64,
    longitude: f64,
}

impl NonlinearError {
    /// The errors at the start, in the order of [`super::ErrorModel`]; those of the vertical channel, which is
    /// held, are left out.
    pub fn new(start: &ErrorVector) -> Self {
        let half = -start.fixed_rows::<3>(ATTITUDE) * 0.5;
        let angle = half.norm();
        let sinc = if angle > 0.0 {
            angle.sin() / angle
        } else {
            1.0
        };
        let velocity = start.fixed_rows::<3>(VELOCITY);
        Self {
            scalar: angle.cos(),
            vector: half * sinc,
            velocity: Vector3::new(velocity.x, velocity.y, 0.0),
            latitude: start[POSITION],
            longitude: start[POSITION + 1],
        }
    }

    /// Goes on by a step of so many seconds (Runge and Kutta, fourth order), driven thus at start, middle and end.
    ///
    /// # Errors
    /// If the computed position comes too near to a pole.
    pub fn advance(
        &mut self,
        duration: f64,
        [start, middle, end]: [&Forcing; 3],
    ) -> Result<(), NearPole> {
        let h = duration;
        let k1 = self.rate(start);
        let k2 = self.after(&k1, 0.5 * h).rate(middle);
        let k3 = self.after(&k2, 0.5 * h).rate(middle);
        let k4 = self.after(&k3, h).rate(end);
        let mut next = self.after(&k1, h / 6.0).after(&k2, h / 3.0);
        next = next.after(&k3, h / 3.0).after(&k4, h / 6.0);
        let norm = next.scalar.hypot(next.vector.norm());
        next.scalar /= norm;
        next.vector /= norm;
        within_reach(end.truth.latitude + next.latitude)?;
        *self = next;
        Ok(())
    }

    /// What is computed where this is true.
    pub fn computed(&self, truth: &Solution) -> Solution {
        let cross = skew(self.vector);
        let turn = Matrix3::identity() + (cross * self.scalar + cross * cross) * 2.0;
        Solution {
            attitude: turn * truth.attitude,
            velocity: truth.velocity + self.velocity,
            latitude: truth.latitude + self.latitude,
            longitude: truth.longitude + self.longitude,
            height: truth.height,
        }
    }

    fn rate(&self, forcing: &Forcing) -> Self {
        let Forcing {
            truth,
            drift,
            force,
            force_error,
            slow,
        } = forcing;
        let (w, v) = (self.scalar, &self.vector);
        let computed = self.moved(truth).coasting();
        let turning = computed.turn - slow.turn;
        let sensed = force + force_error;
        let turned = v.cross(&sensed);
        let acceleration = force_error
            + (turned * w + v.cross(&turned)) * 2.0
            + (computed.velocity - slow.velocity);
        Self {
            scalar: 0.5 * v.dot(&(turning - drift)),
            vector: ((drift - turning) * w + v.cross(&(drift + turning))) * 0.5
                + v.cross(&slow.turn),
            velocity: Vector3::new(acceleration.x, acceleration.y, 0.0),
            latitude: computed.position.x - slow.position.x,
            longitude: computed.position.y - slow.position.y,
        }
    }

    /// Velocity and position that are computed; attitude is left as it is.
    fn moved(&self, truth: &Solution) -> Solution {
        Solution {
            velocity: truth.velocity + self.velocity,
            latitude: truth.latitude + self.latitude,
            ..*truth
        }
    }

    fn after(&self, rate: &Self, time: f64) -> Self {
        Self {
            scalar: self.scalar + rate.scalar * time,
            vector: self.vector + rate.vector * time,
            velocity: self.velocity + rate.velocity * time,
            latitude: self.latitude + rate.latitude * time,
            longitude: self.longitude + rate.longitude * time,
        }
    }
}

/// What drives the errors at one moment.
#[derive(Debug, Clone, Copy)]
pub struct Forcing {
    truth: Solution,
    slow: Slow,
    /// `C δω`, rad/s.
    drift: Vector3<f64>,
    /// `C f` and `C δf`, m/s².
    force: Vector3<f64>,
    force_error: Vector3<f64>,
}

impl Forcing {
    /// Where this is true, and what is sensed has these errors.
    pub fn of(at: &Instant, sensed: &InputError) -> Self {
        let attitude = &at.truth.attitude;
        Self {
            truth: at.truth,
            slow: at.truth.coasting(),
            drift: attitude * sensed.fixed_rows::<3>(0),
            force: attitude * at.force,
            force_error: attitude * sensed.fixed_rows::<3>(3),
        }
    }
}
