//! What a curve shows: processes with their strengths, limits of those not found, and intervals.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

use super::allan::Curve;
use super::process::Process;

/// With more degrees of freedom than this a variance is as good as normal.
pub const MANY: f64 = 1e4;

/// A process that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// Which.
    pub process: Process,
    /// Its strength, see [`Process`].
    pub strength: f64,
    /// 1σ of the strength.
    pub sigma: f64,
    /// 1σ of the logarithm of the correlation time, where it has one.
    pub sigma_log_time: Option<f64>,
}

impl Found {
    /// Its own Allan variance at a cluster time.
    pub fn allan_variance(&self, tau: f64) -> f64 {
        self.strength.powi(2) * self.process.allan_variance(tau)
    }
}

/// One of a kind, if it is among some processes.
pub fn of_kind(found: &[Found], process: Process) -> Option<&Found> {
    found.iter().find(|f| f.process.same_kind(process))
}

/// A process that was not found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hidden {
    /// Which.
    pub process: Process,
    /// What its strength may be at most, with 95 % probability.
    pub limit: f64,
}

/// What a curve shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Identified {
    /// Processes found.
    pub found: Vec<Found>,
    /// Slopes not found.
    pub hidden: Vec<Hidden>,
    /// By how much the curve departs from every mixture of processes beyond chance, as a part of the
    /// Allan variance (1σ); zero if it does not.
    pub misfit: f64,
    /// Points at the begin of the curve, the shortest cluster times, that the processes do not describe:
    /// there the sensor's bandwidth or its pulses show.
    pub first: usize,
    /// Equivalent degrees of freedom of each point, from the scatter of the points where no process describes
    /// them.
    pub freedom: Vec<f64>,
    /// What a filter that knows white noise and one Gauss–Markov process should use: the same as what was
    /// found, with the nearest Gauss–Markov process in the place of whatever else varies.
    pub for_filter: Vec<Found>,
}

impl Identified {
    /// Allan variance at a cluster time of all that was found.
    pub fn allan_variance(&self, tau: f64) -> f64 {
        let parts = self.found.iter();
        parts.map(|found| found.allan_variance(tau)).sum()
    }

    /// The interval that holds the Allan variance at a point with this probability, by χ².
    pub fn interval(&self, curve: &Curve, point: usize, probability: f64) -> Option<(f64, f64)> {
        let (freedom, variance) = (*self.freedom.get(point)?, *curve.variance.get(point)?);
        let tail = 0.5 * (1.0 - probability);
        if freedom > MANY {
            // Normal, and exact where nothing is random.
            let reach = Normal::standard().inverse_cdf(1.0 - tail) * (2.0 / freedom).sqrt();
            return Some((variance / (1.0 + reach), variance / (1.0 - reach)));
        }
        let distribution = ChiSquared::new(freedom).ok()?;
        let at = |p: f64| freedom * variance / distribution.inverse_cdf(p);
        Some((at(1.0 - tail), at(tail)))
    }
}
