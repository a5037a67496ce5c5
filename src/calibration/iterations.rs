//! The iterations: navigation, sizes of all effects and the chain in turn, until the parameters have settled.

use std::sync::Arc;

use crate::attitude::from_tilt_and_heading;
use crate::calibration::chain::Filtered;
use crate::calibration::chain::states::ATTITUDE;
use crate::calibration::linearisation::not_invertible;
use crate::calibration::passes::tell;
use crate::calibration::sizes::{Effects, Stage, Weighed};
use crate::calibration::{
    AttitudePrior, CalibrationError, Constant, Estimate, Linearisation, Pass, Posterior, Problem,
    Progress, Script, from_vector, to_vector,
};

/// The sizes are fully estimated once no parameter moves by more than this, in σ; before that, the misfit is due to the
/// linearisation.
const NEAR: f64 = 2.0;
/// After a step longer than this fraction of the previous step, all further steps are halved.
const SHRINKS: f64 = 0.8;
/// Steps below this limit, in σ, are due to changes of the sizes.
const SMALL: f64 = 0.2;
/// Maximum number of halvings of a failing step: to a thousandth.
const MOST_SHORTENED: usize = 10;

/// A problem whose iterations have ended.
#[derive(Debug, Clone)]
pub struct Solved {
    /// Events at the last linearisation point.
    pub script: Arc<Script>,
    /// Number of scalars that were observed.
    pub observations: usize,
    pub effects: Effects,
    pub posterior: Posterior,
    /// Parameters and attitudes after the last pass.
    pub estimate: Linearisation,
    pub passes: Vec<Pass>,
    pub converged: bool,
}

/// Iterates from a starting point, with the given priors of the initial attitudes.
///
/// # Errors
/// Returns [`CalibrationError`] if the first pass fails at the starting point. If the iterations do not converge, the
/// result is marked as not converged.
pub fn solve(
    problem: &Problem,
    (start, priors): (&Linearisation, &[AttitudePrior]),
    progress: Progress,
) -> Result<Solved, CalibrationError> {
    let mut at = start.clone();
    let mut effects = Effects::new(problem);
    let mut passes = Vec::new();
    let mut before: Option<Solved> = None;
    let (mut fraction, mut shortened) = (1.0, 0);
    let (mut step, mut was_near) = (f64::INFINITY, false);
    loop {
        let stage = match (step < NEAR, was_near) {
            (true, false) => Stage::FirstNear,
            (_, true) => Stage::Near,
            (false, false) => Stage::Far,
        };
        was_near |= stage == Stage::FirstNear;
        let solved = one_pass(problem, (&at, priors), &mut effects, stage);
        let mut solved = match (solved, before) {
            (Ok(solved), _) => solved,
            (Err(error), None) => return Err(error),
            // If a step fails, a shorter one is tried.
            (Err(_), Some(last)) if shortened < MOST_SHORTENED => {
                shortened += 1;
                at = last.script.at.towards(&at, 0.5);
                effects = last.effects.clone();
                before = Some(last);
                continue;
            }
            (Err(_), Some(last)) => return Ok(Solved { passes, ..last }),
        };
        let pass = Pass {
            largest_step: largest(&solved.posterior),
            cost: solved.posterior.cost,
            observations: solved.observations,
        };
        tell(progress, &pass)?;
        passes.push(pass);
        if effects.are_settled && pass.largest_step > (SHRINKS * step).max(SMALL) {
            fraction *= 0.5;
        }
        step = pass.largest_step;
        solved.converged =
            was_near && effects.are_settled && step <= problem.options.converged_sigma;
        if solved.converged || passes.len() >= problem.options.passes {
            return Ok(Solved { passes, ..solved });
        }
        at = at.towards(&solved.estimate, fraction);
        before = Some(solved);
    }
}

/// One pass: navigates, improves the sizes, and solves the chain.
fn one_pass(
    problem: &Problem,
    (at, priors): (&Linearisation, &[AttitudePrior]),
    effects: &mut Effects,
    stage: Stage,
) -> Result<Solved, CalibrationError> {
    let script = Script::new(problem, priors, at)?;
    effects.improve(problem, &script, stage)?;
    let chain = effects.chain(problem, &script)?;
    let Weighed {
        filtered,
        posterior,
        ..
    } = effects.weighed(&chain, problem, &script)?;
    let mut estimate = filtered.moved(at, &posterior);
    if not_invertible(&estimate.triads).is_some() {
        estimate = at.clone();
    }
    Ok(Solved {
        effects: effects.clone(),
        posterior,
        estimate,
        passes: Vec::new(),
        converged: false,
        script: Arc::new(script),
        observations: chain.observations,
    })
}

/// Largest step of any parameter, in σ; a step that is not a number does not end the iterations.
fn largest(posterior: &Posterior) -> f64 {
    let variance = posterior.parameter_covariance.diagonal();
    let steps = posterior.parameters.iter().zip(&variance);
    let magnetic = posterior.constants.iter().enumerate();
    let magnetic = magnetic.filter(|(_, of)| matches!(of, Constant::Magnetic(_)));
    let magnetic = magnetic.map(|(k, _)| (&posterior.mean[k], &posterior.covariance[(k, k)]));
    let steps = steps.chain(magnetic);
    let steps = steps.filter(|(_, variance)| **variance != 0.0);
    steps
        .map(|(step, variance)| (step / variance.sqrt()).abs())
        .max_by(f64::total_cmp)
        .unwrap_or(0.0)
}

impl Filtered<'_> {
    /// The linearisation point of the next pass.
    pub fn moved(&self, at: &Linearisation, posterior: &Posterior) -> Linearisation {
        let values = to_vector(&at.triads) + posterior.parameters;
        let mut moved = Linearisation {
            triads: from_vector(at.triads.gyro.form, &values),
            initial_attitudes: Vec::new(),
            dwells: Vec::new(),
            own: Vec::new(),
            ..at.clone()
        };
        for (constant, error) in posterior.constants.iter().zip(&posterior.mean) {
            match constant {
                Constant::Term(index) => moved.terms[*index] += error,
                Constant::Thermal(of) => *of.of_mut(&mut moved.thermal) += error,
                Constant::Magnetic(k) => moved.magnetic.iter_mut().for_each(|of| of[*k] += error),
                _ => {}
            }
        }
        for (link, mean) in self.means(posterior, |link| link.attitude.is_some()) {
            let Some(computed) = link.attitude else {
                continue;
            };
            let error = mean.fixed_rows::<3>(ATTITUDE).into_owned();
            let attitude = from_tilt_and_heading(&error) * computed;
            if link.begins {
                moved.initial_attitudes.push(attitude);
            }
            moved.dwells.push(attitude);
            while moved.own.len() <= link.recording && !self.layout().own.is_empty() {
                moved.own.push(at.own(moved.own.len()));
                let recording = moved.own.len() - 1;
                for &(state, of) in &self.layout().own {
                    *moved.own[recording].get_mut(of) += mean[state];
                }
            }
        }
        moved
    }
}

impl Solved {
    /// The estimate of both triads, with the covariance of the chain alone.
    pub fn both_triads(&self) -> Estimate {
        let linear = &self.posterior.parameter_covariance;
        Estimate::with_curvature(self.estimate.triads, linear)
    }
}
