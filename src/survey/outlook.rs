//! What each method could see of the instrument.

use crate::calibration::sensor_and_parameter;
use crate::calibration::{CalibrationError, Group, bound, coarse_start, six_position};
use crate::calibration::{Estimate, OBSERVED_BELOW, Options, Problem, parameter_name};
use crate::imu::{BodyFrame, InstallationForm, TermVector};
use crate::run::{Aiding, Run};

/// Forms differ by what the data must say, not by what they can.
const FORM: InstallationForm = InstallationForm::General;

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

    /// As `calibrate` is told.
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
    /// RMS σ of each group's estimated parameters, rad/s or m/s² normalised; none where all are fixed.
    pub sigma: Vec<(Group, Option<f64>)>,
    /// Parameters that stay within half of their prior σ, or that nothing but the prior says.
    pub unobserved: Vec<String>,
}

pub fn methods(run: &Run) -> Vec<MethodOutlook> {
    let outlook = |path| MethodOutlook {
        path,
        expected: expected(run, path),
    };
    Path::ALL.into_iter().map(outlook).collect()
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
