//! The noise processes behind the slopes of the Allan deviation.

use std::f64::consts::{LN_2, PI};

use crate::imu::Noise;

/// A noise process in a rate. The Allan variance of the process is proportional to the square of its strength.
///
/// Sources: IEEE Std 952-1997, annex C (all terms and the Markov process); El-Sheimy, Hou, Niu,
/// *Analysis and Modeling of Inertial Sensors Using Allan Variance*, IEEE Trans. Instrum. Meas. 57
/// (2008); Greenhall, Riley, *Uncertainty of Stability Variances Based on Finite Differences*, PTTI
/// 2003 (generalised autocovariances).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Process {
    /// White noise of the integral, such as the noise of pulses; slope −1, strength Q in rad or m/s.
    Quantisation,
    /// White noise of the rate; slope −1/2, strength N in rad/√s or (m/s)/√s.
    RandomWalk,
    /// Flicker noise; slope 0, strength B in rad/s or m/s², whose floor is `0.664 B`.
    BiasInstability,
    /// Random walk of the rate; slope +1/2, strength K in rad/s/√s or m/s²/√s.
    RateRandomWalk,
    /// A rate that grows linearly; slope +1, strength R in rad/s² or m/s³. Not random.
    RateRamp,
    /// A stationary first-order Gauss–Markov process of the rate; strength its 1σ in rad/s or m/s².
    GaussMarkov {
        /// Correlation time in s.
        correlation_time: f64,
    },
}

impl Noise {
    /// Allan variance at a cluster time in s.
    pub fn allan_variance(&self, tau: f64) -> f64 {
        let bias = self.gauss_markov.map_or(0.0, |of| {
            let correlation_time = of.correlation_time;
            of.sigma.powi(2) * Process::GaussMarkov { correlation_time }.allan_variance(tau)
        });
        self.random_walk.powi(2) * Process::RandomWalk.allan_variance(tau) + bias
    }
}

impl Process {
    /// The processes with a distinct slope, in the order of the cluster times at which they dominate.
    pub const SLOPES: [Self; 5] = [
        Self::Quantisation,
        Self::RandomWalk,
        Self::BiasInstability,
        Self::RateRandomWalk,
        Self::RateRamp,
    ];

    /// Placeholder for a Gauss–Markov process with any correlation time.
    pub const MARKOV: Self = Self::GaussMarkov {
        correlation_time: 1.0,
    };

    /// Whether both processes are of one kind, regardless of their correlation times.
    pub fn same_kind(self, other: Self) -> bool {
        std::mem::discriminant(&self) == std::mem::discriminant(&other)
    }

    /// Correlation time in s, if the process has one.
    pub fn correlation_time(self) -> Option<f64> {
        match self {
            Self::GaussMarkov { correlation_time } => Some(correlation_time),
            _ => None,
        }
    }

    /// The process with its correlation time, if it has one, multiplied by a factor.
    pub fn stretched(self, factor: f64) -> Self {
        self.correlation_time()
            .map_or(self, |time| Self::GaussMarkov {
                correlation_time: time * factor,
            })
    }

    /// Allan variance at a cluster time in s, for unit strength.
    pub fn allan_variance(self, tau: f64) -> f64 {
        match self {
            Self::Quantisation => 3.0 / tau.powi(2),
            Self::RandomWalk => tau.recip(),
            Self::BiasInstability => 2.0 * LN_2 / PI,
            Self::RateRandomWalk => tau / 3.0,
            Self::RateRamp => tau.powi(2) / 2.0,
            Self::GaussMarkov { correlation_time } => {
                // Computed from s(t) as below, because the closed form loses all digits if τ ≪ T.
                let x = tau / correlation_time;
                (4.0 * markov(x) - markov(2.0 * x)) / x.powi(2)
            }
        }
    }

    /// Generalised autocovariance of the integral at a lag in s, for unit strength; zero for the ramp, which is
    /// not random.
    pub fn autocovariance(self, lag: f64) -> f64 {
        let t = lag.abs();
        match self {
            Self::Quantisation => f64::from(u8::from(t == 0.0)),
            Self::RateRamp => 0.0,
            Self::RandomWalk => -t / 2.0,
            Self::BiasInstability if t == 0.0 => 0.0,
            Self::BiasInstability => t * t * t.ln() / (2.0 * PI),
            Self::RateRandomWalk => t.powi(3) / 12.0,
            Self::GaussMarkov { correlation_time } => {
                -correlation_time.powi(2) * markov(t / correlation_time)
            }
        }
    }
}

/// `x − 1 + e⁻ˣ`.
fn markov(x: f64) -> f64 {
    if x < 1e-3 {
        x * x * (0.5 - x * (1.0 / 6.0 - x / 24.0))
    } else {
        x + (-x).exp_m1()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TAUS: [f64; 3] = [0.01, 3.0, 700.0];

    #[test]
    fn the_autocovariance_of_every_process_gives_its_allan_variance() {
        let markov = |correlation_time| Process::GaussMarkov { correlation_time };
        for process in [
            Process::Quantisation,
            Process::RandomWalk,
            Process::BiasInstability,
            Process::RateRandomWalk,
            markov(0.5),
            markov(80.0),
        ] {
            for tau in TAUS {
                let s = |lag| process.autocovariance(lag);
                let difference = 6.0 * s(0.0) - 8.0 * s(tau) + 2.0 * s(2.0 * tau);
                let ratio = difference / (2.0 * tau * tau) / process.allan_variance(tau);
                assert!((ratio - 1.0).abs() < 1e-9, "{process:?} at {tau}: {ratio}");
            }
        }
    }

    #[test]
    fn a_gauss_markov_process_peaks_near_1_89_of_its_correlation_time_at_0_618_sigma() {
        // IEEE Std 952-1997, C.1.2.2: 0.437 q √T at 1.89 T, with q √T = √2 σ.
        let process = Process::GaussMarkov {
            correlation_time: 40.0,
        };
        let deviation = |tau| f64::sqrt(process.allan_variance(tau));
        let peak = deviation(1.89 * 40.0);
        assert!((peak - 0.437 * 2f64.sqrt()).abs() < 1e-3, "{peak}");
        assert!(peak > deviation(1.8 * 40.0) && peak > deviation(2.0 * 40.0));
        // And IEEE's own formula, where it keeps its digits.
        let (tau, t) = (60.0, 40.0);
        let x: f64 = tau / t;
        let bracket = 3.0 - 4.0 * (-x).exp() + (-2.0 * x).exp();
        let expected = 2.0 * t / tau * (1.0 - t / (2.0 * tau) * bracket);
        assert!((process.allan_variance(tau) / expected - 1.0).abs() < 1e-12);
    }
}
