//! Usual sizes of the sources of noise, and how well each is known beforehand.

use crate::calibration::record::schedule::step_length;
use crate::calibration::reduction::Moves;
use crate::calibration::{Model, Problem, Source};
use crate::run::Aiding;

/// Prior 1σ of ln σ of a stated figure: a factor of three.
pub const LOG_SIGMA: f64 = 1.098_612_288_668_109_8;
/// The same of a figure that is not stated, around what white noise makes: a factor of ten.
const LOG_SIGMA_NOT_STATED: f64 = std::f64::consts::LN_10;
/// Correlation time of a bias without a stated one, s.
const CORRELATION_TIME: f64 = 100.0;

/// A size and how well it is known beforehand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Usual {
    pub source: Source,
    /// In SI and radians.
    pub sigma: f64,
    /// 1σ of its logarithm.
    pub spread: f64,
    /// Whether it is stated.
    pub stated: bool,
}

impl Usual {
    /// Of every source that a problem can have; `moves` scale the noise of moves.
    pub fn all(problem: &Problem, moves: &Moves) -> Vec<Self> {
        let sources = Source::ALL.into_iter();
        sources
            .filter_map(|source| Self::of(source, problem, moves))
            .collect()
    }

    fn of(source: Source, problem: &Problem, moves: &Moves) -> Option<Self> {
        let stated = source.stated(problem);
        let sigma = if stated {
            source.sigma(problem)
        } else {
            not_stated(source, problem, moves)?
        };
        let spread = if stated {
            LOG_SIGMA
        } else {
            LOG_SIGMA_NOT_STATED
        };
        (sigma > 0.0).then_some(Self {
            source,
            sigma,
            spread,
            stated,
        })
    }

    /// Whether it acts within dwells.
    pub fn is_at_rest(&self) -> bool {
        matches!(
            self.source,
            Source::AngleRandomWalk
                | Source::VelocityRandomWalk
                | Source::Velocity
                | Source::Attitude
                | Source::RotationAtRest
                | Source::TableReading
        )
    }

    /// Sets this source in a model, at a logarithm over the usual size.
    pub fn set(&self, model: &mut Model, by: f64) {
        let sigma = self.sigma * by.exp();
        self.source.set(model, sigma, CORRELATION_TIME);
    }
}

/// The size of a source that makes about as much as the white noise of its triad; `None` if the problem does not have
/// it, or states all of its kind.
fn not_stated(source: Source, problem: &Problem, moves: &Moves) -> Option<f64> {
    let (model, sensor) = (&problem.model, source.triad());
    let table = model.aiding == Aiding::Table;
    let walk = model.noise.get(sensor).random_walk;
    let period = problem.stretches().first()?.run.recording.imu.period;
    let step = step_length(period) as f64 * period;
    match source {
        Source::GyroMotion | Source::AccelMotion => {
            let known = source == Source::AccelMotion && model.velocity_anew;
            let input = *moves.motion.get(sensor);
            (!known && input > 0.0).then(|| walk * (moves.duration / input).sqrt())
        }
        Source::Velocity => Some(walk * step.sqrt()),
        Source::Attitude => (!table).then(|| walk * step.sqrt()),
        Source::RotationAtRest => (!table).then_some(walk),
        Source::GyroGaussMarkov | Source::AccelGaussMarkov => Some(walk / CORRELATION_TIME.sqrt()),
        _ => None,
    }
}
