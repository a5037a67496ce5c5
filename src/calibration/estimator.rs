//! The estimator: coarse start, then Gauss–Newton iterations, each with a fixed linearisation, until convergence.

use crate::calibration::checks::cause::{Causes, settling};
use crate::calibration::checks::form::form_test;
use crate::calibration::checks::prior_distance::widened;
use crate::calibration::checks::rounding::by_rounding;
use crate::calibration::noise::learn;
use crate::calibration::start::attempt::from_coarse_start;
use crate::calibration::{
    BudgetSource, CalibrationError, Cause, FormTest, FoundCause, Outcome, Problem, Progress,
    Solved, checks, several,
};
use crate::run::Aiding;

/// Least number of dwells per cause; more causes would fit noise.
const DWELLS_OF_ONE: usize = 6;

/// Estimates both triads from zero velocity in dwells and, if observed, the attitude of the table.
///
/// Source: design of the passes after Maybeck, *Stochastic Models, Estimation and Control*, vol. 2,
/// §9.7 (iterated, linearised filters): each pass with fixed linearisation is a Gauss–Newton step on
/// all data.
///
/// # Errors
/// [`CalibrationError`] if the runs cannot give a calibration. Without convergence, the result is an
/// [`Outcome`] with `converged = false` and a finding.
pub fn estimate(problem: &Problem, progress: Progress) -> Result<Outcome, CalibrationError> {
    let solved = match problem.varies() || problem.runs().nth(1).is_some() {
        true => several::solve(problem, progress)?,
        false => from_coarse_start(problem, progress)?,
    };
    let solved = with_wide_prior(solved, progress)?;
    let form_test = form_test(&solved)?;
    let solved = match problem.model.aiding {
        // Angles that are missing are neither a cause nor noise.
        _ if form_test.as_ref().is_some_and(FormTest::rejects) => solved,
        Aiding::Table => {
            let solved = with_causes(settled(solved, progress)?, progress)?;
            with_noise(problem, solved, progress)?
        }
        // By hand only the recording itself tells how much a move leaves.
        Aiding::Velocity => with_causes(with_noise(problem, solved, progress)?, progress)?,
    };
    outcome(&solved.as_stated(problem), solved, form_test)
}

/// The outcome, with unmodelled errors added to its covariance.
fn outcome(
    as_stated: &Problem,
    solved: Solved,
    form_test: Option<FormTest>,
) -> Result<Outcome, CalibrationError> {
    let (problem, findings) = (solved.problem.clone(), solved.findings.clone());
    let mut outcome = Outcome::by_noise(as_stated, solved, form_test)?;
    let (run, triads) = (problem.run(), outcome.estimate.triads);
    outcome.set_part(BudgetSource::Rounding, by_rounding(&problem, &triads));
    if run.recording.imu.period_sigma > 0.0 {
        outcome.set_part(BudgetSource::Period, outcome.estimate.by_period(run));
    }
    outcome.findings = checks::findings(as_stated, &outcome, findings);
    Ok(outcome)
}

/// Drops the settling time after each stop, until none is found; unchanged if it exceeds the settling time of a table.
fn settled<'a>(before: Solved<'a>, progress: Progress) -> Result<Solved<'a>, CalibrationError> {
    let mut solved = before.clone();
    loop {
        let steps = settling::settling(&solved)?;
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

/// Includes the causes found in the recording, the most likely first, until none is significant.
fn with_causes<'a>(
    mut solved: Solved<'a>,
    progress: Progress,
) -> Result<Solved<'a>, CalibrationError> {
    let most = solved.problem.dwells().count() / DWELLS_OF_ONE;
    let mut causes = causes_of(&solved)?;
    while solved.causes.len() < most {
        let Some((with, left)) = with_one(&solved, &causes, progress)? else {
            break;
        };
        (solved, causes) = (with, left);
    }
    Ok(solved)
}

/// Includes the most likely cause that is significant; also returns the remaining causes.
fn with_one<'a>(
    solved: &Solved<'a>,
    causes: &Causes,
    progress: Progress,
) -> Result<Option<(Solved<'a>, Causes)>, CalibrationError> {
    let auto_terms = solved.problem.options.auto_terms;
    // Nothing else is to explain a term that is not asked for.
    let is_asked = |of: &&FoundCause| auto_terms || !matches!(of.cause, Cause::Term(_));
    for found in causes.likeliest.iter().filter(is_asked) {
        let problem = found.taken_into(&solved.problem);
        // A cause with which nothing converges is none.
        let Some(mut with) = solved.better(solved.clone().again(problem, progress))? else {
            continue;
        };
        let left = causes_of(&with)?;
        let found = found.beside_what_it_leaves(&left);
        if found.is_beyond() {
            with.causes.push(found);
            return Ok(Some((with, left)));
        }
    }
    Ok(None)
}

fn causes_of(solved: &Solved) -> Result<Causes, CalibrationError> {
    Causes::of(&solved.problem, &solved.priors, &solved.iterated)
}

/// Uses the noise estimated from the data, if they contradict the stated noise.
fn with_noise<'a>(
    problem: &Problem<'a>,
    solved: Solved<'a>,
    progress: Progress,
) -> Result<Solved<'a>, CalibrationError> {
    let learnt = learn(&solved.as_stated(problem), solved.clone(), progress);
    // Noise that the filter cannot run with, as of a recording without any, leaves the stated one.
    Ok(solved.better(learnt)?.unwrap_or(solved))
}

/// Iterates with a prior that the estimate does not contradict, because a wrong prior would turn correct observations
/// into outliers and its error into noise.
fn with_wide_prior<'a>(
    solved: Solved<'a>,
    progress: Progress,
) -> Result<Solved<'a>, CalibrationError> {
    let estimate = solved.iterated.both_triads();
    let Some(model) = widened(&solved.problem.model, &estimate) else {
        return Ok(solved);
    };
    let again = solved
        .clone()
        .again(solved.problem.with_model(model), progress);
    // A prior that is too tight is better than none.
    Ok(solved.better(again)?.unwrap_or(solved))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::super::linearisation::Linearisation;
    use super::super::parameters::{from_vector, to_vector};
    use super::super::pass::{Gate, pass};
    use super::super::reduction::Script;
    use super::super::{Options, Problem};
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
