//! A calibration starting from the coarse start.

use super::coarse::{CoarseStart, coarse_start};
use crate::calibration::{
    CalibrationError, Gate, Iterated, NoisePolicy, Problem, Progress, Script, Solved, pass,
};

/// Iterates from the coarse start, with the stated noise.
pub fn from_coarse_start<'a>(
    problem: &Problem<'a>,
    progress: Progress,
) -> Result<Solved<'a>, CalibrationError> {
    let start = coarse_start(problem)?;
    let may_be_learnt = problem.options.noise != NoisePolicy::Stated;
    let (at, priors) = (start.at.clone(), start.attitudes.clone());
    match Solved::of(problem, priors, at, Gate::Innovations, progress) {
        Err(CalibrationError::Stopped) => Err(CalibrationError::Stopped),
        Ok(solved) if solved.iterated.converged => Ok(solved),
        // Noise that is stated far too small leads a step out of all that is linear; the start shows how large it is.
        _ if may_be_learnt => at_start(problem, start),
        astray => astray,
    }
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
