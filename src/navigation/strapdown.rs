//! Strapdown navigation on the WGS-84 ellipsoid: attitude, velocity and position, nonlinear.
//!
//! With `C = C_b_n`, specific force f and everything in East-North-Up (Groves, *Principles of GNSS,
//! Inertial, and Multisensor Integrated Navigation Systems*, 2nd ed., §5.4; Titterton and Weston,
//! *Strapdown Inertial Navigation Technology*, 2nd ed., §3.5.3):
//!
//! `Ċ = C [ω_ib×] − [ω_in×] C`, `V̇ = C f − (2ω_ie + ω_en) × V + g`,
//! `L̇ = V_N / (R_M + h)`, `λ̇ = V_E / ((R_N + h) cos L)`, `ḣ = V_U`.

use nalgebra::{Matrix3, Vector3};
use thiserror::Error;

use super::increments::Increments;
use crate::attitude::{exp, orthonormalised};
use crate::earth::{Curvature, earth_rate_n, normal_gravity};
use crate::units::DEGREE;

/// Latitude in radians, north or south, beyond which East-North-Up is not navigated in: heading and
/// longitude lose their meaning at the poles.
pub const LARGEST_LATITUDE: f64 = 89.9 * DEGREE;

/// Where a navigating body is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// `C_b_n`, body to East-North-Up.
    pub attitude: Matrix3<f64>,
    /// Velocity relative to the Earth, East-North-Up, m/s.
    pub velocity: Vector3<f64>,
    /// Geodetic latitude in radians, north positive.
    pub latitude: f64,
    /// Longitude in radians, east positive, counted on without wrapping.
    pub longitude: f64,
    /// Height above the ellipsoid in m.
    pub height: f64,
}

impl Solution {
    /// Transport rate `ω_en` in East-North-Up, rad/s.
    #[inline]
    pub fn transport_rate(&self) -> Vector3<f64> {
        let Curvature {
            meridian,
            prime_vertical,
        } = Curvature::at(self.latitude);
        let east = self.velocity.x / (prime_vertical + self.height);
        let north = self.velocity.y / (meridian + self.height);
        let (sin, cos) = self.latitude.sin_cos();
        Vector3::new(-north, east, east * (sin / cos))
    }

    /// Acceleration relative to the Earth in East-North-Up, m/s², under a specific force in the same
    /// axes: Coriolis, transport and normal gravity added.
    #[inline]
    pub fn acceleration(&self, force: &Vector3<f64>) -> Vector3<f64> {
        let turning = earth_rate_n(self.latitude) * 2.0 + self.transport_rate();
        let mut acceleration = force - turning.cross(&self.velocity);
        acceleration.z -= normal_gravity(self.latitude, self.height);
        acceleration
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

    /// The same attitude and velocity elsewhere: so much further in latitude and longitude (rad) and height (m).
    pub(super) fn moved(&self, by: &Vector3<f64>) -> Self {
        Self {
            latitude: self.latitude + by.x,
            longitude: self.longitude + by.y,
            height: self.height + by.z,
            ..*self
        }
    }

    /// Angular rate `ω_ib` (rad/s) and specific force (m/s²) along body axes of a body that keeps its
    /// attitude and its velocity in East-North-Up; at zero velocity, of one that stands.
    pub fn steady(&self) -> (Vector3<f64>, Vector3<f64>) {
        let turning = earth_rate_n(self.latitude) + self.transport_rate();
        let needed = -self.acceleration(&Vector3::zeros());
        (
            self.attitude.tr_mul(&turning),
            self.attitude.tr_mul(&needed),
        )
    }
}

/// What becomes of height, which diverges e-fold in ten minutes when left to itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Height {
    /// Nothing holds it.
    Free,
    /// Height (m) and vertical velocity (m/s) are those of a reference at the end of the step.
    Held {
        /// Height above the ellipsoid in m.
        height: f64,
        /// Vertical velocity in m/s, up positive.
        velocity: f64,
    },
}

/// Navigation came too near to a pole.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error(
    "navigation reached latitude {:.3}°, and East-North-Up has no heading near a pole: stay within ±{:.1}°",
    latitude / DEGREE,
    LARGEST_LATITUDE / DEGREE
)]
pub struct NearPole {
    /// The latitude that was reached, rad.
    pub latitude: f64,
}

/// Navigates from increments.
///
/// What the body does within a step comes from the increments with coning and sculling
/// ([`Increments::motion`], third order in the step); the slow part — the turn of East-North-Up,
/// Coriolis, gravity and position — is integrated with a Runge–Kutta step of fourth order, in which
/// specific force changes linearly. A standing instrument can therefore be navigated in steps of tens
/// of seconds.
#[derive(Debug, Clone)]
pub struct Strapdown {
    period: f64,
    before: Option<Increments>,
    solution: Solution,
}

