//! The estimator: coarse start, with a table a live pass, and held passes until nothing moves.

use super::coarse::{CoarseStart, coarse_start};
use super::consistency::consistency;
use super::curvature::curvature;
use super::error::CalibrationError;
use super::form::{FormTest, form_test};
use super::further::constant_name;
use super::linearisation::{Linearisation, singular};
use super::observability::Observability;
use super::outcome::{Estimate, Innovation, Outcome, Pass, to_vector};
use super::pass::{Gate, Mode, PassResult, pass};
use super::problem::Problem;
use super::schedule::Schedule;
use super::standstill::velocity_sigma;

use crate::imu::{InstallationForm, Sensor};
use crate::run::Run;
use crate::run::record::BodyFrame;
use crate::units::DEGREE;

/// Told after each pass; the command line draws it.
pub type Progress<'a> = &'a (dyn Fn(&Pass) + Sync);

/// Passes have converged when no parameter moves by more than this many of its σ.
const CONVERGED: f64 = 0.02;
/// At most this many passes.
const PASSES: usize = 10;
/// A merit that rises by more than this part means that the step was too long. Each pass knows the
/// merit of its own linearised problem only, so a small rise means nothing.
const MERIT_RISE: f64 = 0.1;
/// After a step of more than this part of the one before, all go half as far.
const SHRINKS: f64 = 0.8;
/// More than this part of all observations beyond the gate are no outliers.
const MOST_OUTLIERS: f64 = 0.05;
/// A NIS this far from one is worth a warning; what is within changes σ by less than a tenth.
const DOUBTFUL: f64 = 0.2;

/// Estimates both triads of a run, by standstill and, where the run has a table's log, its attitude.
///
/// Source: design of the passes after Maybeck, *Stochastic Models, Estimation and Control*, vol. 2,
/// §9.7 (iterated, linearised filters): each held pass is a Gauss–Newton step of the whole record.
///
/// # Errors
/// [`CalibrationError`] where the run cannot give a calibration. A run that gives one without
/// convergence is an [`Outcome`] with `converged = false` and a warning.
pub fn estimate(
    run: &Run,
    form: InstallationForm,
    progress: Progress,
) -> Result<Outcome, CalibrationError> {
    if !run.imu.continuous {
        return Err(CalibrationError::not_continuous(&run.imu));
    }
    let dwells = run.dwells();
    let schedule = Schedule::new(run, &dwells)?;
    let start = coarse_start(run, &dwells, form)?;
    let velocity_sigma = velocity_sigma(run, &dwells);
    let attempt = |start: CoarseStart| {
        let problem = Problem::new(run, schedule.clone(), form, start.attitude, velocity_sigma);
        attempt(problem, start.at, progress)
    };
    let of_start = attempt(start);
    let others = start.other_headings().map(attempt);
    let Attempt {
        problem,
        passes,
        live,
        held,
        converged,
    } = others.fold(of_start, better)?;
    let estimate = Estimate {
        triads: held.estimate.triads,
        covariance: held.covariance + curvature(&held.estimate.triads, &held.covariance),
    };
    let usable = |sensor| estimate.triads.get(sensor).correction().is_some();
    if !Sensor::ALL.into_iter().all(usable) {
        return Err(singular(&estimate.triads));
    }
    let mut outcome = Outcome {
        form_test: form_test(&problem, &held)?,
        observability: Observability::new(
            &estimate,
            &problem.prior_sigma,
            &held.attitude_covariance,
        ),
        estimate,
        prior_sigma: problem.prior_sigma,
        prior_mean: problem.prior_mean,
        prior_attitude: problem.attitude,
        attitude_sigma: held.attitude_sigma,
        further: held.further,
        linearised_at: held.at,
        converged,
        log_determinant: held.log_determinant,
        consistency: consistency(&held.innovations),
        history: held.history,
        live_history: live.map(|live| live.history).unwrap_or_default(),
        innovations: held.innovations,
        velocity_sigma,
        passes,
        warnings: run.notes.clone(),
    };
    outcome.warnings.extend(warnings(&outcome));
    Ok(outcome)
}

/// A calibration from one start.
struct Attempt<'a> {
    problem: Problem<'a>,
    passes: Vec<Pass>,
    live: Option<PassResult>,
    held: PassResult,
    converged: bool,
}

