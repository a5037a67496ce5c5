//! The closed form: static positions with known attitude (Zhao, Jiang, Li 2016, Eqs. 14 and 15; in the second line of
//! the printed Eq. 15, `N_g` means the accelerometer), and its substitutes without a table.

use super::both_triads::both_triads;
use super::coarse::{Turned, calibrated, dwells};
use super::gravity::AtRest;
use super::gravity_alone::standing;
use super::labels::{Section, Used};
use super::positions::{Observed, Position};
use super::{labels, table};
use crate::calibration::checks::observability::not_observed;
use crate::calibration::checks::prior_distance::far_by_data;
use crate::calibration::checks::rest_scatter::scatter_at_rest;
use crate::calibration::checks::rounding::{by_rounding, rounded};
use crate::calibration::checks::unexplained::unexplained_residuals;
use crate::calibration::linearisation::singular;
use crate::calibration::{
    CalibrationError, Estimate, Finding, Level, MagneticEstimate, Model, Problem, checks,
    from_vector, parameter, parameter_name, to_vector,
};
use crate::calibration::{Verdict, Word};
use crate::earth::Site;
use crate::imu::{BodyFrame, PerSensor, Sensor};
use crate::run::motion::rests;
use crate::run::{Aiding, Dwell};

/// Cosine above which a reference vector lies along a body axis, so that its position is one of the six.
const ALONG_AXIS: f64 = 0.9998;

/// Source of the reference inputs of a closed form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reference {
    /// The attitudes in the table log.
    Table,
    /// Labels of sections, each of which states the upward axis or a turn.
    Labels,
    /// Only gravity: its magnitude at rest and its direction before and after each turn.
    Gravity,
    /// Only gravity at rest: there are no gyros, or no turns.
    GravityAlone,
}

impl Reference {
    /// The body frame that this reference defines.
    pub fn body_frame(self) -> BodyFrame {
        match self {
            Self::Table | Self::Labels => BodyFrame::Table,
            Self::Gravity | Self::GravityAlone => BodyFrame::Accelerometer,
        }
    }
}

/// A closed-form calibration of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedForm {
    /// The estimate; its σ follow from random walk, pulses and the uncertainty of the inputs.
    pub estimate: Estimate,
    /// The magnetometer, from gravity alone.
    pub magnetic: Option<MagneticEstimate>,
    /// Source of the reference inputs.
    pub reference: Reference,
    /// Number of dwells or labelled positions used for each triad.
    pub positions: PerSensor<usize>,
    /// Number of turns used for the gyros.
    pub turns: usize,
    /// Total time of all dwells used, s.
    pub standing_time: f64,
    /// Findings that a calibration engineer must know before using the results.
    pub findings: Vec<Finding>,
}

impl ClosedForm {
    /// Whether the closed form may be used.
    pub fn is_usable(&self) -> bool {
        Verdict::of(&self.findings).word != Word::Failed
    }
}

/// Calibrates both triads of a run without a filter.
///
/// With a table log, the closed form uses the dwells: the six positions that the paper describes for a triad (Earth
/// rate or gravity along each body axis, in both directions) if the run contains them, or all dwells if not. Without a
/// table, the closed form uses labelled sections or, without labels, every dwell and turn with gravity as the only
/// reference. For exactly opposite positions, least squares gives the half sums and half differences stated in the
/// paper.
///
/// # Errors
/// Returns [`CalibrationError`] if there is no dwell. Parameters that the positions do not determine keep their prior
/// values.
pub fn six_position(problem: &Problem) -> Result<ClosedForm, CalibrationError> {
    let sections = &problem.run().recording.segments;
    let reference = if problem.model.aiding == Aiding::Table {
        Reference::Table
    } else if problem.lacks(Sensor::Gyro) {
        Reference::GravityAlone
    } else if sections.iter().any(|s| s.motion.is_some()) {
        Reference::Labels
    } else {
        Reference::Gravity
    };
    six_position_by(reference, problem)
}

