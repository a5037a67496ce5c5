//! What a record holds, and what the methods could see of the instrument in it. Nothing is calibrated: all
//! is by nominal scales and prior biases.

mod advice;
mod session;

pub use advice::{Advisor, Move, TURNED_BY_HAND};
pub use session::{Progress, Session, Status, decided, needed};

use crate::calibration::{
    Bound, CalibrationError, Contradiction, Estimate, Group, OBSERVED_BELOW, Options, Problem,
};
use crate::calibration::{bound, coarse_start, parameter_name, sensor_and_parameter, six_position};
use crate::imu::{BodyFrame, InstallationForm, TermVector};
use crate::run::motion::{self, LabelCheck, Rest, Turn};
use crate::run::{Aiding, Run};
use crate::units::DEGREE;

/// Forms differ by what the data must say, not by what they can.
const FORM: InstallationForm = InstallationForm::General;

/// What a record holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// Where the instrument stands, in order.
    pub rests: Vec<Rest>,
    /// What it does from each of them to the next; empty in a record of sections, except those labelled as
    /// turns.
    pub turns: Vec<Turn>,
    /// Labelled sections against what was found.
    pub labels: Vec<LabelCheck>,
    /// What each method could see: what is to be expected, or why nothing is.
    pub methods: Vec<(Path, Result<Expected, String>)>,
    /// A mounting that the record shows in place of the stated one.
    pub contradiction: Option<Contradiction>,
    /// How long it stands in all, s.
    pub standing: f64,
    /// Length of the longest dwell, s.
    pub longest: f64,
    /// Directions of up that are further apart than [`APART`].
    pub directions: usize,
}

/// Directions nearer to each other than this, rad, count as one.
pub const APART: f64 = 15.0 * DEGREE;

/// A way to a calibration.
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
    /// All of them.
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

/// σ to be expected, in the general installation form.
#[derive(Debug, Clone, PartialEq)]
pub struct Expected {
    /// RMS σ of each group's estimated parameters, rad/s or m/s² normalised; `None` if all are fixed.
    pub sigma: Vec<(Group, Option<f64>)>,
    /// Parameters that stay within half of their prior σ, or that nothing but the prior says.
    pub unobserved: Vec<String>,
}

impl Survey {
    /// Looks at a run, and at what each method could see in it.
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

    /// Looks at a run, without the methods.
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

    /// Of the six ways up, the rests in which each is: x up, x down, … z down.
    pub fn ways_up(&self) -> [usize; 6] {
        let mut ways = [0; 6];
        for rest in self.rests.iter().filter(|rest| rest.up.is_upright()) {
            ways[2 * rest.up.axis + usize::from(rest.up.down)] += 1;
        }
        ways
    }
}

/// How many directions of up differ.
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
    /// By a method.
    ///
    /// # Errors
    /// [`CalibrationError`] if the method cannot calibrate by this run.
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
        let bound = bound_of_record(run, &options)?;
        Ok(summary(run, aiding.body_frame(), &bound.estimate))
    }
}

/// What the filter ends with by a record: the bound where the filter would begin, with the noise that shows there.
///
/// # Errors
/// [`CalibrationError`] if the record allows no calibration.
pub fn bound_of_record(run: &Run, options: &Options) -> Result<Bound, CalibrationError> {
    let problem = Problem::new(run, options);
    let start = coarse_start(&problem)?;
    let problem = start.by_hand(&problem).unwrap_or(problem);
    bound(&problem, &start.at.triads, &TermVector::zeros())
}

fn summary(run: &Run, body_frame: BodyFrame, estimate: &Estimate) -> Expected {
    let sigma = estimate.sigma();
    let prior = run.instrument.prior_sigma(FORM, body_frame);
    let group = |group: Group| {
        let indices = group.estimated(estimate);
        let mean = indices.iter().map(|&k| sigma[k].powi(2)).sum::<f64>() / indices.len() as f64;
        (group, (!indices.is_empty()).then(|| mean.sqrt()))
    };
    let hidden = |&k: &usize| {
        let (sensor, of_triad) = sensor_and_parameter(k);
        sigma[k] > OBSERVED_BELOW * prior.get(sensor)[of_triad]
    };
    let unobserved = estimate.estimated().filter(hidden);
    Expected {
        sigma: Group::all().map(group).collect(),
        unobserved: unobserved.filter_map(|k| parameter_name(FORM, k)).collect(),
    }
}

#[cfg(test)]
mod tests;
