//! The cluster times of a recording, and the covariance of the Allan variances at these times for a mixture of
//! processes.
//!
//! An overlapping Allan variance is a mean of squared second differences `D`; for Gaussian noise `cov(⟨D₁²⟩, ⟨D₂²⟩) = 2
//! Σ cov(D₁, D₂)²` over all pairs of positions. This covariance is quadratic in the squared strengths `c_p`, so one
//! table for each pair of processes serves every mixture. Source: Greenhall, Riley, *Uncertainty of Stability Variances
//! Based on Finite Differences*, PTTI 2003 (for one process and one cluster time); their equivalent degrees of freedom
//! (NIST SP 1065, 5.4.1) are `2 σ⁴ / var σ²`.

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::allan::cluster_sizes;
use super::process::Process;

/// Weights of a second difference.
const WEIGHTS: [f64; 3] = [1.0, -2.0, 1.0];
/// Near the ends and the middle of a cluster, lags are spaced by the shorter cluster divided by this number.
const STEPS: i64 = 16;
/// Farther away, each step is longer than the previous one by this factor.
const GROWTH: f64 = 1.1;
/// Correlation times tried per octave.
const PER_OCTAVE: f64 = 2.0;
/// The shortest correlation time tried, in samples. Noise with a shorter correlation is band-limited white noise, and
/// acts as white noise when it is integrated.
const SHORTEST: f64 = 10.0;
/// The shortest correlation time, in multiples of the shortest cluster time used: below it, the process is
/// indistinguishable from white noise.
const DISTINCT: f64 = 2.0;

/// The cluster times of a recording, with tables for the covariance of its Allan variances.
pub struct Clusters {
    period: f64,
    sizes: Vec<usize>,
    /// The slopes, quantisation first, and Gauss–Markov processes of growing correlation times.
    processes: Vec<Process>,
    tables: Vec<Table>,
}

impl Clusters {
    /// Cluster times for a recording of this many samples of `period` s.
    pub fn new(samples: usize, period: f64) -> Self {
        let sizes = cluster_sizes(samples);
        let longest = sizes.last().copied().unwrap_or(0) as f64;
        let steps = (PER_OCTAVE * (longest / SHORTEST).log2()).floor() as i32;
        let markov = (0..=steps).map(|step| Process::GaussMarkov {
            correlation_time: SHORTEST * 2f64.powf(f64::from(step) / PER_OCTAVE) * period,
        });
        let processes: Vec<Process> = Process::SLOPES.into_iter().chain(markov).collect();
        let pairs: Vec<(usize, usize)> = (0..sizes.len())
            .flat_map(|j| (0..=j).map(move |i| (i, j)))
            .collect();
        let table = |(i, j)| Table {
            pair: (i, j),
            products: products(samples, period, (sizes[i], sizes[j]), &processes),
        };
        Self {
            tables: pairs.into_par_iter().map(table).collect(),
            period,
            sizes,
            processes,
        }
    }

    /// Lengths in samples.
    pub fn sizes(&self) -> &[usize] {
        &self.sizes
    }

    /// The covariance of the points of one curve for a mixture of processes with these squared strengths. A correlation
    /// time is replaced by the nearest one for which there is a table.
    pub fn covariance(&self, mixture: &[(Process, f64)]) -> DMatrix<f64> {
        let log_time = |of: &Process| of.correlation_time().map_or(0.0, f64::ln);
        let table = |process: Process| {
            let apart = |other: &Process| (log_time(other) - log_time(&process)).abs();
            let tables = self.processes.iter().enumerate();
            tables
                .filter(|(_, other)| other.same_kind(process))
                .min_by(|a, b| apart(a.1).total_cmp(&apart(b.1)))
        };
        let strengths: Vec<(usize, f64)> = mixture
            .iter()
            .filter_map(|&(process, strength)| Some((table(process)?.0, strength)))
            .collect();
        let count = self.sizes.len();
        let mut covariance = DMatrix::zeros(count, count);
        for Table { pair, products } in &self.tables {
            let with = |&(p, strength): &(usize, f64)| {
                let of = |&(q, other): &(usize, f64)| other * products[(p, q)];
                strength * strengths.iter().map(of).sum::<f64>()
            };
            covariance[*pair] = strengths.iter().map(with).sum();
        }
        covariance.fill_lower_triangle_with_upper_triangle();
        covariance
    }

