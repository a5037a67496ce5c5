//! The variance of every source, over a reference.

use super::source::Source;
use crate::calibration::record::schedule::step_length;
use crate::calibration::reduction::Moves;
use crate::calibration::{Model, Problem};
use crate::imu::Sensor;
use crate::run::Aiding;

/// Number of sources.
pub const SOURCES: usize = Source::ALL.len();

/// Variance of each source over its reference, in the order of [`Source::ALL`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factors(pub [f64; SOURCES]);

/// What variances are counted in: what is stated; for what is not, as much as the stated random walks
/// make of the same.
#[derive(Debug, Clone)]
pub struct Scale {
    /// Reference variance of each source in SI and radians; zero where the run cannot have it.
    reference: [f64; SOURCES],
    /// Whether a figure that is not zero is stated, of what the run can have.
    stated: [bool; SOURCES],
    /// What the problem has.
    initial: Factors,
    /// Of a bias that is not stated to vary, s. What varies faster acts as random walk, what varies
    /// slower as a constant bias: the length of the longest recording.
    correlation_time: f64,
}

impl Scale {
    pub fn new(problem: &Problem, moves: &Moves) -> Self {
        let step = problem.stretches().first().map_or(0.0, |stretch| {
            let period = stretch.run.recording.imu.period;
            step_length(period) as f64 * period
        });
        let durations = problem
            .stretches()
            .iter()
            .map(|stretch| stretch.run.recording.imu.duration());
        let walk = |sensor| problem.model.noise.get(sensor).random_walk.powi(2);
        // Over all moves as much as the random walk.
        let of_moves = |sensor: Sensor, input: f64| {
            if input > 0.0 {
                walk(sensor) * moves.duration / input
            } else {
                0.0
            }
        };
        // As much in a step as the random walk.
        let over_step = |variance: f64| if step > 0.0 { variance / step } else { 0.0 };
        let table = problem.model.aiding == Aiding::Table;
        let reference = |source: Source| {
            let sigma = source.sigma(problem);
            match source {
                // Beside a table's readings it says nothing.
                Source::Attitude | Source::RotationAtRest if table => 0.0,
                Source::AccelMotion | Source::AccelMoving if problem.model.velocity_anew => 0.0,
                _ if source.stated(problem) => sigma.powi(2),
                Source::GyroMotion => of_moves(Sensor::Gyro, moves.motion.gyro),
                Source::AccelMotion => of_moves(Sensor::Accel, moves.motion.accel),
                Source::GyroMoving => of_moves(Sensor::Gyro, moves.duration),
                Source::AccelMoving => of_moves(Sensor::Accel, moves.duration),
                Source::Velocity => walk(Sensor::Accel) * step,
                Source::Attitude => walk(Sensor::Gyro) * step,
                Source::RotationAtRest => walk(Sensor::Gyro),
                Source::GyroGaussMarkov => over_step(walk(Sensor::Gyro)),
                Source::AccelGaussMarkov => over_step(walk(Sensor::Accel)),
                _ => 0.0,
            }
        };
        let reference = Source::ALL.map(reference);
        let mut initial = Factors([0.0; SOURCES]);
        for (k, source) in Source::ALL.into_iter().enumerate() {
            if reference[k] > 0.0 {
                initial.0[k] = source.sigma(problem).powi(2) / reference[k];
            }
        }
        Self {
            reference,
            stated: std::array::from_fn(|k| reference[k] > 0.0 && Source::ALL[k].stated(problem)),
            initial,
            correlation_time: durations.fold(step, f64::max),
        }
    }

    /// What the problem has without learning.
    pub fn initial(&self) -> Factors {
        self.initial
    }

    /// What is stated, and of what is not as much as the stated random walks make.
    pub fn broad(&self) -> Factors {
        let mut broad = self.initial;
        for k in self.present() {
            if !self.stated[k] {
                broad.0[k] = broad.0[k].max(1.0);
            }
        }
        broad
    }

    /// The sources that the run can have.
    pub fn present(&self) -> Vec<usize> {
        (0..SOURCES).filter(|&k| self.reference[k] > 0.0).collect()
    }

    /// Whether a figure of it is stated that is not zero.
    pub fn is_stated(&self, source: usize) -> bool {
        self.stated[source]
    }

    /// σ of a source at some factors, in SI and radians.
    pub fn sigma(&self, factors: &Factors, source: usize) -> f64 {
        (factors.0[source] * self.reference[source]).sqrt()
    }

    /// A model with these factors. What is as it was stays untouched.
    pub fn apply(&self, factors: &Factors, model: &Model) -> Model {
        let mut model = model.clone();
        for (k, source) in Source::ALL.into_iter().enumerate() {
            if factors.0[k] != self.initial.0[k] {
                source.set(&mut model, self.sigma(factors, k), self.correlation_time);
            }
        }
        model
    }
}
