//! Nonlinear strapdown navigation on the WGS-84 ellipsoid: attitude, velocity and position.
//!
//! With `C = C_b_n`, specific force f and everything in East-North-Up (Groves, *Principles of GNSS,
//! Inertial, and Multisensor Integrated Navigation Systems*, 2nd ed., §5.4; Titterton and Weston,
//! *Strapdown Inertial Navigation Technology*, 2nd ed., §3.5.3):
//!
//! `Ċ = C [ω_ib×] − [ω_in×] C`, `V̇ = C f − (2ω_ie + ω_en) × V + g`,
//! `L̇ = V_N / (R_M + h)`, `λ̇ = V_E / ((R_N + h) cos L)`, `ḣ = V_U`.

use nalgebra::{Matrix3, Vector2, Vector3};
use thiserror::Error;

use super::errors::{ATTITUDE, ErrorVector, POSITION, VELOCITY, joined};
use super::increments::Increments;
use super::runge_kutta::step;
use crate::attitude::{exp, orthonormalised};
use crate::earth::{Curvature, earth_rate_n, normal_gravity};
use crate::units::DEGREE;

/// Largest latitude, north or south, for navigation in East-North-Up, rad: heading and
/// longitude are undefined at the poles.
pub const LARGEST_LATITUDE: f64 = 89.9 * DEGREE;

/// State of a navigating body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// `C_b_n`, body to East-North-Up.
    pub attitude: Matrix3<f64>,
    /// Velocity relative to the Earth, East-North-Up, m/s.
    pub velocity: Vector3<f64>,
    /// Geodetic latitude in radians, north positive.
    pub latitude: f64,
    /// Longitude in radians, east positive, without wrapping.
    pub longitude: f64,
    /// Height above the ellipsoid in m.
    pub height: f64,
}

impl Solution {
    /// Transport rate `ω_en` in East-North-Up, rad/s.
    #[inline]
    pub fn transport_rate(&self) -> Vector3<f64> {
        let radii = Curvature::at(self.latitude);
        let east = self.velocity.x / (radii.prime_vertical + self.height);
        let north = self.velocity.y / (radii.meridian + self.height);
        let (sin, cos) = self.latitude.sin_cos();
        Vector3::new(-north, east, east * (sin / cos))
    }

    /// Acceleration relative to the Earth in East-North-Up, m/s², for a specific force in the same axes, including
    /// Coriolis, transport and normal gravity.
    #[inline]
    pub fn acceleration(&self, force: &Vector3<f64>) -> Vector3<f64> {
        let turning = earth_rate_n(self.latitude) * 2.0 + self.transport_rate();
        let gravity = Vector3::z() * normal_gravity(self.latitude, self.height);
        force - turning.cross(&self.velocity) - gravity
    }

    /// Latitude and longitude, rad.
    pub(super) fn place(&self) -> Vector2<f64> {
        Vector2::new(self.latitude, self.longitude)
    }

    /// Rates of latitude and longitude, rad/s, and of height, m/s.
    #[inline]
    pub(super) fn position_rate(&self) -> Vector3<f64> {
        let transport = self.transport_rate();
        Vector3::new(
            -transport.x,
            transport.y / self.latitude.cos(),
            self.velocity.z,
        )
    }

    /// A copy with unchanged attitude and velocity at another place, displaced in latitude and longitude (rad) and
    /// height (m).
    pub(super) fn moved(&self, by: &Vector3<f64>) -> Self {
        Self {
            latitude: self.latitude + by.x,
            longitude: self.longitude + by.y,
            height: self.height + by.z,
            ..*self
        }
    }

    /// The instantaneous motion of a body with constant attitude and velocity in East-North-Up; with zero velocity, the
    /// body is at rest.
    pub fn steady(&self) -> Instant {
        Instant::of(*self, &Vector3::zeros(), &Vector3::zeros())
    }
}

/// A true state with the input sensed by an ideal instrument.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instant {
    /// The true state.
    pub truth: Solution,
    /// Angular rate `ω_ib` along body axes, rad/s.
    pub rate: Vector3<f64>,
    /// Specific force along body axes, m/s².
    pub force: Vector3<f64>,
}

impl Instant {
    /// The instantaneous motion of a body that turns relative to East-North-Up (rad/s) while its velocity components
    /// change (m/s²), both along East-North-Up.
    pub fn of(truth: Solution, turning: &Vector3<f64>, acceleration: &Vector3<f64>) -> Self {
        let rate = earth_rate_n(truth.latitude) + truth.transport_rate() + turning;
        // The acceleration of an unsupported body is not sensed.
        let force = acceleration - truth.acceleration(&Vector3::zeros());
        Self {
            truth,
            rate: truth.attitude.tr_mul(&rate),
            force: truth.attitude.tr_mul(&force),
        }
    }
}

/// Treatment of the height. The error of a free height grows by a factor of e in every ten minutes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Height {
    /// Free height.
    Free,
    /// Height (m) and vertical velocity (m/s) are set to the values of a reference at the end of the step.
    Held {
        /// Height above the ellipsoid in m.
        height: f64,
        /// Vertical velocity in m/s, up positive.
        velocity: f64,
    },
}