/// Derivatives, or changes, of what moves slowly.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slow {
    /// Rotation vector of East-North-Up since the step began, rad.
    pub turn: Vector3<f64>,
    pub velocity: Vector3<f64>,
    /// Latitude and longitude in rad, height in m.
    pub position: Vector3<f64>,
}

impl Strapdown {
    /// Starts somewhere; every step is `period` seconds long.
    ///
    /// # Errors
    /// If the start is too near to a pole.
    pub fn new(start: Solution, period: f64) -> Result<Self, NearPole> {
        within_reach(start.latitude)?;
        Ok(Self {
            period,
            before: None,
            solution: start,
        })
    }

    /// Where navigation stands.
    pub fn solution(&self) -> &Solution {
        &self.solution
    }

    /// Navigates through one step.
    ///
    /// # Errors
    /// If the step leads too near to a pole; navigation then stays where it was.
    pub fn advance(&mut self, increments: &Increments, height: Height) -> Result<(), NearPole> {
        let period = self.period;
        let start = &self.solution;
        let before = self.before.unwrap_or(*increments);
        let motion = increments.motion(&before);

        // Specific force in East-North-Up as it stood when the step began: mean and change.
        let mean = start.attitude * motion.velocity / period;
        let change = start.attitude
            * (increments.angle.cross(&increments.velocity) + increments.velocity
                - before.velocity)
            / period;
        let at = |part: f64, change_so_far: Option<(&Slow, f64)>| {
            let (state, turn) = start.after(change_so_far, part, period, height);
            let force = mean + change * (part - 0.5);
            state.slow(&turn, &force)
        };
        let k1 = at(0.0, None);
        let k2 = at(0.5, Some((&k1, 0.5 * period)));
        let k3 = at(0.5, Some((&k2, 0.5 * period)));
        let k4 = at(1.0, Some((&k3, period)));
        let mean = Slow::mean(&[k1, k2, k3, k4]);

        let (mut end, turn) = start.after(Some((&mean, period)), 1.0, period, height);
        within_reach(end.latitude)?;
        end.attitude = orthonormalised(&(exp(-turn) * start.attitude * exp(motion.rotation)));
        self.solution = end;
        self.before = Some(*increments);
        Ok(())
    }
}

impl Slow {
    /// Of the four stages of a step, with the weights of Runge and Kutta.
    #[inline]
    fn mean([k1, k2, k3, k4]: &[Self; 4]) -> Self {
        let of = |part: fn(&Self) -> Vector3<f64>| {
            (part(k1) + (part(k2) + part(k3)) * 2.0 + part(k4)) / 6.0
        };
        Self {
            turn: of(|k| k.turn),
            velocity: of(|k| k.velocity),
            position: of(|k| k.position),
        }
    }
}

impl Solution {
    /// Velocity and position after changing at a rate for a time, and the turn of East-North-Up till
    /// then; `part` of the step has gone by. Attitude is left as it was.
    #[inline]
    fn after(
        &self,
        changing: Option<(&Slow, f64)>,
        part: f64,
        period: f64,
        height: Height,
    ) -> (Self, Vector3<f64>) {
        let mut state = *self;
        let mut turn = Vector3::zeros();
        if let Some((rate, time)) = changing {
            turn = rate.turn * time;
            state.velocity += rate.velocity * time;
            state.latitude += rate.position.x * time;
            state.longitude += rate.position.y * time;
            state.height += rate.position.z * time;
        }
        if let Height::Held { height, velocity } = height {
            let bulge = (self.velocity.z - velocity) * period * 0.5 * part * (1.0 - part);
            state.velocity.z = self.velocity.z + (velocity - self.velocity.z) * part;
            state.height = self.height + (height - self.height) * part + bulge;
        }
        (state, turn)
    }

    /// What changes slowly, at this velocity and position, under no specific force.
    #[inline]
    pub(super) fn coasting(&self) -> Slow {
        self.slow(&Vector3::zeros(), &Vector3::zeros())
    }

    /// What changes slowly, at this velocity and position, when East-North-Up has turned since the
    /// step began and the specific force is given in its axes of then.
    #[inline]
    fn slow(&self, turn: &Vector3<f64>, force: &Vector3<f64>) -> Slow {
        let transport = self.transport_rate();
        let rate = earth_rate_n(self.latitude) + transport;
        // Bortz's equation to the order that the turn within a step needs.
        let across = turn.cross(&rate);
        let force = exp(-turn) * force;
        Slow {
            turn: rate + across * 0.5 + turn.cross(&across) / 12.0,
            velocity: self.acceleration(&force),
            position: Vector3::new(
                -transport.x,
                transport.y / self.latitude.cos(),
                self.velocity.z,
            ),
        }
    }
}

/// Whether East-North-Up has a heading at a latitude, rad.
pub(crate) fn within_reach(latitude: f64) -> Result<(), NearPole> {
    // Written so that not-a-number is refused as well.
    if latitude.abs() <= LARGEST_LATITUDE {
        Ok(())
    } else {
        Err(NearPole { latitude })
    }
}
