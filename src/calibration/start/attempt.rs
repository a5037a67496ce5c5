//! A calibration starting from the coarse start.

use super::coarse::{CoarseStart, coarse_start};
use crate::calibration::{
    CalibrationError, Gate, Iterated, NoisePolicy, Problem, Progress, Script, Solved, pass,
};

/// Iterates from the coarse start, with the stated noise or, if noise may be estimated, with the hand noise found at
/// the start.
pub fn from_coarse_start<'a>(
    problem: &Problem<'a>,
    progress: Progress,
) -> Result<Solved<'a>, CalibrationError> {
    let start = coarse_start(problem)?;
    let may_be_learnt = problem.options.noise != NoisePolicy::Stated;
    let by_hand = start.by_hand.as_ref().filter(|_| may_be_learnt);
    let with_hand = by_hand.and_then(|_| start.by_hand(problem));
    let noise = by_hand.map(|by_hand| by_hand.report(problem));
    let problem = with_hand.as_ref().unwrap_or(problem);
    // What a hand leaves is not all that is unknown: noise that is estimated decides on outliers.
    let gate = by_hand.map_or(Gate::Innovations, |_| Gate::Open);
    let (at, priors) = (start.at.clone(), start.attitudes.clone());
    let mut solved = match Solved::of(problem, priors, at, gate, progress) {
        Err(CalibrationError::Stopped) => return Err(CalibrationError::Stopped),
        Ok(solved) if solved.iterated.converged => solved,
        // Noise that is stated far too small leads a step out of all that is linear; the start shows how large it is.
        _ if may_be_learnt => at_start(problem, start)?,
        astray => astray?,
    };
    solved.noise = noise.unwrap_or(solved.noise);
    Ok(solved)
}

/// One pass at the start, which remains the estimate.
fn at_start<'a>(problem: &Problem<'a>, start: CoarseStart) -> Result<Solved<'a>, CalibrationError> {
    let script = Script::new(problem, &start.attitudes, &start.at)?;
    let iterated = Iterated {
        held: pass(problem, &script, Gate::Open)?,
        estimate: start.at,
        converged: false,
    };
    Ok(Solved::new(problem, start.attitudes, iterated, Vec::new()))
}
