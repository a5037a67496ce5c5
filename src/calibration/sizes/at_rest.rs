//! The noise at rest, from the dwells alone.
//!
//! What a part of a dwell begins with, and the constant rates and forces in it, are its own and free; the remainder
//! shows white noise, sway and turning by hand, whatever the parameters are.

use std::convert::Infallible;

use nalgebra::{DMatrix, DVector};

use super::descent::{Lowest, Slope, descend};
use super::usual::Usual;
use crate::calibration::chain::Dispersion;
use crate::calibration::chain::part::{Part, Whitened, filter_of, part_filters};
use crate::calibration::chain::states::States;
use crate::calibration::{Model, Problem, Script};

/// Step of a logarithm for differences.
const DIFFERENCE: f64 = 1e-3;
/// Prior 1σ of what a part begins with, rad and m/s, …
const BEGIN: f64 = 0.1;
/// … and of the constant rates, rad/s, and specific forces, m/s², in it.
const RATE: f64 = 1e-3;
const FORCE: f64 = 0.03;
/// Degrees of freedom of the prior of a dwell's variance over that of all.
const BEFOREHAND: f64 = 6.0;
/// Rounds of common sizes and dispersions of dwells.
const ROUNDS: usize = 3;

/// The noise at rest.
pub struct NoiseAtRest {
    /// Logarithms of the common sizes over the usual ones.
    pub logs: DVector<f64>,
    /// 1σ of each.
    pub sigma: DVector<f64>,
    pub dispersion: Dispersion,
}

/// What the parts of a dwell leave when all that they are given is free.
#[derive(Debug, Clone, Copy, Default)]
struct Left {
    /// −2 ln L.
    deviance: f64,
    /// Sum of squares over the variances common to all dwells …
    squares: f64,
    /// … and its degrees of freedom.
    freedom: f64,
}

/// What all dwells leave with some noise at rest.
#[derive(Default)]
struct AllLeft {
    dwells: Vec<Left>,
    /// Each whitened observation, and the logarithm of its σ.
    seen: Vec<(f64, f64)>,
}

impl AllLeft {
    /// With the noise at rest of a model; `None` if a covariance is not positive definite.
    fn new(
        problem: &Problem,
        script: &Script,
        dispersion: &Dispersion,
        model: &Model,
    ) -> Option<Self> {
        let states = States::new(model, problem.one_gravity());
        let mut filters = part_filters(states.moving);
        let mut all = Self::default();
        for (number, stretch) in problem.stretches().iter().enumerate() {
            for rest in script.parts(number) {
                if rest.first {
                    all.dwells.push(Left::default());
                }
                let factor = dispersion.of(all.dwells.len() - 1);
                let root = factor.sqrt();
                let seen = &mut all.seen;
                let filter = &mut filters[filter_of(rest)];
                let part = filter.reduce((rest, stretch), model, &mut |of: Whitened| {
                    let each = (0..3).map(|k| (of.scalars[k] / root, of.root[(k, k)].ln()));
                    seen.extend(each);
                })?;
                all.dwells
                    .last_mut()?
                    .add(&part.dispersed(factor), factor)?;
            }
        }
        Some(all)
    }

    fn deviance(&self) -> f64 {
        self.dwells.iter().map(|of| of.deviance).sum()
    }

    /// Product of the changes of the observations' distribution from here to two other places, for Fisher's
    /// information on what was changed.
    fn product(&self, one: &Self, other: &Self) -> f64 {
        let pairs = one.seen.iter().zip(&other.seen).zip(&self.seen);
        pairs
            .map(|((one, other), here)| {
                let (a, b) = (one.1 - here.1, other.1 - here.1);
                let (u, v) = (one.0 - here.0, other.0 - here.0);
                // The whitened observation changes by its σ too.
                2.0 * a * b + (u + a * here.0) * (v + b * here.0)
            })
            .sum()
    }
}

