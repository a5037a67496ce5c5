//! Gauss–Newton iterations: passes with fixed linearisation until convergence.

use std::ops::ControlFlow;

use crate::calibration::linearisation::not_invertible;
use crate::calibration::{
    AttitudePrior, CalibrationError, Estimate, Gate, Innovation, Linearisation, PassResult,
    Problem, Script, pass,
};

/// A cost increase by more than this fraction indicates that a step was too long. Each pass knows only the cost of its
/// own linearised problem, so a small rise is not significant.
const COST_RISE: f64 = 0.1;
/// After a step longer than this fraction of the previous one, all further steps are halved.
const SHRINKS: f64 = 0.8;
/// Number of passes after which the gate decisions are fixed, so that an observation at its limit does not toggle.
const DECIDED_AFTER: usize = 4;
/// If more than this fraction of observations is beyond the gate, they are not outliers.
const MOST_OUTLIERS: f64 = 0.05;

/// Maximum number of halvings of a step after a failed pass: to a thousandth.
const MOST_SHORTENED: usize = 10;

/// One pass over the recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pass {
    /// The largest step of any parameter from the linearisation point, in σ.
    pub largest_step: f64,
    /// Whitened innovations squared plus prior, summed.
    pub cost: f64,
    /// Number of scalar observations that entered the cost.
    pub observations: usize,
    /// Number of observations (of three components) that the gate rejected.
    pub rejected: usize,
}

/// Callback after each pass, which may stop the work; the command line displays the progress.
pub type Progress<'a> = &'a (dyn Fn(&Pass) -> ControlFlow<()> + Sync);

/// A callback that does nothing.
pub const UNWATCHED: Progress<'static> = &|_| ControlFlow::Continue(());

/// Reports a pass.
pub fn tell(progress: Progress, pass: &Pass) -> Result<(), CalibrationError> {
    match progress(pass) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(CalibrationError::Stopped),
    }
}

/// The last pass, its estimate, and whether it converged.
#[derive(Clone)]
pub struct Iterated {
    pub held: PassResult,
    pub estimate: Linearisation,
    pub converged: bool,
}

impl Iterated {
    /// The result of a last pass: at its estimate or, if that is singular, at its linearisation point.
    fn ended(held: PassResult, converged: bool) -> Self {
        let mut estimate = held.estimate();
        if not_invertible(&estimate.triads).is_some() {
            estimate = held.at.clone();
        }
        Self {
            held,
            estimate,
            converged,
        }
    }

    /// The estimate of both triads.
    pub fn both_triads(&self) -> Estimate {
        let linear = &self.held.posterior.parameter_covariance;
        Estimate::with_curvature(self.estimate.triads, linear)
    }
}

/// Iterates from a first point, each pass linearised at the previous estimate. `gate` is either fixed or decides by
/// innovations.
pub fn iterate(
    problem: &Problem,
    priors: &[AttitudePrior],
    from: Linearisation,
    mut gate: Gate,
    passes: &mut Vec<Pass>,
    progress: Progress,
) -> Result<Iterated, CalibrationError> {
    let most = passes.len() + problem.options.passes;
    let given = matches!(gate, Gate::As(_));
    let mut decision: Option<Vec<bool>> = None;
    let first = passes.len();
    let mut at = from;
    let mut before: Option<PassResult> = None;
    let (mut fraction, mut last_step) = (1.0, f64::INFINITY);
    loop {
        let gate_now = decision.as_deref().map_or(gate, Gate::As);
        let decided = matches!(gate_now, Gate::As(_));
        let result = match pass_towards(problem, priors, &mut at, gate_now, before.as_ref()) {
            Ok(result) => result,
            Err(error) => {
                return before.map_or(Err(error), |last| Ok(Iterated::ended(last, false)));
            }
        };
        let summary = summary(&result);
        tell(progress, &summary)?;
        passes.push(summary);
        let same_data = |last: &PassResult| last.accepted() == result.accepted();
        let same_data = before.as_ref().is_some_and(same_data);
        let settled = summary.largest_step <= problem.options.converged_sigma
            && (decided || same_data || (before.is_none() && summary.rejected == 0));
        let doubtful = !given && beyond(&result, problem.gate_limit()) > MOST_OUTLIERS;
        let finished = settled && (gate == Gate::Open || !doubtful);
        if finished || passes.len() >= most {
            return Ok(Iterated::ended(result, settled));
        }
        // Where many observations contradict the model it is the model that is wrong, and leaving
        // them out would only hide that.
        if doubtful {
            gate = Gate::Open;
            decision = None;
        } else if gate == Gate::Innovations && passes.len() == first + DECIDED_AFTER {
            decision = Some(result.accepted());
        }
        let too_far =
            before.filter(|before| same_data && result.cost > before.cost * (1.0 + COST_RISE));
        // A step as large as the one before may be the way back of it.
        if summary.largest_step > SHRINKS * last_step {
            fraction *= 0.5;
        }
        last_step = summary.largest_step;
        at = match &too_far {
            Some(before) => before.at.towards(&at, 0.5),
            None => at.towards(&result.estimate(), fraction),
        };
        before = Some(too_far.unwrap_or(result));
    }
}

/// A pass at a point; if it fails, at half the distance from the previous pass, and so on.
fn pass_towards(
    problem: &Problem,
    priors: &[AttitudePrior],
    at: &mut Linearisation,
    gate: Gate,
    before: Option<&PassResult>,
) -> Result<PassResult, CalibrationError> {
    let made_at = |at: &Linearisation| pass(problem, &Script::new(problem, priors, at)?, gate);
    let mut made = made_at(at);
    for _ in 0..MOST_SHORTENED {
        let (Err(_), Some(before)) = (&made, before) else {
            break;
        };
        *at = before.at.towards(at, 0.5);
        made = made_at(at);
    }
    made
}

/// Fraction of observations that are beyond the gate or were rejected.
fn beyond(result: &PassResult, gate: f64) -> f64 {
    let beyond = |i: &&Innovation| !i.accepted || i.distance() > gate;
    result.innovations.iter().filter(beyond).count() as f64 / result.innovations.len() as f64
}

fn summary(result: &PassResult) -> Pass {
    let posterior = &result.posterior;
    let variance = posterior.parameter_covariance.diagonal();
    // What is not estimated has no σ; a step that is no number is no step to end with.
    let steps = posterior.parameters.iter().zip(&variance);
    let steps = steps.filter(|&(_, &variance)| variance != 0.0);
    Pass {
        largest_step: steps
            .map(|(step, variance)| (step / variance.sqrt()).abs())
            .max_by(f64::total_cmp)
            .unwrap_or(0.0),
        cost: result.cost,
        observations: 3 * result.innovations.len(),
        rejected: result.innovations.iter().filter(|i| !i.accepted).count(),
    }
}
