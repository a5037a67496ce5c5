//! Test of σ without a noise model: whether the scatter of the dwells agrees with the covariance of the
//! estimate.
//!
//! The whitened rows G of a dwell give its contribution: information `ΔI = Gᵀ G` and score `s = Gᵀ (ν − G θ̂)`.
//! Attitude and velocity that carry over from one dwell to the next are integrated out, so the scores are those
//! of `p(y_u | y_1 … y_{u−1}, θ)` and independent of each other. If the model is correct, the covariance of a score
//! is `ΔI − ΔI P ΔI`; if not, it is estimated from the scores (White 1982, "Maximum likelihood estimation of
//! misspecified models", Econometrica 50(1); correction of the leverage of few clusters: Bell and McCaffrey 2002,
//! Survey Methodology 28(2)).

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::finding::widened_by;
use crate::calibration::{
    Finding, FindingKind as Kind, Posterior, Prior, Reduction, mean_square_interval,
};
use crate::statistics::FALSE_ALARM;

/// Directions in which a dwell has less than this part of the total information are ignored: only rounding
/// shows there.
const SHARE: f64 = 1e-3;

/// Scatter of the dwells relative to the covariance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DwellScatter {
    /// Mean of squared normalised scores; one if σ are correct.
    pub mean: f64,
    /// Number of scores.
    pub count: usize,
    /// Its limit for correct σ, at the false-alarm rate.
    pub limit: f64,
}

impl DwellScatter {
    /// The finding, with the factor by which σ were widened.
    pub fn finding(&self, growth: f64) -> Finding {
        let Self { mean, limit, .. } = self;
        let text = format!(
            "The dwells disagree with one another by more than σ allow (scatter statistic {mean:.2}; limit \
             {limit:.2}). turncal widened σ {}. This usually means an unmodelled error. Find the error term that \
             explains most in the report, and rerun with --with and that term.",
            widened_by(growth)
        );
        let figures = json!({ "mean": mean, "limit": limit, "growth": growth });
        Finding::new(Kind::DwellsScatter, text, figures)
    }
}

/// The scores of dwells in units in which the covariance of the estimate is the identity.
pub struct DwellScores {
    pub scatter: DwellScatter,
    /// Square root of the covariance of the estimate.
    root: DMatrix<f64>,
    /// Indices of the estimated constants.
    on: Vec<usize>,
    all: usize,
    /// Covariance of the estimate from the scatter of the scores (robust covariance).
    robust: DMatrix<f64>,
}

impl DwellScores {
    /// Scores from the rows of each dwell; `None` if there are too few.
    pub fn new(reduction: &Reduction, prior: &Prior, posterior: &Posterior) -> Option<Self> {
        let all = reduction.constants.len();
        let sigma = posterior.covariance.diagonal().map(f64::sqrt);
        let on: Vec<usize> = (0..all).filter(|&k| sigma[k] > 0.0).collect();
        let n = on.len();
        let correlation = DMatrix::from_fn(n, n, |i, j| {
            posterior.covariance[(on[i], on[j])] / (sigma[on[i]] * sigma[on[j]])
        });
        let root = correlation.cholesky()?.unpack();
        let scaled = DMatrix::from_fn(n, n, |i, j| sigma[on[i]] * root[(i, j)]);
        let shares = (0..n).map(|i| scaled.row(i).norm_squared() / prior.sigma[on[i]].powi(2));
        let before = shares.sum::<f64>();
        let mut squares = Vec::new();
        let mut robust = DMatrix::zeros(n, n);
        for dwell in reduction.dwells() {
            let rows = dwell.select_columns(&on) * &scaled;
            let residual = dwell.column(all) - dwell.columns(0, all) * &posterior.mean;
            let (gained, score) = (rows.tr_mul(&rows), rows.tr_mul(&residual));
            let eigen = gained.symmetric_eigen();
            let mut corrected = DVector::zeros(n);
            for (share, direction) in eigen
                .eigenvalues
                .iter()
                .zip(eigen.eigenvectors.column_iter())
            {
                if !(SHARE..1.0 - SHARE).contains(share) {
                    continue;
                }
                let along = direction.dot(&score);
                squares.push(along.powi(2) / (share * (1.0 - share)));
                corrected.axpy(along / (1.0 - share).sqrt(), &direction, 1.0);
            }
            robust.ger(1.0, &corrected, &corrected, 1.0);
        }
        // What the estimate takes of the scores they do not have: as many as there are constants that
        // dwells, and not what was known before, determine.
        let constants = n as f64 - before;
        let freedom = squares.len() as f64 - constants;
        if freedom < 1.0 {
            return None;
        }
        let (_, limit) = mean_square_interval(freedom as usize, 2.0 * FALSE_ALARM);
        Some(Self {
            scatter: DwellScatter {
                mean: squares.iter().sum::<f64>() / squares.len() as f64,
                count: squares.len(),
                limit,
            },
            root: scaled,
            robust,
            on,
            all,
        })
    }

