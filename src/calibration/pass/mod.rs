//! A pass of the filter through a record: estimate, covariance, and which observations it let in.

mod gate;
mod result;

use super::constants::Prior;
use super::error::CalibrationError;
use super::problem::Problem;
use super::reduction::Script;
pub use gate::Gate;
use gate::Judge;
pub use result::PassResult;

/// A pass through what happens in a record.
pub fn pass(
    problem: &Problem,
    script: &Script,
    gate: Gate,
) -> Result<PassResult, CalibrationError> {
    let mut judge = Judge::new(gate, problem.gate_limit());
    let mut known = script.known(problem);
    let reduction = script.follow(problem, &mut judge, Some(&mut known))?;
    Ok(PassResult {
        at: script.at.clone(),
        posterior: reduction.posterior_of(&known),
        reduction,
        cost: judge.sums.cost,
        log_determinant: judge.sums.log_determinant,
        innovations: judge.innovations,
    })
}

/// The same where all observations are let in and nobody asks for innovations.
pub fn open_pass(problem: &Problem, script: &Script) -> Result<PassResult, CalibrationError> {
    let reduction = script.reduce(problem, &[])?;
    let prior = Prior::new(&reduction.constants, &problem.model, script.at);
    let posterior = reduction.posterior(&prior);
    Ok(PassResult {
        at: script.at.clone(),
        cost: posterior.cost,
        log_determinant: posterior.deviance - posterior.cost,
        posterior,
        reduction,
        innovations: Vec::new(),
    })
}
