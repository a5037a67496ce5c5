//! What navigation hands to a filter: the error model over a stretch of samples.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::increments::Increments;
use super::process_noise::NoiseInput;
use super::state::State;
use crate::attitude::skew;
use crate::imu::{PARAMETERS as PER_TRIAD, PerSensor, Sensor, Term, TermResponse, Triad};

/// Attitude, velocity and position error.
pub const NAVIGATION: usize = 9;
/// Navigation errors against navigation errors.
pub type BlockMatrix = SMatrix<f64, NAVIGATION, NAVIGATION>;
/// Navigation errors against the parameters of one triad.
pub type ParameterBlock = SMatrix<f64, NAVIGATION, PER_TRIAD>;

/// The error model over a stretch of samples: the rows of the transition matrix that differ from
/// identity, what process noise acts on, and the computed state at the end.
///
/// Errors: φ in `C_computed = (I − [φ×]) C_true` (rad), δV and δp computed − true (m/s, m), all
/// East-North-Up; parameter errors δθ true − estimated, in the order of [`crate::imu::TriadVector`].
/// With these signs (Eq. 13 at a standing site)
///
/// `φ̇ = −ω_ie × φ − C_b_n B_g δθ_g`, `δV̇ = f_n × φ − 2ω_ie × δV + C_b_n B_a δθ_a`, `δṗ = δV`,
/// `B = (K̂Ĉ)⁻¹ ∂(K C u + D)/∂θ`.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Computed state at the end.
    pub state: State,
    /// Length in s.
    pub duration: f64,
    /// Transition of the navigation errors.
    pub navigation: BlockMatrix,
    /// Transition from the parameter errors of each triad.
    pub parameters: PerSensor<ParameterBlock>,
    /// Transition from the parameter errors of error terms that are on.
    pub terms: Vec<TermColumn>,
    /// What noise acts on: its covariance follows for any densities.
    pub noise: NoiseInput,
}

/// What the error of one term parameter makes of the navigation errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TermColumn {
    /// The parameter's index among [`crate::imu::TERM_PARAMETERS`].
    pub parameter: usize,
    /// Navigation errors by the parameter's error, true − estimated.
    pub column: SVector<f64, NAVIGATION>,
}

/// Integrals over a stretch of samples from which its [`Block`] follows.
///
/// The output of a triad is linear in `b = [u; 1]` (see [`Triad::response`]), so the integrals of
/// `C_b_n b_k` hold the derivative with respect to every parameter of any installation form.
#[derive(Debug, Clone, Default)]
pub(super) struct Moments {
    /// ∫C_b_n b_k dt with the gyros' input in b.
    gyro: [Matrix3<f64>; 4],
    /// ∫[f_n×] (∫C_b_n b_k dt) dt: what tilts from the gyros make of specific force.
    tilt: [Matrix3<f64>; 4],
    /// ∫C_b_n b_k dt with the accelerometers' input in b.
    accel: [Matrix3<f64>; 4],
    /// ∫f_n dt.
    force: Vector3<f64>,
    duration: f64,
    /// ∫|ω − ω_ie|² dt and ∫|f + g|² dt of a move.
    motion: PerSensor<f64>,
    /// Length of a move, s.
    moving: f64,
    terms: Vec<TermMoment>,
}

/// Integrals of what one term parameter does.
#[derive(Debug, Clone)]
struct TermMoment {
    parameter: usize,
    sensor: Sensor,
    /// ∫C_b_n ∂t/∂q dt.
    input: Vector3<f64>,
    /// ∫[f_n×] (∫C_b_n ∂t/∂q dt) dt, for a parameter of the gyros.
    tilt: Vector3<f64>,
}

impl Moments {
    /// Of no time, with these term parameters on.
    pub(super) fn with_terms(parameters: &[usize]) -> Self {
        let moment = |&parameter: &usize| {
            Some(TermMoment {
                parameter,
                sensor: Term::of(parameter)?.sensor(),
                input: Vector3::zeros(),
                tilt: Vector3::zeros(),
            })
        };
        Self {
            terms: parameters.iter().filter_map(moment).collect(),
            ..Self::default()
        }
    }

    /// Adds a sample's worth of error terms: attitude at its middle, response of both triads, velocity
    /// change by specific force in `n`.
    pub(super) fn add_terms(
        &mut self,
        attitude: &Matrix3<f64>,
        responses: &PerSensor<TermResponse>,
        force: &Vector3<f64>,
        period: f64,
    ) {
        for moment in &mut self.terms {
            let response = responses.get(moment.sensor).column(moment.parameter);
            let step = attitude * response * period;
            moment.tilt += force.cross(&(moment.input + step * 0.5));
            moment.input += step;
        }
    }

    /// Adds a sample: attitude at its middle, increments along body axes, velocity change by
    /// specific force in `n`.
    #[inline]
    pub(super) fn add(
        &mut self,
        attitude: &Matrix3<f64>,
        increments: &Increments,
        force: &Vector3<f64>,
        period: f64,
    ) {
        let Increments { angle, velocity } = increments;
        for k in 0..4 {
            let weight = if k < 3 { angle[k] } else { period };
            let step = attitude * weight;
            // The tilt at the middle of the sample acts on the force of the whole sample.
            let middle = self.gyro[k] + step * 0.5;
            for column in 0..3 {
                let tilt = force.cross(&middle.column(column));
                let mut sum = self.tilt[k].column_mut(column);
                sum += tilt;
            }
            self.gyro[k] += step;
            self.accel[k] += attitude * if k < 3 { velocity[k] } else { period };
        }
        self.force += force;
        self.duration += period;
    }