    /// Covariance of the estimate, raised to that of the scores wherever it is larger than that of the model; `None`
    /// if the scatter is within its limit.
    pub fn widened(&self) -> Option<DMatrix<f64>> {
        if self.scatter.mean <= self.scatter.limit {
            return None;
        }
        let mut eigen = self.robust.clone().symmetric_eigen();
        eigen.eigenvalues.apply(|value| *value = value.max(1.0));
        let widened = &self.root * eigen.recompose() * self.root.transpose();
        let mut covariance = DMatrix::zeros(self.all, self.all);
        for (i, &row) in self.on.iter().enumerate() {
            for (j, &column) in self.on.iter().enumerate() {
                covariance[(row, column)] = widened[(i, j)];
            }
        }
        Some(covariance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::UNWATCHED;
    use crate::calibration::{Finding, NoisePolicy, Options, Outcome, Problem, estimate};
    use crate::run::Run;
    use crate::simulation::Scenario;

    /// Fixed before the first run was made.
    const SEED: u64 = 13;
    const RUNS: u64 = 4;

    fn run(number: u64) -> Run {
        Scenario::load("demo")
            .unwrap()
            .simulate(SEED, number)
            .unwrap()
            .run
    }

    fn estimated(run: &Run) -> Outcome {
        let options = Options::default().noise(NoisePolicy::Stated);
        estimate(&Problem::new(run, &options), UNWATCHED).unwrap()
    }

    #[test]
    fn scores_of_a_right_model_are_as_large_as_their_variance() {
        let all: Vec<DwellScatter> = (0..RUNS)
            .map(|number| estimated(&run(number)).dwell_scatter.unwrap())
            .collect();
        let count: usize = all.iter().map(|scatter| scatter.count).sum();
        let sum: f64 = all.iter().map(|s| s.mean * s.count as f64).sum();
        let (low, high) = mean_square_interval(count, 1e-3);
        let mean = sum / count as f64;
        println!("{mean:.3} of {count}");
        assert!((low..high).contains(&mean), "{mean} {low} {high}");
    }

    #[test]
    fn positions_worse_than_stated_are_seen_and_sigma_grow_to_them() {
        let mut run = run(0);
        let truth = estimated(&run);
        run.table.position_sigma /= 3.0;
        let outcome = estimated(&run);
        let said = |finding: &Finding| finding.kind == "dwells-scatter";
        assert!(outcome.findings.iter().any(said));
        // What positions tell most is again known as well as with the figure that is right.
        let sigma = |outcome: &Outcome| outcome.estimate.sigma().rows(3, 6).norm();
        let ratio = sigma(&outcome) / sigma(&truth);
        let by_noise = outcome.covariance_by_noise.diagonal().map(f64::sqrt);
        let without = by_noise.rows(3, 6).norm() / sigma(&truth);
        println!(
            "σ of gyro E over those with the correct figure: {ratio:.2}, by noise {without:.2}"
        );
        assert!(without < 0.5 && ratio > 0.7, "{without} {ratio}");
    }
}
