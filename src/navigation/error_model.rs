//! The linear error model of strapdown navigation (Eq. 13), continuous and in exact discrete form.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::sensitivity::SensedErrors;
use super::strapdown::{Height, Solution};
use crate::attitude::{exp, skew};
use crate::earth::{
    Curvature, ROTATION_RATE, SEMI_MAJOR_AXIS, earth_rate_n, normal_gravity_gradient,
};
use crate::imu::{PARAMETERS as PER_TRIAD, PerSensor, Triad};
use crate::units::STANDARD_GRAVITY;

/// Attitude error φ, `C_computed = (I − [φ×]) C_true`, East-North-Up, rad.
pub const ATTITUDE: usize = 0;
/// Velocity error δV, computed − true, East-North-Up, m/s.
pub const VELOCITY: usize = 3;
/// Position error, computed − true: δL and δλ in rad, δh in m.
pub const POSITION: usize = 6;
/// Number of states.
pub const STATES: usize = 9;
/// Number of inputs: errors of the sensed angular rate (rad/s) and specific force (m/s²), computed −
/// true, along body axes.
pub const INPUTS: usize = 6;
/// Parameters of both triads, the gyros' before the accelerometers', each in the order of
/// [`crate::imu::TriadVector`].
pub const PARAMETERS: usize = 2 * PER_TRIAD;

const EAST: usize = 0;
const NORTH: usize = 1;
const UP: usize = 2;
const LATITUDE: usize = POSITION;
const LONGITUDE: usize = POSITION + 1;
const HEIGHT: usize = POSITION + 2;

/// A vector of the states.
pub type ErrorVector = SVector<f64, STATES>;
/// A matrix of the states.
pub type ErrorMatrix = SMatrix<f64, STATES, STATES>;
/// Navigation errors against input errors.
pub type InputMatrix = SMatrix<f64, STATES, INPUTS>;

/// `ẋ = F x + G ε` about a true state, with ε the errors of the sensed rate and force.
///
/// Eq. 13 as printed has slips that are put right here (Groves, 2nd ed., §14.2.4, has the same model
/// in North-East-Down):
/// * `δλ̇ = δV_E sec L/(R_N+h) + δL V_E tan L sec L/(R_N+h) − δh V_E sec L/(R_N+h)²`; printed, the
///   first term lacks sec L and the second has a minus.
/// * `R_M` and `R_N` are the radii of the meridian and of the prime vertical; printed, they are named
///   equatorial and polar radius.
/// * The brackets in `δV̇` and `φ̇` are errors of the sensed quantity, `û − u`, not `û`; and ε and ∇ at
///   the end of the lines are these same errors, not to be counted twice.
/// * `V × (2δω_ie + δω_en)` belongs to `δV̇` as printed; gravity's change with height and latitude,
///   which is not printed, is added: without it a free height has no instability.
///
/// What is linear leaves out that a vertical error of specific force changes the period of the Schuler
/// motion, also where height is held: after a time t its phase is off by `ω_s t ∇_U / 2g`, one degree
/// in 40 h for 0.2 mg.
///
/// Radii change with latitude: that is kept, so that the model is the derivative of
/// [`super::Strapdown`] and not only near to it.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorModel {
    /// F.
    pub dynamics: ErrorMatrix,
    /// G.
    pub input: InputMatrix,
}

