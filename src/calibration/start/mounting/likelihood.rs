//! How likely residuals are when errors of two triads within their prior and white noise make them.

use nalgebra::{SMatrix, SVector};

/// Entries of both sensitivity matrices, row by row, each triad's followed by its biases.
pub const UNKNOWNS: usize = 24;
/// The first unknown of the accelerometers.
pub const OF_ACCEL: usize = 12;
/// The first bias of a triad, from its first unknown on.
pub const BIAS: usize = 9;

pub type Row = SVector<f64, UNKNOWNS>;

/// What is stated of the prior and of the noise may each be too small by these factors, all alike likely:
/// then neither a careless prior nor motion that is no white noise speaks for another mounting.
const TOO_SMALL: [f64; 7] = [1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0];

/// Linear equations in the errors of both triads, about one mounting.
#[derive(Debug, Clone)]
pub struct Equations {
    prior_sigma: Row,
    information: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    vector: Row,
    squares: f64,
    log_variances: f64,
    count: f64,
    unexplained: f64,
}

impl Equations {
    pub fn new(prior_sigma: &Row) -> Self {
        Self {
            prior_sigma: *prior_sigma,
            information: SMatrix::zeros(),
            vector: Row::zeros(),
            squares: 0.0,
            log_variances: 0.0,
            count: 0.0,
            unexplained: 0.0,
        }
    }

    pub fn prior_sigma(&self, unknown: usize) -> f64 {
        self.prior_sigma[unknown]
    }

    /// Adds one: a residual, relative to what is measured, with its noise's variance and its derivatives
    /// by the unknowns.
    pub fn add(&mut self, row: &Row, residual: f64, variance: f64) {
        let row = row.component_mul(&self.prior_sigma);
        self.information.ger(variance.recip(), &row, &row, 1.0);
        self.vector += row * (residual / variance);
        self.squares += residual.powi(2) / variance;
        self.log_variances += variance.ln();
        self.count += 1.0;
        let any = 1.0 + variance;
        self.unexplained += residual.powi(2) / any + any.ln();
    }

    /// Logarithm of the likelihood of the residuals, the errors of the triads being integrated out.
    pub fn log_likelihood(&self) -> f64 {
        // Samples of absurd size overflow, and say nothing.
        if !self
            .information
            .iter()
            .chain(&self.vector)
            .all(|v| v.is_finite())
        {
            return f64::NEG_INFINITY;
        }
        let eigen = self.information.symmetric_eigen();
        let along = eigen.eigenvectors.tr_mul(&self.vector);
        let mut logarithms = Vec::with_capacity(TOO_SMALL.len().pow(2));
        for noise in TOO_SMALL {
            for prior in TOO_SMALL {
                let ratio = (prior / noise).powi(2);
                let (mut explained, mut determinant) = (0.0, 0.0);
                for (value, part) in eigen.eigenvalues.iter().zip(&along) {
                    let gain = ratio * value.max(0.0);
                    explained += part.powi(2) * ratio / (1.0 + gain);
                    determinant += gain.ln_1p();
                }
                let squares = (self.squares - explained).max(0.0) / noise.powi(2);
                let noise = self.log_variances + 2.0 * self.count * noise.ln();
                logarithms.push(-0.5 * (squares + noise + determinant));
            }
        }
        let largest = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = logarithms.iter().map(|l| (l - largest).exp()).sum();
        largest + (sum / logarithms.len() as f64).ln()
    }

    /// The same if nothing of what is measured is as it should be: residuals of its own size.
    pub fn log_likelihood_of_none(&self) -> f64 {
        -0.5 * self.unexplained
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_beyond_the_prior_is_less_likely_and_one_within_hardly() {
        let prior = Row::repeat(1e-3);
        let of = |error: f64| {
            let mut equations = Equations::new(&prior);
            for k in 0..10 {
                let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                equations.add(&(Row::ith(0, sign)), sign * error, 1e-8);
            }
            equations.log_likelihood()
        };
        assert!(of(0.0) - of(1e-3) < 1.0);
        assert!(of(0.0) - of(2.0) > 5.0);
    }
}
