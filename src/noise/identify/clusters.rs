//! The cluster times of a record, and the mean of several curves over them.

use std::sync::OnceLock;

use nalgebra::DMatrix;

use super::super::allan::Curve;
use super::super::covariance::Covariance;
use super::super::process::Process;
use super::Identified;
use super::search::Search;

/// Correlation times tried in an octave.
const PER_OCTAVE: f64 = 2.0;
/// The shortest correlation time tried, in samples. What is correlated over less than an order of magnitude
/// more than a sample is the bandwidth of white noise, and white to whoever integrates it.
const SHORTEST: f64 = 10.0;
/// The shortest one, in cluster times that are explained: shorter ones are not told from white noise.
const TOLD: f64 = 2.0;
/// Where something has to be left out, a start less probable than this is taken only if no later one is more
/// so: one too late costs little, one too early is wrong.
const DOUBTFUL: f64 = 0.05;
/// Cluster times left out in a step: an octave.
const STEP: usize = 2;

/// A record's cluster times, with what the covariance of its Allan variances needs.
pub struct Clusters {
    samples: usize,
    period: f64,
    sizes: Vec<usize>,
    slopes: Covariance,
    /// With Gauss–Markov processes of growing correlation times.
    markov: OnceLock<Vec<(f64, Covariance)>>,
}

impl Clusters {
    /// For a record of so many samples of `period` s.
    pub fn new(samples: usize, period: f64, sizes: Vec<usize>) -> Self {
        let slopes = Covariance::new(samples, period, &sizes, &Process::SLOPES[..4]);
        Self {
            samples,
            period,
            sizes,
            slopes,
            markov: OnceLock::new(),
        }
    }

    /// Lengths in samples.
    pub fn sizes(&self) -> &[usize] {
        &self.sizes
    }

    /// What the mean of some curves over these clusters shows; `None` if they are of others, too short or
    /// zero somewhere. Axes that are averaged count as independent.
    ///
    /// Pulses coarser than the noise and the bandwidth of a sensor make the deviations at short cluster
    /// times, and no process describes them: where none does, the shortest ones are left out, up to half of
    /// all, and one octave more, for what is left of them just below notice. What no start helps is taken as
    /// it is, with a misfit.
    pub fn identify(&self, curves: &[&Curve]) -> Option<Identified> {
        let varies = |v: &f64| v.is_finite() && *v > 0.0;
        let curve = mean(curves);
        if curves.iter().any(|c| c.variance.len() != self.sizes.len())
            || curve.tau.len() < 2
            || !curve.variance.iter().all(varies)
        {
            return None;
        }
        let shares = shares(curves);
        let from = |first: usize| Search::new(self, first, &shares, &curve);
        let mut sound = None;
        for first in (0..=curve.tau.len() / 2).step_by(STEP) {
            match from(first).probable() {
                Some((found, probability)) if first == 0 || probability > DOUBTFUL => {
                    sound = Some(found);
                    break;
                }
                Some((found, _)) => sound = sound.or(Some(found)),
                None => {}
            }
        }
        let Some(sound) = sound else {
            return from(0).with_misfit();
        };
        let further = (sound.first > 0).then(|| from(sound.first + STEP).probable());
        Some(further.flatten().map_or(sound, |(found, _)| found))
    }

    /// How the points of one curve vary together under a mixture.
    pub(super) fn covariance(&self, mixture: &[(Process, f64)]) -> DMatrix<f64> {
        let time = mixture.iter().find_map(|(process, _)| match process {
            Process::GaussMarkov { correlation_time } => Some(correlation_time.ln()),
            _ => None,
        });
        let Some(time) = time else {
            return self.slopes.under(mixture);
        };
        let apart = |tables: &&(f64, Covariance)| (tables.0.ln() - time).abs();
        let nearest = self
            .markov()
            .iter()
            .min_by(|a, b| apart(a).total_cmp(&apart(b)));
        nearest
            .map_or(&self.slopes, |(_, tables)| tables)
            .under(mixture)
    }

    /// The shortest correlation time where cluster times from this one on are explained, both in s.
    pub(super) fn shortest_time(&self, shortest: f64) -> f64 {
        (SHORTEST * self.period).max(TOLD * shortest)
    }

    /// Correlation times to be tried there.
    pub(super) fn correlation_times(&self, shortest: f64) -> impl Iterator<Item = f64> {
        let times = self.markov().iter().map(|(time, _)| *time);
        times.filter(move |&time| time >= self.shortest_time(shortest))
    }

    fn markov(&self) -> &[(f64, Covariance)] {
        self.markov.get_or_init(|| {
            let longest = self.sizes.last().copied().unwrap_or(0) as f64;
            let steps = (PER_OCTAVE * (longest / SHORTEST).log2()).floor() as i32;
            (0..=steps)
                .map(|step| {
                    let size = SHORTEST * 2f64.powf(f64::from(step) / PER_OCTAVE);
                    let correlation_time = size * self.period;
                    let processes = [
                        Process::Quantisation,
                        Process::RandomWalk,
                        Process::RateRandomWalk,
                        Process::GaussMarkov { correlation_time },
                    ];
                    let tables =
                        Covariance::new(self.samples, self.period, &self.sizes, &processes);
                    (correlation_time, tables)
                })
                .collect()
        })
    }
}

/// The mean of curves at the same cluster times.
pub(in crate::noise) fn mean(curves: &[&Curve]) -> Curve {
    let mut variance = Vec::new();
    let tau = curves
        .first()
        .map_or_else(Vec::new, |first| first.tau.clone());
    for point in 0..tau.len() {
        let sum: f64 = curves.iter().map(|curve| curve.variance[point]).sum();
        variance.push(sum / curves.len() as f64);
    }
    Curve { tau, variance }
}

/// As how many equal ones the averaged curves count at each cluster time.
fn shares(curves: &[&Curve]) -> Vec<f64> {
    let points = curves.iter().map(|curve| curve.variance.len()).min();
    (0..points.unwrap_or(0))
        .map(|point| {
            let at = || curves.iter().map(|curve| curve.variance[point]);
            let (sum, squares) = (at().sum::<f64>(), at().map(|v| v * v).sum::<f64>());
            if squares > 0.0 {
                sum * sum / squares
            } else {
                1.0
            }
        })
        .collect()
}
