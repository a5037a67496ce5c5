//! A calibration from one start, with stated noise: with a table a pass with feedback, and Gauss–Newton iterations.
//! Where stated noise leads nowhere, with the noise that the data show at the start.

use std::ops::Range;

use rayon::prelude::*;

use super::coarse::{CoarseStart, coarse_start};
use crate::attitude::log;
use crate::calibration::error::CalibrationError;
use crate::calibration::group::Group;
use crate::calibration::iterations::{Iterated, iterate, summary};
use crate::calibration::linearisation::{AttitudePrior, Linearisation};
use crate::calibration::noise::{Learnt, NoisePolicy, learn};
use crate::calibration::outcome::Pass;
use crate::calibration::parameters::{ParameterMatrix, ParameterVector, to_vector};
use crate::calibration::pass::{Epoch, Gate, Mode, pass};
use crate::calibration::problem::Problem;
use crate::imu::{ParameterKind, Sensor};
use crate::run::Aiding;

/// Of the variance that Earth rate would have along an unknown heading, so much of that of a bias is too little to tell.
const ENOUGH_TO_MATTER: f64 = 10.0;

/// A fall of −2 ln of the likelihood that is nothing: a third of a σ of one parameter.
const SETTLED: f64 = 0.1;

/// Told after each pass; the command line draws it.
pub type Progress<'a> = &'a (dyn Fn(&Pass) + Sync);

/// A calibration from one start, with stated noise, unless it had to be learnt there.
pub struct Attempt {
    /// Where it began, of one recording.
    pub start: Option<CoarseStart>,
    pub priors: Vec<AttitudePrior>,
    pub passes: Vec<Pass>,
    /// Of the pass with feedback, where there was one.
    pub feedback_history: Vec<Epoch>,
    pub iterated: Iterated,
    /// Noise that was learnt at the start, with which the passes were made.
    pub learnt: Option<Learnt>,
    /// Mean square by which the parameters differ from those of the other headings, each as likely as its data.
    pub by_headings: ParameterMatrix,
}

/// From the coarse start; where Earth rate does not tell the headings, from all four quadrants, first of all stretches
/// together, then, where the biases are known well enough for it to matter, of each alone.
pub fn from_coarse_start(
    problem: &Problem,
    progress: Progress,
) -> Result<Attempt, CalibrationError> {
    let start = coarse_start(problem)?;
    let tried = Tried::new(problem, start.clone(), progress);
    if !start.hidden {
        return tried.or_learnt(problem, progress);
    }
    let stretches = start.attitudes.len();
    let (mut best, mut by_headings) = tried.among_headings(problem, 0..stretches, progress);
    let of_best = best.attempt.as_ref();
    if stretches > 1 && of_best.is_ok_and(|attempt| matters(problem, attempt)) {
        for stretch in 0..stretches {
            let of_stretch;
            (best, of_stretch) = best.among_headings(problem, stretch..stretch + 1, progress);
            by_headings += of_stretch;
        }
    }
    let mut attempt = best.or_learnt(problem, progress)?;
    attempt.by_headings = by_headings;
    Ok(attempt)
}

/// Whether Earth rate along an unknown heading adds to what the biases of the gyros are known to.
fn matters(problem: &Problem, attempt: &Attempt) -> bool {
    let covariance = &attempt.iterated.held.covariance;
    let level = problem.run().site.earth_rate_n().y.powi(2);
    let biases =
        Group::all().filter(|of| of.sensor() == Sensor::Gyro && of.kind() == ParameterKind::Bias);
    let mut biases = biases.flat_map(|of| of.parameters(problem.model.form));
    biases.any(|index| ENOUGH_TO_MATTER * level > covariance[(index, index)])
}

/// A start and what came of it.
struct Tried {
    start: CoarseStart,
    attempt: Result<Attempt, CalibrationError>,
}

impl Tried {
    fn new(problem: &Problem, start: CoarseStart, progress: Progress) -> Self {
        Self {
            attempt: attempt(problem, start.clone(), progress),
            start,
        }
    }

    /// What came of it; where that did not converge, what comes of the noise that the data show at the start.
    fn or_learnt(self, problem: &Problem, progress: Progress) -> Result<Attempt, CalibrationError> {
        let converged = |attempt: &Attempt| attempt.iterated.converged;
        if self.attempt.as_ref().is_ok_and(converged)
            || problem.options.noise == NoisePolicy::Stated
        {
            return self.attempt;
        }
        let mut passes = Vec::new();
        match learnt_at(&self.start, problem, &mut passes, progress) {
            Ok(learnt) if learnt.iterated.converged => Ok(Attempt {
                priors: self.start.attitudes.clone(),
                start: Some(self.start),
                passes,
                feedback_history: Vec::new(),
                iterated: learnt.iterated.clone(),
                learnt: Some(learnt),
                by_headings: ParameterMatrix::zeros(),
            }),
            _ => self.attempt,
        }
    }

