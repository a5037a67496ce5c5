//! The result for a curve: processes with their strengths, limits for processes that were not found, and intervals.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

use super::allan::Curve;
use super::process::Process;

/// With more degrees of freedom than this, a variance is treated as normally distributed.
pub const MANY: f64 = 1e4;

/// A process that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// The process.
    pub process: Process,
    /// Strength, see [`Process`].
    pub strength: f64,
    /// 1σ of the strength.
    pub sigma: f64,
    /// 1σ of the logarithm of the correlation time, if the process has a correlation time.
    pub sigma_log_time: Option<f64>,
}

impl Found {
    /// Allan variance of this process alone at a cluster time.
    pub fn allan_variance(&self, tau: f64) -> f64 {
        self.strength.powi(2) * self.process.allan_variance(tau)
    }
}

/// The process of this kind, if it was found.
pub fn of_kind(found: &[Found], process: Process) -> Option<&Found> {
    found.iter().find(|f| f.process.same_kind(process))
}

/// A process that was not found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hidden {
    /// The process.
    pub process: Process,
    /// Upper limit of the strength of the process, with 95 % probability.
    pub limit: f64,
}

/// Processes identified in a curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Identified {
    /// Processes found.
    pub found: Vec<Found>,
    /// Slopes not found.
    pub hidden: Vec<Hidden>,
    /// Significant deviation of the curve from every mixture of processes, relative to the
    /// Allan variance (1σ); zero if there is none.
    pub misfit: f64,
    /// Number of points at the start of the curve (the shortest cluster times) that the processes do not describe
    /// because of sensor bandwidth or pulses.
    pub first: usize,
    /// Equivalent degrees of freedom of each point; for points that no process describes, the degrees of freedom of
    /// their scatter.
    pub freedom: Vec<f64>,
    /// Processes for a filter that models white noise and one Gauss–Markov process: the processes found, with the
    /// nearest Gauss–Markov process in place of all other variations.
    pub for_filter: Vec<Found>,
}

impl Identified {
    /// Allan variance, at a cluster time, of all processes found.
    pub fn allan_variance(&self, tau: f64) -> f64 {
        let parts = self.found.iter();
        parts.map(|found| found.allan_variance(tau)).sum()
    }

    /// The interval that contains the Allan variance at a point with this probability, from χ².
    pub fn interval(&self, curve: &Curve, point: usize, probability: f64) -> Option<(f64, f64)> {
        let (freedom, variance) = (*self.freedom.get(point)?, *curve.variance.get(point)?);
        let tail = 0.5 * (1.0 - probability);
        if freedom > MANY {
            // The distribution is normal, and exact if nothing is random.
            let reach = Normal::standard().inverse_cdf(1.0 - tail) * (2.0 / freedom).sqrt();
            return Some((variance / (1.0 + reach), variance / (1.0 - reach)));
        }
        let distribution = ChiSquared::new(freedom).ok()?;
        let at = |p: f64| freedom * variance / distribution.inverse_cdf(p);
        Some((at(1.0 - tail), at(tail)))
    }
}
