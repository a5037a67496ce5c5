//! How Allan variances at different cluster times vary together, under a mixture of processes.
//!
//! An overlapping Allan variance is a mean of squared second differences `D`; for Gaussian noise
//! `cov(⟨D₁²⟩, ⟨D₂²⟩) = 2 Σ cov(D₁, D₂)²` over all pairs of places. With strengths squared `c_p` that is
//! quadratic in c, so one table for each pair of processes serves every mixture. Source: Greenhall,
//! Riley, *Uncertainty of Stability Variances Based on Finite Differences*, PTTI 2003, which does so for
//! one process and one cluster time: their equivalent degrees of freedom (NIST SP 1065, 5.4.1) are
//! `2 σ⁴ / var σ²`.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::process::Process;

/// Weights of a second difference.
const WEIGHTS: [f64; 3] = [1.0, -2.0, 1.0];
/// Near the ends and the middle of a cluster, lags are taken in steps of this part of the shorter one.
const STEPS: usize = 16;
/// Further away each step is longer than the one before by this factor.
const GROWTH: f64 = 1.1;

/// The tables for one record, for every pair of cluster times.
pub(super) struct Covariance {
    processes: Vec<Process>,
    tau: Vec<f64>,
    /// By pair of cluster times, the shorter first.
    pairs: Vec<Pair>,
}

struct Pair {
    index: (usize, usize),
    /// Σ R_p R_q over the products of processes, row by row.
    products: Vec<f64>,
    /// Σ R_p.
    sums: Vec<f64>,
    /// Products of counts and of τ²: what both are divided by.
    scale: f64,
}

impl Covariance {
    /// For a record of so many samples of `period` s.
    pub fn new(samples: usize, period: f64, sizes: &[usize], processes: &[Process]) -> Self {
        let indices: Vec<(usize, usize)> = (0..sizes.len())
            .flat_map(|j| (0..=j).map(move |i| (i, j)))
            .collect();
        let pairs = indices
            .into_par_iter()
            .map(|(i, j)| Pair::new((i, j), samples, period, (sizes[i], sizes[j]), processes))
            .collect();
        Self {
            processes: processes.to_vec(),
            tau: sizes.iter().map(|&size| size as f64 * period).collect(),
            pairs,
        }
    }

    /// The covariance of all Allan variances under a mixture of these strengths squared. Any correlation
    /// time counts as that of the tables.
    pub fn under(&self, mixture: &[(Process, f64)]) -> DMatrix<f64> {
        let strength = |wanted: &Process| {
            let found = mixture
                .iter()
                .find(|(process, _)| process.same_kind(*wanted));
            found.map_or(0.0, |(_, strength)| *strength)
        };
        let strengths: Vec<f64> = self.processes.iter().map(strength).collect();
        let ramp = strength(&Process::RateRamp);
        let count = strengths.len();
        let mut matrix = DMatrix::zeros(self.tau.len(), self.tau.len());
        for pair in &self.pairs {
            let (i, j) = pair.index;
            let mut random = 0.0;
            let mut with_ramp = 0.0;
            for p in 0..count {
                with_ramp += strengths[p] * pair.sums[p];
                for q in 0..count {
                    random += strengths[p] * strengths[q] * pair.products[p * count + q];
                }
            }
            // A ramp makes every second difference R τ².
            let means = ramp * (self.tau[i] * self.tau[j]).powi(2);
            let covariance = (2.0 * random + 4.0 * means * with_ramp) / pair.scale;
            matrix[(i, j)] = covariance;
            matrix[(j, i)] = covariance;
        }
        matrix
    }
}

impl Pair {
    fn new(
        index: (usize, usize),
        samples: usize,
        period: f64,
        (short, long): (usize, usize),
        processes: &[Process],
    ) -> Self {
        let places = |size: usize| (samples + 1).saturating_sub(2 * size) as i64;
        let (first, second) = (places(short), places(long));
        // Pairs of places that are so many samples apart.
        let common = |lag: i64| (first.min(second + lag) - lag.max(0)).max(0) as f64;
        let (m, n) = (short as i64, long as i64);
        let crossing = |process: Process, lag: i64| -> f64 {
            let mut sum = 0.0;
            for (a, wa) in (0..).zip(WEIGHTS) {
                for (b, wb) in (0..).zip(WEIGHTS) {
                    let apart = (lag + a * m - b * n) as f64 * period;
                    sum += wa * wb * process.autocovariance(apart);
                }
            }
            sum
        };
        let count = processes.len();
        let mut products = vec![0.0; count * count];
        let mut sums = vec![0.0; count];
        let mut add = |weight: f64, values: &[f64]| {
            for p in 0..count {
                sums[p] += weight * values[p];
                for q in 0..count {
                    products[p * count + q] += weight * values[p] * values[q];
                }
            }
        };
        let mut values = vec![0.0; count];
        for (lag, steps) in graded_lags(m, n) {
            let weight = common(lag) * steps;
            if weight > 0.0 {
                for (value, &process) in values.iter_mut().zip(processes) {
                    *value = crossing(process, lag);
                }
                add(weight, &values);
            }
        }
        // Quantisation has its covariance at single lags, so it is not stepped over.
        if let Some(q) = processes.iter().position(|p| *p == Process::Quantisation) {
            let mut spikes: Vec<(i64, f64)> = Vec::new();
            for (a, wa) in (0..).zip(WEIGHTS) {
                for (b, wb) in (0..).zip(WEIGHTS) {
                    let lag = b * n - a * m;
                    match spikes.iter_mut().find(|spike| spike.0 == lag) {
                        Some(spike) => spike.1 += wa * wb,
                        None => spikes.push((lag, wa * wb)),
                    }
                }
            }
            for (lag, spike) in spikes {
                let weight = common(lag) * spike;
                sums[q] += weight;
                products[q * count + q] += weight * spike;
                for (p, &process) in processes.iter().enumerate().filter(|(p, _)| *p != q) {
                    let cross = weight * crossing(process, lag);
                    products[p * count + q] += cross;
                    products[q * count + p] += cross;
                }
            }
        }
        let tau = |size: usize| size as f64 * period;
        Self {
            index,
            products,
            sums,
            scale: 4.0 * (tau(short) * tau(long)).powi(2) * (first * second) as f64,
        }
    }
}

/// Lags at which a sum over all lags is taken, with how many lags each stands for: dense where second
/// differences over clusters of `short` and `long` samples have a corner in common, sparse elsewhere, and
/// every lag once where clusters are short.
fn graded_lags(short: i64, long: i64) -> Vec<(i64, f64)> {
    let step = (short / STEPS as i64).max(1);
    let reach = 2 * (short + long);
    let mut lags = Vec::new();
    for corner in [0, long, 2 * long].map(|corner| corner - short) {
        let (mut distance, mut stride) = (0, step);
        while distance <= 2 * reach {
            lags.extend([corner - distance, corner + distance]);
            if distance >= 2 * short {
                stride = (stride as f64 * GROWTH).ceil() as i64;
            }
            distance += stride;
        }
    }
    lags.retain(|lag| (-reach..=reach).contains(lag));
    lags.sort_unstable();
    lags.dedup();
    let gap = |i: usize| lags.get(i + 1).map_or(1.0, |next| (next - lags[i]) as f64);
    (0..lags.len())
        .map(|i| {
            let before = if i == 0 { 1.0 } else { gap(i - 1) };
            (lags[i], 0.5 * (before + gap(i)))
        })
        .collect()
}
