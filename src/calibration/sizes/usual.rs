//! Typical magnitudes of effects with their priors.

use crate::calibration::chain::Effect;
use crate::calibration::model::SETTLING_TIME;
use crate::calibration::record::schedule::step_length;
use crate::calibration::record::script::Moves;
use crate::calibration::{Group, Model, Problem, Source};
use crate::run::Aiding;

/// Prior 1σ of the logarithm of a stated σ: a factor of three.
pub const LOG_SIGMA: f64 = 1.098_612_288_668_109_8;
/// Prior 1σ of the log σ of an unstated figure, about the effect of white noise: a factor of ten.
const LOG_SIGMA_NOT_STATED: f64 = std::f64::consts::LN_10;
/// Default correlation time of a bias, s.
const CORRELATION_TIME: f64 = 100.0;
/// Typical disturbance of the magnetic field, T: the Earth's field itself varies by tens of nanotesla within hours on a
/// quiet day (Campbell, *Introduction to Geomagnetic Fields*, 2nd ed., ch. 2); a building is found by the data.
const DISTURBANCE: f64 = 2e-9;
/// Typical differences between recordings, divided by the prior σ of an instrument.
const DIFFERENCE: f64 = 0.1;

/// A quantity whose size is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum What {
    /// A source of noise.
    Noise(Source),
    /// The time constant with which a table settles.
    SettlingTime,
    /// The difference between recordings of a group of parameters.
    Difference(Group),
}

/// A typical magnitude with its prior.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Usual {
    pub what: What,
    /// Typical magnitude in SI units and radians; for a difference, a fraction of the prior σ of each parameter.
    pub sigma: f64,
    /// 1σ of its logarithm.
    pub spread: f64,
    /// Whether the size is stated.
    pub stated: bool,
}

impl Usual {
    /// The typical magnitudes of every source that a problem can have, and of the differences between its recordings;
    /// `moves` scales the noise of moves.
    pub fn all(problem: &Problem, moves: &Moves) -> Vec<Self> {
        let sources = Source::ALL.into_iter();
        let sources = sources.filter_map(|source| Self::of(source, problem, moves));
        let settles = problem.model.aiding == Aiding::Table;
        let settling = settles.then_some(Self {
            what: What::SettlingTime,
            sigma: SETTLING_TIME,
            spread: LOG_SIGMA,
            stated: false,
        });
        let several = problem.runs().nth(1).is_some();
        let groups = Group::all().filter(|_| several);
        let differences = groups.filter_map(|group| Self::difference(group, &problem.model));
        sources.chain(settling).chain(differences).collect()
    }

    fn of(source: Source, problem: &Problem, moves: &Moves) -> Option<Self> {
        let stated = source.stated(problem);
        let sigma = if stated {
            source.sigma(problem)
        } else {
            not_stated(source, problem, moves)?
        };
        Self::new(What::Noise(source), sigma, stated)
    }

    fn difference(group: Group, model: &Model) -> Option<Self> {
        let stated = stated_difference(group, model);
        Self::new(
            What::Difference(group),
            stated.unwrap_or(DIFFERENCE),
            stated.is_some(),
        )
    }

    fn new(what: What, sigma: f64, stated: bool) -> Option<Self> {
        let spread = if stated {
            LOG_SIGMA
        } else {
            LOG_SIGMA_NOT_STATED
        };
        (sigma > 0.0).then_some(Self {
            what,
            sigma,
            spread,
            stated,
        })
    }

    /// The effect of the chain that this size scales; `None` if the source acts only within dwells.
    pub fn effect(&self) -> Option<Effect> {
        match self.what {
            What::SettlingTime => None,
            What::Difference(group) => Some(Effect::Difference(group)),
            What::Noise(source) => {
                let at_rest = matches!(
                    source,
                    Source::AngleRandomWalk
                        | Source::VelocityRandomWalk
                        | Source::Velocity
                        | Source::Attitude
                        | Source::RotationAtRest
                        | Source::TableReading
                        | Source::Settling
                );
                (!at_rest).then_some(Effect::Noise(source))
            }
        }
    }

    /// Sets the size in a model, as a logarithm relative to the typical magnitude.
    pub fn set(&self, model: &mut Model, by: f64) {
        let sigma = self.sigma * by.exp();
        match self.what {
            What::SettlingTime => model.settling_time = sigma,
            What::Noise(source) => source.set(model, sigma, CORRELATION_TIME),
            What::Difference(group) => {
                for index in group.parameters(model.form) {
                    let own = &mut model.day_to_day.parameters[index];
                    *own = if self.stated {
                        *own * by.exp()
                    } else {
                        sigma * model.prior_sigma[index]
                    };
                }
            }
        }
    }
}

/// 1σ of the stated differences of a group, divided by the prior σ.
fn stated_difference(group: Group, model: &Model) -> Option<f64> {
    let of = |index: usize| model.day_to_day.parameters[index] / model.prior_sigma[index];
    let each = group.parameters(model.form).into_iter().map(of);
    each.filter(|over| over.is_finite() && *over > 0.0)
        .reduce(f64::max)
}

/// The size at which the effect of a source is about that of the white noise of its triad; `None` if the problem does
/// not have the source, or states all sources of its kind.
fn not_stated(source: Source, problem: &Problem, moves: &Moves) -> Option<f64> {
    let (model, sensor) = (&problem.model, source.triad());
    let table = model.aiding == Aiding::Table;
    let walk = model.noise.get(sensor).random_walk;
    let period = problem.stretches().first()?.run.recording.imu.period;
    let step = step_length(period) as f64 * period;
    match source {
        Source::GyroMotion | Source::AccelMotion => {
            let input = *moves.motion.get(sensor);
            (input > 0.0).then(|| walk * (moves.duration / input).sqrt())
        }
        Source::Velocity => Some(walk * step.sqrt()),
        Source::Attitude => (!table).then(|| walk * step.sqrt()),
        Source::RotationAtRest => (!table).then_some(walk),
        Source::Settling => table.then_some(model.reading_sigma),
        Source::GyroGaussMarkov | Source::AccelGaussMarkov => Some(walk / CORRELATION_TIME.sqrt()),
        Source::MagneticDisturbance => model.magnetic.is_on().then_some(DISTURBANCE),
        _ => None,
    }
}
