//! A calibration from one start, with stated noise: with a table a pass with feedback, and Gauss–Newton iterations.
//! Where stated noise leads nowhere, with the noise that the data show at the start.

use rayon::prelude::*;

use super::coarse::{CoarseStart, coarse_start};
use crate::attitude::log;
use crate::calibration::error::CalibrationError;
use crate::calibration::gauss_newton::{Iterated, Progress, iterate, summary, tell};
use crate::calibration::linearisation::Linearisation;
use crate::calibration::noise::{NoisePolicy, learn};
use crate::calibration::parameters::{ParameterMatrix, ParameterVector, to_vector};
use crate::calibration::pass::{Gate, Mode, pass};
use crate::calibration::problem::Problem;
use crate::calibration::solved::Solved;
use crate::run::Aiding;

/// A fall of −2 ln of the likelihood that is nothing: a third of a σ of one parameter.
const SETTLED: f64 = 0.1;

/// From the coarse start, with the heading in the likeliest of four quadrants where Earth rate does not tell it; where
/// stated noise does not converge, with the noise that the data show there.
pub fn from_coarse_start<'a>(
    problem: &Problem<'a>,
    progress: Progress,
) -> Result<Solved<'a>, CalibrationError> {
    let start = coarse_start(problem)?;
    let tried = |start| (stated(problem, &start, progress), start);
    let mut best = tried(start);
    let mut headings: Vec<Heading> = Heading::of(&best.0).into_iter().collect();
    if best.1.heading_unobserved {
        let others: Vec<_> = best.1.other_headings().into_par_iter().map(tried).collect();
        headings.extend(others.iter().filter_map(|(solved, _)| Heading::of(solved)));
        best = others.into_iter().fold(best, likelier);
    }
    let (mut stated, start) = best;
    let chosen = Heading::of(&stated);
    if let Ok(stated) = &mut stated {
        stated.start = Some(start.clone());
        if let Some(chosen) = chosen {
            stated.by_headings = chosen.mean_square_to(&headings);
        }
    }
    let converged = |solved: &Solved| solved.iterated.converged;
    let stopped = matches!(stated, Err(CalibrationError::Stopped));
    let ended = stopped || stated.as_ref().is_ok_and(converged);
    if ended || problem.options.noise == NoisePolicy::Stated {
        return stated;
    }
    match learnt_at(problem, start, progress) {
        Ok(learnt) if converged(&learnt) => Ok(learnt),
        Err(CalibrationError::Stopped) => Err(CalibrationError::Stopped),
        _ => stated,
    }
}

/// What came of a start.
type Tried<'a> = (Result<Solved<'a>, CalibrationError>, CoarseStart);

/// The one that converged, and if both did, the likelier one.
fn likelier<'a>(one: Tried<'a>, other: Tried<'a>) -> Tried<'a> {
    let rank = |solved: &Solved| {
        let Iterated { held, converged } = &solved.iterated;
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
        let held = &solved.iterated.held;
        let attitudes = held.estimate.initial_attitudes.iter();
        let off = attitudes.zip(&solved.priors).map(|(attitude, prior)| {
            let off = log(&(attitude * prior.mean.transpose()));
            (off.z / prior.sigma.z).powi(2)
        });
        solved.iterated.converged.then(|| Self {
            deviance: held.deviance() - off.sum::<f64>(),
            parameters: to_vector(&held.estimate.triads),
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

/// With stated noise: with a table a pass with feedback first.
fn stated<'a>(
    problem: &Problem<'a>,
    start: &CoarseStart,
    progress: Progress,
) -> Result<Solved<'a>, CalibrationError> {
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
        tell(progress, &passes[0])?;
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
    Ok(Solved {
        feedback_history,
        ..Solved::stated(problem, priors, stated?, passes)
    })
}

/// The calibration with the noise that the data show at the start. Where noise is stated far too small, what it leaves
/// of moves pulls a step out of all that is linear; as large as it is, the step is a short one.
fn learnt_at<'a>(
    problem: &Problem<'a>,
    start: CoarseStart,
    progress: Progress,
) -> Result<Solved<'a>, CalibrationError> {
    let CoarseStart {
        at,
        attitudes,
        by_hand,
        ..
    } = start;
    let mut passes = Vec::new();
    let here = match by_hand {
        Some(by_hand) => {
            let problem = &problem.with_model(by_hand.model(problem));
            let gate = Gate::Innovations;
            iterate(problem, &attitudes, at, gate, &mut passes, progress)?
        }
        None => {
            let mut held = pass(problem, &attitudes, &at, Mode::Held(Gate::Open))?;
            held.estimate = at;
            Iterated {
                held,
                converged: false,
            }
        }
    };
    learn(Solved::stated(problem, attitudes, here, passes), progress)
}

/// With the noise that the data show, where they contradict what is stated. It is estimated where stated noise led and,
/// without a table, at the start as well: stated noise that is too small may lead to a place from which no step leads
/// back. The likelier result is kept.
pub fn learnt_or_stated<'a>(
    as_stated: &Problem<'a>,
    stated: Solved<'a>,
    progress: Progress,
) -> Result<Solved<'a>, CalibrationError> {
    let learnt = match learn(stated.clone(), progress) {
        Ok(learnt) if learnt.iterated.converged || !stated.iterated.converged => learnt,
        Err(CalibrationError::Stopped) => return Err(CalibrationError::Stopped),
        // Noise that the filter cannot run with, as of a record without any, leaves the stated one.
        _ => return Ok(stated),
    };
    // Where a table is read attitudes are known, and no step leads far.
    let may_be_astray = learnt.noise.learnt && as_stated.model.aiding == Aiding::Velocity;
    let Some(start) = learnt.start.clone().filter(|_| may_be_astray) else {
        return Ok(learnt);
    };
    let deviance = |solved: &Solved| solved.iterated.held.deviance();
    match learnt_at(as_stated, start, progress) {
        Ok(other) if other.iterated.converged && deviance(&other) < deviance(&learnt) - SETTLED => {
            Ok(Solved {
                problem: other.problem,
                iterated: other.iterated,
                noise: other.noise,
                passes: [learnt.passes, other.passes].concat(),
                ..learnt
            })
        }
        Err(CalibrationError::Stopped) => Err(CalibrationError::Stopped),
        _ => Ok(learnt),
    }
}
