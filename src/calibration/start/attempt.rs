//! A calibration from one start, with stated noise: with a table a pass with feedback, and Gauss–Newton iterations.
//! Where stated noise leads nowhere, with the noise that the data show at the start.

use super::coarse::{CoarseStart, coarse_start};
use crate::calibration::error::CalibrationError;
use crate::calibration::iterations::{Iterated, iterate, summary};
use crate::calibration::linearisation::{AttitudePrior, Linearisation};
use crate::calibration::noise::{Learnt, NoisePolicy, learn};
use crate::calibration::outcome::Pass;
use crate::calibration::pass::{Epoch, Gate, Mode, pass};
use crate::calibration::problem::Problem;
use crate::run::Aiding;

/// Told after each pass; the command line draws it.
pub type Progress<'a> = &'a (dyn Fn(&Pass) + Sync);

/// A calibration from the coarse start, with stated noise, unless it had to be learnt there.
pub struct Attempt {
    pub priors: Vec<AttitudePrior>,
    pub passes: Vec<Pass>,
    /// Of the pass with feedback, where there was one.
    pub feedback_history: Vec<Epoch>,
    pub iterated: Iterated,
    /// Noise that was learnt at the start, with which the passes were made.
    pub learnt: Option<Learnt>,
}

/// From the coarse start; where stated noise does not converge, with the noise that the data show there.
pub fn from_coarse_start(
    problem: &Problem,
    progress: Progress,
) -> Result<Attempt, CalibrationError> {
    let start = coarse_start(problem)?;
    let stated = attempt(problem, &start, progress);
    let converged = |attempt: &Attempt| attempt.iterated.converged;
    if stated.as_ref().is_ok_and(converged) || problem.options.noise == NoisePolicy::Stated {
        return stated;
    }
    let mut passes = Vec::new();
    match learnt_at(&start, problem, &mut passes, progress) {
        Ok(learnt) if learnt.iterated.converged => Ok(Attempt {
            priors: start.attitudes,
            passes,
            feedback_history: Vec::new(),
            iterated: learnt.iterated.clone(),
            learnt: Some(learnt),
        }),
        _ => stated,
    }
}

fn attempt(
    problem: &Problem,
    start: &CoarseStart,
    progress: Progress,
) -> Result<Attempt, CalibrationError> {
    let mut passes = Vec::new();
    let priors = start.attitudes.clone();
    // What is fed back while heading is known to degrees only leads a pass astray; the coarse start
    // without a table is good enough for the iterations to begin from.
    let feedback = match problem.model.aiding {
        Aiding::Table => pass(problem, &priors, &start.at, Mode::Feedback).ok(),
        Aiding::Velocity => None,
    };
    if let Some(feedback) = &feedback {
        passes.push(summary(feedback, &start.at, true));
        passes.iter().for_each(progress);
    }
    let mut from = |at: Linearisation| {
        iterate(
            problem,
            &priors,
            at,
            Gate::Innovations,
            &mut passes,
            progress,
        )
    };
    // Nothing else of it is needed.
    let (live, feedback_history) = match feedback {
        Some(pass) => (Some(pass.estimate), pass.history),
        None => (None, Vec::new()),
    };
    let stated = match live.map(&mut from) {
        Some(Ok(iterated)) if iterated.converged => Ok(iterated),
        // What figures that are wrong by orders of magnitude feed back may lead astray, too.
        Some(astray) => match (astray, from(start.at.clone())) {
            (Ok(astray), Err(_)) => Ok(astray),
            (_, of_start) => of_start,
        },
        None => from(start.at.clone()),
    };
    Ok(Attempt {
        priors,
        passes,
        feedback_history,
        iterated: stated?,
        learnt: None,
    })
}

/// The calibration with the noise that the data show at the start. Where noise is stated far too small, what it leaves
/// of moves pulls a step out of all that is linear; as large as it is, the step is a short one.
fn learnt_at(
    start: &CoarseStart,
    problem: &Problem,
    passes: &mut Vec<Pass>,
    progress: Progress,
) -> Result<Learnt, CalibrationError> {
    let CoarseStart {
        at,
        attitudes,
        by_hand,
        ..
    } = start;
    let here = match by_hand {
        Some(by_hand) => {
            let problem = &problem.with_model(by_hand.model(problem));
            let gate = Gate::Innovations;
            iterate(problem, attitudes, at.clone(), gate, passes, progress)?
        }
        None => {
            let mut held = pass(problem, attitudes, at, Mode::Held(Gate::Open))?;
            held.estimate = at.clone();
            Iterated {
                held,
                converged: false,
            }
        }
    };
    learn(problem, attitudes, here, passes, progress)
}

/// The calibration with the noise that the data show, where they contradict what is stated.
pub fn learnt_or_stated(
    problem: &Problem,
    priors: &[AttitudePrior],
    stated: Iterated,
    passes: &mut Vec<Pass>,
    progress: Progress,
) -> Learnt {
    let number = passes.len();
    match learn(problem, priors, stated.clone(), passes, progress) {
        Ok(learnt) if learnt.iterated.converged || !stated.converged => learnt,
        // Noise that the filter cannot run with, as of a record without any, leaves the stated one.
        _ => {
            passes.truncate(number);
            Learnt::stated(problem, stated)
        }
    }
}
