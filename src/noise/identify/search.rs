//! The search for the most likely combination of processes.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::super::allan::Curve;
use super::super::fit::{Mixture, Weighted, allan_variance};
use super::super::process::Process;
use super::clusters::Clusters;
use super::{Found, Hidden, Identified, SIGNIFICANT, TELLS_TIME, of_kind};

/// A fit less probable than this does not describe the curve.
const IMPROBABLE: f64 = 1e-3;
/// Departure from all models that is looked for, as a part of the Allan variance.
const MISFITS: (f64, f64) = (1e-3, 10.0);
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

/// Points to either side of one whose scatter is that of it.
const NEAR: usize = 3;
/// The octaves at the short end of a curve, in points, whose departure is looked for by itself.
const SHORT_ENDS: [usize; 2] = [2, 4];

/// A curve that is searched.
pub(super) struct Search<'a> {
    clusters: &'a Clusters,
    /// Points at its begin that are left out.
    first: usize,
    /// As how many equal curves it counts, at each point.
    shares: &'a [f64],
    whole: &'a Curve,
    /// Without what is left out.
    curve: Curve,
}

/// A mixture and how likely it is.
#[derive(Clone)]
struct Candidate {
    mixture: Mixture,
    /// Of the cube roots.
    chi_square: f64,
    /// The parts of it that the points at the short end add to those of the others.
    short_ends: [f64; 2],
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
    /// Of a curve without so many of its shortest cluster times.
    pub fn new(clusters: &'a Clusters, first: usize, shares: &'a [f64], whole: &'a Curve) -> Self {
        Self {
            clusters,
            first,
            shares,
            whole,
            curve: Curve {
                tau: whole.tau[first..].to_vec(),
                variance: whole.variance[first..].to_vec(),
            },
        }
    }

    /// What it shows, and how probable what the most likely mixture leaves of it is: the whole, or an octave
    /// or two at its short end.
    pub fn probable(&self) -> Option<(Identified, f64)> {
        let best = most_likely(self.all(0.0))?;
        let tail = |square: f64, freedom: usize| {
            ChiSquared::new(freedom as f64).map_or(0.0, |of| of.sf(square))
        };
        let ends = SHORT_ENDS.into_iter().zip(best.short_ends);
        let ends = ends.map(|(points, square)| tail(square, points));
        let probability = ends.fold(tail(best.chi_square, self.freedom(&best)), f64::min);
        (probability > IMPROBABLE)
            .then(|| self.identified(best, 0.0))
            .flatten()
            .map(|identified| (identified, probability))
    }

    /// What it shows if all may depart from every model, by as little as makes the most likely one probable.
    pub fn with_misfit(&self) -> Option<Identified> {
        let (mut low, mut high) = MISFITS;
        let mut best = most_likely(self.all(high))?;
        while high / low > 1.1 {
            let middle = (low * high).sqrt();
            let likely = most_likely(self.all(middle)).filter(|best| {
                ChiSquared::new(self.freedom(best) as f64)
                    .is_ok_and(|chi_square| chi_square.sf(best.chi_square) > IMPROBABLE)
            });
            match likely {
                Some(likely) => (high, best) = (middle, likely),
                None => low = middle,
            }
        }
        self.identified(best, high)
    }

    fn freedom(&self, of: &Candidate) -> usize {
        self.curve.tau.len().saturating_sub(of.parameters()).max(1)
    }

    fn identified(&self, best: Candidate, misfit: f64) -> Option<Identified> {
        let best = self.refined(best, misfit);
        let weighted = self.weighted(&best.mixture, misfit)?;
        let found = found(&weighted, &best.mixture)?;
        Some(Identified {
            hidden: self.hidden(&weighted, &best, &found),
            found,
            misfit,
            first: self.first,
            freedom: self.degrees(&best.mixture, misfit),
            for_filter: self.for_filter(&best, misfit)?,
        })
    }

    /// Equivalent degrees of freedom of every point: those of the mixture, and where it does not describe
    /// the curve no more than neighbouring points show by their scatter.
    fn degrees(&self, mixture: &[(Process, f64)], misfit: f64) -> Vec<f64> {
        let mixture = &positive(mixture);
        let covariance = self.clusters.covariance(mixture);
        let Curve { tau, variance } = self.whole;
        let logarithms: Vec<f64> = variance.iter().map(|v| v.ln()).collect();
        let bends = logarithms.windows(3).map(|w| w[0] - 2.0 * w[1] + w[2]);
        // Of three independent ones it has six times the variance of one.
        let scatter: Vec<f64> = bends.map(|bend| bend * bend / 6.0).collect();
        let model = |i: usize| {
            let share = self.shares[i];
            2.0 * share * allan_variance(mixture, tau[i]).powi(2) / covariance[(i, i)]
        };
        let near = |i: usize| {
            let near = &scatter[i.saturating_sub(1 + NEAR)..(i + NEAR).min(scatter.len())];
            near.iter().sum::<f64>() / near.len().max(1) as f64
        };
        (0..tau.len())
            .map(|i| match i < self.first || misfit > 0.0 {
                true => model(i).min(2.0 / near(i)),
                false => model(i),
            })
            .collect()
    }

