//! The estimate: navigation, sizes of all effects and the chain in turn, until the parameters have settled.

use nalgebra::{DMatrix, DVector, Matrix3};

use super::at_rest::{self, Dispersion};
use super::forward::Filtered;
use super::sizes::{self, Likeliest};
use super::usual::Usual;
use super::{Chain, Sizes};
use crate::attitude::from_tilt_and_heading;
use crate::calibration::{
    ATTITUDE, AttitudePrior, CalibrationError, Constant, Linearisation, Model, NoisePolicy,
    Posterior, Prior, Problem, Script, from_vector, to_vector,
};

/// The sizes are estimated once no parameter moves by more than this, in σ: before, the misfit is that of the
/// linearisation.
const NEAR: f64 = 2.0;

/// A change of ln of the size of every effect by less than this has settled.
const SETTLED: f64 = 0.1;

/// Estimate of a problem.
pub struct Estimated {
    /// Parameters and initial attitudes.
    pub estimate: Linearisation,
    pub posterior: Posterior,
    pub sizes: Sizes,
    pub passes: usize,
    pub converged: bool,
}

/// Estimates from a starting point.
///
/// # Errors
/// [`CalibrationError`] if a pass diverges.
pub fn estimate(
    problem: &Problem,
    priors: &[AttitudePrior],
    start: Linearisation,
) -> Result<Estimated, CalibrationError> {
    let mut at = start;
    let mut effects = Effects::stated(problem);
    let (mut step, mut passes) = (f64::INFINITY, 0);
    // Biases keep their values within a part and a move.
    let plain = problem.with(|model| {
        model.noise.gyro.gauss_markov = None;
        model.noise.accel.gauss_markov = None;
    });
    let mut attitudes: Vec<Matrix3<f64>> = Vec::new();
    loop {
        passes += 1;
        let plain = plain.with_attitudes(&attitudes);
        let script = Script::new(&plain, priors, &at)?;
        if step < NEAR {
            effects.improve(problem, &plain, &script)?;
        }
        let made = problem.with(|model| effects.set(model));
        let chain = Chain::new(&made, &script, &effects.dispersion)?;
        let prior = Prior::new(&chain.constants, &made.model, &at);
        let filtered = chain.filter(&effects.sizes)?;
        let posterior = filtered.posterior(&prior);
        let rests = filtered.rests(&posterior);
        attitudes = rests.iter().map(|&(_, attitude)| attitude).collect();
        let estimate = moved(&at, &chain, &posterior, &rests);
        step = largest(&posterior);
        let converged = step < problem.options.converged_sigma && effects.are_settled;
        if converged || passes == problem.options.passes {
            return Ok(Estimated {
                sizes: effects.sizes,
                estimate,
                posterior,
                passes,
                converged,
            });
        }
        at = estimate;
    }
}

/// Largest step of any parameter, in σ.
fn largest(posterior: &Posterior) -> f64 {
    let variance = posterior.parameter_covariance.diagonal();
    let steps = posterior.parameters.iter().zip(&variance);
    let steps = steps.filter(|(_, variance)| **variance > 0.0);
    steps
        .map(|(step, variance)| step.abs() / variance.sqrt())
        .fold(0.0, f64::max)
}

/// The linearisation point of the next pass, from the attitude at the begin of each dwell.
fn moved(
    at: &Linearisation,
    chain: &Chain,
    posterior: &Posterior,
    rests: &[(bool, Matrix3<f64>)],
) -> Linearisation {
    let begins = rests.iter().filter(|(begins, _)| *begins);
    let values = to_vector(&at.triads) + posterior.parameters;
    let mut moved = Linearisation {
        triads: from_vector(at.triads.gyro.form, &values),
        initial_attitudes: begins.map(|&(_, attitude)| attitude).collect(),
        ..at.clone()
    };
    for (constant, error) in chain.constants.iter().zip(&posterior.mean) {
        match constant {
            Constant::Term(index) => moved.terms[*index] += error,
            Constant::Thermal(of) => *of.of_mut(&mut moved.thermal) += error,
            _ => {}
        }
    }
    moved
}

