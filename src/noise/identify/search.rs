//! The search for the most likely combination of processes.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::super::allan::Curve;
use super::super::fit::{Mixture, Weighted, allan_variance};
use super::super::process::Process;
use super::clusters::Clusters;
use super::{Found, Hidden, Identified, SIGNIFICANT, TELLS_TIME};

/// A fit less probable than this does not describe the curve.
const IMPROBABLE: f64 = 1e-3;
/// Departure from all models that is looked for, as a part of the Allan variance.
const MISFITS: (f64, f64) = (1e-3, 1.0);
/// Rounds of weights and fit.
const ROUNDS: usize = 5;
/// Halvings of the step between correlation times tried.
const REFINEMENTS: usize = 10;
/// Of a normal distribution, below which 95 % lie.
const BELOW_95: f64 = 1.645;
/// Where a Gauss–Markov process is meant, whatever its correlation time.
const MARKOV: Process = Process::GaussMarkov {
    correlation_time: 1.0,
};

/// A curve that is searched.
pub(super) struct Search<'a> {
    clusters: &'a Clusters,
    /// As how many equal curves it counts, at each point.
    shares: Vec<f64>,
    curve: &'a Curve,
}

/// A mixture and how likely it is.
#[derive(Clone)]
struct Candidate {
    mixture: Mixture,
    /// Of the cube roots.
    chi_square: f64,
    /// Minus twice the logarithm of the likelihood, but for a constant.
    unlikelihood: f64,
}

impl Candidate {
    fn has(&self, process: Process) -> bool {
        self.mixture.iter().any(|(own, _)| own.same_kind(process))
    }

    fn processes(&self) -> Vec<Process> {
        self.mixture.iter().map(|(process, _)| *process).collect()
    }

    fn parameters(&self) -> usize {
        self.mixture.len() + usize::from(self.has(MARKOV))
    }

    fn score(&self) -> f64 {
        let time = if self.has(MARKOV) { TELLS_TIME } else { 0.0 };
        self.unlikelihood + SIGNIFICANT * self.mixture.len() as f64 + time
    }
}

impl<'a> Search<'a> {
    pub fn new(clusters: &'a Clusters, shares: Vec<f64>, curve: &'a Curve) -> Self {
        Self {
            clusters,
            shares,
            curve,
        }
    }

    pub fn run(&self) -> Option<Identified> {
        let varies = |v: &f64| v.is_finite() && *v > 0.0;
        if self.curve.tau.len() < 2 || !self.curve.variance.iter().all(varies) {
            return None;
        }
        let (misfit, candidates) = self.candidates()?;
        let best = candidates
            .into_iter()
            .min_by(|a, b| a.score().total_cmp(&b.score()))?;
        let best = self.refined(best, misfit);
        let weighted = self.weighted(&best.mixture, misfit)?;
        let covariance = self.covariance(&best.mixture, 0.0);
        let freedom =
            self.curve.tau.iter().enumerate().map(|(i, &tau)| {
                2.0 * allan_variance(&best.mixture, tau).powi(2) / covariance[(i, i)]
            });
        Some(Identified {
            found: found(&weighted, &best.mixture)?,
            hidden: self.hidden(&weighted, &best),
            misfit,
            freedom: freedom.collect(),
            for_filter: self.for_filter(&best, misfit)?,
        })
    }

    /// The covariance of the points under a mixture, with so much departure from every model.
    fn covariance(&self, mixture: &[(Process, f64)], misfit: f64) -> DMatrix<f64> {
        let mut covariance = self.clusters.covariance(mixture);
        for (i, (&tau, share)) in self.curve.tau.iter().zip(&self.shares).enumerate() {
            let factor = share.sqrt().recip();
            covariance.row_mut(i).scale_mut(factor);
            covariance.column_mut(i).scale_mut(factor);
            covariance[(i, i)] += (misfit * allan_variance(mixture, tau)).powi(2);
        }
        covariance
    }