    /// The covariance of the points under a mixture, with so much departure from every model.
    fn covariance(&self, mixture: &[(Process, f64)], misfit: f64) -> DMatrix<f64> {
        let (first, points) = (self.first, self.curve.tau.len());
        let whole = self.clusters.covariance(&positive(mixture));
        let mut covariance = whole.view((first, first), (points, points)).into_owned();
        let shares = &self.shares[first..];
        for (i, (&tau, share)) in self.curve.tau.iter().zip(shares).enumerate() {
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
        let Curve { tau, variance } = &self.curve;
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
                // What a bandwidth takes away from the integral of white noise falls with the same slope.
                let is_signed = process == Process::Quantisation && strength < 0.0;
                let share = most.fold(f64::NEG_INFINITY, |most, m| most.max(m.abs()));
                share < 1e-6 || (strength < 0.0 && !is_signed)
            };
            let is_left = |&tau: &f64| allan_variance(&mixture, tau) > 0.0;
            if mixture.iter().any(absent) || !tau.iter().all(is_left) || self.is_bandwidth(&mixture)
            {
                return None;
            }
            weighted = self.weighted(&mixture, misfit)?;
        }
        self.judged(mixture, misfit)
    }

    /// Whether a Gauss–Markov process is most of the shortest cluster time: no bias then, but the output's own
    /// noise, whose bandwidth is less than that of the samples.
    fn is_bandwidth(&self, mixture: &[(Process, f64)]) -> bool {
        let shortest = self.curve.tau[0];
        let markov = mixture
            .iter()
            .filter(|(process, _)| process.same_kind(MARKOV));
        let markov: f64 = markov.map(|(p, c)| c * p.allan_variance(shortest)).sum();
        markov > 0.5 * allan_variance(mixture, shortest)
    }

    /// How likely a mixture is.
    fn judged(&self, mixture: Mixture, misfit: f64) -> Option<Candidate> {
        let Curve { tau, variance } = &self.curve;
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
        // The longest cluster times first, so that each adds what those longer than it do not tell.
        let count = tau.len();
        let covariance = DMatrix::from_fn(count, count, |i, j| {
            covariance[(count - 1 - i, count - 1 - j)]
        });
        let residual = DVector::from_fn(count, |i, _| residual[count - 1 - i]);
        let root = covariance.cholesky()?;
        let log_determinant: f64 = root.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
        let white = root.l_dirty().solve_lower_triangular(&residual)?;
        let chi_square = white.norm_squared();
        let short = |points: usize| white.iter().rev().take(points).map(|w| w * w).sum();
        Some(Candidate {
            mixture,
            chi_square,
            short_ends: SHORT_ENDS.map(short),
            unlikelihood: chi_square + 2.0 * log_determinant,
        })
    }

    /// All combinations that fit.
    fn all(&self, misfit: f64) -> Vec<Candidate> {
        let beside_markov = Process::SLOPES.map(|p| (p != Process::BiasInstability).then_some(p));
        let beside_markov: Vec<Process> = beside_markov.into_iter().flatten().collect();
        // What was left out leaves a tail behind, significant or not.
        let is_whole = |processes: &Vec<Process>| {
            self.first == 0 || processes.contains(&Process::Quantisation)
        };
        let fit = |processes: Vec<Process>| self.candidate(&processes, misfit);
        subsets(&Process::SLOPES)
            .filter(|processes| !processes.is_empty())
            .chain(self.with_markov(&beside_markov))
            .filter(is_whole)
            .filter_map(fit)
            .collect()
    }

    /// Some processes with Gauss–Markov processes of many correlation times.
    fn with_markov(&self, others: &[Process]) -> impl Iterator<Item = Vec<Process>> {
        let times = self.clusters.correlation_times(self.curve.tau[0]);
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
        let shortest = self.clusters.shortest_time(self.curve.tau[0]);
        let is_told = |process: &Process| match process {
            Process::GaussMarkov { correlation_time } => *correlation_time >= shortest,
            _ => true,
        };
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
                    && processes.iter().all(is_told)
                    && let Some(tried) = self.candidate(&processes, misfit)
                    && tried.chi_square < best.chi_square
                {
                    best = tried;
                }
            }
        }
        best
    }

    fn hidden(&self, weighted: &Weighted, best: &Candidate, found: &[Found]) -> Vec<Hidden> {
        let limit = |process: Process| -> Option<Hidden> {
            let mut processes = vec![process];
            processes.extend(
                best.processes()
                    .into_iter()
                    .filter(|other| *other != process),
            );
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
            of_kind(found, process).is_none() && !floor && process != Process::RateRamp
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

/// The processes that are there, without what a bandwidth takes away.
fn positive(mixture: &[(Process, f64)]) -> Mixture {
    mixture.iter().copied().filter(|of| of.1 > 0.0).collect()
}

/// By the likelihood and what each process must raise it by.
fn most_likely(candidates: Vec<Candidate>) -> Option<Candidate> {
    let candidates = candidates.into_iter();
    candidates.min_by(|a, b| a.score().total_cmp(&b.score()))
}

/// A fit's strengths with their σ.
fn found(weighted: &Weighted, mixture: &Mixture) -> Option<Vec<Found>> {
    let covariance = weighted.covariance(mixture)?;
    let sigma = |i: usize| covariance[(i, i)].sqrt();
    let is_there = |&(i, of): &(usize, &(Process, f64))| match of.0 {
        Process::Quantisation => of.1 > SIGNIFICANT.sqrt() * sigma(i),
        _ => true,
    };
    let present = mixture.iter().enumerate().filter(is_there);
    let found = present.map(|(i, &(process, squared))| {
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
