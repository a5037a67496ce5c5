//! What a record holds, and what the methods could see of the instrument in it. Nothing is calibrated: all
//! is by nominal scales and prior biases.

use crate::calibration::{
    CalibrationError, Estimate, Group, Mounting, OBSERVED_BELOW, Options, Problem,
};
use crate::calibration::{bound, coarse_start, parameter_name, sensor_and_parameter, six_position};
use crate::imu::{BodyFrame, InstallationForm, PerSensor, Sensor, TermVector};
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
    /// What each method could see.
    pub methods: Vec<MethodOutlook>,
    /// A mounting that the record shows in place of the stated one.
    pub mounting: Option<Mounting>,
    /// How long it stands.
    pub standing: Standing,
    /// Step of each axis' grid, rad/s or m/s², where the file's values lie on one.
    pub steps: PerSensor<[Option<f64>; 3]>,
    /// Directions of up that are further apart than [`APART`].
    pub directions: usize,
}

/// Directions nearer to each other than this, rad, count as one.
pub const APART: f64 = 15.0 * DEGREE;

/// How long the instrument stands.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Standing {
    /// In all, s.
    pub total: f64,
    /// In the longest dwell, s.
    pub longest: f64,
}

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

/// What a method could see.
#[derive(Debug, Clone, PartialEq)]
pub struct MethodOutlook {
    /// The method.
    pub path: Path,
    /// What is to be expected, or why nothing is.
    pub expected: Result<Expected, String>,
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
    /// Looks at a run.
    pub fn of(run: &Run) -> Self {
        let rests = motion::rests(run);
        let durations = || {
            rests
                .iter()
                .map(|rest| rest.dwell.duration(&run.recording.imu))
        };
        Self {
            turns: motion::turns(run, &rests),
            labels: motion::checks(run, &rests),
            methods: Path::ALL
                .map(|path| MethodOutlook {
                    path,
                    expected: expected(run, path),
                })
                .into(),
            mounting: Mounting::contradicted(&Problem::new(run, &Options::default())),
            standing: Standing {
                total: durations().sum(),
                longest: durations().fold(0.0, f64::max),
            },
            steps: PerSensor::from_fn(|sensor| [0, 1, 2].map(|axis| step(run, sensor, axis))),
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

/// A step of the file's values as a rate.
fn step(run: &Run, sensor: Sensor, axis: usize) -> Option<f64> {
    let column = &run.recording.imu.log.as_ref()?.columns.get(sensor)[axis];
    Some((column.step? * column.unit / run.recording.imu.period).abs())
}

fn expected(run: &Run, path: Path) -> Result<Expected, String> {
    let expected = match path {
        Path::SixPosition => {
            let problem = Problem::new(run, &Options::default());
            six_position(&problem)
                .map(|closed| summary(run, closed.reference.body_frame(), &closed.estimate))
        }
        Path::TableAiding if run.recording.table.is_none() => Err(CalibrationError::NoTable),
        Path::TableAiding => filtered(run, Aiding::Table),
        Path::VelocityAiding => filtered(run, Aiding::Velocity),
    };
    expected.map_err(|error| error.to_string())
}

/// What the filter ends with, linearised where it would begin.
fn filtered(run: &Run, aiding: Aiding) -> Result<Expected, CalibrationError> {
    let problem = Problem::new(run, &Options::default().aiding(aiding));
    let start = coarse_start(&problem)?;
    let bound = bound(&problem, &start.at.triads, &TermVector::zeros())?;
    Ok(summary(run, aiding.body_frame(), &bound.estimate))
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
    Expected {
        sigma: Group::all().map(group).collect(),
        unobserved: estimate
            .estimated()
            .filter(hidden)
            .filter_map(|k| parameter_name(FORM, k))
            .collect(),
    }
}

#[cfg(test)]
mod tests;
