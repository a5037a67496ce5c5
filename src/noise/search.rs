//! The search for the most likely combination of processes.
//!
//! The fit is a generalised least-squares fit of the Allan variance itself, at cluster times half an octave apart, with
//! the covariance of the points for the fitted mixture. The most likely combination of processes is selected. Each
//! process must raise twice the log-likelihood by [`SIGNIFICANT`], and a correlation time by [`SIGNIFICANT_TIME`], so
//! that a slope that is not observed gets no coefficient.
//!
//! The method follows El-Sheimy, Hou, Niu 2008 (the slopes) and Guerrier, Skaloud, Stebler, Victoria-Feser,
//! *Wavelet-Variance-Based Estimation for Composite Stochastic Processes*, JASA 108 (2013) (least squares with the
//! covariance of the points).

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::allan::{Curve, mean};
use super::clusters::Clusters;
use super::fit::{Mixture, Weighted, allan_variance};
use super::identify::{Found, Hidden, Identified, of_kind};
use super::process::Process;

/// Minimum increase of twice the log-likelihood per process: three standard deviations, squared.
const SIGNIFICANT: f64 = 9.0;
/// Additional increase for a correlation time: two standard deviations, squared, because it only distinguishes
/// between processes.
const SIGNIFICANT_TIME: f64 = 4.0;
/// A fit less probable than this does not describe the curve.
const IMPROBABLE: f64 = 1e-3;
/// If cluster times must be dropped, a start with a probability below this is accepted only if no later start is above
/// it: starting too late costs little, starting too early is wrong.
const DOUBTFUL: f64 = 0.05;
/// Cluster times dropped per step: an octave.
const STEP: usize = 2;
/// Range in which the deviation from all models is searched, relative to the Allan variance.
const MISFITS: (f64, f64) = (1e-3, 10.0);
/// Number of rounds of weights and fit.
const ROUNDS: usize = 5;
/// Number of halvings of the step between correlation times tried.
const REFINEMENTS: usize = 10;
/// 95 % quantile of the normal distribution.
const BELOW_95: f64 = 1.645;
/// Number of points on either side of a point whose scatter gives its variance.
const NEAR: usize = 3;
/// Lengths of the short end of a curve, in points, that are tested separately: one and two octaves.
const SHORT_ENDS: [usize; 2] = [2, 4];

impl Clusters {
    /// Identifies the processes in the mean of some curves; `None` if the curves have other cluster times, are too
    /// short or contain a zero. Averaged axes are treated as independent.
    ///
    /// At short cluster times, coarse pulses and the bandwidth of a sensor cause deviations that no process describes.
    /// Up to half of the cluster times, and one additional octave because a remainder may not be significant, are
    /// dropped for this reason. If the fit fails from every starting point of the curve, the whole curve is fitted with
    /// a misfit.
    pub fn identify(&self, curves: &[&Curve]) -> Option<Identified> {
        let is_of_these = |of: &&Curve| of.variance.len() == self.sizes().len();
        if !curves.iter().all(is_of_these) {
            return None;
        }
        let curve = mean(curves);
        let varies = |v: &f64| v.is_finite() && *v > 0.0;
        if curve.tau.len() < 2 || !curve.variance.iter().all(varies) {
            return None;
        }
        let whole = Search {
            clusters: self,
            curve: &curve,
            shares: &shares(curves),
            first: 0,
            misfit: 0.0,
        };
        let mut doubtful = None;
        let mut starts = (0..=curve.tau.len() / 2).step_by(STEP);
        let clear = starts.find_map(|first| {
            let (found, probability) = whole.from(first).probable()?;
            if first == 0 || probability > DOUBTFUL {
                return Some(found);
            }
            doubtful = doubtful.take().or(Some(found));
            None
        });
        let Some(found) = clear.or(doubtful) else {
            return whole.with_misfit();
        };
        let further = (found.first > 0).then(|| whole.from(found.first + STEP).probable());
        Some(further.flatten().map_or(found, |(later, _)| later))
    }
}

/// Equivalent number of equal curves in the average at each cluster time.
fn shares(curves: &[&Curve]) -> Vec<f64> {
    let share = |point: usize| {
        let at = || curves.iter().map(|curve| curve.variance[point]);
        at().sum::<f64>().powi(2) / at().map(|v| v * v).sum::<f64>()
    };
    let points = curves.first().map_or(0, |curve| curve.tau.len());
    (0..points).map(share).collect()
}

/// The search on one curve.
#[derive(Clone, Copy)]
struct Search<'a> {
    clusters: &'a Clusters,
    curve: &'a Curve,
    /// Equivalent number of equal curves at each point.
    shares: &'a [f64],
    /// Number of points dropped at its start.
    first: usize,
    /// Allowed deviation from every model, relative to the Allan variance.
    misfit: f64,
}