impl ErrorModel {
    /// About a true state with this specific force along body axes, m/s². Where height is held its
    /// error and that of vertical velocity are zero, and seven states remain.
    pub fn about(truth: &Solution, force: &Vector3<f64>, height: Height) -> Self {
        let Solution {
            velocity,
            latitude,
            height: h,
            ..
        } = *truth;
        let (sin, cos) = latitude.sin_cos();
        let (tan, sec) = (sin / cos, 1.0 / cos);
        let radii = Curvature::at(latitude);
        let slope = Curvature::slope(latitude);
        let (r_m, r_n) = (radii.meridian + h, radii.prime_vertical + h);
        let earth = earth_rate_n(latitude);
        let transport = truth.transport_rate();

        // Earth rate against latitude; transport rate against velocity and position.
        let earth_by_latitude = Vector3::new(0.0, -ROTATION_RATE * sin, ROTATION_RATE * cos);
        let mut by_velocity = Matrix3::zeros();
        by_velocity[(EAST, NORTH)] = -1.0 / r_m;
        by_velocity[(NORTH, EAST)] = 1.0 / r_n;
        by_velocity[(UP, EAST)] = tan / r_n;
        let by_height = Vector3::new(-transport.x / r_m, -transport.y / r_n, -transport.z / r_n);
        let mut by_latitude = Vector3::new(
            by_height.x * slope.meridian,
            by_height.y * slope.prime_vertical,
            by_height.z * slope.prime_vertical,
        );
        by_latitude.z += velocity.x * sec * sec / r_n;

        let mut f = ErrorMatrix::zeros();
        let mut set = |row: usize, column: usize, m: Matrix3<f64>| {
            f.fixed_view_mut::<3, 3>(row, column).copy_from(&m);
        };
        set(ATTITUDE, ATTITUDE, -skew(earth + transport));
        set(ATTITUDE, VELOCITY, by_velocity);
        set(VELOCITY, ATTITUDE, skew(truth.attitude * force));
        // −δω_en × V = V × δω_en.
        let across = skew(velocity);
        set(
            VELOCITY,
            VELOCITY,
            across * by_velocity - skew(earth * 2.0 + transport),
        );
        let (gravity_north, gravity_up) = normal_gravity_gradient(latitude, h);
        let positions = [
            (
                LATITUDE,
                earth_by_latitude + by_latitude,
                across * (earth_by_latitude * 2.0 + by_latitude),
                gravity_north,
            ),
            (HEIGHT, by_height, across * by_height, gravity_up),
        ];
        for (column, turning, acceleration, gravity) in positions {
            f.fixed_view_mut::<3, 1>(ATTITUDE, column)
                .copy_from(&turning);
            f.fixed_view_mut::<3, 1>(VELOCITY, column)
                .copy_from(&(acceleration - Vector3::z() * gravity));
        }
        f[(LATITUDE, VELOCITY + NORTH)] = 1.0 / r_m;
        f[(LATITUDE, LATITUDE)] = -by_latitude.x;
        f[(LATITUDE, HEIGHT)] = -by_height.x;
        f[(LONGITUDE, VELOCITY + EAST)] = sec / r_n;
        f[(LONGITUDE, LATITUDE)] = by_latitude.y * sec + transport.y * tan * sec;
        f[(LONGITUDE, HEIGHT)] = by_height.y * sec;
        f[(HEIGHT, VELOCITY + UP)] = 1.0;

        let mut g = InputMatrix::zeros();
        g.fixed_view_mut::<3, 3>(ATTITUDE, 0)
            .copy_from(&-truth.attitude);
        g.fixed_view_mut::<3, 3>(VELOCITY, 3)
            .copy_from(&truth.attitude);
        if matches!(height, Height::Held { .. }) {
            for state in [VELOCITY + UP, HEIGHT] {
                f.row_mut(state).fill(0.0);
                f.column_mut(state).fill(0.0);
                g.row_mut(state).fill(0.0);
            }
        }
        Self {
            dynamics: f,
            input: g,
        }
    }

    /// The exact discrete form over a time in s in which F, G and ε are constant: for a body that
    /// stands or moves steadily of any length, otherwise as long as attitude and velocity may be taken
    /// for constant (Van Loan, "Computing integrals involving the matrix exponential", IEEE Trans.
    /// Automatic Control 23, 1978).
    pub fn over(&self, duration: f64) -> Transition {
        // All entries of the scaled matrix are about the Schuler frequency, so the exponential keeps
        // its digits over hours.
        let schuler = (STANDARD_GRAVITY / SEMI_MAJOR_AXIS).sqrt();
        let speed = schuler * SEMI_MAJOR_AXIS;
        let state = ErrorVector::from_fn(|i, _| match i {
            ATTITUDE..VELOCITY => 1.0,
            VELOCITY..POSITION => speed,
            HEIGHT => SEMI_MAJOR_AXIS,
            _ => 1.0,
        });
        let input =
            SVector::<f64, INPUTS>::from_fn(|i, _| if i < 3 { schuler } else { STANDARD_GRAVITY });

        let mut joined = SMatrix::<f64, { STATES + INPUTS }, { STATES + INPUTS }>::zeros();
        for row in 0..STATES {
            for column in 0..STATES {
                joined[(row, column)] =
                    self.dynamics[(row, column)] * duration * state[column] / state[row];
            }
            for column in 0..INPUTS {
                joined[(row, STATES + column)] =
                    self.input[(row, column)] * duration * input[column] / state[row];
            }
        }
        let exponential = joined.exp();
        Transition {
            errors: ErrorMatrix::from_fn(|row, column| {
                exponential[(row, column)] * state[row] / state[column]
            }),
            input: InputMatrix::from_fn(|row, column| {
                exponential[(row, STATES + column)] * state[row] / input[column]
            }),
        }
    }
}

