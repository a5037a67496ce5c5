//! The estimator: coarse start, and Gauss–Newton iterations with the linearisation held until nothing moves.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::budget::BudgetSource;
use super::constants::Prior;
use super::error::CalibrationError;
use super::gauss_newton::{Iterated, Progress};
use super::linearisation::{UNKNOWN_HEADING, not_invertible};
use super::model::Model;
use super::outcome::Outcome;
use super::parameters::ParameterMatrix;
use super::problem::Problem;
use super::several;
use super::solved::Solved;
use crate::calibration::checks;
use crate::calibration::checks::cause::{Cause, FoundCause, likeliest};
use crate::calibration::checks::dwell_scatter::{DwellScatter, DwellScores};
use crate::calibration::checks::form::{FormTest, form_test};
use crate::calibration::checks::innovation::consistency;
use crate::calibration::checks::observability::Observability;
use crate::calibration::checks::prior_distance::widened;
use crate::calibration::checks::rounding::by_rounding;
use crate::calibration::checks::settling;
use crate::calibration::noise::learn;
use crate::calibration::start::attempt::from_coarse_start;
use crate::imu::Sensor;
use crate::run::Aiding;

/// More than one cause in so many dwells explains noise.
const DWELLS_OF_ONE: usize = 6;

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
    let solved = with_wide_prior(solved, progress)?;
    let form_test = form_test(&solved.problem, &solved.priors, &solved.iterated)?;
    // Angles that are missing are neither a cause nor noise.
    if form_test.as_ref().is_some_and(FormTest::rejects) {
        return outcome(&as_stated(problem, &solved), solved, form_test);
    }
    let solved = match problem.model.aiding {
        Aiding::Table => {
            let solved = settled(with_causes(solved, progress)?, progress)?;
            with_noise(&as_stated(problem, &solved), solved, progress)?
        }
        // By hand only the record itself tells how much a move leaves.
        Aiding::Velocity => {
            let solved = with_noise(&as_stated(problem, &solved), solved, progress)?;
            with_causes(solved, progress)?
        }
    };
    outcome(&as_stated(problem, &solved), solved, form_test)
}

/// The problem that was solved with noise and prior as they are stated; recordings differ as they show.
fn as_stated<'a>(stated: &Problem<'a>, solved: &Solved<'a>) -> Problem<'a> {
    let mut model = solved.problem.model.with_noise_of(&stated.model);
    model.prior_sigma = stated.model.prior_sigma;
    solved.problem.with_model(model)
}

/// Without the time after each stop in which the attitude settles, as long as more of it shows; as it is where that lasts
/// longer than a table settles.
fn settled<'a>(before: Solved<'a>, progress: Progress) -> Result<Solved<'a>, CalibrationError> {
    let mut solved = before.clone();
    loop {
        let steps = settling::settling(&solved.problem, &solved.iterated.held.innovations);
        if steps == 0 {
            return Ok(solved);
        }
        if settling::is_longer(&solved.problem, solved.settling + steps) {
            return Ok(before);
        }
        let problem = solved.problem.settled(steps);
        solved = solved.again(problem, progress)?;
        solved.settling += steps;
    }
}

/// With the causes that the record shows: the one that explains most first, as long as one is beyond chance.
fn with_causes<'a>(
    mut solved: Solved<'a>,
    progress: Progress,
) -> Result<Solved<'a>, CalibrationError> {
    let most = solved.problem.dwells().count() / DWELLS_OF_ONE;
    while solved.causes.len() < most {
        let Some(found) = likeliest(&solved.problem, &solved.priors, &solved.iterated)? else {
            break;
        };
        // Nothing else is to explain a term that is not asked for.
        if matches!(found.cause, Cause::Term(_)) && !solved.problem.options.auto_terms {
            break;
        }
        let problem = found.taken_into(&solved.problem);
        match solved.clone().again(problem, progress) {
            Ok(again) if again.iterated.converged || !solved.iterated.converged => solved = again,
            Err(CalibrationError::Stopped) => return Err(CalibrationError::Stopped),
            // A cause with which nothing converges is none.
            _ => break,
        }
        solved.causes.push(found);
    }
    Ok(solved)
}

/// With the noise that the data show, where they contradict what is stated.
fn with_noise<'a>(
    as_stated: &Problem<'a>,
    solved: Solved<'a>,
    progress: Progress,
) -> Result<Solved<'a>, CalibrationError> {
    match learn(as_stated, solved.clone(), progress) {
        Ok(learnt) if learnt.iterated.converged || !solved.iterated.converged => Ok(learnt),
        Err(CalibrationError::Stopped) => Err(CalibrationError::Stopped),
        // Noise that the filter cannot run with, as of a record without any, leaves the stated one.
        _ => Ok(solved),
    }
}

/// Iterations with a prior that its estimate does not contradict: a wrong one would make outliers of correct
/// observations, and noise of itself.
fn with_wide_prior<'a>(
    solved: Solved<'a>,
    progress: Progress,
) -> Result<Solved<'a>, CalibrationError> {
    let estimate = solved.iterated.both_triads();
    let Some(model) = widened(&solved.problem.model, &estimate) else {
        return Ok(solved);
    };
    let problem = solved.problem.with_model(model);
    match solved.clone().again(problem, progress) {
        Err(CalibrationError::Stopped) => Err(CalibrationError::Stopped),
        // A prior that is too tight is better than none.
        again => Ok(again.unwrap_or(solved)),
    }
}