/// A mixture with its likelihood.
#[derive(Clone)]
struct Candidate {
    mixture: Mixture,
    /// Whitened residuals of the cube roots, from the longest cluster time to the shortest.
    residual: DVector<f64>,
    /// Minus twice the log-likelihood, without its constant.
    unlikelihood: f64,
}

impl Candidate {
    fn processes(&self) -> Vec<Process> {
        self.mixture.iter().map(|(process, _)| *process).collect()
    }

    fn has_time(&self) -> bool {
        let mut processes = self.mixture.iter();
        processes.any(|(process, _)| process.correlation_time().is_some())
    }

    fn chi_square(&self) -> f64 {
        self.residual.norm_squared()
    }

    fn score(&self) -> f64 {
        let time = f64::from(u8::from(self.has_time()));
        self.unlikelihood + SIGNIFICANT * self.mixture.len() as f64 + SIGNIFICANT_TIME * time
    }

    /// Probability (p-value) of the residuals of the mixture.
    fn probability(&self) -> f64 {
        let parameters = self.mixture.len() + usize::from(self.has_time());
        let freedom = self.residual.len().saturating_sub(parameters).max(1);
        beyond(self.chi_square(), freedom)
    }

    /// Probability of the residuals of one or two octaves at the short end, given the others.
    fn probability_of_ends(&self) -> f64 {
        let of_end = |points: usize| {
            let shortest = self.residual.iter().rev().take(points);
            beyond(shortest.map(|r| r * r).sum(), points)
        };
        SHORT_ENDS.map(of_end).into_iter().fold(1.0, f64::min)
    }
}

/// Probability of a larger χ².
fn beyond(chi_square: f64, freedom: usize) -> f64 {
    ChiSquared::new(freedom as f64).map_or(0.0, |of| of.sf(chi_square))
}

impl<'a> Search<'a> {
    fn from(self, first: usize) -> Self {
        Self { first, ..self }
    }

