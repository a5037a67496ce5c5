//! The variance of every source, relative to a reference.

use super::source::Source;
use crate::calibration::record::schedule::step_length;
use crate::calibration::reduction::Moves;
use crate::calibration::{Model, Problem};
use crate::run::Aiding;

/// Number of sources.
pub const SOURCES: usize = Source::ALL.len();

/// Variance of each source relative to its reference, in the order of [`Source::ALL`].
pub type Factors = [f64; SOURCES];

/// Reference variances: the stated ones; for figures that are not stated, the equivalent of the stated random
/// walks.
#[derive(Debug, Clone)]
pub struct Scale {
    /// Reference variance of each source in SI and radians; zero if the run cannot have it.
    reference: [f64; SOURCES],
    /// Whether a nonzero figure is stated, for each possible source of the run.
    pub stated: [bool; SOURCES],
    /// The factors of the problem without estimation.
    pub initial: Factors,
    /// Correlation time of a bias without stated variation, s: the length of the longest recording. Faster variation
    /// acts as random walk, slower variation as a constant bias.
    correlation_time: f64,
}

impl Scale {
    pub fn new(problem: &Problem, moves: &Moves) -> Self {
        let of_stretches = problem.stretches().iter();
        let periods = of_stretches.clone().map(|of| of.run.recording.imu.period);
        let mut steps = periods.map(|period| step_length(period) as f64 * period);
        let step = steps.next().unwrap_or(0.0);
        let durations = of_stretches.map(|of| of.run.recording.imu.duration());
        let over = |variance: f64, input: f64| if input > 0.0 { variance / input } else { 0.0 };
        let table = problem.model.aiding == Aiding::Table;
        let reference = |source: Source| {
            let sensor = source.triad();
            let walk = problem.model.noise.get(sensor).random_walk.powi(2);
            // Over all moves as much as the random walk.
            let of_moves = |input: f64| over(walk * moves.duration, input);
            match source {
                // Beside a table's readings it says nothing.
                Source::Attitude | Source::RotationAtRest if table => 0.0,
                Source::AccelMotion | Source::AccelMoving if problem.model.velocity_anew => 0.0,
                _ if source.stated(problem) => source.sigma(problem).powi(2),
                Source::GyroMotion | Source::AccelMotion => of_moves(*moves.motion.get(sensor)),
                Source::GyroMoving | Source::AccelMoving => of_moves(moves.duration),
                // As much in a step as the random walk.
                Source::Velocity | Source::Attitude => walk * step,
                Source::RotationAtRest => walk,
                Source::GyroGaussMarkov | Source::AccelGaussMarkov => over(walk, step),
                _ => 0.0,
            }
        };
        let reference = Source::ALL.map(reference);
        let initial = |k: usize| over(Source::ALL[k].sigma(problem).powi(2), reference[k]);
        let initial = std::array::from_fn(initial);
        Self {
            reference,
            stated: std::array::from_fn(|k| reference[k] > 0.0 && Source::ALL[k].stated(problem)),
            initial,
            correlation_time: durations.fold(step, f64::max),
        }
    }

    /// The stated factors, or the reference for unstated figures.
    pub fn broad(&self) -> Factors {
        let mut broad = self.initial;
        for k in self.present() {
            if !self.stated[k] {
                broad[k] = broad[k].max(1.0);
            }
        }
        broad
    }

    /// Possible sources of the run.
    pub fn present(&self) -> Vec<usize> {
        (0..SOURCES).filter(|&k| self.reference[k] > 0.0).collect()
    }

    /// σ of a source at some factors, in SI and radians.
    pub fn sigma(&self, factors: &Factors, source: usize) -> f64 {
        (factors[source] * self.reference[source]).sqrt()
    }

    /// A model with these factors. Unchanged factors leave the model untouched.
    pub fn apply(&self, factors: &Factors, model: &Model) -> Model {
        let mut model = model.clone();
        for (k, source) in Source::ALL.into_iter().enumerate() {
            if factors[k] != self.initial[k] {
                source.set(&mut model, self.sigma(factors, k), self.correlation_time);
            }
        }
        model
    }
}