    /// The shortest correlation time to try, in s, if the fit starts at this cluster time, in s.
    pub fn shortest_time(&self, shortest: f64) -> f64 {
        (SHORTEST * self.period).max(DISTINCT * shortest)
    }

    /// Gauss–Markov processes to try in a fit that starts at this cluster time.
    pub fn markov(&self, shortest: f64) -> impl Iterator<Item = Process> {
        let is_distinct = move |time: f64| time >= self.shortest_time(shortest);
        let processes = self.processes.iter().copied();
        processes.filter(move |of| of.correlation_time().is_some_and(is_distinct))
    }
}

/// Covariances of the Allan variances at a pair of cluster times, the shorter first, for each product of two
/// processes of unit strength.
struct Table {
    pair: (usize, usize),
    products: DMatrix<f64>,
}

/// `2 Σ R_p R_q` over all pairs of positions, for clusters of `short` and `long` samples.
fn products(
    samples: usize,
    period: f64,
    (short, long): (usize, usize),
    processes: &[Process],
) -> DMatrix<f64> {
    let (m, n) = (short as i64, long as i64);
    let places = |size: i64| (samples as i64 + 1 - 2 * size).max(0);
    let (first, second) = (places(m), places(n));
    // Number of pairs of positions that are this many samples apart.
    let common = |lag: i64| (first.min(second + lag) - lag.max(0)).max(0) as f64;
    // Lags at which a corner of one second difference meets a corner of the other.
    let corners: [(i64, f64); 9] = std::array::from_fn(|k| {
        let (a, b) = (k / 3, k % 3);
        (b as i64 * n - a as i64 * m, WEIGHTS[a] * WEIGHTS[b])
    });
    let squares = (short as f64 * period * (long as f64 * period)).powi(2);
    let crossing = |process: &Process, lag: i64| -> f64 {
        let apart = |corner: i64| (lag - corner) as f64 * period;
        let part = |&(corner, weight): &(i64, f64)| weight * process.autocovariance(apart(corner));
        match process {
            // Every second difference is R τ²: `cov(D₁², D₂²) = 2 cov(D₁, D₂)² + 4 ⟨D₁⟩ ⟨D₂⟩ cov(D₁, D₂)`.
            Process::RateRamp => squares,
            _ => corners.iter().map(part).sum(),
        }
    };
    let mut lags = graded_lags(m, n);
    for (corner, _) in corners {
        lags.entry(corner).or_insert(0.0);
    }
    let mut products = DMatrix::zeros(processes.len(), processes.len());
    for (lag, steps) in lags.into_iter().filter(|&(lag, _)| common(lag) > 0.0) {
        let values: Vec<f64> = processes.iter().map(|of| crossing(of, lag)).collect();
        for (p, value) in values.iter().enumerate() {
            for (q, other) in values[..=p].iter().enumerate() {
                // Quantisation has covariance only at the corners, each of which is a separate lag.
                let steps = if processes[q] == Process::Quantisation {
                    1.0
                } else {
                    steps
                };
                products[(p, q)] += common(lag) * steps * value * other;
            }
        }
    }
    // A ramp alone does not vary.
    for ramp in (0..processes.len()).filter(|&p| processes[p] == Process::RateRamp) {
        products[(ramp, ramp)] = 0.0;
    }
    products.fill_upper_triangle_with_lower_triangle();
    products / (2.0 * squares * (first * second) as f64)
}

/// Lags that approximate a sum over all lags, each with the number of lags that it represents: dense where second
/// differences over clusters of `short` and `long` samples have a common corner, sparse elsewhere; if clusters are
/// short, every lag once.
fn graded_lags(short: i64, long: i64) -> BTreeMap<i64, f64> {
    let reach = 2 * (short + long);
    let mut lags = Vec::new();
    for corner in [0, long, 2 * long].map(|corner| corner - short) {
        let (mut distance, mut stride) = (0, (short / STEPS).max(1));
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