/// Navigation comes too close to a pole.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error(
    "navigation reached latitude {:.3}°, but the heading is undefined near a pole in East-North-Up: stay within \
     ±{:.1}°",
    latitude / DEGREE,
    LARGEST_LATITUDE / DEGREE
)]
pub struct NearPole {
    /// The computed latitude, rad.
    pub latitude: f64,
}

/// Navigates from increments.
///
/// The motion of the body within a step follows from the increments with coning and sculling ([`Increments::motion`],
/// third order in the step); the slow part — rotation of East-North-Up, Coriolis, gravity and position — is integrated
/// by a fourth-order Runge–Kutta step with linearly changing specific force. An instrument at rest can therefore be
/// navigated in steps of tens of seconds.
#[derive(Debug, Clone)]
pub struct Strapdown {
    period: f64,
    before: Option<Increments>,
    solution: Solution,
}

impl Strapdown {
    /// Starts from a solution; every step is `period` seconds long.
    ///
    /// # Errors
    /// Returns an error if the start is too close to a pole.
    pub fn new(start: Solution, period: f64) -> Result<Self, NearPole> {
        within_reach(start.latitude)?;
        Ok(Self {
            period,
            before: None,
            solution: start,
        })
    }

    /// The current solution.
    pub fn solution(&self) -> &Solution {
        &self.solution
    }

    /// Navigates through one step.
    ///
    /// # Errors
    /// Returns an error if the step leads too close to a pole; the solution is then unchanged.
    pub fn advance(&mut self, increments: &Increments, height: Height) -> Result<(), NearPole> {
        let (period, start) = (self.period, self.solution);
        let before = self.before.unwrap_or(*increments);
        let motion = increments.motion(&before);

        // Specific force along the body axes of the start: mean and change.
        let mean = motion.velocity / period;
        let turning = increments.angle.cross(&increments.velocity);
        let change = (turning + increments.velocity - before.velocity) / period;
        // Slow changes since the start: rotation of East-North-Up, velocity and position.
        let after = |part: f64, slow: &ErrorVector| {
            height.hold(start.with_errors(slow), &start, part, period)
        };
        let rate = |&part: &f64, slow: &ErrorVector| {
            let force = mean + change * (part - 0.5);
            let turn = slow.fixed_rows::<3>(ATTITUDE).into_owned();
            after(part, slow).slow(&turn, &force)
        };
        let slow = step(&ErrorVector::zeros(), period, [&0.0, &0.5, &1.0], rate);
        let mut end = after(1.0, &slow);
        within_reach(end.latitude)?;
        end.attitude = orthonormalised(&(end.attitude * exp(motion.rotation)));
        self.solution = end;
        self.before = Some(*increments);
        Ok(())
    }
}

impl Height {
    /// A state within a step from this start, with height and vertical velocity of the reference.
    #[inline]
    fn hold(self, mut state: Solution, start: &Solution, part: f64, period: f64) -> Solution {
        let Self::Held { height, velocity } = self else {
            return state;
        };
        let bulge = (start.velocity.z - velocity) * period * 0.5 * part * (1.0 - part);
        state.velocity.z = start.velocity.z + (velocity - start.velocity.z) * part;
        state.height = start.height + (height - start.height) * part + bulge;
        state
    }
}

impl Solution {
    /// The computed solution that has these errors relative to this true solution.
    #[inline]
    pub fn with_errors(&self, errors: &ErrorVector) -> Self {
        let position = errors.fixed_rows::<3>(POSITION).into_owned();
        Self {
            attitude: exp(-errors.fixed_rows::<3>(ATTITUDE)) * self.attitude,
            velocity: self.velocity + errors.fixed_rows::<3>(VELOCITY),
            ..self.moved(&position)
        }
    }

    /// Rates of the slow quantities at this velocity and position without specific force: rotation of East-North-Up,
    /// velocity, position.
    #[inline]
    pub(super) fn coasting(&self) -> ErrorVector {
        self.slow(&Vector3::zeros(), &Vector3::zeros())
    }

    /// Rates with a specific force along body axes, after this rotation of East-North-Up since the start of the step.
    #[inline]
    fn slow(&self, turn: &Vector3<f64>, force: &Vector3<f64>) -> ErrorVector {
        let rate = earth_rate_n(self.latitude) + self.transport_rate();
        // Bortz equation to the order required by the rotation within a step.
        let across = turn.cross(&rate);
        let turning = rate + across * 0.5 + turn.cross(&across) / 12.0;
        let acceleration = self.acceleration(&(self.attitude * force));
        joined([turning, acceleration, self.position_rate()])
    }
}

/// Whether the heading in East-North-Up is defined at a latitude, rad.
pub fn within_reach(latitude: f64) -> Result<(), NearPole> {
    // Written so that not-a-number is refused as well.
    if latitude.abs() <= LARGEST_LATITUDE {
        Ok(())
    } else {
        Err(NearPole { latitude })
    }
}
