//! Predicted accuracy of a path before any data exist, from the covariance of a recording along this path.

use super::navigation::{Mission, NavigationStudyError, Outlook};
use crate::calibration::{
    Bound, CalibrationError, ErrorTerm, Options, ParameterVector, Problem, TermLeftOff,
    bound_without_moves, coarse_start, terms_left_off,
};
use crate::imu::{MotionNoise, PerSensor, TermVector, Triad};
use crate::lot::{Check, Specification};
use crate::models::{Instrument, ModelError, Place, path_by_hand, turntable};
use crate::run::{Aiding, Run};
use crate::simulation::Scenario;
use crate::survey::decided;
use crate::turntable::TableError;

/// A path to evaluate.
#[derive(Debug, Clone)]
pub struct PathStudy {
    /// The path, with the instrument, table and site.
    pub scenario: Scenario,
    /// Whether the sensor is turned by hand, without a table.
    pub by_hand: bool,
    /// Options of the calibration.
    pub options: Options,
}

/// Names of a path and of the models for its evaluation.
#[derive(Debug, Clone, Default)]
pub struct Named<'a> {
    /// The path: a TOML file, an embedded name, or a list of moves by hand.
    pub path: &'a str,
    /// The scenario; `None` for the default scenario.
    pub scenario: Option<&'a str>,
    /// Instrument that replaces the instrument of the scenario.
    pub imu: Option<&'a str>,
    /// Table that replaces the table of the scenario.
    pub table: Option<&'a str>,
    /// Whether the sensor is turned by hand, without a table; a list of moves always is.
    pub by_hand: bool,
    /// Observations used by the filter. `None` means the table or, by hand, velocity.
    pub aiding: Option<Aiding>,
    /// Error terms to estimate.
    pub terms: Vec<ErrorTerm>,
}

/// Expected results of a path, or of the recording of a run.
#[derive(Debug, Clone)]
pub struct Evaluation {
    /// Duration, s.
    pub duration: f64,
    /// Total duration of the dwells, s.
    pub standing: f64,
    /// Observations used by the filter.
    pub aiding: Aiding,
    /// Expected covariance, its history, and the combinations of parameters that the path determines.
    pub bound: Bound,
    /// Error terms that are not estimated.
    pub left_off: Vec<TermLeftOff>,
    /// The value of each move, in order; empty for a recording.
    pub without: Vec<Without>,
    /// Expected navigation errors.
    pub navigation: Vec<Outlook>,
}

/// Accuracy of a calibration without the information from one move: attitude, velocity and position may change
/// arbitrarily during this move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Without {
    /// Time of the move and the dwell after it, s.
    pub time: f64,
    /// Expected σ without the move.
    pub sigma: ParameterVector,
}

impl Named<'_> {
    /// Options of a calibration with this aiding.
    pub fn options(&self, aiding: Aiding) -> Options {
        Options {
            terms: self.terms.clone(),
            aiding: Some(aiding),
            ..Options::default()
        }
    }
}

