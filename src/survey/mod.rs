//! Content of a recording, and the parameters that each method could observe. A survey does not calibrate; it uses
//! nominal scales and prior biases.

mod advice;
mod attained;
mod evaluator;
mod field;
mod session;

pub use advice::{Attitude, Move, nearest_attitude};
pub use attained::{Attained, Reached, decided, needed};
pub use evaluator::{Due, Evaluator, GROWTH, InterimCalibration, Status};
pub use session::Session;

use crate::calibration::{
    Bound, CalibrationError, Contradiction, Estimate, Group, Method, OBSERVED_BELOW, Options,
    ParameterVector, Problem, UNWATCHED, bound, coarse_start, parameter_name, six_position,
    stacked,
};
use crate::imu::{BodyFrame, InstallationForm, MotionNoise, TermVector};
use crate::run::motion::{self, LabelCheck, Rest, Turn};
use crate::run::{Aiding, Run};
use crate::units::DEGREE;

/// Predictions are always in the general form, because forms differ only in their constraints.
const FORM: InstallationForm = InstallationForm::General;

/// Content of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// The dwells, in order of time.
    pub rests: Vec<Rest>,
    /// The turns between the dwells; in concatenated sections, only sections labelled as turns.
    pub turns: Vec<Turn>,
    /// Labelled sections compared with the data.
    pub labels: Vec<LabelCheck>,
    /// Predicted accuracy of each method, or the reason why it fails.
    pub methods: Vec<(Path, Result<Expected, String>)>,
    /// A contradiction between the recording and run.toml.
    pub contradiction: Option<Contradiction>,
    /// Total duration of dwells, s.
    pub standing: f64,
    /// Length of the longest dwell, s.
    pub longest: f64,
    /// Number of upward directions farther apart than [`APART`].
    pub directions: usize,
}

/// Directions closer together than this angle, rad, count as one direction.
pub const APART: f64 = 15.0 * DEGREE;

/// A calibration method.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Path {
    /// `--method six-position`.
    SixPosition,
    /// `--method ekf --aiding table`.
    TableAiding,
    /// `--method ekf --aiding velocity`.
    VelocityAiding,
}

impl Path {
    /// All methods.
    pub const ALL: [Self; 3] = [Self::SixPosition, Self::TableAiding, Self::VelocityAiding];

    /// Options of `calibrate`.
    pub fn words(self) -> &'static str {
        match self {
            Self::SixPosition => "--method six-position",
            Self::TableAiding => "--method ekf --aiding table",
            Self::VelocityAiding => "--method ekf --aiding velocity",
        }
    }
}

/// RMS σ of each group's estimated parameters, normalised to rad/s or m/s²; `None` if all are fixed.
pub type GroupSigma = Vec<(Group, Option<f64>)>;

/// Predicted σ, in the general misalignment form.
#[derive(Debug, Clone, PartialEq)]
pub struct Expected {
    /// RMS σ of the estimated parameters of each group, normalised to rad/s or m/s²; `None` if all are fixed.
    pub sigma: GroupSigma,
    /// Parameters whose σ is above half of the prior σ, or which only the prior determines.
    pub unobserved: Vec<String>,
}

impl Survey {
    /// Surveys a run, and the parameters that each method could observe in it.
    pub fn of(run: &Run) -> Self {
        let expected = |path| {
            (
                path,
                Expected::of(run, path).map_err(|error| error.to_string()),
            )
        };
        Self {
            methods: Path::ALL.map(expected).into(),
            ..Self::of_motion(run)
        }
    }

    /// Surveys a run without predicting the accuracy of the methods.
    pub fn of_motion(run: &Run) -> Self {
        let rests = motion::rests(run);
        let durations = || {
            rests
                .iter()
                .map(|rest| rest.dwell.duration(&run.recording.imu))
        };
        Self {
            turns: motion::turns(run, &rests),
            labels: motion::checks(run, &rests),
            methods: Vec::new(),
            contradiction: Contradiction::of(&Problem::new(run, &Options::default()))
                .map(|(_, contradiction)| contradiction),
            standing: durations().sum(),
            longest: durations().fold(0.0, f64::max),
            directions: directions(&rests),
            rests,
        }
    }