fn attempt<'a>(
    problem: Problem<'a>,
    start: Linearisation,
    progress: Progress,
) -> Result<Attempt<'a>, CalibrationError> {
    let mut passes = Vec::new();
    // What a live pass feeds back while heading is known to degrees only leads it astray; the coarse
    // start without a table is good enough for the held passes to begin from.
    let live = match problem.run.body_frame() {
        BodyFrame::Table => Some(pass(&problem, &start, Mode::Live)?),
        BodyFrame::Accelerometer => None,
    };
    if let Some(live) = &live {
        passes.push(summary(live, &start, true));
        passes.iter().for_each(progress);
    }
    let from = live.as_ref().map_or(start, |live| live.estimate);
    let (held, converged) = iterate(&problem, from, &mut passes, progress)?;
    Ok(Attempt {
        problem,
        passes,
        live,
        held,
        converged,
    })
}

/// The attempt that converged, and if both did, that of the lower merit.
fn better<'a>(
    one: Result<Attempt<'a>, CalibrationError>,
    other: Result<Attempt<'a>, CalibrationError>,
) -> Result<Attempt<'a>, CalibrationError> {
    let rank = |attempt: &Attempt| (!attempt.converged, attempt.held.merit);
    match (one, other) {
        (Ok(one), Ok(other)) if rank(&other) < rank(&one) => Ok(other),
        (Err(_), Ok(other)) => Ok(other),
        (one, _) => one,
    }
}

/// Held passes from a first point on, each linearised at the estimate of the one before; and whether
/// they converged.
fn iterate(
    problem: &Problem,
    from: Linearisation,
    passes: &mut Vec<Pass>,
    progress: Progress,
) -> Result<(PassResult, bool), CalibrationError> {
    let mut at = from;
    let mut gate = Gate::Innovations;
    let mut before: Option<PassResult> = None;
    let (mut fraction, mut last_step) = (1.0, f64::INFINITY);
    loop {
        let result = pass(problem, &at, Mode::Held(gate))?;
        let summary = summary(&result, &at, false);
        progress(&summary);
        passes.push(summary);
        let same_data = before
            .as_ref()
            .is_some_and(|before| same_data(before, &result));
        let settled = summary.largest_step <= CONVERGED
            && (same_data || (before.is_none() && summary.rejected == 0));
        let doubtful = beyond(&result, problem.gate) > MOST_OUTLIERS;
        if passes.len() >= PASSES || (settled && (gate == Gate::Open || !doubtful)) {
            return Ok((result, settled));
        }
        // Where many observations contradict the model it is the model that is wrong, and leaving
        // them out would only hide that.
        if doubtful {
            gate = Gate::Open;
        }
        let too_far =
            before.filter(|before| same_data && result.merit > before.merit * (1.0 + MERIT_RISE));
        // A step as large as the one before may be the way back of it.
        if summary.largest_step > SHRINKS * last_step {
            fraction *= 0.5;
        }
        last_step = summary.largest_step;
        at = match &too_far {
            Some(before) => before.at.towards(&at, 0.5),
            None if fraction < 1.0 => at.towards(&result.estimate, fraction),
            None => result.estimate,
        };
        before = Some(too_far.unwrap_or(result));
    }
}

/// Whether two passes let the same observations in.
fn same_data(a: &PassResult, b: &PassResult) -> bool {
    let accepted = |result: &PassResult| -> Vec<bool> {
        result.innovations.iter().map(|i| i.accepted).collect()
    };
    accepted(a) == accepted(b)
}

/// Part of all observations that are beyond the gate or were left out.
fn beyond(result: &PassResult, gate: f64) -> f64 {
    let beyond = |i: &&Innovation| !i.accepted || i.distance() > gate;
    result.innovations.iter().filter(beyond).count() as f64 / result.innovations.len() as f64
}

fn summary(result: &PassResult, at: &Linearisation, live: bool) -> Pass {
    let sigma = result.covariance.diagonal().map(f64::sqrt);
    let step = to_vector(&result.estimate.triads) - to_vector(&at.triads);
    Pass {
        live,
        largest_step: step
            .iter()
            .zip(&sigma)
            .filter(|&(_, &sigma)| sigma > 0.0)
            .map(|(step, sigma)| (step / sigma).abs())
            .max_by(f64::total_cmp)
            .unwrap_or(0.0),
        merit: result.merit,
        observations: 3 * result.innovations.len(),
        rejected: result.innovations.iter().filter(|i| !i.accepted).count(),
    }
}

