//! A separate filter for a part of a dwell.
//!
//! At rest, the parameters act through three constant rates and three constant specific forces. Given these and the
//! navigation errors at the start (together `g`), only noise remains, which a small filter of navigation errors with
//! known start whitens in each observation. The residuals of the observations are linear in `g` and white, so together
//! they are one measurement of `g`; the errors at the end are also linear in `g`. No information is lost: it is the
//! filter of all states with its steps in a different order (Friedland 1969, "Treatment of bias in recursive
//! filtering", IEEE Trans. Automatic Control 14(4)).

use nalgebra::{DMatrix, DVector, Vector3};

use super::gain_cache::GainCache;
use super::gate::{Decision, Judge};
use super::input_prior::InputPrior;
use super::rows::{add, factor};
use crate::calibration::Observation;

/// An observation of three components: navigation errors from `state` on.
pub struct Observed {
    pub time: f64,
    pub kind: Observation,
    pub state: usize,
    pub residual: Vector3<f64>,
    /// Variance of each component.
    pub variance: f64,
}

/// Navigation errors `U g + m` for given `g`, and the information on `g`: `M` states move, `G` is the size of
/// `g`.
pub struct DwellFilter<'a, const M: usize, const G: usize> {
    gains: &'a mut GainCache<M, G>,
    /// Its current point in the sequence.
    at: usize,
    /// Mean m.
    mean: [f64; M],
    /// Sum of rows of `g` times their measured values.
    vector: [f64; G],
    /// Sum of squares of the observations given `g = 0`, and logarithm of the determinant of their covariance.
    squares: f64,
    log_determinant: f64,
    /// Prior of `g`; `None` if innovations are not requested.
    given: Option<InputPrior<G>>,
}

/// Result of a part of a dwell.
pub struct Summary {
    /// Rows of `g` …
    pub measured: DMatrix<f64>,
    /// … and their measured values, of σ 1.
    pub values: DVector<f64>,
    /// Sum of squares of the observations independent of `g`, and logarithm of the determinant of their covariance.
    pub squares: f64,
    pub log_determinant: f64,
    /// Navigation errors at the end: rows of `g`, offset, covariance.
    pub of_given: DMatrix<f64>,
    pub offset: DVector<f64>,
    pub covariance: DMatrix<f64>,
}

impl<'a, const M: usize, const G: usize> DwellFilter<'a, M, G> {
    pub fn new(given: Option<InputPrior<G>>, gains: &'a mut GainCache<M, G>) -> Self {
        Self {
            gains,
            at: GainCache::<M, G>::BEGIN,
            mean: [0.0; M],
            vector: [0.0; G],
            squares: 0.0,
            log_determinant: 0.0,
            given,
        }
    }

    /// Adds a known amount to the errors of a state.
    pub fn refer(&mut self, state: usize, by: f64) {
        self.mean[state] += by;
    }

    pub fn propagate(&mut self, model: usize) {
        self.at = self.gains.step(self.at, model);
        let mut mean = [0.0; M];
        for &(row, column, phi) in &self.gains.models[model].transition {
            mean[row] += phi * self.mean[column];
        }
        self.mean = mean;
    }

    /// Processes an observation if the judge accepts it; `None` if it is not finite or its covariance is not positive
    /// definite.
    pub fn observe(&mut self, observed: &Observed, judge: &mut Judge) -> Option<Decision> {
        if self.given.is_none() && !judge.lets_in() {
            return Some(Decision::Rejected);
        }
        let &Observed {
            state,
            residual,
            variance,
            ..
        } = observed;
        let to = self.gains.observe(self.at, state, variance)?;
        let gain = self.gains.course[to].gain.as_ref()?;
        let expected = Vector3::from_fn(|axis, _| self.mean[state + axis]);
        let whitened = gain.root.solve_lower_triangular(&(residual - expected))?;
        if let Some(given) = &mut self.given {
            let unexpected = given.predict(&gain.rows, &whitened)?;
            let sigma = [0, 1, 2].map(|k| gain.root[(k, k)] * unexpected.root[(k, k)]);
            let (time, kind) = (observed.time, observed.kind);
            match judge.judge((time, kind), unexpected.whitened, sigma) {
                Decision::Accepted => given.update(&unexpected),
                other => return Some(other),
            }
        }
        self.at = to;
        self.squares += whitened.norm_squared();
        self.log_determinant += gain.log_determinant;
        for k in 0..3 {
            add(&mut self.mean, whitened[k], &gain.of_errors[k]);
            add(&mut self.vector, whitened[k], &gain.rows[k]);
        }
        Some(Decision::Accepted)
    }

    pub fn summary(self) -> Summary {
        let known = &self.gains.course[self.at].known;
        let rows = factor(known.information, self.vector);
        let (rows, values): (Vec<_>, Vec<_>) = rows.map(|(_, row, value)| (row, value)).unzip();
        let values = DVector::from_vec(values);
        Summary {
            measured: matrix(&rows),
            squares: self.squares - values.norm_squared(),
            log_determinant: self.log_determinant,
            values,
            of_given: matrix(&known.of_given),
            offset: DVector::from_column_slice(&self.mean),
            covariance: matrix(&known.covariance),
        }
    }
}

fn matrix<const N: usize>(rows: &[[f64; N]]) -> DMatrix<f64> {
    DMatrix::from_row_slice(rows.len(), N, rows.as_flattened())
}