/// Does the same as [`six_position`], with a given source of the reference inputs; labels need no dwells.
pub fn six_position_by(
    reference: Reference,
    problem: &Problem,
) -> Result<ClosedForm, CalibrationError> {
    let mut closed_form = match reference {
        Reference::Table => {
            let dwells: Vec<Dwell> = problem.dwells().cloned().collect();
            six_position_of(problem, &dwells)
        }
        Reference::Labels => by_labels(problem),
        Reference::Gravity => by_gravity(problem),
        Reference::GravityAlone => by_gravity_alone(problem),
    }?;
    let ClosedForm {
        estimate, findings, ..
    } = &mut closed_form;
    findings.splice(0..0, problem.remarks());
    findings.extend(unexplained_residuals(findings));
    findings.extend(scatter_at_rest(problem, &estimate.triads));
    let rounding = by_rounding(problem, &estimate.triads);
    estimate.covariance += rounding;
    findings.extend(rounded(problem, &rounding, &estimate.covariance));
    share_gravity(estimate, &problem.run().site);
    estimate.covariance += estimate.by_period(problem.run());
    Ok(closed_form)
}

/// Adds the gravity error, which causes the same relative error in all three accelerometer scale factors.
fn share_gravity(estimate: &mut Estimate, site: &Site) {
    let part = (site.gravity_sigma / site.gravity).powi(2);
    let scale = estimate.triads.accel.scale;
    let first = parameter(Sensor::Accel, 0);
    let mut of_scale = estimate.covariance.fixed_view_mut::<3, 3>(first, first);
    of_scale += scale * scale.transpose() * part;
}

/// The closed form from dwells (or parts of dwells) of the first run of the problem, with table attitudes.
///
/// # Errors
/// The errors of [`six_position`], and an error if there is no table.
pub fn six_position_of(
    problem: &Problem,
    dwells: &[Dwell],
) -> Result<ClosedForm, CalibrationError> {
    let run = problem.run();
    let mut used = vec![false; dwells.len()];
    let of_six = |sensor| -> Result<Observed, CalibrationError> {
        let all = table::positions(problem, dwells, sensor).ok_or(CalibrationError::NoTable)?;
        let six = six_of(&all);
        six.iter().for_each(|&k| used[k] = true);
        let known = six.iter().map(|&k| all.known[k].clone()).collect();
        Ok(Observed { known, ..all })
    };
    let observed = PerSensor::try_from_fn(of_six)?;
    if observed.gyro.known.is_empty() {
        return Err(CalibrationError::NoDwells);
    }
    let (estimate, mut findings) = both_triads(&observed, problem)?;
    findings.extend(hidden(&problem.model, &estimate, Reference::Table));
    let used = dwells.iter().zip(used).filter(|(_, used)| *used);
    Ok(ClosedForm {
        findings,
        estimate,
        magnetic: None,
        reference: Reference::Table,
        positions: PerSensor::from_fn(|sensor| observed.get(sensor).known.len()),
        turns: 0,
        standing_time: used
            .map(|(dwell, _)| dwell.duration(&run.recording.imu))
            .sum(),
    })
}

/// The positions with the input along a body axis, if all six exist, otherwise all.
fn six_of(observed: &Observed) -> Vec<usize> {
    let along = |k: usize| -> Option<(usize, bool)> {
        let Position { input, .. } = observed.known[k].position;
        let axis = input.iamax();
        (input[axis].abs() > ALONG_AXIS * input.norm()).then_some((axis, input[axis] > 0.0))
    };
    let all = 0..observed.known.len();
    let six: Vec<usize> = all.clone().filter(|&k| along(k).is_some()).collect();
    let has = |axis, up| six.iter().any(|&k| along(k) == Some((axis, up)));
    if (0..3).all(|axis| has(axis, true) && has(axis, false)) {
        six
    } else {
        all.collect()
    }
}

