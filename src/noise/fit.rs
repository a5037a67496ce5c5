//! Weighted least-squares fit of an Allan variance as a sum of processes.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::process::Process;

/// Processes with their squared strengths.
pub type Mixture = Vec<(Process, f64)>;

/// Allan variance of a mixture at a cluster time.
pub fn allan_variance(mixture: &[(Process, f64)], tau: f64) -> f64 {
    let parts = mixture.iter();
    parts.map(|(p, c)| c * p.allan_variance(tau)).sum()
}

/// Points with their covariance, which gives the weights.
pub struct Weighted<'a> {
    tau: &'a [f64],
    variance: &'a [f64],
    root: Cholesky<f64, Dyn>,
}

impl<'a> Weighted<'a> {
    /// The points with their weights; `None` if the covariance is not positive definite.
    pub fn new(tau: &'a [f64], variance: &'a [f64], covariance: DMatrix<f64>) -> Option<Self> {
        let root = covariance.cholesky()?;
        Some(Self {
            tau,
            variance,
            root,
        })
    }

    /// A value at each cluster time, whitened.
    fn white(&self, values: impl Iterator<Item = f64>) -> Option<DVector<f64>> {
        let values = DVector::from_iterator(self.tau.len(), values);
        self.root.l_dirty().solve_lower_triangular(&values)
    }

    /// A whitened column for each process; `None` if there are too few points.
    fn columns(&self, processes: impl Iterator<Item = Process>) -> Option<Vec<DVector<f64>>> {
        let column = |of: Process| self.white(self.tau.iter().map(|&tau| of.allan_variance(tau)));
        let columns: Vec<_> = processes.map(column).collect::<Option<_>>()?;
        (!columns.is_empty() && columns.len() < self.tau.len()).then_some(columns)
    }

    /// The best-fit squared strengths, of any sign; `None` if the processes are not distinguishable.
    pub fn solve(&self, processes: &[Process]) -> Option<Mixture> {
        let columns = self.columns(processes.iter().copied())?;
        let factors = DMatrix::from_columns(&columns).qr();
        let right = factors
            .q()
            .tr_mul(&self.white(self.variance.iter().copied())?);
        let strengths = factors.r().solve_upper_triangular(&right)?;
        let processes = processes.iter().copied();
        Some(processes.zip(strengths.iter().copied()).collect())
    }

    /// Covariance of the squared strengths of a fit and, in the last row, of the logarithm of the correlation time if
    /// one of the processes has a correlation time.
    pub fn covariance(&self, mixture: &[(Process, f64)]) -> Option<DMatrix<f64>> {
        const STEP: f64 = 1e-4;
        let mut columns = self.columns(mixture.iter().map(|(process, _)| *process))?;
        for (process, strength) in mixture
            .iter()
            .filter(|of| of.0.correlation_time().is_some())
        {
            let at = |step: f64, tau| strength * process.stretched(step.exp()).allan_variance(tau);
            let slope = |&tau: &f64| (at(STEP, tau) - at(-STEP, tau)) / (2.0 * STEP);
            columns.push(self.white(self.tau.iter().map(slope))?);
        }
        let root = DMatrix::from_columns(&columns).qr().r();
        let inverse =
            root.solve_upper_triangular(&DMatrix::identity(columns.len(), columns.len()))?;
        let covariance = &inverse * inverse.transpose();
        covariance
            .iter()
            .all(|x| x.is_finite())
            .then_some(covariance)
    }
}