    fn tau(&self) -> &'a [f64] {
        &self.curve.tau[self.first..]
    }

    fn variance(&self) -> &'a [f64] {
        &self.curve.variance[self.first..]
    }

    /// The most likely mixture, if its residuals are probable, with their probability: the smaller of the probabilities
    /// of all residuals and of those at the short end.
    fn probable(&self) -> Option<(Identified, f64)> {
        let best = self.most_likely()?;
        let probability = best.probability().min(best.probability_of_ends());
        let identified = (probability > IMPROBABLE).then(|| self.identified(best));
        Some((identified.flatten()?, probability))
    }

    /// The most likely mixture with the smallest deviation from all models that makes it probable.
    fn with_misfit(self) -> Option<Identified> {
        let with = |misfit: f64| Self { misfit, ..self };
        let (mut low, mut high) = MISFITS;
        let mut best = with(high).most_likely()?;
        while high / low > 1.1 {
            let middle = (low * high).sqrt();
            match with(middle).most_likely() {
                Some(likely) if likely.probability() > IMPROBABLE => {
                    (high, best) = (middle, likely)
                }
                _ => low = middle,
            }
        }
        with(high).identified(best)
    }

    fn identified(&self, best: Candidate) -> Option<Identified> {
        let best = self.refined(best);
        let weighted = self.weighted(&best.mixture)?;
        let found = found(&weighted, &best.mixture)?;
        Some(Identified {
            hidden: self.hidden(&weighted, &best, &found),
            found,
            misfit: self.misfit,
            first: self.first,
            freedom: self.degrees(&best.mixture),
            for_filter: self.for_filter(&best)?,
        })
    }

    /// Equivalent degrees of freedom of every point: those of the mixture; for points that it does not describe, at
    /// most those of the scatter of neighbouring points.
    fn degrees(&self, mixture: &[(Process, f64)]) -> Vec<f64> {
        let mixture = &positive(mixture);
        let covariance = self.clusters.covariance(mixture);
        let logarithms: Vec<f64> = self.curve.variance.iter().map(|v| v.ln()).collect();
        let bends = logarithms.windows(3).map(|w| w[0] - 2.0 * w[1] + w[2]);
        // For three independent points, it has six times the variance of one point.
        let scatter: Vec<f64> = bends.map(|bend| bend * bend / 6.0).collect();
        let of_point = |(i, &tau): (usize, &f64)| {
            let square = allan_variance(mixture, tau).powi(2);
            let model = 2.0 * self.shares[i] * square / covariance[(i, i)];
            if i >= self.first && self.misfit == 0.0 {
                return model;
            }
            let near = &scatter[i.saturating_sub(1 + NEAR)..(i + NEAR).min(scatter.len())];
            model.min(2.0 * near.len().max(1) as f64 / near.iter().sum::<f64>())
        };
        self.curve.tau.iter().enumerate().map(of_point).collect()
    }

    /// The covariance of the points under a mixture, with the deviation from every model.
    fn covariance(&self, mixture: &[(Process, f64)]) -> DMatrix<f64> {
        let whole = self.clusters.covariance(&positive(mixture));
        let (tau, share) = (self.tau(), &self.shares[self.first..]);
        DMatrix::from_fn(tau.len(), tau.len(), |i, j| {
            let random = whole[(self.first + i, self.first + j)] / (share[i] * share[j]).sqrt();
            let misfit = if i == j { self.misfit } else { 0.0 };
            random + (misfit * allan_variance(mixture, tau[i])).powi(2)
        })
    }

    fn weighted(&self, mixture: &[(Process, f64)]) -> Option<Weighted<'a>> {
        Weighted::new(self.tau(), self.variance(), self.covariance(mixture))
    }

    /// The fit of a combination of processes, with weights from the fit itself; `None` if a strength is not positive.
    fn candidate(&self, processes: &[Process]) -> Option<Candidate> {
        let (tau, variance) = (self.tau(), self.variance());
        // Initially, the weight of every point depends only on its length.
        let diagonal = variance.iter().zip(tau).map(|(v, tau)| v * v * tau);
        let diagonal = DVector::from_iterator(tau.len(), diagonal);
        let mut covariance = DMatrix::from_diagonal(&diagonal);
        let mut mixture = Mixture::new();
        for _ in 0..ROUNDS {
            mixture = Weighted::new(tau, variance, covariance)?.solve(processes)?;
            if !self.is_possible(&mixture) {
                return None;
            }
            covariance = self.covariance(&mixture);
        }
        self.judged(mixture, &covariance)
    }

    /// Whether every process of a mixture contributes and is positive, and whether the sum is positive at every point.
    /// Quantisation is excepted: it may be negative if it models a bandwidth.
    fn is_possible(&self, mixture: &[(Process, f64)]) -> bool {
        let (tau, variance) = (self.tau(), self.variance());
        let is_there = |&(process, strength): &(Process, f64)| {
            let is_part = |(&tau, v): (&f64, &f64)| {
                (strength * process.allan_variance(tau) / v).abs() >= 1e-6
            };
            // The reduction of the integral of white noise by a bandwidth has the same slope.
            tau.iter().zip(variance).any(is_part)
                && (strength >= 0.0 || process == Process::Quantisation)
        };
        // A Gauss–Markov process that dominates at the shortest cluster time is not a bias, but the noise of the output
        // itself, with a bandwidth below that of the samples.
        let varying = mixture.iter().filter(|of| of.0.same_kind(Process::MARKOV));
        let varying: Mixture = varying.copied().collect();
        let is_bandwidth = allan_variance(&varying, tau[0]) > 0.5 * allan_variance(mixture, tau[0]);
        mixture.iter().all(is_there)
            && tau.iter().all(|&tau| allan_variance(mixture, tau) > 0.0)
            && !is_bandwidth
    }

    /// Likelihood of a mixture with this covariance of the points. The cube roots of the variances are treated as
    /// normal (Wilson, Hilferty 1931), because at long cluster times there are few degrees of freedom.
    fn judged(&self, mixture: Mixture, covariance: &DMatrix<f64>) -> Option<Candidate> {
        let (tau, variance, count) = (self.tau(), self.variance(), self.tau().len());
        let model: Vec<f64> = tau
            .iter()
            .map(|&tau| allan_variance(&mixture, tau))
            .collect();
        // The longest cluster times come first, so that each adds what longer cluster times do not show.
        let place = |i: usize| count - 1 - i;
        let residual = DVector::from_fn(count, |i, _| {
            let i = place(i);
            // The mean of a cube root is less than the cube root of the mean.
            let bias = covariance[(i, i)] / (9.0 * model[i] * model[i]);
            variance[i].cbrt() - model[i].cbrt() * (1.0 - bias)
        });
        let slope = |i: usize| model[i].cbrt().powi(-2) / 3.0;
        let covariance = DMatrix::from_fn(count, count, |i, j| {
            let (i, j) = (place(i), place(j));
            covariance[(i, j)] * slope(i) * slope(j)
        });
        let root = covariance.cholesky()?;
        let log_determinant: f64 = root.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
        let residual = root.l_dirty().solve_lower_triangular(&residual)?;
        Some(Candidate {
            mixture,
            unlikelihood: residual.norm_squared() + 2.0 * log_determinant,
            residual,
        })
    }

    /// The combination with the best score.
    fn most_likely(&self) -> Option<Candidate> {
        // Omitted cluster times leave a remainder, which may not be significant.
        let is_whole = |of: &Vec<Process>| self.first == 0 || of.contains(&Process::Quantisation);
        self.least(self.combinations().filter(is_whole), Candidate::score)
    }

    /// Every combination of slopes; combinations without a floor also with each Gauss–Markov process, in last position.
    fn combinations(&self) -> impl Iterator<Item = Vec<Process>> {
        let markov = self.clusters.markov(self.tau()[0]);
        let with_markov = markov.flat_map(|process| {
            let others = subsets().filter(|of| !of.contains(&Process::BiasInstability));
            others.map(move |of| [&of[..], &[process]].concat())
        });
        subsets().chain(with_markov)
    }

    /// The combination with the smallest score among those that can be fitted.
    fn least(
        &self,
        combinations: impl Iterator<Item = Vec<Process>>,
        figure: fn(&Candidate) -> f64,
    ) -> Option<Candidate> {
        combinations
            .filter_map(|processes| self.candidate(&processes))
            .min_by(|a, b| figure(a).total_cmp(&figure(b)))
    }

    /// Refines the correlation time, if any, between the tested ones.
    fn refined(&self, mut best: Candidate) -> Candidate {
        let shortest = self.clusters.shortest_time(self.tau()[0]);
        let mut step = std::f64::consts::SQRT_2;
        let rounds = if best.has_time() { REFINEMENTS } else { 0 };
        for _ in 0..rounds {
            step = step.sqrt();
            for factor in [step.recip(), step] {
                let processes = best.processes().into_iter().map(|of| of.stretched(factor));
                let processes: Vec<Process> = processes.collect();
                let mut times = processes.iter().filter_map(|of| of.correlation_time());
                if times.all(|time| time >= shortest)
                    && let Some(tried) = self.candidate(&processes)
                    && tried.chi_square() < best.chi_square()
                {
                    best = tried;
                }
            }
        }
        best
    }

    /// Slopes not found, each with its upper limit.
    fn hidden(&self, weighted: &Weighted, best: &Candidate, found: &[Found]) -> Vec<Hidden> {
        let limit = |process: Process| -> Option<Hidden> {
            let mut processes = best.processes();
            processes.retain(|other| *other != process);
            processes.insert(0, process);
            let mixture = weighted.solve(&processes)?;
            let sigma = weighted.covariance(&mixture)?[(0, 0)].sqrt();
            let limit = (mixture.first()?.1.max(0.0) + BELOW_95 * sigma).sqrt();
            Some(Hidden { process, limit })
        };
        let is_hidden = |process: &Process| match process {
            Process::RateRamp => false,
            // A variation with a correlation time has no additional floor.
            Process::BiasInstability if best.has_time() => false,
            _ => of_kind(found, *process).is_none(),
        };
        let slopes = Process::SLOPES.into_iter();
        slopes.filter(is_hidden).filter_map(limit).collect()
    }

    /// The processes with the nearest Gauss–Markov process in place of all other variations.
    fn for_filter(&self, best: &Candidate) -> Option<Vec<Found>> {
        use Process::{BiasInstability, GaussMarkov, RateRandomWalk};
        let mut others = best.processes();
        others.retain(|of| !matches!(of, BiasInstability | RateRandomWalk | GaussMarkov { .. }));
        let mixture = if others.len() == best.mixture.len() {
            best.mixture.clone()
        } else {
            let markov = self.clusters.markov(self.tau()[0]);
            let near = markov.map(|process| [&others[..], &[process]].concat());
            let nearest = self.least(near, |of| of.unlikelihood)?;
            self.refined(nearest).mixture
        };
        found(&self.weighted(&mixture)?, &mixture)
    }
}