/// The closed form from sections whose labels state a position or a turn.
fn by_labels(problem: &Problem) -> Result<ClosedForm, CalibrationError> {
    let run = problem.run();
    let rests = rests(run);
    let Used {
        sections,
        lost,
        contradicted,
    } = Used::of(run, &rests);
    if sections.is_empty() {
        return Err(if contradicted.is_empty() {
            CalibrationError::NoSections {
                labels: run.recording.labels(),
            }
        } else {
            CalibrationError::LabelsContradicted { contradicted }
        });
    }
    let observed = labels::observed(run, &rests, &sections);
    let (estimate, mut findings) = both_triads(&observed, problem)?;
    findings.extend(hidden(&problem.model, &estimate, Reference::Labels));
    findings.extend(checks::labels::contradicted(&contradicted));
    findings.extend(checks::labels::lost(&lost));
    let standing: Vec<&Section> = sections.iter().filter(|s| s.stands()).collect();
    let samples: usize = standing.iter().map(|section| section.samples.len()).sum();
    Ok(ClosedForm {
        findings,
        estimate,
        magnetic: None,
        reference: Reference::Labels,
        positions: PerSensor::from_fn(|_| standing.len()),
        turns: sections.len() - standing.len(),
        standing_time: samples as f64 * run.recording.imu.period,
    })
}

/// The closed form from every dwell and every move with gravity as the only reference; with the prior, if there are too
/// few dwells and moves.
fn by_gravity(problem: &Problem) -> Result<ClosedForm, CalibrationError> {
    let rests = dwells(problem)?;
    let Turned { at, equations, .. } = calibrated(problem, &rests)?;
    let solution = equations.solved().ok_or_else(|| singular(&at.triads))?;
    let estimate = Estimate {
        triads: from_vector(problem.model.form, &(to_vector(&at.triads) + solution.step)),
        covariance: solution.covariance,
    };
    let far = far_by_data(&problem.model, &estimate).into_iter();
    let findings = far.chain(hidden(&problem.model, &estimate, Reference::Gravity));
    let count = rests.iter().map(Vec::len).sum();
    Ok(ClosedForm {
        findings: findings
            .chain(solution.residuals.finding("both triads"))
            .collect(),
        estimate,
        magnetic: None,
        reference: Reference::Gravity,
        positions: PerSensor::from_fn(|_| count),
        turns: count - rests.len(),
        standing_time: rests.iter().flatten().map(AtRest::duration).sum(),
    })
}

/// The closed form from every dwell with gravity as the only reference; what the dwells do not show keeps the prior.
fn by_gravity_alone(problem: &Problem) -> Result<ClosedForm, CalibrationError> {
    let found = standing(problem)?;
    let far = far_by_data(&problem.model, &found.estimate).into_iter();
    let hidden = hidden(&problem.model, &found.estimate, Reference::GravityAlone);
    Ok(ClosedForm {
        findings: far.chain(hidden).chain(found.findings).collect(),
        estimate: found.estimate,
        magnetic: found.magnetic,
        reference: Reference::GravityAlone,
        positions: PerSensor::from_fn(|_| found.count),
        turns: 0,
        standing_time: found.time,
    })
}

/// Parameters hardly better known than from the prior, if any.
fn hidden(model: &Model, estimate: &Estimate, reference: Reference) -> Option<Finding> {
    let names = estimate.unobserved(&model.prior_sigma).into_iter();
    let hidden: Vec<String> = names
        .filter_map(|index| parameter_name(estimate.form(), index))
        .collect();
    let by = match reference {
        Reference::Table => "these positions",
        Reference::Labels => "these sections",
        Reference::Gravity => "these dwells and moves",
        Reference::GravityAlone => return not_observed("gravity in these dwells", hidden),
    };
    // The values are stated as the closed form gives them.
    not_observed(by, hidden).map(|finding| finding.at(Level::Care))
}
