//! Least squares with a prior about zero, where few equations are as bad as they like.

use nalgebra::{SMatrix, SVector};

use crate::statistics::{SIGMA_OF_MEDIAN, median};

/// Steps after which a fit has settled or never will.
const STEPS: usize = 60;
/// Parts of a step below this are none.
const NO_STEP: f64 = 1e-9;
/// A fit has settled when a step changes no parameter by this part of its σ, and σ has when it changes by this
/// part. As a median σ may go on jumping between two equations, which does no harm: so many are enough.
const SETTLED: f64 = 0.01;
const SIGMAS: usize = 10;
/// Residuals beyond so many σ begin to lose their weight (95 % efficient where all are normal).
///
/// Source: Holland and Welsch 1977, "Robust regression using iteratively reweighted least-squares",
/// Communications in Statistics A6(9), table 1: Cauchy.
const BEYOND: f64 = 2.385;

/// What is off, and how it changes with the parameters.
pub(super) struct Equation<const N: usize> {
    pub residual: f64,
    pub row: SVector<f64, N>,
}

/// What is least off.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fit<const N: usize> {
    pub at: SVector<f64, N>,
    pub covariance: SMatrix<f64, N, N>,
    /// Of one equation.
    pub sigma: f64,
}

/// The parameters that are likeliest by the equations, which are off by `floor` at least, and by the prior's
/// information about zero; none where they do not settle.
pub(super) fn fit<const N: usize>(
    start: SVector<f64, N>,
    prior: &SMatrix<f64, N, N>,
    floor: f64,
    equations: impl Fn(&SVector<f64, N>) -> Vec<Equation<N>>,
) -> Option<Fit<N>> {
    let mut found = fit_at(start, prior, floor, &equations)?;
    for _ in 0..SIGMAS {
        let off = equations(&found.at);
        let (information, _) = normal(&off, found.sigma);
        // As many equations as the parameters take in say nothing of how far they are off.
        let taken = (information * found.covariance).trace();
        let free = (off.len() as f64 - taken).max(1.0);
        let mut sizes: Vec<f64> = off.iter().map(|of| of.residual.abs()).collect();
        let scatter = SIGMA_OF_MEDIAN * median(&mut sizes)? * (off.len() as f64 / free).sqrt();
        let sigma = scatter.max(floor);
        if (sigma / found.sigma).ln().abs() < SETTLED {
            break;
        }
        found = fit_at(found.at, prior, sigma, &equations)?;
    }
    Some(found)
}

/// The same with equations of this σ.
pub(super) fn fit_at<const N: usize>(
    start: SVector<f64, N>,
    prior: &SMatrix<f64, N, N>,
    sigma: f64,
    equations: impl Fn(&SVector<f64, N>) -> Vec<Equation<N>>,
) -> Option<Fit<N>> {
    let mut at = start;
    for _ in 0..STEPS {
        let found = equations(&at);
        let (information, gradient) = normal(&found, sigma);
        let precision = information + prior;
        let covariance = precision.cholesky()?.inverse();
        let step = -covariance * (gradient + prior * at);
        let before = cost(&found, sigma, prior, &at);
        let mut part = 1.0;
        // A step that makes it worse goes too far.
        let is_worse = |at: SVector<f64, N>| {
            let after = cost(&equations(&at), sigma, prior, &at);
            after.is_nan() || after > before * (1.0 + NO_STEP)
        };
        while part > NO_STEP && is_worse(at + step * part) {
            part *= 0.5;
        }
        at += step * part;
        if step.dot(&(precision * step)) < SETTLED.powi(2) {
            return Some(Fit {
                at,
                covariance,
                sigma,
            });
        }
    }
    None
}

fn normal<const N: usize>(
    equations: &[Equation<N>],
    sigma: f64,
) -> (SMatrix<f64, N, N>, SVector<f64, N>) {
    let (mut information, mut gradient) = (SMatrix::zeros(), SVector::zeros());
    for Equation { residual, row } in equations {
        let weight = (1.0 + (residual / (BEYOND * sigma)).powi(2)).recip() / (sigma * sigma);
        information += weight * row * row.transpose();
        gradient += weight * *residual * row;
    }
    (information, gradient)
}

/// −2 ln of likelihood and prior, but for what does not depend on the parameters.
pub(super) fn cost<const N: usize>(
    equations: &[Equation<N>],
    sigma: f64,
    prior: &SMatrix<f64, N, N>,
    at: &SVector<f64, N>,
) -> f64 {
    let of = |of: &Equation<N>| (of.residual / (BEYOND * sigma)).powi(2).ln_1p();
    BEYOND.powi(2) * equations.iter().map(of).sum::<f64>() + at.dot(&(prior * at))
}