    /// Dwells in each of the six positions: x up, x down, … z down.
    pub fn ways_up(&self) -> [usize; 6] {
        let mut ways = [0; 6];
        for rest in self.rests.iter().filter(|rest| rest.up.is_upright()) {
            ways[2 * rest.up.axis + usize::from(rest.up.down)] += 1;
        }
        ways
    }
}

/// Number of distinct upward directions.
fn directions(rests: &[Rest]) -> usize {
    let mut known: Vec<&Rest> = Vec::new();
    for rest in rests {
        let apart = |other: &&Rest| other.force.angle(&rest.force) > APART;
        if known.iter().all(apart) {
            known.push(rest);
        }
    }
    known.len()
}

impl Expected {
    /// Prediction for a method.
    ///
    /// # Errors
    /// Returns [`CalibrationError`] if the method cannot calibrate this run.
    pub fn of(run: &Run, path: Path) -> Result<Self, CalibrationError> {
        let aiding = match path {
            Path::SixPosition => {
                let closed = six_position(&Problem::new(run, &Options::default()))?;
                let body_frame = closed.reference.body_frame();
                return Ok(summary(run, body_frame, &closed.estimate));
            }
            Path::TableAiding if run.recording.table.is_none() => {
                return Err(CalibrationError::NoTable);
            }
            Path::TableAiding => Aiding::Table,
            Path::VelocityAiding => Aiding::Velocity,
        };
        let options = Options::default().aiding(aiding);
        let problem = Problem::new(run, &options);
        if problem.shows_gravity_alone() {
            let solution = problem.solve(Method::Ekf, UNWATCHED)?;
            return Ok(summary(run, aiding.body_frame(), solution.estimate()));
        }
        let bound = bound_of_record(run, &options)?;
        Ok(summary(run, aiding.body_frame(), &bound.estimate))
    }
}

/// Expected covariance of the filter for a recording: the bound at the filter's starting point, with the noise that the
/// recording shows at this point.
///
/// # Errors
/// Returns [`CalibrationError`] if the recording cannot be calibrated.
pub fn bound_of_record(run: &Run, options: &Options) -> Result<Bound, CalibrationError> {
    let problem = Problem::new(run, options);
    let start = coarse_start(&problem)?;
    let problem = start.by_hand(&problem).unwrap_or(problem);
    let problem = problem.with(|model| {
        let of_moves = &mut model.motion_noise.accel;
        // The residual velocity of a hand is never stated; a table without a log is treated like a hand.
        if model.aiding == Aiding::Velocity && *of_moves == MotionNoise::default() {
            *of_moves = MotionNoise::BY_HAND;
        }
    });
    bound(&problem, &start.at.triads, &TermVector::zeros())
}

fn summary(run: &Run, body_frame: BodyFrame, estimate: &Estimate) -> Expected {
    let sigma = estimate.sigma();
    let prior = stacked(&run.instrument.prior_sigma(FORM, body_frame));
    Expected {
        sigma: by_group(&sigma, estimate),
        unobserved: unobserved(&sigma, &prior, estimate),
    }
}

/// RMS of each group of σ.
fn by_group(sigma: &ParameterVector, estimate: &Estimate) -> GroupSigma {
    let rms = |group: Group| {
        let indices = group.estimated(estimate);
        let sum: f64 = indices.iter().map(|&k| sigma[k].powi(2)).sum();
        let rms = (sum / indices.len() as f64).sqrt();
        (group, (!indices.is_empty()).then_some(rms))
    };
    Group::all().map(rms).collect()
}

/// Names of the parameters that keep more than half of their prior σ.
fn unobserved(
    sigma: &ParameterVector,
    prior: &ParameterVector,
    estimate: &Estimate,
) -> Vec<String> {
    let hidden = |&k: &usize| sigma[k] > OBSERVED_BELOW * prior[k];
    let hidden = estimate.estimated().filter(hidden);
    let name = |k| parameter_name(estimate.form(), k);
    hidden.filter_map(name).collect()
}

#[cfg(test)]
mod tests;
