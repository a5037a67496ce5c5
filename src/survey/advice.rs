//! The next move of a hand-held sensor: of 26 attitudes and six turns, the move that reduces the σ most.
//!
//! The information of a short recording of the move (dwell, turn, dwell) is added to the information of the recording
//! so far.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::Survey;
use super::attained::Attained;
use super::field::{AfterMove, FieldDirections};
use crate::attitude::level;
use crate::calibration::{Bound, Options, Problem, bound};
use crate::imu::{InstallationForm, MotionNoise, NoiseSource, PerSensor, Sensor, TermVector};
use crate::lot::{Check, Specification, Verdict};
use crate::recording::Recording;
use crate::run::{Aiding, Run};
use crate::simulation::{Integrator, true_increments};
use crate::turntable::{
    Axis, BodyStep, Imperfection, Motion, Moves, Path, Rotation, Table, TableErrors,
};
use crate::units::DEGREE;

/// Duration of a dwell, s.
const DWELL: f64 = 5.0;
/// Mean rate of a turn by hand, rad/s.
const RATE: f64 = 45.0 * DEGREE;
/// Sample period of the short recordings, s: noise is stated by its density, and hands are slow.
const PERIOD: f64 = 0.05;

/// A move of the instrument, to be followed by a dwell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Move {
    /// A move to the attitude in which this direction points up; the direction is given in right-front-up axes and is
    /// an axis, an edge or a corner.
    Up(Vector3<f64>),
    /// Half a turn about this body axis, right-handed about the positive or negative axis.
    HalfTurn {
        /// Index of the axis (right, front or up).
        axis: usize,
        /// Whether the turn is about the negative axis.
        is_negative: bool,
    },
}

impl Move {
    /// The 26 attitudes and six turns.
    pub fn all() -> impl Iterator<Item = Self> {
        let turns = (0..6).map(|k| Self::HalfTurn {
            axis: k / 2,
            is_negative: k % 2 == 1,
        });
        attitudes().map(up_in).map(Self::Up).chain(turns)
    }

    fn rotation(self) -> Rotation {
        match self {
            Self::Up(axis) => Rotation::Point {
                axis,
                along: Vector3::z(),
            },
            Self::HalfTurn { axis, is_negative } => {
                let angle = if is_negative { -180.0 } else { 180.0 };
                Rotation::By(Vector3::ith(axis, angle * DEGREE))
            }
        }
    }
}

/// An attitude, given by its upward direction with −1, 0 or 1 along each body axis: the direction from the centre of a
/// cube to a face, an edge or a corner.
pub type Attitude = [i8; 3];

/// The six faces, then twelve edges, then eight corners.
fn attitudes() -> impl Iterator<Item = Attitude> {
    (1..=3).flat_map(|parts| {
        let all = (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]);
        all.filter(move |of: &Attitude| of.iter().filter(|part| **part != 0).count() == parts)
    })
}

fn up_in(attitude: Attitude) -> Vector3<f64> {
    Vector3::from(attitude).map(f64::from).normalize()
}

/// The attitude whose upward direction is closest to this direction along body axes.
pub fn nearest_attitude(up: &Vector3<f64>) -> Attitude {
    let apart = |of: &Attitude| up_in(*of).angle(up);
    let nearest = attitudes().min_by(|a, b| apart(a).total_cmp(&apart(b)));
    nearest.unwrap_or([0, 0, 1])
}

/// Chooses moves. The information from each move is cached for each attitude at which the move begins.
#[derive(Debug, Clone, Default)]
pub struct Advisor {
    from: BTreeMap<Attitude, Vec<(Move, DMatrix<f64>)>>,
}

impl Advisor {
    /// The move to advise before any calibration is possible: it turns up the axis whose upward position is farthest
    /// from all dwells.
    pub fn first(&self, survey: &Survey) -> Move {
        let faces = attitudes().take(6).map(up_in);
        let apart = |up: &Vector3<f64>| {
            let angles = survey.rests.iter().map(|rest| rest.force.angle(up));
            angles.fold(f64::INFINITY, f64::min)
        };
        let farthest = faces.max_by(|a, b| apart(a).total_cmp(&apart(b)));
        Move::Up(farthest.unwrap_or(Vector3::z()))
    }

