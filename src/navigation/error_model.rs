//! The linear error model of strapdown navigation (Eq. 13), continuous and in exact discrete form.

use nalgebra::{Matrix3, RowVector3, SMatrix, SVector, Vector3};

use super::errors::{Rows, blocks};
use super::instrument::{Response, response};
use super::runge_kutta::step;
use super::strapdown::{Height, Instant, Solution};
use crate::attitude::skew;
use crate::earth::{Curvature, SEMI_MAJOR_AXIS, earth_rate_n, normal_gravity_gradient};
use crate::imu::{PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad};
use crate::units::STANDARD_GRAVITY;

pub use super::errors::{ATTITUDE, ErrorMatrix, ErrorVector, POSITION, STATES, VELOCITY};

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
/// The inputs after the states.
const RATE: usize = STATES;
const FORCE: usize = STATES + 3;

/// Sensitivity of navigation errors to input errors.
pub type InputMatrix = SMatrix<f64, STATES, INPUTS>;

/// `ẋ = F x + G ε` about a true state, with ε the errors of the sensed rate and force.
///
/// Eq. 13 as printed has errors that are corrected here (Groves, 2nd ed., §14.2.4, has the same model
/// in North-East-Down):
/// * `δλ̇ = δV_E sec L/(R_N+h) + δL V_E tan L sec L/(R_N+h) − δh V_E sec L/(R_N+h)²`; as printed, the first term lacks
///   sec L and the second has a minus sign.
/// * `R_M` and `R_N` are the radii of the meridian and of the prime vertical; the paper calls them equatorial and polar
///   radius.
/// * The brackets in `δV̇` and `φ̇` are errors of the sensed quantity, `û − u`, not `û`; ε and ∇ at the end of the
///   lines denote the same errors and must not be counted twice.
/// * As printed, `V × (2δω_ie + δω_en)` belongs to `δV̇`. The change of gravity with height and latitude, which is not
///   printed, is added; without this term, a free height would not be unstable.
///
/// The linear model neglects that a vertical error of specific force changes the period of the Schuler oscillation,
/// even if the height is fixed: after a time t the phase error is `ω_s t ∇_U / 2g`, one degree in 40 h for 0.2 mg.
///
/// The change of the radii with latitude is included, so that the model is the exact derivative of
/// [`super::Strapdown`].
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorModel {
    /// F.
    pub dynamics: ErrorMatrix,
    /// G.
    pub input: InputMatrix,
}

impl ErrorModel {
    /// The model about a true state with this specific force along body axes, m/s². If the height is fixed, the errors
    /// of height and vertical velocity are zero, and seven states remain.
    pub fn about(truth: &Solution, force: &Vector3<f64>, height: Height) -> Self {
        let (latitude, transport) = (truth.latitude, truth.transport_rate());
        let earth = earth_rate_n(latitude);
        let (tan, sec) = (latitude.tan(), 1.0 / latitude.cos());
        // Columns by latitude, longitude and height.
        let zero = Vector3::zeros();
        let earth_by = Matrix3::from_columns(&[Vector3::new(0.0, -earth.z, earth.y), zero, zero]);
        let (by_velocity, transport_by) = transport_slopes(truth, &transport);
        let turning_by = earth_by + transport_by;
        let (north, up) = normal_gravity_gradient(latitude, truth.height);
        let gravity_by = Vector3::z() * RowVector3::new(north, 0.0, up);
        let moves = Matrix3::from_diagonal(&Vector3::new(-1.0, sec, 0.0));
        // −δω_en × V = V × δω_en.
        let across = skew(truth.velocity);
        let coriolis = across * by_velocity - skew(earth * 2.0 + transport);
        let coriolis_by = across * (earth_by + turning_by);

        let mut f: ErrorMatrix = blocks(&[
            (ATTITUDE, ATTITUDE, -skew(earth + transport)),
            (ATTITUDE, VELOCITY, by_velocity),
            (ATTITUDE, POSITION, turning_by),
            (VELOCITY, ATTITUDE, skew(truth.attitude * force)),
            (VELOCITY, VELOCITY, coriolis),
            (VELOCITY, POSITION, coriolis_by - gravity_by),
            (POSITION, VELOCITY, moves * by_velocity),
            (POSITION, POSITION, moves * transport_by),
        ]);
        f[(LONGITUDE, LATITUDE)] += transport.y * tan * sec;
        f[(HEIGHT, VELOCITY + UP)] = 1.0;
        let attitude = truth.attitude;
        let mut g: InputMatrix = blocks(&[(ATTITUDE, 0, -attitude), (VELOCITY, 3, attitude)]);
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

    /// The exact discrete form over a time in s in which F, G and ε are constant: any time for a body at rest or in
    /// steady motion; otherwise, a time over which attitude and velocity are nearly constant (Van Loan, "Computing
    /// integrals involving the matrix exponential", IEEE Trans. Automatic Control 23, 1978).
    pub fn over(&self, duration: f64) -> Transition {
        // All entries of the scaled matrix are of the order of the Schuler frequency, so the exponential remains
        // accurate over hours.
        let schuler = (STANDARD_GRAVITY / SEMI_MAJOR_AXIS).sqrt();
        let unit = SVector::<f64, { STATES + INPUTS }>::from_fn(|i, _| match i {
            VELOCITY..POSITION => schuler * SEMI_MAJOR_AXIS,
            HEIGHT => SEMI_MAJOR_AXIS,
            RATE..FORCE => schuler,
            FORCE.. => STANDARD_GRAVITY,
            _ => 1.0,
        });

        let mut joined = Joined::zeros();
        joined
            .fixed_view_mut::<STATES, STATES>(0, 0)
            .copy_from(&self.dynamics);
        joined
            .fixed_view_mut::<STATES, INPUTS>(0, STATES)
            .copy_from(&self.input);
        let scaled = Joined::from_fn(|i, j| joined[(i, j)] * duration * unit[j] / unit[i]).exp();
        let exact = Joined::from_fn(|i, j| scaled[(i, j)] * unit[i] / unit[j]);
        Transition {
            errors: exact.fixed_view::<STATES, STATES>(0, 0).into_owned(),
            input: exact.fixed_view::<STATES, INPUTS>(0, STATES).into_owned(),
        }
    }
}

/// States before inputs.
type Joined = SMatrix<f64, { STATES + INPUTS }, { STATES + INPUTS }>;

/// Derivatives of the transport rate with respect to velocity, and to latitude, longitude and height.
fn transport_slopes(truth: &Solution, transport: &Vector3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
    let (tan, sec) = (truth.latitude.tan(), 1.0 / truth.latitude.cos());
    let slope = Curvature::slope(truth.latitude);
    let radii = Curvature::at(truth.latitude);
    let r_m = radii.meridian + truth.height;
    let r_n = radii.prime_vertical + truth.height;
    let mut by_velocity = Matrix3::zeros();
    by_velocity[(EAST, NORTH)] = -1.0 / r_m;
    by_velocity[(NORTH, EAST)] = 1.0 / r_n;
    by_velocity[(UP, EAST)] = tan / r_n;
    let by_height = -transport.component_div(&Vector3::new(r_m, r_n, r_n));
    let slopes = Vector3::new(slope.meridian, slope.prime_vertical, slope.prime_vertical);
    let mut by_latitude = by_height.component_mul(&slopes);
    by_latitude.z += truth.velocity.x * sec * sec / r_n;
    let by_position = Matrix3::from_columns(&[by_latitude, Vector3::zeros(), by_height]);
    (by_velocity, by_position)
}

/// The error model over a step: `x ← Φ x + Γ ε`. Sensitivities to constants obey the same equation, with `∂ε/∂θ` in
/// place of ε.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    /// Φ.
    pub errors: ErrorMatrix,
    /// Γ.
    pub input: InputMatrix,
}