/// Errors in evaluating a path.
#[derive(Debug, thiserror::Error)]
pub enum PathError {
    /// A model cannot be read.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The words are not moves.
    #[error("{0}")]
    Words(String),
    /// The table cannot follow the path.
    #[error(transparent)]
    Table(#[from] TableError),
    /// No calibration is possible.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// The calibration cannot be used for navigation.
    #[error(transparent)]
    Navigation(#[from] NavigationStudyError),
}

impl PathStudy {
    /// Reads a path and the models that are given by name.
    ///
    /// # Errors [`PathError`] if a model cannot be read, or the words are not moves.
    pub fn load(named: &Named) -> Result<Self, PathError> {
        let is_words = named.path.contains(',') || named.path.starts_with("turn ");
        let setting = Self::setting(&Named {
            by_hand: named.by_hand || is_words,
            ..named.clone()
        })?;
        let scenario = if is_words {
            let path = path_by_hand(named.path);
            let along = path.and_then(|path| setting.scenario.along(path, "by hand"));
            along.map_err(PathError::Words)?
        } else {
            setting.scenario.with_path(named.path)?
        };
        Ok(Self {
            scenario,
            ..setting
        })
    }

    /// The setting of paths: the models given by name, with the path of the scenario, which the table may not be able
    /// to follow.
    ///
    /// # Errors [`PathError`] if a model cannot be read.
    pub fn setting(named: &Named) -> Result<Self, PathError> {
        let by_hand = named.by_hand;
        let usual = if by_hand { "mems" } else { "demo" };
        let mut scenario = Scenario::load(named.scenario.unwrap_or(usual))?;
        if let Some(model) = named.imu {
            scenario.instrument = Instrument::load(model, &Place::CommandLine)?;
        }
        if let Some(model) = named.table {
            (scenario.table, scenario.table_name) = turntable(model, &Place::CommandLine)?;
        }
        if by_hand {
            scenario.integrator.lever_arm = Default::default();
        }
        let aiding = match (named.aiding, by_hand) {
            (Some(aiding), _) => aiding,
            (None, true) => Aiding::Velocity,
            (None, false) => Aiding::Table,
        };
        scenario.body_frame = aiding.body_frame();
        for &term in &named.terms {
            scenario = scenario.with_error_term(term);
        }
        Ok(Self {
            scenario,
            by_hand,
            options: named.options(aiding),
        })
    }

    /// Evaluates the path and each of its moves.
    ///
    /// # Errors
    /// Returns [`PathError`] if the table cannot follow the path, or no calibration is possible.
    pub fn evaluate(&self) -> Result<Evaluation, PathError> {
        let motion = self.scenario.motion()?;
        let moves = motion.moves();
        let (run, truth, terms) = self.record()?;
        let problem = Problem::new(&run, &self.options);
        let (mut evaluation, sigma) = Evaluation::new(&problem, (&truth, &terms))?;
        evaluation.standing = motion.dwells().map(|(start, end)| end - start).sum();
        let starts = moves.iter().map(|(start, _)| *start);
        let next = starts.clone().skip(1).chain([motion.duration()]);
        let without = starts.zip(next).zip(sigma);
        evaluation.without = without
            .map(|((start, next), sigma)| Without {
                time: next - start,
                sigma,
            })
            .collect();
        Ok(evaluation)
    }

    /// A simulated recording along the path, with its truth.
    pub(super) fn record(&self) -> Result<(Run, PerSensor<Triad>, TermVector), TableError> {
        let simulated = self.scenario.simulate(self.scenario.seed, 0)?;
        let mut run = simulated.run;
        if self.by_hand {
            run.recording.table = None;
            run.instrument.motion_noise = PerSensor::from_fn(|_| MotionNoise::BY_HAND);
        }
        Ok((run, simulated.truth, simulated.terms))
    }
}

impl Evaluation {
    /// Expected results of the calibration of a run, linearised at the triads with which the filter would start.
    ///
    /// # Errors
    /// Returns [`PathError`] if no calibration is possible.
    pub fn of_run(run: &Run, options: &Options) -> Result<Self, PathError> {
        let problem = Problem::new(run, options);
        let start = coarse_start(&problem)?;
        let problem = start.by_hand(&problem).unwrap_or(problem);
        let (evaluation, _) = Self::new(&problem, (&start.at.triads, &TermVector::zeros()))?;
        Ok(evaluation)
    }

    /// Check of every limit of a specification for a unit at its nominal values; a limit that passes can be decided.
    pub fn decided(&self, specification: &Specification) -> Vec<Check> {
        decided(specification, &self.bound.estimate)
    }

    /// Expected results (without the value of each move), and the σ without each move.
    fn new(
        problem: &Problem,
        (truth, terms): (&PerSensor<Triad>, &TermVector),
    ) -> Result<(Self, Vec<ParameterVector>), PathError> {
        let run = problem.run();
        let imu = &run.recording.imu;
        let (bound, left_off) = rayon::join(
            || bound_without_moves(problem, truth, terms),
            || terms_left_off(problem, truth, terms),
        );
        let (bound, without) = bound?;
        let mission = Mission::suited(&run.site, &[&bound.estimate])?;
        let evaluation = Self {
            duration: imu.duration(),
            standing: problem.dwells().map(|dwell| dwell.duration(imu)).sum(),
            aiding: problem.model.aiding,
            navigation: mission.outlook(&bound.estimate, None)?,
            bound,
            left_off: left_off?,
            without: Vec::new(),
        };
        Ok((evaluation, without))
    }
}

#[cfg(test)]
mod tests {
    use rayon::prelude::*;

    use super::*;
    use crate::calibration::{Group, NoisePolicy, PARAMETERS, UNWATCHED, estimate, to_vector};

    #[test]
    fn what_is_expected_of_a_record_is_what_the_filter_states() {
        let run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
        let options = Options::default()
            .noise(NoisePolicy::Stated)
            .no_auto_terms();
        let expected = Evaluation::of_run(&run, &options).unwrap();
        let stated = estimate(&Problem::new(&run, &options), UNWATCHED).unwrap();
        let [expected, stated] = [&expected.bound.estimate, &stated.estimate].map(|of| of.sigma());
        for k in 0..PARAMETERS {
            assert!((expected[k] / stated[k] - 1.0).abs() < 0.02, "{k}");
        }
    }

    /// 60 runs: RMS errors of a group of n parameters scatter by about 1/√(2·60·n) about the expected σ.
    #[test]
    #[ignore = "statistical"]
    fn errors_of_many_runs_are_as_large_as_the_path_was_expected_to_leave() {
        const RUNS: u64 = 60;
        let scenario = Scenario::load("demo").unwrap();
        let options = Options::default()
            .noise(NoisePolicy::Stated)
            .no_auto_terms();
        let study = PathStudy {
            scenario: scenario.clone(),
            by_hand: false,
            options: options.clone(),
        };
        let expected = study.evaluate().unwrap().bound.estimate.sigma();
        let errors = (0..RUNS).into_par_iter().map(|stream| {
            let simulated = scenario.simulate(4242, stream).unwrap();
            let outcome = estimate(&Problem::new(&simulated.run, &options), UNWATCHED).unwrap();
            outcome.estimate.vector() - to_vector(&simulated.truth)
        });
        let errors: Vec<ParameterVector> = errors.collect();
        for group in Group::all() {
            let of_group = (0..PARAMETERS).filter(|&k| Group::of(k) == group);
            let squares =
                of_group.flat_map(|k| errors.iter().map(move |e| (e[k] / expected[k]).powi(2)));
            let squares: Vec<f64> = squares.collect();
            let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
            let scatter = (2.0 * squares.len() as f64).sqrt().recip();
            assert!((rms - 1.0).abs() < 4.0 * scatter, "{group:?}: {rms}");
        }
    }
}
