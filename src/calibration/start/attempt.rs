//! A calibration from the coarse start.

use rayon::prelude::*;

use super::coarse::{CoarseStart, coarse_start};
use crate::attitude::log;
use crate::calibration::error::CalibrationError;
use crate::calibration::gauss_newton::{Iterated, Progress, iterate};
use crate::calibration::noise::NoisePolicy;
use crate::calibration::parameters::{ParameterMatrix, ParameterVector, to_vector};
use crate::calibration::pass::{Gate, pass};
use crate::calibration::problem::Problem;
use crate::calibration::reduction::Script;
use crate::calibration::solved::Solved;

/// From the coarse start, with the heading in the likeliest of four quadrants where Earth rate does not tell it; with the
/// noise that is stated or, where it may be learnt, with what a hand adds to it as the start shows.
pub fn from_coarse_start<'a>(
    problem: &Problem<'a>,
    progress: Progress,
) -> Result<Solved<'a>, CalibrationError> {
    let start = coarse_start(problem)?;
    let may_be_learnt = problem.options.noise != NoisePolicy::Stated;
    let by_hand = start.by_hand.as_ref().filter(|_| may_be_learnt);
    let with_hand = by_hand.map(|by_hand| problem.with_model(by_hand.model(problem)));
    let problem = with_hand.as_ref().unwrap_or(problem);
    // What a hand leaves is not all that is unknown: noise that is estimated decides on outliers.
    let gate = with_hand.as_ref().map_or(Gate::Innovations, |_| Gate::Open);
    let tried = |start: CoarseStart| (solved(problem, &start, gate, progress), start);
    let mut best = tried(start);
    let mut headings: Vec<Heading> = Heading::of(&best.0).into_iter().collect();
    if best.1.heading_unobserved {
        let others: Vec<_> = best.1.other_headings().into_par_iter().map(tried).collect();
        headings.extend(others.iter().filter_map(|(solved, _)| Heading::of(solved)));
        best = others.into_iter().fold(best, likelier);
    }
    let (mut solved, start) = best;
    let chosen = Heading::of(&solved);
    if let (Ok(solved), Some(chosen)) = (&mut solved, chosen) {
        solved.by_headings = chosen.mean_square_to(&headings);
    }
    match &solved {
        Err(CalibrationError::Stopped) => solved,
        Ok(solved) if solved.iterated.converged => Ok(solved.clone()),
        // Noise that is stated far too small leads a step out of all that is linear; the start shows how large it is.
        _ if may_be_learnt => at_start(problem, &start),
        _ => solved,
    }
}

/// What came of a start.
type Tried<'a> = (Result<Solved<'a>, CalibrationError>, CoarseStart);

/// The one that converged, and if both did, the likelier one.
fn likelier<'a>(one: Tried<'a>, other: Tried<'a>) -> Tried<'a> {
    let rank = |solved: &Solved| {
        let Iterated {
            held, converged, ..
        } = &solved.iterated;
        (!converged, held.deviance())
    };
    match (&one.0, &other.0) {
        (Ok(first), Ok(second)) if rank(second) < rank(first) => other,
        (Err(_), Ok(_)) => other,
        _ => one,
    }
}

/// What came of one heading, where it converged.
struct Heading {
    /// −2 ln of its likelihood, except a constant. Within its quadrant one heading is as likely as another.
    deviance: f64,
    parameters: ParameterVector,
}

impl Heading {
    fn of(solved: &Result<Solved, CalibrationError>) -> Option<Self> {
        let solved = solved.as_ref().ok()?;
        let Iterated { held, estimate, .. } = &solved.iterated;
        let attitudes = estimate.initial_attitudes.iter();
        let off = attitudes.zip(&solved.priors).map(|(attitude, prior)| {
            let off = log(&(attitude * prior.mean.transpose()));
            (off.z / prior.sigma.z).powi(2)
        });
        solved.iterated.converged.then(|| Self {
            deviance: held.deviance() - off.sum::<f64>(),
            parameters: to_vector(&estimate.triads),
        })
    }

    /// Mean square by which the parameters differ from those of all headings, each weighted by its likelihood.
    ///
    /// Source: Hoeting, Madigan, Raftery and Volinsky 1999, "Bayesian model averaging: a tutorial", Statistical
    /// Science 14(4), for the weights.
    fn mean_square_to(&self, all: &[Self]) -> ParameterMatrix {
        let weight = |of: &Self| (0.5 * (self.deviance - of.deviance)).min(0.0).exp();
        let sum: f64 = all.iter().map(weight).sum();
        let each = all.iter().map(|of| {
            let apart = of.parameters - self.parameters;
            apart * apart.transpose() * (weight(of) / sum)
        });
        each.sum()
    }
}

fn solved<'a>(
    problem: &Problem<'a>,
    start: &CoarseStart,
    gate: Gate,
    progress: Progress,
) -> Result<Solved<'a>, CalibrationError> {
    let (mut passes, at) = (Vec::new(), start.at.clone());
    let priors = start.attitudes.clone();
    let iterated = iterate(problem, &priors, at, gate, &mut passes, progress)?;
    Ok(Solved::new(problem, priors, iterated, passes))
}

/// One pass at the start, which stays the estimate.
fn at_start<'a>(
    problem: &Problem<'a>,
    start: &CoarseStart,
) -> Result<Solved<'a>, CalibrationError> {
    let script = Script::new(problem, &start.attitudes, &start.at)?;
    let iterated = Iterated {
        held: pass(problem, &script, Gate::Open)?,
        estimate: start.at.clone(),
        converged: false,
    };
    Ok(Solved::new(
        problem,
        start.attitudes.clone(),
        iterated,
        Vec::new(),
    ))
}