    fn weighted(&self, mixture: &[(Process, f64)], misfit: f64) -> Option<Weighted<'_>> {
        let covariance = self.covariance(mixture, misfit);
        Weighted::new(&self.curve.tau, &self.curve.variance, covariance)
    }

    /// The fit of a combination of processes, weighted by itself; none if one of them is not positive.
    fn candidate(&self, processes: &[Process], misfit: f64) -> Option<Candidate> {
        let Curve { tau, variance } = self.curve;
        // To begin with every point counts by its length alone.
        let diagonal = variance.iter().zip(tau).map(|(v, tau)| v * v * tau);
        let diagonal = DVector::from_iterator(tau.len(), diagonal);
        let mut weighted = Weighted::new(tau, variance, DMatrix::from_diagonal(&diagonal))?;
        let mut mixture = Mixture::new();
        for _ in 0..ROUNDS {
            mixture = weighted.solve(processes)?;
            let absent = |&(process, strength): &(Process, f64)| {
                let share = |&tau: &f64| strength * process.allan_variance(tau);
                let most = tau.iter().zip(variance).map(|(tau, v)| share(tau) / v);
                most.fold(f64::NEG_INFINITY, f64::max) < 1e-6
            };
            if mixture.iter().any(absent) {
                return None;
            }
            weighted = self.weighted(&mixture, misfit)?;
        }
        self.judged(mixture, misfit)
    }

    /// How likely a mixture is.
    fn judged(&self, mixture: Mixture, misfit: f64) -> Option<Candidate> {
        let Curve { tau, variance } = self.curve;
        let mut covariance = self.covariance(&mixture, misfit);
        let model = DVector::from_iterator(
            tau.len(),
            tau.iter().map(|&tau| allan_variance(&mixture, tau)),
        );
        let mut residual = DVector::zeros(tau.len());
        for (i, (model, variance)) in model.iter().zip(variance).enumerate() {
            // The mean of a cube root is less than the cube root of the mean.
            let bias = covariance[(i, i)] / (9.0 * model * model);
            residual[i] = variance.cbrt() - model.cbrt() * (1.0 - bias);
        }
        for (i, model) in model.iter().enumerate() {
            let derivative = model.cbrt().powi(-2) / 3.0;
            covariance.row_mut(i).scale_mut(derivative);
            covariance.column_mut(i).scale_mut(derivative);
        }
        let root = covariance.cholesky()?;
        let log_determinant: f64 = root.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
        let white = root.l_dirty().solve_lower_triangular(&residual)?;
        let chi_square = white.norm_squared();
        Some(Candidate {
            mixture,
            chi_square,
            unlikelihood: chi_square + 2.0 * log_determinant,
        })
    }

    /// All combinations that fit, and the smallest departure with which the best of them is not
    /// improbable.
    fn candidates(&self) -> Option<(f64, Vec<Candidate>)> {
        let probable = |candidates: &[Candidate]| {
            candidates.iter().any(|candidate| {
                let points = self.curve.tau.len();
                let freedom = points.saturating_sub(candidate.parameters()).max(1);
                ChiSquared::new(freedom as f64)
                    .is_ok_and(|chi_square| chi_square.sf(candidate.chi_square) > IMPROBABLE)
            })
        };
        let candidates = self.all(0.0);
        if probable(&candidates) {
            return Some((0.0, candidates));
        }
        let (mut low, mut high) = MISFITS;
        let mut best = self.all(high);
        while high / low > 1.1 {
            let middle = (low * high).sqrt();
            let candidates = self.all(middle);
            if probable(&candidates) {
                (high, best) = (middle, candidates);
            } else {
                low = middle;
            }
        }
        Some((high, best))
    }

    fn all(&self, misfit: f64) -> Vec<Candidate> {
        let beside_markov = Process::SLOPES.map(|p| (p != Process::BiasInstability).then_some(p));
        let beside_markov: Vec<Process> = beside_markov.into_iter().flatten().collect();
        let fit = |processes: Vec<Process>| self.candidate(&processes, misfit);
        subsets(&Process::SLOPES)
            .filter(|processes| !processes.is_empty())
            .chain(self.with_markov(&beside_markov))
            .filter_map(fit)
            .collect()
    }

    /// Some processes with Gauss–Markov processes of many correlation times.
    fn with_markov(&self, others: &[Process]) -> impl Iterator<Item = Vec<Process>> {
        let times = self.clusters.correlation_times();
        times.flat_map(move |correlation_time| {
            subsets(others).map(move |mut processes| {
                processes.push(Process::GaussMarkov { correlation_time });
                processes
            })
        })
    }

    /// With a correlation time between those tried, if it has one.
    fn refined(&self, mut best: Candidate, misfit: f64) -> Candidate {
        let mut step = std::f64::consts::SQRT_2;
        for _ in 0..REFINEMENTS {
            step = step.sqrt();
            for factor in [step.recip(), step] {
                let processes = best.processes().into_iter().map(|process| match process {
                    Process::GaussMarkov { correlation_time } => Process::GaussMarkov {
                        correlation_time: correlation_time * factor,
                    },
                    other => other,
                });
                let processes: Vec<Process> = processes.collect();
                if processes != best.processes()
                    && let Some(tried) = self.candidate(&processes, misfit)
                    && tried.chi_square < best.chi_square
                {
                    best = tried;
                }
            }
        }
        best
    }

    fn hidden(&self, weighted: &Weighted, best: &Candidate) -> Vec<Hidden> {
        let limit = |process: Process| -> Option<Hidden> {
            let mut processes = vec![process];
            processes.extend(best.processes());
            let mixture = weighted.solve(&processes)?;
            let sigma = weighted.covariance(&mixture)?[(0, 0)].sqrt();
            let limit = mixture.first()?.1.max(0.0) + BELOW_95 * sigma;
            Some(Hidden {
                process,
                limit: limit.sqrt(),
            })
        };
        let hidden = Process::SLOPES.into_iter().filter(|&process| {
            // What varies with a correlation time has no floor besides.
            let floor = process == Process::BiasInstability && best.has(MARKOV);
            !best.has(process) && !floor && process != Process::RateRamp
        });
        hidden.filter_map(limit).collect()
    }

    /// With the nearest Gauss–Markov process in the place of whatever varies.
    fn for_filter(&self, best: &Candidate, misfit: f64) -> Option<Vec<Found>> {
        let varies = [Process::BiasInstability, Process::RateRandomWalk, MARKOV];
        let (varying, others): (Vec<Process>, Vec<Process>) = best
            .processes()
            .into_iter()
            .partition(|process| varies.iter().any(|w| w.same_kind(*process)));
        let mut nearest = best.clone();
        if !varying.is_empty() {
            nearest = self
                .with_markov(&others)
                .filter_map(|processes| self.candidate(&processes, misfit))
                .min_by(|a, b| a.unlikelihood.total_cmp(&b.unlikelihood))?;
            nearest = self.refined(nearest, misfit);
        }
        found(&self.weighted(&nearest.mixture, misfit)?, &nearest.mixture)
    }
}

/// A fit's strengths with their σ.
fn found(weighted: &Weighted, mixture: &Mixture) -> Option<Vec<Found>> {
    let covariance = weighted.covariance(mixture)?;
    let sigma = |i: usize| covariance[(i, i)].sqrt();
    let found = mixture.iter().enumerate().map(|(i, &(process, squared))| {
        let strength = squared.sqrt();
        Found {
            process,
            strength,
            sigma: sigma(i) / (2.0 * strength),
            sigma_log_time: process.same_kind(MARKOV).then(|| sigma(mixture.len())),
        }
    });
    Some(found.collect())
}

/// Every combination of some processes, none at all included.
fn subsets(processes: &[Process]) -> impl Iterator<Item = Vec<Process>> + use<> {
    let processes = processes.to_vec();
    (0..1u32 << processes.len()).map(move |bits| {
        let chosen = processes.iter().enumerate();
        chosen
            .filter(|(i, _)| bits >> i & 1 == 1)
            .map(|(_, process)| *process)
            .collect()
    })
}
