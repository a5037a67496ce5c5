//! The estimator: coarse start, with a table a pass with feedback, and Gauss–Newton iterations with the
//! linearisation held until nothing moves.

use std::collections::BTreeMap;

use super::budget::BudgetSource;
use super::error::CalibrationError;
use super::iterations::{Iterated, iterate};
use super::layout::Layout;
use super::linearisation::not_invertible;
use super::noise::Learnt;
use super::outcome::Outcome;
use super::parameters::ParameterMatrix;
use super::pass::Gate;
use super::problem::Problem;
use super::several::{self, Joint};
use crate::calibration::checks;
use crate::calibration::checks::dwell_scatter::DwellScores;
use crate::calibration::checks::finding::Finding;
use crate::calibration::checks::form::{FormTest, form_test};
use crate::calibration::checks::innovation::consistency;
use crate::calibration::checks::observability::Observability;
use crate::calibration::checks::prior_distance::widened;
use crate::calibration::checks::rounding::by_rounding;
use crate::calibration::several::alone::Alone;
use crate::calibration::start::attempt::{Attempt, Progress, from_coarse_start, learnt_or_stated};
use crate::imu::Sensor;

/// Estimates both triads, by standstill and, where it is observed, the attitude of the table.
///
/// Source: design of the passes after Maybeck, *Stochastic Models, Estimation and Control*, vol. 2,
/// §9.7 (iterated, linearised filters): each pass with the linearisation held is a Gauss–Newton step of
/// all data.
///
/// # Errors
/// [`CalibrationError`] where the runs cannot give a calibration. Runs that give one without
/// convergence are an [`Outcome`] with `converged = false` and a finding.
pub fn estimate(problem: &Problem, progress: Progress) -> Result<Outcome, CalibrationError> {
    let Solved {
        attempt,
        problem,
        alone,
        findings: of_recordings,
    } = match problem.varies() || problem.runs().nth(1).is_some() {
        true => Solved::of(several::solve(problem, progress)?),
        false => Solved {
            attempt: from_coarse_start(problem, progress)?,
            problem: problem.clone(),
            alone: Vec::new(),
            findings: Vec::new(),
        },
    };
    let Attempt {
        start,
        priors,
        mut passes,
        feedback_history,
        mut iterated,
        learnt,
        by_headings,
    } = attempt;
    let as_stated = &problem;
    let with_noise = learnt
        .as_ref()
        .map(|learnt| problem.with_model(learnt.model.clone()));
    let problem = with_noise.as_ref().unwrap_or(&problem);
    let widened = widened(&problem.model, &iterated.held.both_triads());
    let with_wide_prior = widened.map(|model| problem.with_model(model));
    let again = with_wide_prior.as_ref().and_then(|wide| {
        let (from, gate) = (iterated.held.estimate.clone(), Gate::Innovations);
        let again = iterate(wide, &priors, from, gate, &mut passes, progress);
        again.ok().map(|again| (wide, again))
    });
    let problem = match again {
        Some((wide, again)) => {
            iterated = again;
            wide
        }
        None => problem,
    };
    let form_test = form_test(problem, &priors, &iterated.held)?;
    // Noise that makes up for angles that are missing is no noise.
    let is_no_noise = form_test.as_ref().is_some_and(FormTest::rejects);
    let Learnt {
        model,
        iterated: Iterated {
            mut held,
            converged,
        },
        report,
        of_other_noise,
    } = match learnt {
        Some(learnt) => Learnt {
            model: problem.model.clone(),
            iterated,
            ..learnt
        },
        None if is_no_noise => Learnt::stated(problem, iterated),
        None => learnt_or_stated(
            start,
            (as_stated, problem),
            &priors,
            iterated,
            &mut passes,
            progress,
        ),
    };
    let problem = &problem.with_model(model);
    let scores = held.posteriors.split_first();
    let scores = scores.and_then(|(prior, after)| DwellScores::new(prior, after));
    let by_scatter = scores.as_ref().and_then(DwellScores::widened);
    let estimate = held.both_triads();
    let scattered = by_scatter.map(|widened| {
        held.widen(&Layout::new(&problem.model), &widened);
        held.both_triads().covariance - estimate.covariance
    });
    if let Some(sensor) = not_invertible(&estimate.triads) {
        return Err(CalibrationError::Singular { sensor });
    }
    let rounding = by_rounding(problem, &estimate.triads);
    let model = &problem.model;
    let mut outcome = Outcome {
        form_test,
        dwell_scatter: scores.map(|scores| scores.scatter),
        observability: Observability::new(
            &estimate,
            &as_stated.model.prior_sigma,
            &held.attitude_covariance,
        ),
        covariance_by_noise: estimate.covariance,
        estimate,
        beside: BTreeMap::new(),
        prior_sigma: as_stated.model.prior_sigma,
        prior_mean: model.prior_mean,
        prior_attitudes: priors,
        attitude_sigma: held.attitude_sigma,
        auxiliary: held.auxiliary,
        thermal: held.thermal,
        own: held.own,
        warming: match problem.model.thermal {
            Some(_) => problem.warming(),
            None => Vec::new(),
        },
        alone,
        gravity: (problem.run().site.gravity + held.gravity.0, held.gravity.1),
        linearised_at: held.at,
        converged,
        log_determinant: held.log_determinant,
        consistency: consistency(&held.innovations),
        history: held.history,
        feedback_history,
        innovations: held.innovations,
        aiding: model.aiding,
        velocity_sigma: problem
            .stretches()
            .first()
            .map_or(0.0, |s| s.stillness(model, Sensor::Accel)),
        model: model.clone(),
        noise: report,
        passes,
        findings: Vec::new(),
    };
    outcome.set_part(BudgetSource::Headings, by_headings);
    if let Some(scattered) = scattered {
        outcome.set_part(BudgetSource::DwellScatter, scattered);
    }
    let growth = outcome.growth_by(BudgetSource::DwellScatter);
    outcome.set_part(BudgetSource::Rounding, rounding);
    if let Some(of_other_noise) = of_other_noise {
        outcome.set_part(BudgetSource::LearntNoise, of_other_noise);
    }
    outcome.findings = checks::findings(as_stated, &outcome);
    outcome.findings.extend(of_recordings);
    if let Some(scatter) = outcome.dwell_scatter.filter(|_| scattered.is_some()) {
        outcome.findings.push(scatter.finding(growth));
    }
    Ok(outcome)
}