    /// The best of the four quadrants in which the headings of these stretches may be, and the mean square of the
    /// parameters from it.
    fn among_headings(
        self,
        problem: &Problem,
        stretches: Range<usize>,
        progress: Progress,
    ) -> (Self, ParameterMatrix) {
        let heading = |tried: &Self| Heading::of(tried.attempt.as_ref().ok()?);
        let mut headings: Vec<Heading> = heading(&self).into_iter().collect();
        let others = self.start.other_headings(stretches).into_par_iter();
        let others: Vec<Self> = others
            .map(|start| Self::new(problem, start, progress))
            .collect();
        let best = others.into_iter().fold(self, |best, other| {
            headings.extend(heading(&other));
            better(best, other)
        });
        let chosen = heading(&best);
        let apart = chosen.map_or_else(ParameterMatrix::zeros, |chosen| {
            chosen.mean_square_to(&headings)
        });
        (best, apart)
    }
}

/// What came of one heading.
struct Heading {
    /// −2 ln of its likelihood, but for a constant.
    deviance: f64,
    parameters: ParameterVector,
}

impl Heading {
    /// `None` where it did not converge.
    fn of(attempt: &Attempt) -> Option<Self> {
        let held = &attempt.iterated.held;
        // Within its quadrant one heading is as likely as another.
        let attitudes = held.estimate.initial_attitudes.iter();
        let off = attitudes.zip(&attempt.priors).map(|(attitude, prior)| {
            let off = log(&(attitude * prior.mean.transpose()));
            (off.z / prior.sigma.z).powi(2)
        });
        attempt.iterated.converged.then(|| Self {
            deviance: held.deviance() - off.sum::<f64>(),
            parameters: to_vector(&held.estimate.triads),
        })
    }

    /// Source: Hoeting, Madigan, Raftery and Volinsky 1999, "Bayesian model averaging: a tutorial", Statistical
    /// Science 14(4), for the weights.
    fn mean_square_to(&self, all: &[Self]) -> ParameterMatrix {
        let weight = |of: &Self| (0.5 * (self.deviance - of.deviance)).min(0.0).exp();
        let sum: f64 = all.iter().map(weight).sum();
        all.iter()
            .map(|of| {
                let apart = of.parameters - self.parameters;
                apart * apart.transpose() * (weight(of) / sum)
            })
            .sum()
    }
}

fn attempt(
    problem: &Problem,
    start: CoarseStart,
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
        start: Some(start),
        priors,
        passes,
        feedback_history,
        iterated: stated?,
        learnt: None,
        by_headings: ParameterMatrix::zeros(),
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

/// The calibration with the noise that the data show, where they contradict what is stated: learnt from where stated
/// noise led, or, where that is likelier, at the start. The problem comes as it was stated and as it was calibrated.
pub fn learnt_or_stated(
    start: Option<CoarseStart>,
    (as_stated, problem): (&Problem, &Problem),
    priors: &[AttitudePrior],
    stated: Iterated,
    passes: &mut Vec<Pass>,
    progress: Progress,
) -> Learnt {
    let number = passes.len();
    let learnt = match learn(problem, priors, stated.clone(), passes, progress) {
        Ok(learnt) if learnt.iterated.converged || !stated.converged => learnt,
        // Noise that the filter cannot run with, as of a record without any, leaves the stated one.
        _ => {
            passes.truncate(number);
            return Learnt::stated(problem, stated);
        }
    };
    // Where a table is read attitudes are known, and no step leads far.
    let may_be_astray = learnt.report.learnt && problem.model.aiding == Aiding::Velocity;
    match start.filter(|_| may_be_astray) {
        Some(start) => likelier_from(&start, learnt, as_stated, passes, progress),
        None => learnt,
    }
}

/// A calibration with learnt noise, or with what the data show of it at the start, where that is likelier: stated noise
/// that was too small may have led to a place from which no step leads back, or to sources that others there make
/// needless.
fn likelier_from(
    start: &CoarseStart,
    learnt: Learnt,
    problem: &Problem,
    passes: &mut Vec<Pass>,
    progress: Progress,
) -> Learnt {
    let held = &learnt.iterated.held;
    let number = passes.len();
    if let Ok(of_start) = learnt_at(start, problem, passes, progress)
        && of_start.iterated.converged
        && of_start.iterated.held.deviance() < held.deviance() - SETTLED
    {
        return of_start;
    }
    passes.truncate(number);
    learnt
}

/// The one that converged, and if both did, the likelier one.
fn better(one: Tried, other: Tried) -> Tried {
    let rank = |attempt: &Attempt| {
        let Iterated { held, converged } = &attempt.iterated;
        (!converged, held.deviance())
    };
    match (&one.attempt, &other.attempt) {
        (Ok(first), Ok(second)) if rank(second) < rank(first) => other,
        (Err(_), Ok(_)) => other,
        _ => one,
    }
}