/// The error model over a step: `x ← Φ x + Γ ε`.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    /// Φ.
    pub errors: ErrorMatrix,
    /// Γ.
    pub input: InputMatrix,
}

/// How navigation errors depend on `N` unknown constants, followed along a trajectory.
///
/// The constants may be the input errors themselves (`N = 6`, [`Self::advance`] with the identity) or
/// the parameters of both triads (`N = 24`, with [`sensed_errors`]).
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity<const N: usize>(
    /// `∂x/∂θ`, each state by each constant.
    pub SMatrix<f64, STATES, N>,
);

impl<const N: usize> Sensitivity<N> {
    /// Navigation starts without errors.
    pub fn new() -> Self {
        Self(SMatrix::zeros())
    }

    /// Goes on by a step in which `sensed` is `∂ε/∂θ`.
    pub fn advance(&mut self, step: &Transition, sensed: &SMatrix<f64, INPUTS, N>) {
        self.0 = step.errors * self.0 + step.input * sensed;
    }

    /// Navigation errors that these constants cause.
    pub fn errors(&self, constants: &SVector<f64, N>) -> ErrorVector {
        self.0 * constants
    }

    /// Covariance of the navigation errors from that of the constants.
    pub fn covariance(&self, constants: &SMatrix<f64, N, N>) -> ErrorMatrix {
        self.0 * constants * self.0.transpose()
    }
}

impl<const N: usize> Default for Sensitivity<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// `∂ε/∂θ`, errors of the sensed rate and force by parameter errors δθ = true − estimated, at an
/// angular rate (rad/s) and specific force (m/s²) along body axes: `(K̂Ĉ)⁻¹ ∂(K C u + D)/∂θ`.
/// `None` where the sensitivity of a triad is singular.
pub fn sensed_errors(
    triads: &PerSensor<Triad>,
    rate: &Vector3<f64>,
    force: &Vector3<f64>,
) -> Option<SMatrix<f64, INPUTS, PARAMETERS>> {
    Some(SensedErrors::new(triads).ok()?.at(rate, force))
}

impl Solution {
    /// The computed solution that has these errors against this true one.
    pub fn with_errors(&self, errors: &ErrorVector) -> Self {
        Self {
            attitude: exp(-errors.fixed_rows::<3>(ATTITUDE)) * self.attitude,
            velocity: self.velocity + errors.fixed_rows::<3>(VELOCITY),
            latitude: self.latitude + errors[LATITUDE],
            longitude: self.longitude + errors[LONGITUDE],
            height: self.height + errors[HEIGHT],
        }
    }

    /// The errors of this computed solution against the true one.
    pub fn errors(&self, truth: &Self) -> ErrorVector {
        let mut errors = ErrorVector::zeros();
        let turned = crate::attitude::log(&(self.attitude * truth.attitude.transpose()));
        errors.fixed_rows_mut::<3>(ATTITUDE).copy_from(&-turned);
        errors
            .fixed_rows_mut::<3>(VELOCITY)
            .copy_from(&(self.velocity - truth.velocity));
        errors[LATITUDE] = self.latitude - truth.latitude;
        errors[LONGITUDE] = self.longitude - truth.longitude;
        errors[HEIGHT] = self.height - truth.height;
        errors
    }
}