/// `∂x/∂θ`, navigation errors with respect to `N` unknown constants: the input errors themselves (`N = 6`) or the
/// parameters of both triads ([`PARAMETERS`], [`SensedErrors`]). Zero if navigation starts without errors.
pub type Sensitivity<const N: usize = PARAMETERS> = SMatrix<f64, STATES, N>;

/// `∂ε/∂θ`, errors of the sensed rate and force with respect to parameter errors δθ = true − estimated: `(K̂Ĉ)⁻¹ ∂(K C
/// u + D)/∂θ`, linear in `[u; 1]`.
#[derive(Debug, Clone)]
pub struct SensedErrors(PerSensor<Response>);

impl SensedErrors {
    /// The errors in the quantities that these triads sense.
    ///
    /// # Errors
    /// A triad whose sensitivity is singular.
    pub fn new(triads: &PerSensor<Triad>) -> Result<Self, Sensor> {
        let of = |sensor: Sensor| {
            let triad = triads.get(sensor);
            Ok(response(triad, &triad.correction().ok_or(sensor)?))
        };
        Ok(Self(PerSensor {
            gyro: of(Sensor::Gyro)?,
            accel: of(Sensor::Accel)?,
        }))
    }

    /// The derivatives at this true state and input.
    pub fn at(&self, at: &Instant) -> SMatrix<f64, INPUTS, PARAMETERS> {
        let mut sensed = SMatrix::<f64, INPUTS, PARAMETERS>::zeros();
        for (place, (sensor, u)) in Sensor::ALL.into_iter().zip([at.rate, at.force]).enumerate() {
            for axis in 0..3 {
                let weights = self.0.get(sensor).fixed_rows::<4>(4 * axis);
                sensed
                    .fixed_view_mut::<1, PER_TRIAD>(3 * place + axis, PER_TRIAD * place)
                    .copy_from(&u.push(1.0).tr_mul(&weights));
            }
        }
        sensed
    }
}

/// The linear error model at one moment, with the height fixed: `ẋ = F x + G (∂ε/∂θ) θ`.
#[derive(Debug, Clone)]
pub struct Linearisation {
    dynamics: Rows<STATES, STATES>,
    forcing: Rows<STATES, PARAMETERS>,
}

impl Linearisation {
    /// The linear model about a true motion.
    pub fn about(at: &Instant, sensed: &SensedErrors) -> Self {
        let ErrorModel { dynamics, input } = at.linear_model();
        Self {
            dynamics: dynamics.transpose(),
            forcing: sensed.at(at).tr_mul(&input.transpose()),
        }
    }

    /// Propagates sensitivities over a step of this duration in s, linearised at start, middle and end.
    pub fn follow(before: &Sensitivity, duration: f64, linearised: [&Self; 3]) -> Sensitivity {
        let rate =
            |linear: &Self, at: &Rows<STATES, PARAMETERS>| linear.forcing + at * linear.dynamics;
        step(&before.transpose(), duration, linearised, rate).transpose()
    }
}

impl Instant {
    /// The linear error model at this moment, with the height fixed.
    pub fn linear_model(&self) -> ErrorModel {
        let held = Height::Held {
            height: self.truth.height,
            velocity: self.truth.velocity.z,
        };
        ErrorModel::about(&self.truth, &self.force, held)
    }
}