impl Left {
    fn add(&mut self, part: &Part, factor: f64) -> Option<()> {
        let given = part.measured.ncols();
        let wide = |k: usize| match given - k {
            1..=3 => FORCE,
            4..=6 => RATE,
            _ => BEGIN,
        };
        let mut information = part.measured.tr_mul(&part.measured);
        (0..given).for_each(|k| information[(k, k)] += wide(k).powi(-2));
        let root = information.cholesky()?;
        let mut told = part.measured.tr_mul(&part.values);
        root.l_dirty().solve_lower_triangular_mut(&mut told);
        let determinant = 2.0 * root.l_dirty().diagonal().map(f64::ln).sum();
        let squares = part.squares + part.values.norm_squared() - told.norm_squared();
        self.squares += factor * squares;
        self.freedom += (part.count - part.values.len()) as f64;
        self.deviance += squares + part.log_determinant + determinant;
        Some(())
    }
}

/// The likeliest noise at rest, each size with its prior; from that at a linearisation point before, if any.
pub fn likeliest(
    problem: &Problem,
    script: &Script,
    usual: &[Usual],
    before: Option<(Dispersion, DVector<f64>)>,
) -> NoiseAtRest {
    let rounds = if before.is_some() { 1 } else { ROUNDS };
    let (mut dispersion, mut logs) =
        before.unwrap_or_else(|| (Dispersion::alike(problem), DVector::zeros(usual.len())));
    let mut sigma = DVector::zeros(usual.len());
    for _ in 0..rounds {
        let lowest = common(problem, script, usual, &dispersion, logs);
        sigma = lowest.sigma();
        logs = lowest.at;
        let model = model_at(problem, usual, &logs);
        if let Some(left) = AllLeft::new(problem, script, &dispersion, &model) {
            let factor = |of: &Left| (BEFOREHAND + of.squares) / (BEFOREHAND + of.freedom);
            dispersion = Dispersion::of_dwells(left.dwells.iter().map(factor).collect());
        }
    }
    NoiseAtRest {
        logs,
        sigma,
        dispersion,
    }
}

fn model_at(problem: &Problem, usual: &[Usual], at: &DVector<f64>) -> Model {
    let mut model = problem.model.clone();
    usual
        .iter()
        .zip(at)
        .for_each(|(usual, by)| usual.set(&mut model, *by));
    model
}

/// The likeliest sizes common to all dwells, by Fisher's scoring with differences (Gupta and Mehra 1974, IEEE Trans.
/// Automatic Control 19(6)).
fn common(
    problem: &Problem,
    script: &Script,
    usual: &[Usual],
    dispersion: &Dispersion,
    start: DVector<f64>,
) -> Lowest {
    let left_at = |at: &DVector<f64>| {
        let model = model_at(problem, usual, at);
        AllLeft::new(problem, script, dispersion, &model)
    };
    let n = usual.len();
    let of_prior = |k: usize| usual[k].spread.powi(-2);
    let slope_at = |at: &DVector<f64>| {
        let penalty: f64 = (0..n).map(|k| at[k].powi(2) * of_prior(k)).sum();
        let beside = |k: usize| {
            let mut there = at.clone();
            there[k] += DIFFERENCE;
            left_at(&there)
        };
        let all: Option<Vec<AllLeft>> = (0..n).map(beside).collect();
        let Some((here, beside)) = left_at(at).zip(all) else {
            return Ok::<_, Infallible>(Slope::nowhere(n));
        };
        let deviance = here.deviance();
        Ok(Slope {
            cost: deviance + penalty,
            gradient: DVector::from_fn(n, |k, _| {
                (beside[k].deviance() - deviance) / DIFFERENCE + 2.0 * at[k] * of_prior(k)
            }),
            curvature: DMatrix::from_fn(n, n, |i, j| {
                let own = if i == j { 2.0 * of_prior(i) } else { 0.0 };
                2.0 * here.product(&beside[i], &beside[j]) / DIFFERENCE.powi(2) + own
            }),
        })
    };
    let Ok(lowest) = descend(start, slope_at);
    lowest
}
