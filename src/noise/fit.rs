//! Weighted least squares of an Allan variance as a sum of processes.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::process::Process;

/// Processes with their strengths squared.
pub(super) type Mixture = Vec<(Process, f64)>;

/// Allan variance of a mixture at a cluster time.
pub(super) fn allan_variance(mixture: &[(Process, f64)], tau: f64) -> f64 {
    let parts = mixture.iter();
    parts.map(|(p, c)| c * p.allan_variance(tau)).sum()
}

/// Points with the covariance that weighs them.
pub(super) struct Weighted<'a> {
    tau: &'a [f64],
    root: Cholesky<f64, Dyn>,
    variance: DVector<f64>,
}

impl<'a> Weighted<'a> {
    /// None if the covariance is not positive definite.
    pub fn new(tau: &'a [f64], variance: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let root = covariance.cholesky()?;
        let variance = DVector::from_column_slice(variance);
        let variance = root.l_dirty().solve_lower_triangular(&variance)?;
        Some(Self {
            tau,
            root,
            variance,
        })
    }

    fn column(&self, values: impl Fn(f64) -> f64) -> Option<DVector<f64>> {
        let column = self.tau.iter().map(|&tau| values(tau));
        let column = DVector::from_iterator(self.tau.len(), column);
        self.root.l_dirty().solve_lower_triangular(&column)
    }

    fn design(&self, processes: impl Iterator<Item = Process>) -> Option<Vec<DVector<f64>>> {
        let columns = processes.map(|p| self.column(|tau| p.allan_variance(tau)));
        let columns: Vec<_> = columns.collect::<Option<_>>()?;
        (!columns.is_empty() && columns.len() < self.tau.len()).then_some(columns)
    }

    /// The strengths squared that fit best, whatever their signs; none if the processes cannot be told
    /// apart.
    pub fn solve(&self, processes: &[Process]) -> Option<Mixture> {
        let design = Scaled::new(&self.design(processes.iter().copied())?)?;
        let strengths = design.solve(&self.variance);
        Some(
            processes
                .iter()
                .copied()
                .zip(strengths.iter().copied())
                .collect(),
        )
    }

    /// Covariance of the strengths squared of a fit, and last of the logarithm of the correlation time
    /// where one of its processes has one.
    pub fn covariance(&self, mixture: &[(Process, f64)]) -> Option<DMatrix<f64>> {
        let mut columns = self.design(mixture.iter().map(|(process, _)| *process))?;
        for &(process, strength) in mixture {
            if let Process::GaussMarkov { correlation_time } = process {
                const STEP: f64 = 1e-4;
                let at = |step: f64, tau: f64| {
                    let correlation_time = correlation_time * step.exp();
                    strength * Process::GaussMarkov { correlation_time }.allan_variance(tau)
                };
                columns.push(self.column(|tau| (at(STEP, tau) - at(-STEP, tau)) / (2.0 * STEP))?);
            }
        }
        Some(Scaled::new(&columns)?.covariance())
    }
}

/// A design whose columns have length one, with its normal equations solved.
struct Scaled {
    design: DMatrix<f64>,
    lengths: DVector<f64>,
    inverse: DMatrix<f64>,
}

impl Scaled {
    fn new(columns: &[DVector<f64>]) -> Option<Self> {
        let mut design = DMatrix::from_columns(columns);
        let lengths = DVector::from_iterator(columns.len(), columns.iter().map(|c| c.norm()));
        for (mut column, length) in design.column_iter_mut().zip(&lengths) {
            column /= *length;
        }
        let inverse = (design.transpose() * &design).cholesky()?.inverse();
        inverse.iter().all(|x| x.is_finite()).then_some(Self {
            design,
            lengths,
            inverse,
        })
    }

    fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        (&self.inverse * self.design.tr_mul(right)).component_div(&self.lengths)
    }

    fn covariance(&self) -> DMatrix<f64> {
        let mut covariance = self.inverse.clone();
        for i in 0..self.lengths.len() {
            for j in 0..self.lengths.len() {
                covariance[(i, j)] /= self.lengths[i] * self.lengths[j];
            }
        }
        covariance
    }
}