    /// The move that reduces the σ most, starting from the last dwell, and whether the magnetometer alone asks for it.
    /// With a specification, only the σ that are too large for it count; without a specification, all σ count.
    pub fn next(
        &mut self,
        (run, survey): (&Run, &Survey),
        attained: &Attained,
        specification: Option<&Specification>,
    ) -> Option<(Move, bool)> {
        let known = information(&attained.bound)?;
        let up = survey
            .rests
            .last()
            .map_or(Vector3::z(), |rest| rest.force.normalize());
        let from = nearest_attitude(&up);
        // A specification has no limits for magnetometers.
        let field = match specification {
            None => FieldDirections::new((run, survey), &attained.bound),
            Some(_) => None,
        };
        let moves = self
            .from
            .entry(from)
            .or_insert_with(|| worth(run, &up_in(from)));
        let missing = moves.iter().map(|(of, gained)| {
            let covariance = (&known + gained).cholesky().map(|root| root.inverse());
            let of_triads = covariance.map_or(f64::INFINITY, |covariance| {
                missing(
                    attained,
                    &covariance.diagonal().map(f64::sqrt),
                    specification,
                )
            });
            let after = field.as_ref().map(|field| field.after(of.rotation()));
            (*of, of_triads, after.unwrap_or_default())
        });
        let missing: Vec<(Move, f64, AfterMove)> = missing.collect();
        let best = |weight: f64| {
            let sum = |of: &(Move, f64, AfterMove)| of.1 + weight * of.2.log_sigma;
            missing.iter().min_by(|a, b| sum(a).total_cmp(&sum(b)))
        };
        let (best, of_triads) = (best(1.0)?, best(0.0)?);
        Some((best.0, best.2.is_lacking && best.0 != of_triads.0))
    }
}

/// Sum of the log σ. With a specification, relative to the required σ, for σ that are larger; without one, of all σ in
/// units of their prior.
fn missing(
    attained: &Attained,
    sigma: &DVector<f64>,
    specification: Option<&Specification>,
) -> f64 {
    let Attained {
        bound,
        inflation,
        checks,
        ..
    } = attained;
    let Some(specification) = specification else {
        return sigma.iter().map(|sigma| sigma.ln()).sum();
    };
    let over = |check: &Check| {
        let parameter = check.limit.parameter;
        let expected = sigma[parameter] * bound.prior_sigma[parameter] * inflation[parameter];
        let needed = specification.deciding_sigma(check.limit.within);
        (expected / needed).ln().max(0.0)
    };
    let open = checks.iter().filter(|check| check.verdict != Verdict::Pass);
    open.map(over).sum()
}

/// Information on the parameters in units of their prior σ, with that of the prior. Parameters that are not estimated
/// have no other, so records that estimate different parameters can be combined.
fn information(bound: &Bound) -> Option<DMatrix<f64>> {
    let prior = &bound.prior_sigma;
    let mut covariance = DMatrix::identity(prior.len(), prior.len());
    for i in bound.estimate.estimated() {
        for j in bound.estimate.estimated() {
            covariance[(i, j)] = bound.estimate.covariance[(i, j)] / (prior[i] * prior[j]);
        }
    }
    Some(covariance.cholesky()?.inverse())
}

/// Information from each move that begins at an attitude, without the prior.
fn worth(run: &Run, from: &Vector3<f64>) -> Vec<(Move, DMatrix<f64>)> {
    let gained = |of: Move| {
        let information = information(&alone(run, from, of)?)?;
        let n = information.nrows();
        Some((of, information - DMatrix::identity(n, n)))
    };
    Move::all().filter_map(gained).collect()
}

/// The bound of a short recording of one move.
fn alone(run: &Run, from: &Vector3<f64>, of: Move) -> Option<Bound> {
    let start = level(from);
    let rotation = of.rotation();
    let angle = rotation.vector(&start).norm();
    let path = Path {
        first_dwell: DWELL,
        moves: Moves::Body {
            start,
            steps: vec![BodyStep {
                rotation,
                duration: 1.0 + angle / RATE,
                acceleration: 2.0 * RATE,
                dwell: DWELL,
            }],
        },
    };
    let record = Run {
        recording: recording(run, &path)?,
        ..run.clone()
    };
    let options = Options::default().aiding(Aiding::Velocity);
    let mut problem = Problem::new(&record, &options);
    problem.model.motion_noise = PerSensor::from_fn(|_| MotionNoise::BY_HAND);
    let truth = run.instrument.prior_mean(InstallationForm::General);
    bound(&problem, &truth, &TermVector::zeros()).ok()
}

/// The recording of a path by an instrument like that of a run, with its noise.
fn recording(run: &Run, path: &Path) -> Option<Recording> {
    let fast = Axis {
        name: String::new(),
        direction: Vector3::z(),
        max_rate: f64::INFINITY,
        max_acceleration: f64::INFINITY,
    };
    let hand = Table {
        axes: vec![fast],
        mount: Matrix3::identity(),
        errors: TableErrors::default(),
    };
    let motion = Motion::new(&hand, path, &Imperfection::none(&hand)).ok()?;
    let integrator = Integrator {
        period: PERIOD,
        lever_arm: Vector3::zeros(),
        steps: 1,
    };
    let mut samples = true_increments(&motion, &run.site, &integrator, &TermVector::zeros());
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    for sensor in Sensor::ALL {
        let instrument = &run.instrument;
        let mut noise = NoiseSource::new(*instrument.noise.get(sensor), PERIOD, &mut rng);
        let bias = instrument.prior.get(sensor).bias * PERIOD;
        for sample in samples.get_mut(sensor) {
            *sample += bias + noise.draw(&mut rng);
        }
    }
    Recording::from_samples("", 0.0, PERIOD, samples.gyro, samples.accel).ok()
}