/// Sizes of all effects.
struct Effects {
    at_rest: Vec<(Usual, f64)>,
    between: Vec<(Usual, f64)>,
    dispersion: Dispersion,
    sizes: Sizes,
    are_settled: bool,
}

impl Effects {
    fn stated(problem: &Problem) -> Self {
        Self {
            at_rest: Vec::new(),
            between: Vec::new(),
            dispersion: Dispersion::alike(problem),
            sizes: Sizes::default(),
            are_settled: problem.options.noise == NoisePolicy::Stated,
        }
    }

    /// Makes the sizes likelier at a linearisation point.
    fn improve(
        &mut self,
        problem: &Problem,
        plain: &Problem,
        script: &Script,
    ) -> Result<(), CalibrationError> {
        if problem.options.noise == NoisePolicy::Stated {
            return Ok(());
        }
        let usual = Usual::all(problem, &script.moves());
        let (at_rest, between): (Vec<_>, Vec<_>) = usual.into_iter().partition(Usual::is_at_rest);
        let logs = |of: &[(Usual, f64)], count: usize| {
            DVector::from_fn(count, |k, _| of.get(k).map_or(0.0, |of| of.1))
        };
        let before = || (self.dispersion.clone(), logs(&self.at_rest, at_rest.len()));
        let before = (!self.at_rest.is_empty()).then(before);
        let still = at_rest::likeliest(plain, script, &at_rest, before);
        let first = logs(&self.between, between.len());
        self.dispersion = still.dispersion;
        self.at_rest = at_rest
            .into_iter()
            .zip(still.logs.iter().copied())
            .collect();
        self.between = between.iter().map(|usual| (*usual, 0.0)).collect();
        let made = problem.with(|model| self.set(model));
        let chain = Chain::new(&made, script, &self.dispersion)?;
        let prior = Prior::new(&chain.constants, &made.model, script.at);
        let Likeliest { logs, sizes } = sizes::likeliest(&chain, &prior, &between, first.clone())?;
        self.are_settled = (&logs - first).amax() < SETTLED;
        self.between = between.into_iter().zip(logs.iter().copied()).collect();
        self.sizes = sizes;
        Ok(())
    }

    /// The model with which links are made: noise at rest as estimated, all other effects at their usual sizes.
    fn set(&self, model: &mut Model) {
        self.at_rest
            .iter()
            .for_each(|(usual, by)| usual.set(model, *by));
        self.between
            .iter()
            .for_each(|(usual, _)| usual.set(model, 0.0));
    }
}

impl Filtered<'_> {
    /// Attitude at the begin of each dwell, given all data, and whether a stretch begins there.
    fn rests(&self, posterior: &Posterior) -> Vec<(bool, Matrix3<f64>)> {
        let mut all = Vec::new();
        self.backward(|link, passed, cumulants| {
            if let Some(computed) = link.attitude {
                let by: DMatrix<f64> =
                    &passed.by_constants - &passed.covariance * &cumulants.by_constants;
                let states = &passed.mean + &passed.covariance * &cumulants.mean;
                let states = states + by * &posterior.mean;
                let error = states.fixed_rows::<3>(ATTITUDE).into_owned();
                all.push((link.begins, from_tilt_and_heading(&error) * computed));
            }
        });
        all.reverse();
        all
    }
}

impl Problem<'_> {
    /// The same problem with the attitude with which each dwell begins, if it is on a table: navigation is linearised
    /// there, whatever the table reads.
    fn with_attitudes(&self, attitudes: &[Matrix3<f64>]) -> Self {
        self.with_dwells(|number, _, dwell| {
            let mut dwell = dwell.clone();
            if let (Some(position), Some(attitude)) = (&mut dwell.position, attitudes.get(number)) {
                position.attitude = *attitude;
            }
            Some(dwell)
        })
    }
}
