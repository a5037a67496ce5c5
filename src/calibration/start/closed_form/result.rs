//! What a closed form gives.

use crate::calibration::checks::finding::Finding;
use crate::calibration::checks::observability::not_observed;
use crate::calibration::estimate::Estimate;
use crate::calibration::model::Model;
use crate::calibration::noise::NoiseReport;
use crate::calibration::parameters::{OBSERVED_BELOW, parameter_name};
use crate::imu::{BodyFrame, PerSensor};

/// Where the inputs of a closed form are known from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reference {
    /// Attitudes of the table's log.
    Table,
    /// Labels of sections: an axis up, a turn about an axis by an angle.
    Labels,
    /// Gravity alone: its magnitude at rest, its direction before and after each turn.
    Gravity,
}

impl Reference {
    /// What fixes the body axes.
    pub fn body_frame(self) -> BodyFrame {
        match self {
            Self::Table | Self::Labels => BodyFrame::Table,
            Self::Gravity => BodyFrame::Accelerometer,
        }
    }
}

/// A closed-form calibration of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedForm {
    /// The estimate; its σ follow from random walk, pulses and how well the inputs are known.
    pub estimate: Estimate,
    /// Where the inputs are known from.
    pub reference: Reference,
    /// Dwells or labelled positions used for each triad.
    pub positions: PerSensor<usize>,
    /// Turns used for the gyros.
    pub turns: usize,
    /// Total time of all dwells used, s.
    pub standing_time: f64,
    /// Noise that was learnt; none where it is as stated.
    pub noise: Option<NoiseReport>,
    /// What a calibration engineer must know before using the figures.
    pub findings: Vec<Finding>,
}

impl ClosedForm {
    /// Whether it may be used: noise explains what it leaves.
    pub fn is_usable(&self) -> bool {
        !self.findings.iter().any(Finding::is_unexplained)
    }
}

/// Parameters that are hardly better known than before, if there are any.
pub fn hidden(model: &Model, estimate: &Estimate, reference: Reference) -> Option<Finding> {
    let sigma = estimate.sigma();
    let hidden = |&i: &usize| {
        let prior = model.prior_sigma[i];
        prior > 0.0 && sigma[i] > OBSERVED_BELOW * prior
    };
    let names = estimate.estimated().filter(hidden);
    let hidden: Vec<String> = names
        .filter_map(|index| parameter_name(estimate.form(), index))
        .collect();
    let by = match reference {
        Reference::Table => "these positions",
        Reference::Labels => "these sections",
        Reference::Gravity => "these dwells and moves",
    };
    not_observed(by, hidden)
}