fn warnings(outcome: &Outcome) -> Vec<String> {
    let mut warnings = Vec::new();
    if !outcome.converged {
        warnings.push(format!(
            "Not converged: the last of {} passes still moved a parameter by {:.2} σ. Neither \
             values nor σ may be used.",
            outcome.passes.len(),
            outcome
                .passes
                .last()
                .map_or(f64::NAN, |pass| pass.largest_step),
        ));
    }
    let form = outcome.estimate.form();
    let unobserved = outcome.unobserved();
    warnings.extend(outcome.observability.warnings(form, &unobserved));
    if !outcome.heading_observed() {
        warnings.push(format!(
            "The heading is not observed: its σ is {:.1}° after the run. Earth rate is too little for \
             the noise of the gyros, or their biases hide it; parameters are found nevertheless.",
            outcome.attitude_sigma.z / DEGREE
        ));
    }
    let hidden: Vec<String> = outcome
        .further
        .unobserved()
        .filter_map(constant_name)
        .collect();
    if !hidden.is_empty() {
        warnings.push(format!(
            "Not observed by this path, σ not even halved: {}.",
            hidden.join(", ")
        ));
    }
    if outcome.further.even_terms_inseparable() {
        warnings.push(
            "Second order and asymmetry of the accelerometers are one and the same in dwells with an \
             axis up or down. Add dwells between them, at 45° and the like, or leave one of the two \
             off."
                .to_owned(),
        );
    }
    if let Some(test) = outcome.form_test.filter(FormTest::rejects) {
        warnings.push(format!(
            "The data reject the {} installation form: {} more angles, as the general form has them, \
             lower the merit by {:.4e}, where a right form leaves less than {:.1} in 999 runs of 1000. \
             Use the general form.",
            outcome.estimate.form().name(),
            test.angles,
            test.gain,
            test.limit
        ));
    }
    let rejected = outcome.innovations.iter().filter(|i| !i.accepted).count();
    if rejected > 0 {
        warnings.push(format!(
            "{rejected} of {} observations were rejected as outliers.",
            outcome.innovations.len()
        ));
    }
    for (name, nis) in [
        ("velocity", outcome.consistency.velocity),
        ("table attitude", outcome.consistency.table),
    ] {
        if (nis.mean - 1.0).abs() > DOUBTFUL {
            warnings.push(format!(
                "Innovations of {name} are {:.2} times as large as their σ says (NIS {:.2}): noise \
                 figures or model do not fit the data, and the σ of the parameters are as doubtful.",
                nis.mean.sqrt(),
                nis.mean
            ));
        }
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::super::coarse::AttitudePrior;
    use super::super::outcome::from_vector;
    use super::super::schedule::first_reading;
    use super::*;
    use crate::attitude::exp;
    use crate::imu::FurtherVector;
    use crate::simulation::Scenario;
    use crate::units::{ARCSEC, PPM};
    use nalgebra::Vector3;

    #[test]
    fn the_estimate_does_not_depend_on_where_a_held_pass_linearises() {
        let simulated = Scenario::load("demo").unwrap().simulate(1, 0).unwrap();
        let form = InstallationForm::General;
        let dwells = simulated.run.dwells();
        let schedule = Schedule::new(&simulated.run, &dwells).unwrap();
        let reading = first_reading(&simulated.run, &dwells).unwrap();
        let table = simulated.run.table.as_ref().unwrap();
        let prior = AttitudePrior::of_reading(table, reading);
        let mut problem = Problem::new(&simulated.run, schedule, form, prior, 1e-6);
        // As tight a prior of attitude and scale as a run gives, so that it counts.
        problem.start.attitude = Vector3::repeat(ARCSEC);
        problem.prior_mean = to_vector(&simulated.truth);
        problem.prior_sigma.fill(PPM);

        let estimate = |shift: f64| {
            let at = Linearisation {
                triads: from_vector(form, &problem.prior_mean.add_scalar(shift * PPM)),
                further: FurtherVector::zeros(),
                initial_attitude: exp(Vector3::new(1.0, -2.0, 3.0) * (shift * ARCSEC)) * reading,
            };
            let mode = Mode::Held(Gate::Open);
            pass(&problem, &at, mode).unwrap()
        };
        let (here, there) = (estimate(0.0), estimate(2.0));
        let shift = to_vector(&there.estimate.triads) - to_vector(&here.estimate.triads);
        let sigma = here.covariance.diagonal().map(f64::sqrt);
        let largest = shift.component_div(&sigma).amax();
        assert!(largest < 1e-3, "{largest} σ");
    }
}