/// What was found with its covariance, to which errors that no pass knows of are added.
fn outcome(
    as_stated: &Problem,
    solved: Solved,
    form_test: Option<FormTest>,
) -> Result<Outcome, CalibrationError> {
    let (problem, mut iterated) = (solved.problem, solved.iterated);
    let model = &problem.model;
    let estimate = iterated.both_triads();
    let (dwell_scatter, scattered) = scattered(&mut iterated, model);
    let Iterated {
        held, converged, ..
    } = iterated;
    if let Some(sensor) = not_invertible(&estimate.triads) {
        return Err(CalibrationError::Singular { sensor });
    }
    let (attitude_sigma, attitude_covariance) = held.last_attitude();
    let gravity = held.gravity();
    let prior = Prior::new(&held.reduction.constants, model, &held.at);
    let rounding = by_rounding(&problem, &estimate.triads);
    let mut outcome = Outcome {
        form_test,
        dwell_scatter,
        observability: Observability::new(
            &estimate,
            &as_stated.model.prior_sigma,
            &attitude_covariance,
        ),
        covariance_by_noise: estimate.covariance,
        estimate,
        covariance_parts: BTreeMap::new(),
        prior_sigma: as_stated.model.prior_sigma,
        prior_mean: model.prior_mean,
        attitude_sigma: match solved.priors.last() {
            Some(prior) if prior.heading_is_unknown() => {
                Vector3::new(attitude_sigma.x, attitude_sigma.y, UNKNOWN_HEADING)
            }
            _ => attitude_sigma,
        },
        prior_attitudes: solved.priors,
        auxiliary: held.auxiliary(model),
        thermal: held.thermal(model),
        own: held.reduction.own(&held.at, &held.posterior),
        warming: problem.warming(),
        alone: solved.alone,
        gravity: (problem.run().site.gravity + gravity.0, gravity.1),
        converged,
        consistency: consistency(&held.innovations),
        history: held.reduction.history(&prior, &held.at),
        linearised_at: held.at,
        innovations: held.innovations,
        aiding: model.aiding,
        velocity_sigma: problem.standstill_sigma(Sensor::Accel),
        model: model.clone(),
        settling: solved.settling,
        causes: solved.causes,
        noise: solved.noise,
        passes: solved.passes,
        findings: Vec::new(),
    };
    if let Some(scattered) = scattered {
        outcome.set_part(BudgetSource::DwellScatter, scattered);
    }
    let growth = outcome.growth_by(BudgetSource::DwellScatter);
    outcome.set_part(BudgetSource::Rounding, rounding);
    if problem.run().recording.imu.period_sigma > 0.0 {
        let by_period = outcome.estimate.by_period(problem.run());
        outcome.set_part(BudgetSource::Period, by_period);
    }
    outcome.findings = checks::findings(as_stated, &outcome);
    outcome
        .findings
        .extend(settling::finding(as_stated, outcome.settling));
    let causes = outcome.causes.iter().map(FoundCause::finding);
    outcome.findings.extend(causes.collect::<Vec<_>>());
    outcome.findings.extend(solved.findings);
    if let Some(scatter) = outcome.dwell_scatter.filter(|_| scattered.is_some()) {
        outcome.findings.push(scatter.finding(growth));
    }
    Ok(outcome)
}

/// How much dwells scatter, none where there are too few; and what the covariance gains where that is beyond chance.
fn scattered(
    iterated: &mut Iterated,
    model: &Model,
) -> (Option<DwellScatter>, Option<ParameterMatrix>) {
    let held = &iterated.held;
    let prior = Prior::new(&held.reduction.constants, model, &held.at);
    let Some(scores) = DwellScores::new(&held.reduction, &prior, &held.posterior) else {
        return (None, None);
    };
    let gained = scores.widened().map(|widened| {
        let by_noise = iterated.both_triads().covariance;
        let posterior = &mut iterated.held.posterior;
        *posterior = posterior.clone().with_covariance(widened);
        iterated.both_triads().covariance - by_noise
    });
    (Some(scores.scatter), gained)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::super::Options;
    use super::super::linearisation::Linearisation;
    use super::super::parameters::{from_vector, to_vector};
    use super::super::pass::{Gate, pass};
    use super::super::reduction::Script;
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
            let priors = [prior];
            let script = Script::new(&problem, &priors, &at).unwrap();
            pass(&problem, &script, Gate::Open).unwrap()
        };
        let (here, there) = (estimate(0.0), estimate(2.0));
        let shift = to_vector(&there.estimate().triads) - to_vector(&here.estimate().triads);
        let sigma = here
            .posterior
            .parameter_covariance
            .diagonal()
            .map(f64::sqrt);
        let largest = shift.component_div(&sigma).amax();
        assert!(largest < 1e-3, "{largest} σ");
    }
}