/// The processes with positive strength, without the negative ones that model a bandwidth.
fn positive(mixture: &[(Process, f64)]) -> Mixture {
    mixture.iter().copied().filter(|of| of.1 > 0.0).collect()
}

/// The strengths of a fit with their σ.
fn found(weighted: &Weighted, mixture: &[(Process, f64)]) -> Option<Vec<Found>> {
    let covariance = weighted.covariance(mixture)?;
    let sigma = |i: usize| covariance[(i, i)].sqrt();
    let found = |(i, &(process, squared)): (usize, &(Process, f64))| {
        let is_there = process != Process::Quantisation || squared > SIGNIFICANT.sqrt() * sigma(i);
        let strength = squared.sqrt();
        let time = process.correlation_time();
        is_there.then(|| Found {
            process,
            strength,
            sigma: sigma(i) / (2.0 * strength),
            sigma_log_time: time.map(|_| sigma(mixture.len())),
        })
    };
    Some(mixture.iter().enumerate().filter_map(found).collect())
}

/// Every combination of slopes, including the empty one.
fn subsets() -> impl Iterator<Item = Vec<Process>> {
    (0..1 << Process::SLOPES.len()).map(|bits| {
        let chosen = Process::SLOPES.into_iter().enumerate();
        let chosen = chosen.filter(|(i, _)| bits >> i & 1 == 1);
        chosen.map(|(_, process)| process).collect()
    })
}