/// A calibration with stated noise, of one recording or of several together.
struct Solved<'a> {
    attempt: Attempt,
    /// With what the data call for of what it had.
    problem: Problem<'a>,
    alone: Vec<Alone>,
    findings: Vec<Finding>,
}

impl<'a> Solved<'a> {
    fn of(joint: Joint<'a>) -> Self {
        Self {
            attempt: Attempt {
                start: None,
                priors: joint.priors,
                passes: joint.passes,
                feedback_history: Vec::new(),
                iterated: joint.iterated,
                learnt: None,
                by_headings: ParameterMatrix::zeros(),
            },
            problem: joint.problem,
            alone: joint.alone,
            findings: joint.findings,
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::super::Options;
    use super::super::linearisation::Linearisation;
    use super::super::parameters::{from_vector, to_vector};
    use super::super::pass::{Mode, pass};
    use super::*;
    use crate::attitude::exp;
    use crate::imu::TermVector;
    use crate::simulation::Scenario;
    use crate::units::{ARCSEC, PPM};

    #[test]
    fn the_estimate_does_not_depend_on_where_a_pass_linearises() {
        let simulated = Scenario::load("demo").unwrap().simulate(1, 0).unwrap();
        let mut problem = Problem::new(&simulated.run, &Options::default());
        let mut prior = problem.stretches()[0].attitude_of_table().unwrap();
        // As tight a prior of attitude and scale as a run gives, so that it counts.
        prior.sigma = Vector3::repeat(ARCSEC);
        problem.model.prior_mean = to_vector(&simulated.truth);
        problem.model.prior_sigma.fill(PPM);
        let form = problem.model.form;

        let estimate = |shift: f64| {
            let turn = exp(Vector3::new(1.0, -2.0, 3.0) * (shift * ARCSEC));
            let triads = from_vector(form, &problem.model.prior_mean.add_scalar(shift * PPM));
            let initial = vec![turn * prior.mean];
            let at = Linearisation::new(triads, TermVector::zeros(), initial);
            let mode = Mode::Held(Gate::Open);
            pass(&problem, &[prior], &at, mode).unwrap()
        };
        let (here, there) = (estimate(0.0), estimate(2.0));
        let shift = to_vector(&there.estimate.triads) - to_vector(&here.estimate.triads);
        let sigma = here.covariance.diagonal().map(f64::sqrt);
        let largest = shift.component_div(&sigma).amax();
        assert!(largest < 1e-3, "{largest} σ");
    }
}
