//! A calibration from one start, with stated noise: with a table a pass with feedback, and Gauss–Newton iterations.

use super::coarse::{CoarseStart, coarse_start};
use super::error::CalibrationError;
use super::iterations::{Iterated, iterate, summary};
use super::linearisation::{AttitudePrior, Linearisation};
use super::outcome::Pass;
use super::pass::{Epoch, Gate, Mode, pass};
use super::problem::Problem;
use crate::run::Aiding;

/// Told after each pass; the command line draws it.
pub type Progress<'a> = &'a (dyn Fn(&Pass) + Sync);

/// A calibration from one start, with stated noise.
pub(super) struct Attempt {
    pub priors: Vec<AttitudePrior>,
    pub passes: Vec<Pass>,
    /// Of the pass with feedback, where there was one.
    pub feedback_history: Vec<Epoch>,
    pub iterated: Iterated,
}

/// From the coarse start, and where the heading is hidden from all four quadrants.
pub(super) fn from_coarse_start(
    problem: &Problem,
    progress: Progress,
) -> Result<Attempt, CalibrationError> {
    let start = coarse_start(problem)?;
    let others = start.other_headings();
    let of_start = attempt(problem, start, progress);
    let others = others
        .into_iter()
        .map(|start| attempt(problem, start, progress));
    others.fold(of_start, better)
}

fn attempt(
    problem: &Problem,
    start: CoarseStart,
    progress: Progress,
) -> Result<Attempt, CalibrationError> {
    let mut passes = Vec::new();
    let priors = start.attitudes;
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
    let iterated = match live.map(&mut from) {
        Some(Ok(iterated)) if iterated.converged => iterated,
        // What figures that are wrong by orders of magnitude feed back may lead astray, too.
        Some(astray) => match (astray, from(start.at)) {
            (Ok(astray), Err(_)) => astray,
            (_, of_start) => of_start?,
        },
        None => from(start.at)?,
    };
    Ok(Attempt {
        priors,
        passes,
        feedback_history,
        iterated,
    })
}

/// The attempt that converged, and if both did, that of the lower cost.
fn better(
    one: Result<Attempt, CalibrationError>,
    other: Result<Attempt, CalibrationError>,
) -> Result<Attempt, CalibrationError> {
    let rank = |attempt: &Attempt| (!attempt.iterated.converged, attempt.iterated.held.cost);
    match (one, other) {
        (Ok(one), Ok(other)) if rank(&other) < rank(&one) => Ok(other),
        (Err(_), Ok(other)) => Ok(other),
        (one, _) => one,
    }
}