    /// Of a body that stands for a while: `rate` and `force` in `n`, rad/s and m/s².
    pub(super) fn standing(
        attitude: &Matrix3<f64>,
        rate: &Vector3<f64>,
        force: &Vector3<f64>,
        duration: f64,
    ) -> Self {
        let integrals = |u: Vector3<f64>| u.push(1.0).map(|b| attitude * (b * duration));
        let gyro: [Matrix3<f64>; 4] = integrals(attitude.tr_mul(rate)).into();
        // A tilt that grows evenly acts on the force for half the time.
        let tilting = skew(*force) * (0.5 * duration);
        Self {
            tilt: gyro.map(|moment| tilting * moment),
            gyro,
            accel: integrals(attitude.tr_mul(force)).into(),
            force: force * duration,
            duration,
            ..Self::default()
        }
    }

    /// Adds the motion of a sample of a move: the turn over that of the Earth, rad, and the change of
    /// velocity over that of gravity, m/s.
    #[inline]
    pub(super) fn add_motion(&mut self, turned: &Vector3<f64>, change: &Vector3<f64>, period: f64) {
        self.motion.gyro += turned.norm_squared() / period;
        self.motion.accel += change.norm_squared() / period;
        self.moving += period;
    }

    /// Adds error terms to those of a body that stands.
    pub(super) fn stand_terms(
        &mut self,
        parameters: &[usize],
        attitude: &Matrix3<f64>,
        responses: &PerSensor<TermResponse>,
    ) {
        self.terms = Self::with_terms(parameters).terms;
        // A tilt that grows evenly acts on the force of the whole time for half of it, as in a sample.
        let (force, duration) = (self.force, self.duration);
        self.add_terms(attitude, responses, &force, duration);
    }

    /// The block of these integrals. `bridged` is the covariance, in `n`, that interpolated samples of
    /// each triad add to the integral of its input over the stretch, rad² and (m/s)².
    pub(super) fn block(
        &self,
        state: State,
        earth_rate: &Vector3<f64>,
        responses: PerSensor<&CorrectedResponse>,
        bridged: PerSensor<Matrix3<f64>>,
    ) -> Block {
        let t = self.duration;
        let force = skew(self.force);
        let earth = skew(*earth_rate);
        let identity = Matrix3::identity();

        let mut navigation = BlockMatrix::identity();
        let mut set = |row: usize, column: usize, m: Matrix3<f64>| {
            navigation
                .fixed_view_mut::<3, 3>(3 * row, 3 * column)
                .copy_from(&m);
        };
        set(0, 0, identity - earth * t);
        set(1, 0, force);
        set(1, 1, identity - earth * (2.0 * t));
        set(2, 0, force * (0.5 * t));
        set(2, 1, identity * t);

        let mut parameters: PerSensor<ParameterBlock> =
            PerSensor::from_fn(|_| ParameterBlock::zeros());
        for p in 0..PER_TRIAD {
            let attitude = -product(&self.gyro, &responses.gyro.0[p]);
            let tilt = -product(&self.tilt, &responses.gyro.0[p]);
            let velocity = product(&self.accel, &responses.accel.0[p]);
            let mut gyro = parameters.gyro.column_mut(p);
            gyro.fixed_rows_mut::<3>(0).copy_from(&attitude);
            gyro.fixed_rows_mut::<3>(3).copy_from(&tilt);
            // A tilt that grows with time moves velocity with t² and position with t³.
            gyro.fixed_rows_mut::<3>(6).copy_from(&(tilt * (t / 3.0)));
            let mut accel = parameters.accel.column_mut(p);
            accel.fixed_rows_mut::<3>(3).copy_from(&velocity);
            accel
                .fixed_rows_mut::<3>(6)
                .copy_from(&(velocity * (t / 2.0)));
        }

        let terms = self.terms.iter().map(|moment| {
            let mut column = SVector::<f64, NAVIGATION>::zeros();
            let mut set = |row: usize, v: Vector3<f64>| {
                column.fixed_rows_mut::<3>(3 * row).copy_from(&v);
            };
            match moment.sensor {
                Sensor::Gyro => {
                    set(0, -moment.input);
                    set(1, -moment.tilt);
                    set(2, -moment.tilt * (t / 3.0));
                }
                Sensor::Accel => {
                    set(1, moment.input);
                    set(2, moment.input * (t / 2.0));
                }
            }
            TermColumn {
                parameter: moment.parameter,
                column,
            }
        });

        // Of no time there is no mean, and no noise either.
        let mean_force = if t > 0.0 {
            self.force / t
        } else {
            Vector3::zeros()
        };
        Block {
            state,
            duration: t,
            navigation,
            parameters,
            terms: terms.collect(),
            noise: NoiseInput {
                motion: self.motion,
                moving: self.moving,
                ..NoiseInput::bridging(t, mean_force, bridged)
            },
        }
    }
}

/// Σ_k M_k v_k over the columns of a triad's corrected response.
#[inline]
fn product(moments: &[Matrix3<f64>; 4], response: &SMatrix<f64, 3, 4>) -> Vector3<f64> {
    moments
        .iter()
        .zip(response.column_iter())
        .map(|(moment, column)| moment * column)
        .sum()
}

/// `(K̂Ĉ)⁻¹ W_p` for every parameter: the error of the computed input is this times `[u; 1]`.
#[derive(Debug, Clone)]
pub(super) struct CorrectedResponse([SMatrix<f64, 3, 4>; PER_TRIAD]);

impl CorrectedResponse {
    pub(super) fn new(triad: &Triad, correction: &Matrix3<f64>) -> Self {
        Self(triad.response().map(|w| correction * w))
    }

    /// Error of the computed input by one parameter's error, at an input.
    pub(super) fn error(&self, parameter: usize, u: &Vector3<f64>) -> Vector3<f64> {
        self.0[parameter] * u.push(1.0)
    }
}
