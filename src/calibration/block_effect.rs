//! What each block of states costs in σ, and what it explains of the data.
//!
//! One pass more, with every block that the record can hold, answers for all blocks of constants:
//! its estimates and their covariance, given that some of the constants are zero, are those of a
//! pass without them. Wandering biases are no constants; they take a pass of their own.

use nalgebra::{DMatrix, DVector, Dyn, linalg::Cholesky};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::error::CalibrationError;
use super::further::{CONSTANTS, Constant};
use super::group::Group;
use super::outcome::Outcome;
use super::pass::{Gate, Mode, PassResult, pass};
use super::problem::Problem;
use super::schedule::Schedule;
use super::states::{PARAMETERS, ParameterVector};
use crate::run::{Run, StateBlock};

/// A block of states against the same calibration without it.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockEffect {
    /// The block.
    pub block: StateBlock,
    /// Whether it was on in the calibration; if not, it was tried with its usual σ.
    pub on: bool,
    /// RMS σ of each of [`Group::all`] with the block over that without it; none where the group has
    /// no σ.
    pub cost: [Option<f64>; 6],
    /// By how much the merit, −2 ln of likelihood and prior, falls with the block; for wandering
    /// biases, which are no constants, −2 ln of the likelihood of the whole record.
    pub gain: f64,
    /// What the gain stays below but for a chance of one in ten thousand if the block's errors are not
    /// there: χ² with as many degrees as it has constants; a ratio of likelihoods exceeds ten thousand
    /// with no more than that chance.
    pub limit: f64,
    /// Merit per scalar observation, which is NIS, without it …
    pub without: f64,
    /// … and with it.
    pub with: f64,
}

/// Chance that a block is asked for whose errors are not there. A run tries up to eight.
const FALSE_ALARM: f64 = 1e-4;

impl BlockEffect {
    /// Whether the data ask for the block.
    pub fn asked_for(&self) -> bool {
        self.gain > self.limit
    }
}

/// The effect of every block that a record can hold.
///
/// Source: for the test, Van Trees, *Detection, Estimation, and Modulation Theory*, part I, §2.5; for
/// conditioning, Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and
/// Navigation*, §1.4.14.
///
/// # Errors
/// [`CalibrationError`] where the run is not the one of the outcome.
pub fn block_effects(run: &Run, outcome: &Outcome) -> Result<Vec<BlockEffect>, CalibrationError> {
    let scalars = 3.0 * outcome.innovations.len() as f64;
    let mut everything = run.clone();
    for block in constant_blocks() {
        everything.switch_on(block);
    }
    let wandering = StateBlock::WanderingBias;
    let mut otherwise = run.clone();
    if run.has(wandering) {
        otherwise.switch_off(wandering);
    } else {
        otherwise.switch_on(wandering);
    }
    let (joint, otherwise) = rayon::join(
        || once_more(&everything, outcome),
        || once_more(&otherwise, outcome),
    );
    let (joint, otherwise) = (Joint(joint?), otherwise?);
    let effect = |block: StateBlock, with: &Fit, without: &Fit| BlockEffect {
        block,
        on: run.has(block),
        cost: cost(&with.variance, &without.variance),
        gain: without.merit - with.merit,
        limit: ChiSquared::new(block.states() as f64)
            .map_or(f64::INFINITY, |chi2| chi2.inverse_cdf(1.0 - FALSE_ALARM)),
        without: without.merit / scalars,
        with: with.merit / scalars,
    };

    let mut effects = Vec::new();
    if let Some(own) = joint.given(|block| run.has(block)) {
        let deviance = own.merit + outcome.log_determinant;
        let other_deviance = otherwise.merit + otherwise.log_determinant;
        let otherwise = Fit::of(&otherwise);
        let (with, without, gain) = if run.has(wandering) {
            (&own, &otherwise, other_deviance - deviance)
        } else {
            (&otherwise, &own, deviance - other_deviance)
        };
        effects.push(BlockEffect {
            gain,
            limit: -2.0 * FALSE_ALARM.ln(),
            ..effect(wandering, with, without)
        });
    }
    for block in constant_blocks().filter(|&block| run.can_have(block)) {
        let on = |other: StateBlock| run.has(other) && other != block;
        let fits = joint
            .given(|other| on(other) || other == block)
            .zip(joint.given(on));
        effects.extend(fits.map(|(with, without)| effect(block, &with, &without)));
    }
    Ok(effects)
}

