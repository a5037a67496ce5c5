//! What each block of states costs in σ, and what it explains of the data.

use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::consistency::{consistency, mean_square_interval};
use super::error::CalibrationError;
use super::estimator::problem;
use super::group::Group;
use super::outcome::{Consistency, Outcome};
use super::pass::{Gate, Mode, PassResult, pass};
use super::schedule::Schedule;
use super::states::ParameterMatrix;
use crate::run::{Run, StateBlock};

/// A block of states against the same run without it.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockEffect {
    /// The block.
    pub block: StateBlock,
    /// Whether it was on in the calibration.
    pub on: bool,
    /// RMS σ of each of [`Group::all`] with the block over that without it; none where the group has
    /// no σ.
    pub cost: [Option<f64>; 6],
    /// By how much the merit, −2 ln of likelihood and prior, falls with the block.
    pub gain: f64,
    /// What the gain stays below in all but one in a thousand runs if the block's errors are not
    /// there (χ² with as many degrees as it has states).
    pub limit: f64,
    /// NIS without it …
    pub without: Consistency,
    /// … and with it.
    pub with: Consistency,
}

/// Chance that a block is asked for that is not there.
const FALSE_ALARM: f64 = 1e-3;
/// Two-sided probability outside the interval beyond which NIS betrays an error that is not modelled.
const OUTSIDE: f64 = 2e-3;

impl BlockEffect {
    /// Whether the data ask for the block.
    pub fn asked_for(&self) -> bool {
        self.gain > self.limit
    }
}

/// The effect of every block that was on, and where NIS is larger than chance allows, of every
/// other that the run can have: which of them would explain it?
///
/// Each is one more held pass, linearised where the calibration's last one was and with the same
/// observations. A block that is off is tried with its usual σ.
///
/// # Errors
/// [`CalibrationError`] where the run is not the one of the outcome.
pub fn block_effects(run: &Run, outcome: &Outcome) -> Result<Vec<BlockEffect>, CalibrationError> {
    let betrayed = betrays(&outcome.consistency);
    let blocks = StateBlock::ALL.into_iter();
    let candidates: Vec<StateBlock> = blocks
        .filter(|&block| run.has(block) || (betrayed && run.can_have(block)))
        .collect();
    if candidates.is_empty() {
        return Ok(Vec::new());
    }
    let own = once_more(run, outcome)?;
    let effect = |block| {
        let on = run.has(block);
        let mut other = run.clone();
        if on {
            other.switch_off(block);
        } else {
            other.switch_on(block);
        }
        let other = once_more(&other, outcome)?;
        let (with, without) = if on { (&own, &other) } else { (&other, &own) };
        Ok(BlockEffect {
            block,
            on,
            cost: cost(&with.covariance, &without.covariance),
            gain: without.merit - with.merit,
            limit: ChiSquared::new(block.states() as f64)
                .map_or(f64::INFINITY, |chi2| chi2.inverse_cdf(1.0 - FALSE_ALARM)),
            without: consistency(&without.innovations),
            with: consistency(&with.innovations),
        })
    };
    candidates.into_par_iter().map(effect).collect()
}

/// The last pass of a calibration with the blocks of a run.
fn once_more(run: &Run, outcome: &Outcome) -> Result<PassResult, CalibrationError> {
    let problem = problem(
        run,
        Schedule::new(run, &run.dwells())?,
        outcome.estimate.form(),
        outcome.prior_attitude,
        outcome.velocity_sigma,
    );
    let mut at = outcome.linearised_at;
    // A term that is off is not there.
    at.further.zip_apply(&run.further_sigma, |value, sigma| {
        if sigma == 0.0 {
            *value = 0.0;
        }
    });
    pass(&problem, &at, Mode::Held(Gate::As(&outcome.innovations)))
}

/// Whether innovations of one kind are larger than chance allows.
fn betrays(consistency: &Consistency) -> bool {
    [consistency.velocity, consistency.table]
        .iter()
        .any(|nis| nis.count > 0 && nis.mean > mean_square_interval(nis.count, OUTSIDE).1)
}

fn cost(with: &ParameterMatrix, without: &ParameterMatrix) -> [Option<f64>; 6] {
    let mut cost = [None; 6];
    for (cost, group) in cost.iter_mut().zip(Group::all()) {
        let sum = |of: &ParameterMatrix| -> f64 {
            let all = 0..of.nrows();
            let of_group = all.filter(|&i| Group::of(i) == group);
            of_group.map(|i| of[(i, i)]).sum()
        };
        let ratio = (sum(with) / sum(without)).sqrt();
        *cost = ratio.is_finite().then_some(ratio);
    }
    cost
}
