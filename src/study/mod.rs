//! Studies: statistics over many simulated runs.

pub mod accuracy;
mod checked;
pub mod design;

pub mod experiment;
pub mod navigation;
pub mod path;
mod ratio;
mod shard;
pub mod table1;

use std::ops::ControlFlow;

use navigation::NavigationStudyError;
use rayon::prelude::*;

use crate::calibration::CalibrationError;
use crate::models::ModelError;
use crate::turntable::TableError;

pub use accuracy::{Accuracy, AccuracyStudy, Figures, NavigationAccuracy};
pub use checked::{CheckedCalibration, Consequences};
pub use experiment::{Experiment, ExperimentStudy};
pub use ratio::Ratio;
pub use shard::{Shard, ShardError};
pub use table1::{Table1, Table1Study};

/// Callback after each run, which may stop the study.
pub type Done<'a> = &'a (dyn Fn() -> ControlFlow<()> + Sync);

/// A callback that does nothing.
pub const UNWATCHED: Done<'static> = &|| ControlFlow::Continue(());

/// A study of numbered runs, each with its own random streams, so that the result depends neither on the number of
/// cores nor on a division into parts.
pub trait Study: Sync {
    /// Result of one run.
    type Trial: Send;
    /// Result of all runs.
    type Outcome;

    /// Number of runs.
    fn runs(&self) -> u64;

    /// A function that performs the run with a given number.
    ///
    /// # Errors [`StudyError`] if no run can be performed.
    fn maker(&self) -> Result<impl Fn(u64) -> Result<Self::Trial, StudyError> + Sync, StudyError>;

    /// The outcome of all runs, in the order of their numbers.
    ///
    /// # Errors
    /// Returns [`StudyError`] if the runs cannot be evaluated.
    fn outcome(&self, trials: Vec<Self::Trial>) -> Result<Self::Outcome, StudyError>;

    /// Performs some of the runs on all cores; `done` is called after each and may stop the study.
    ///
    /// # Errors [`StudyError`] if runs cannot be performed, or if the study was stopped. A run without a calibration is not an error:
    /// it is counted.
    fn trials(&self, runs: &[u64], done: Done) -> Result<Vec<Self::Trial>, StudyError> {
        let make = self.maker()?;
        let all = runs.par_iter().with_max_len(1).map(|&run| {
            let trial = make(run)?;
            match done() {
                ControlFlow::Continue(()) => Ok(trial),
                ControlFlow::Break(()) => Err(StudyError::Stopped),
            }
        });
        all.collect()
    }

    /// Performs the whole study.
    ///
    /// # Errors
    /// The errors of [`Self::trials`] and [`Self::outcome`].
    fn run(&self, done: Done) -> Result<Self::Outcome, StudyError> {
        let all: Vec<u64> = (0..self.runs()).collect();
        self.outcome(self.trials(&all, done)?)
    }
}

/// Errors of a study.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A path, table or trajectory that the study needs cannot be read.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The table cannot follow a path.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A mission cannot be navigated.
    #[error(transparent)]
    Navigation(#[from] NavigationStudyError),
    /// The bound of a run cannot be computed.
    #[error("run {run} of the study: {source}")]
    Bound {
        /// Number of the run.
        run: u64,
        /// The cause.
        source: CalibrationError,
    },
    /// The callback stopped the study.
    #[error("the study was stopped before its end")]
    Stopped,
}
