//! The exact, nonlinear deviation of computed navigation from the truth.
//!
//! The true and the computed solution obey the same equations, those of [`super::Strapdown`]. Their difference obeys
//! the difference of these equations, without approximation: with `E = Ĉ Cᵀ` (hats mark computed quantities)
//!
//! `Ė = E [C δω×] + E [ω_in×] − [ω̂_in×] E`, `δω = ω̂_ib − ω_ib`,
//!
//! `δV̇ = E C f̂ − C f + â − a`, `δL̇ = L̂̇ − L̇`, `δλ̇ = λ̂̇ − λ̇`,
//!
//! where `a` is the contribution of gravity and the rotating frame to specific force. All terms are slow compared with
//! the motion of the body and proportional to the instrument errors, so steps of seconds preserve more digits than
//! navigating the samples of an instrument and subtracting the truth. E is stored as a quaternion, because its vector
//! part keeps the digits of a small rotation.

use nalgebra::{Matrix3, SVector, UnitQuaternion, Vector3};

use super::error_model::INPUTS;
use super::errors::{ATTITUDE, ErrorVector, POSITION, STATES, VELOCITY, joined};
use super::runge_kutta::step;
use super::strapdown::{Instant, NearPole, Solution, within_reach};
use crate::attitude::skew;

/// Errors of the sensed angular rate (rad/s), then of specific force (m/s²), computed − true, along body axes.
pub type InputError = SVector<f64, INPUTS>;

/// Index of the scalar part of the quaternion of `E`.
const SCALAR: usize = STATES;

/// The vector part in place of attitude, velocity and position as in an [`ErrorVector`], and the scalar part.
type Errors = SVector<f64, { STATES + 1 }>;

/// Computed minus true navigation, with the height fixed to the true height: E rotates true to computed East-North-Up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NonlinearError(Errors);

impl NonlinearError {
    /// The errors at the start, in the order of [`super::ErrorModel`]; errors of the fixed vertical channel are
    /// ignored.
    pub fn new(start: &ErrorVector) -> Self {
        let turn = UnitQuaternion::from_scaled_axis(-start.fixed_rows::<3>(ATTITUDE));
        let mut errors = start.push(turn.w);
        let mut vector = errors.fixed_rows_mut::<3>(ATTITUDE);
        vector.copy_from(&turn.imag());
        errors[VELOCITY + 2] = 0.0;
        errors[POSITION + 2] = 0.0;
        Self(errors)
    }

    /// Advances by a step of this duration in s, with this forcing at its start, middle and end.
    ///
    /// # Errors If the computed position comes too close to a pole.
    pub fn advance(&mut self, duration: f64, driven: [&Forcing; 3]) -> Result<(), NearPole> {
        let mut next = step(&self.0, duration, driven, Forcing::rate);
        let norm = next[SCALAR].hypot(next.fixed_rows::<3>(ATTITUDE).norm());
        next[SCALAR] /= norm;
        let mut vector = next.fixed_rows_mut::<3>(ATTITUDE);
        vector /= norm;
        within_reach(driven[2].truth.latitude + next[POSITION])?;
        self.0 = next;
        Ok(())
    }

    /// The computed solution that corresponds to this true solution.
    pub fn computed(&self, truth: &Solution) -> Solution {
        let cross = skew(self.0.fixed_rows::<3>(ATTITUDE).into_owned());
        let turn = Matrix3::identity() + (cross * self.0[SCALAR] + cross * cross) * 2.0;
        Solution {
            attitude: turn * truth.attitude,
            ..moved(truth, &self.0)
        }
    }
}

/// Computed velocity and position; the attitude is unchanged.
fn moved(truth: &Solution, errors: &Errors) -> Solution {
    Solution {
        velocity: truth.velocity + errors.fixed_rows::<3>(VELOCITY),
        ..truth.moved(&errors.fixed_rows::<3>(POSITION).into_owned())
    }
}

/// Forcing of the errors at one moment.
#[derive(Debug, Clone, Copy)]
pub struct Forcing {
    truth: Solution,
    slow: ErrorVector,
    /// `C δω`, rad/s.
    drift: Vector3<f64>,
    /// `C f` and `C δf`, m/s².
    force: Vector3<f64>,
    force_error: Vector3<f64>,
}

impl Forcing {
    /// The forcing at this true state with these errors of the sensed input.
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

    fn rate(&self, at: &Errors) -> Errors {
        let (w, v) = (at[SCALAR], at.fixed_rows::<3>(ATTITUDE).into_owned());
        let slow = moved(&self.truth, at).coasting() - self.slow;
        let [turning, velocity, position] =
            [ATTITUDE, VELOCITY, POSITION].map(|first| slow.fixed_rows::<3>(first).into_owned());
        let vector = ((self.drift - turning) * w + v.cross(&(self.drift + turning))) * 0.5
            + v.cross(&self.slow.fixed_rows::<3>(ATTITUDE));
        let turned = v.cross(&(self.force + self.force_error));
        let mut acceleration = self.force_error + (turned * w + v.cross(&turned)) * 2.0 + velocity;
        acceleration.z = 0.0;
        joined([vector, acceleration, position]).push(0.5 * v.dot(&(turning - self.drift)))
    }
}