fn constant_blocks() -> impl Iterator<Item = StateBlock> {
    let all = StateBlock::ALL.into_iter();
    all.filter(|&block| block != StateBlock::WanderingBias)
}

/// The last pass of a calibration with the blocks of a run.
fn once_more(run: &Run, outcome: &Outcome) -> Result<PassResult, CalibrationError> {
    let problem = Problem::new(
        run,
        Schedule::new(run, &run.dwells())?,
        outcome.estimate.form(),
        outcome.prior_attitude,
        outcome.velocity_sigma,
    );
    let gate = Gate::As(&outcome.innovations);
    pass(&problem, &outcome.linearised_at, Mode::Held(gate))
}

/// How well a calibration fits, and variance of the parameters of both triads.
struct Fit {
    merit: f64,
    variance: ParameterVector,
}

impl Fit {
    fn of(result: &PassResult) -> Self {
        Self {
            merit: result.merit,
            variance: result.covariance.diagonal(),
        }
    }
}

/// A calibration with every block of constants that the record can hold.
struct Joint(PassResult);

impl Joint {
    /// The calibration with those blocks alone: the constants of all others are zero. `None` if their
    /// covariance is singular.
    fn given(&self, on: impl Fn(StateBlock) -> bool) -> Option<Fit> {
        let further = &self.0.further;
        let is_off = |k: &usize| {
            let block = Constant::of(*k).map(Constant::block);
            further.prior_sigma[*k] > 0.0 && block.is_some_and(|block| !on(block))
        };
        let off: Vec<usize> = (0..CONSTANTS).filter(is_off).collect();
        let mut fit = Fit::of(&self.0);
        if off.is_empty() {
            return Some(fit);
        }
        let n = off.len();
        let covariance = DMatrix::from_fn(n, n, |i, j| further.covariance[(off[i], off[j])]);
        let values = DVector::from_fn(n, |i, _| further.values[off[i]]);
        let cross = DMatrix::from_fn(n, PARAMETERS, |i, p| further.cross[(p, off[i])]);
        let covariance: Cholesky<f64, Dyn> = covariance.cholesky()?;
        fit.merit += values.dot(&covariance.solve(&values));
        let known = covariance.solve(&cross);
        for p in 0..PARAMETERS {
            fit.variance[p] -= cross.column(p).dot(&known.column(p));
        }
        Some(fit)
    }
}

fn cost(with: &ParameterVector, without: &ParameterVector) -> [Option<f64>; 6] {
    let mut cost = [None; 6];
    for (cost, group) in cost.iter_mut().zip(Group::all()) {
        let of_group = |i: &usize| Group::of(*i) == group;
        let sum =
            |of: &ParameterVector| -> f64 { (0..PARAMETERS).filter(of_group).map(|i| of[i]).sum() };
        let ratio = (sum(with) / sum(without)).sqrt();
        *cost = ratio.is_finite().then_some(ratio);
    }
    cost
}

#[cfg(test)]
mod tests {
    use super::super::estimate;
    use super::*;
    use crate::imu::{InstallationForm, Term};
    use crate::simulation::Scenario;
    use approx::assert_relative_eq;

    #[test]
    fn conditioning_on_zero_is_a_pass_without_the_block() {
        let order = StateBlock::Term(Term::AccelSecondOrder);
        let scenario = Scenario::load("real-table").unwrap().with_block(order);
        let run = scenario.simulate(23, 0).unwrap().run;
        let outcome = estimate(&run, InstallationForm::General, &|_| {}).unwrap();
        let effects = block_effects(&run, &outcome).unwrap();
        let with = Fit::of(&once_more(&run, &outcome).unwrap());
        for block in [order, StateBlock::TableBase, StateBlock::TableAxes] {
            let mut other = run.clone();
            other.switch_off(block);
            let without = Fit::of(&once_more(&other, &outcome).unwrap());
            let effect = effects.iter().find(|e| e.block == block).unwrap();
            println!("{block:?}: {} {}", effect.gain, without.merit - with.merit);
            assert!(effect.on);
            assert_relative_eq!(effect.gain, without.merit - with.merit, max_relative = 1e-3);
            for (a, b) in effect
                .cost
                .iter()
                .zip(cost(&with.variance, &without.variance))
            {
                assert_relative_eq!(a.unwrap(), b.unwrap(), max_relative = 1e-4);
            }
        }
    }
}
