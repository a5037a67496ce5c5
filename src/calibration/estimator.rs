//! The estimator: coarse start, with a table a pass with feedback, and Gauss–Newton iterations with the
//! linearisation held until nothing moves.

use std::collections::BTreeMap;

use super::budget::BudgetSource;
use super::error::CalibrationError;
use super::gauss_newton::{Iterated, Progress, iterate};
use super::linearisation::{AttitudePrior, not_invertible};
use super::outcome::Outcome;
use super::parameters::ParameterMatrix;
use super::pass::{Gate, PassResult};
use super::problem::Problem;
use super::reduction::{Prior, Script};
use super::several;
use super::solved::Solved;
use crate::calibration::checks;
use crate::calibration::checks::dwell_scatter::{DwellScatter, DwellScores};
use crate::calibration::checks::form::{FormTest, form_test};
use crate::calibration::checks::innovation::consistency;
use crate::calibration::checks::observability::Observability;
use crate::calibration::checks::prior_distance::widened;
use crate::calibration::checks::rounding::by_rounding;
use crate::calibration::start::attempt::{from_coarse_start, learnt_or_stated};
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
    let solved = match problem.varies() || problem.runs().nth(1).is_some() {
        true => several::solve(problem, progress)?,
        false => from_coarse_start(problem, progress)?,
    };
    let as_stated = match solved.noise.learnt {
        true => problem.clone(),
        false => solved.problem.clone(),
    };
    let solved = with_wide_prior(solved, progress)?;
    let form_test = form_test(&solved.problem, &solved.priors, &solved.iterated.held)?;
    // Noise that makes up for angles that are missing is no noise.
    let is_no_noise = form_test.as_ref().is_some_and(FormTest::rejects);
    let solved = match solved.noise.learnt || is_no_noise {
        true => solved,
        false => learnt_or_stated(&as_stated, solved, progress)?,
    };
    outcome(&as_stated, solved, form_test)
}

/// Iterations with a prior that its estimate does not contradict: a wrong one would make outliers of correct
/// observations, and noise of itself.
fn with_wide_prior<'a>(
    mut solved: Solved<'a>,
    progress: Progress,
) -> Result<Solved<'a>, CalibrationError> {
    let held = &solved.iterated.held;
    let Some(model) = widened(&solved.problem.model, &held.both_triads()) else {
        return Ok(solved);
    };
    let (problem, from) = (solved.problem.with_model(model), held.estimate.clone());
    let gate = Gate::Innovations;
    match iterate(
        &problem,
        &solved.priors,
        from,
        gate,
        &mut solved.passes,
        progress,
    ) {
        Ok(iterated) => (solved.iterated, solved.problem) = (iterated, problem),
        Err(CalibrationError::Stopped) => return Err(CalibrationError::Stopped),
        // A prior that is too tight is better than none.
        Err(_) => {}
    }
    Ok(solved)
}

/// What was found with its covariance, to which errors that no pass knows of are added.
fn outcome(
    as_stated: &Problem,
    solved: Solved,
    form_test: Option<FormTest>,
) -> Result<Outcome, CalibrationError> {
    let Solved {
        problem,
        iterated: Iterated {
            mut held,
            converged,
        },
        ..
    } = solved;
    let model = &problem.model;
    let estimate = held.both_triads();
    if let Some(sensor) = not_invertible(&estimate.triads) {
        return Err(CalibrationError::Singular { sensor });
    }
    let (dwell_scatter, scattered) = scattered(&mut held, &problem, &solved.priors);
    let rounding = by_rounding(&problem, &estimate.triads);
    let mut outcome = Outcome {
        form_test,
        dwell_scatter,
        observability: Observability::new(
            &estimate,
            &as_stated.model.prior_sigma,
            &held.attitude_covariance,
        ),
        covariance_by_noise: estimate.covariance,
        estimate,
        covariance_parts: BTreeMap::new(),
        prior_sigma: as_stated.model.prior_sigma,
        prior_mean: model.prior_mean,
        prior_attitudes: solved.priors,
        attitude_sigma: held.attitude_sigma,
        auxiliary: held.auxiliary,
        thermal: held.thermal,
        own: held.own,
        warming: problem.warming(),
        alone: solved.alone,
        gravity: (problem.run().site.gravity + held.gravity.0, held.gravity.1),
        linearised_at: held.at,
        converged,
        log_determinant: held.log_determinant,
        consistency: consistency(&held.innovations),
        history: held.history,
        feedback_history: solved.feedback_history,
        innovations: held.innovations,
        aiding: model.aiding,
        velocity_sigma: problem.standstill_sigma(Sensor::Accel),
        model: model.clone(),
        noise: solved.noise,
        passes: solved.passes,
        findings: Vec::new(),
    };
    outcome.set_part(BudgetSource::Headings, solved.by_headings);
    if let Some(scattered) = scattered {
        outcome.set_part(BudgetSource::DwellScatter, scattered);
    }
    let growth = outcome.growth_by(BudgetSource::DwellScatter);
    outcome.set_part(BudgetSource::Rounding, rounding);
    outcome.findings = checks::findings(as_stated, &outcome);
    outcome.findings.extend(solved.findings);
    if let Some(scatter) = outcome.dwell_scatter.filter(|_| scattered.is_some()) {
        outcome.findings.push(scatter.finding(growth));
    }
    Ok(outcome)
}

/// How much dwells scatter, none where there are too few; and what the covariance gains where that is beyond chance.
fn scattered(
    held: &mut PassResult,
    problem: &Problem,
    priors: &[AttitudePrior],
) -> (Option<DwellScatter>, Option<ParameterMatrix>) {
    let accepted: Vec<bool> = held.innovations.iter().map(|of| of.accepted).collect();
    // Iterations may have ended where nothing can be reduced.
    let reduction = Script::new(problem, priors, &held.at);
    let reduction = reduction.and_then(|script| script.reduce(problem, &accepted));
    let scores = reduction.ok().and_then(|reduction| {
        let prior = Prior::new(&reduction.constants, &problem.model, &held.at);
        let posterior = reduction.posterior(&prior).ok()?;
        let scores = DwellScores::new(&reduction, &prior, &posterior)?;
        Some((scores, reduction.constants))
    });
    let Some((scores, constants)) = scores else {
        return (None, None);
    };
    let gained = scores.widened().map(|widened| {
        let by_noise = held.both_triads().covariance;
        held.widen(&constants, &widened);
        held.both_triads().covariance - by_noise
    });
    (Some(scores.scatter), gained)
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
