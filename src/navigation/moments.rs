//! Integrals over a few samples.

use nalgebra::{Matrix3, Vector3};

use super::increments::Increments;
use super::vectors::Vectors;
use crate::attitude::skew;
use crate::imu::{PerSensor, Sensor, Term, TermResponse};

/// Integrals over a short stretch of samples from which its error model follows.
///
/// The output of a triad is linear in `b = [u; 1]` (see [`crate::imu::Triad::response`]), so the integrals
/// of `C_b_n b_k`, for each column of `C_b_n` one `b_k` after the other, hold the derivative with respect to every
/// parameter of any installation form.
#[derive(Debug, Clone, Default)]
pub(super) struct Moments {
    /// ∫C_b_n b_k dt with the gyros' input in b.
    pub gyro: Vectors<12>,
    /// ∫[(∫f_n dt)×] C_b_n b_k dt with the gyros' input in b.
    forced: Vectors<12>,
    /// ∫C_b_n b_k dt with the accelerometers' input in b.
    pub accel: Vectors<12>,
    /// ∫f_n dt.
    pub force: Vector3<f64>,
    pub duration: f64,
    /// ∫|ω − ω_ie|² dt and ∫|f + g|² dt of a move.
    pub motion: PerSensor<f64>,
    /// Length of a move, s.
    pub moving: f64,
    pub terms: Vec<TermMoment>,
}

/// Integrals of what one term parameter does.
#[derive(Debug, Clone)]
pub(super) struct TermMoment {
    pub parameter: usize,
    pub sensor: Sensor,
    /// ∫C_b_n ∂t/∂q dt.
    pub input: Vector3<f64>,
    /// ∫[f_n×] (∫C_b_n ∂t/∂q dt) dt, for a parameter of the gyros.
    pub tilt: Vector3<f64>,
}

impl Moments {
    /// Of no time, with these term parameters on.
    pub fn with_terms(parameters: &[usize]) -> Self {
        let moment = |&parameter: &usize| {
            Some(TermMoment {
                parameter,
                sensor: Term::of(parameter)?.entry().sensor,
                input: Vector3::zeros(),
                tilt: Vector3::zeros(),
            })
        };
        Self {
            terms: parameters.iter().filter_map(moment).collect(),
            ..Self::default()
        }
    }

    /// Adds a sample: attitude at its middle, increments along body axes, velocity change by
    /// specific force in `n`.
    #[inline]
    pub fn add(
        &mut self,
        attitude: &Matrix3<f64>,
        increments: &Increments,
        force: &Vector3<f64>,
        period: f64,
    ) {
        let Increments { angle, velocity } = increments;
        let input = [angle.x, angle.y, angle.z, period];
        self.gyro.add_outer(attitude, &input);
        // The tilt at the middle of the sample acts on the force of the whole sample.
        let so_far = skew(self.force + force * 0.5);
        self.forced.add_outer(&(so_far * attitude), &input);
        let input = [velocity.x, velocity.y, velocity.z, period];
        self.accel.add_outer(attitude, &input);
        self.force += force;
        self.duration += period;
    }

    /// Of a body that stands for a while: `rate` and `force` in `n`, rad/s and m/s².
    pub fn standing(
        attitude: &Matrix3<f64>,
        rate: &Vector3<f64>,
        force: &Vector3<f64>,
        duration: f64,
    ) -> Self {
        let integrals = |in_n: &Vector3<f64>| {
            let u = attitude.tr_mul(in_n) * duration;
            let mut integrals = Vectors::default();
            integrals.add_outer(attitude, &[u.x, u.y, u.z, duration]);
            integrals
        };
        let gyro = integrals(rate);
        let mut forced = Vectors::default();
        // A tilt that grows evenly acts on the force for half the time.
        forced.add_cross(&(force * (0.5 * duration)), &gyro);
        Self {
            forced,
            gyro,
            accel: integrals(force),
            force: force * duration,
            duration,
            ..Self::default()
        }
    }

    /// ∫[f_n×] (∫C_b_n b_k dt) dt: what tilts from the gyros make of specific force, by parts.
    pub fn tilt(&self) -> Vectors<12> {
        let mut tilt = Vectors::default();
        tilt.add_cross(&self.force, &self.gyro);
        tilt.add(-1.0, &self.forced);
        tilt
    }

    /// Adds the motion of a sample of a move: the turn over that of the Earth, rad, and the change of
    /// velocity over that of gravity, m/s.
    #[inline]
    pub fn add_motion(&mut self, turned: &Vector3<f64>, change: &Vector3<f64>, period: f64) {
        self.motion.gyro += turned.norm_squared() / period;
        self.motion.accel += change.norm_squared() / period;
        self.moving += period;
    }

    /// Adds a sample's worth of error terms: attitude at its middle, response of both triads, velocity
    /// change by specific force in `n`.
    pub fn add_terms(
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

    /// Adds error terms to those of a body that stands.
    pub fn stand_terms(
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
}
