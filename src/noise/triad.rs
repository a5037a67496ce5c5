//! The noise of each axis of a triad, and of the triad as a whole.

use nalgebra::Vector3;

use super::allan::{Curve, mean, overlapping};
use super::clusters::Clusters;
use super::identify::{Found, Hidden, Identified, of_kind};
use super::process::Process;
use crate::imu::{GaussMarkov, Noise};
use crate::statistics::{SIGMA_OF_MEDIAN, median};

/// A difference of neighbouring samples by more than this many σ counts as a knock.
const KNOCK: f64 = 8.0;
/// Variation below this fraction of the mean is rounding.
const ROUNDING: f64 = 1e-9;
/// Cluster time at which the Allan deviation of a Gauss–Markov process peaks, in correlation times.
const PEAK: f64 = 1.89;

/// The noise of a triad.
#[derive(Debug, Clone, PartialEq)]
pub struct TriadNoise {
    /// Noise of the axes x, y, z.
    pub axes: [AxisNoise; 3],
    /// Noise from the mean Allan variance of all axes that vary. If the axes are alike, the mean shows more processes
    /// than the individual axes. Strengths of processes that are found on all axes are kept within the range of the
    /// axes.
    pub mean: AxisNoise,
}

/// The noise of one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisNoise {
    /// Allan variance of the axis.
    pub curve: Curve,
    /// The identified processes; `None` if the samples do not vary at all.
    pub identified: Option<Identified>,
    /// Number of jumps that are too large to be noise.
    pub knocks: usize,
    /// Whether the samples of the axis vary only by rounding.
    pub is_constant: bool,
}

/// Noise figures for a run, and their origin.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseFigures {
    /// The figures of `[imu.noise]`.
    pub noise: Noise,
    /// Whether the random walk is only an upper limit, because its slope was not found.
    pub random_walk_is_limit: bool,
    /// Whether the correlation time is only a lower limit: the curve does not show the end of the correlation.
    pub correlation_is_open: bool,
}

impl TriadNoise {
    /// Noise of integrals over samples of `period` s, at rest.
    pub fn new(samples: &[Vector3<f64>], period: f64, clusters: &Clusters) -> Self {
        let axes = [0, 1, 2].map(|axis| {
            let values: Vec<f64> = samples.iter().map(|sample| sample[axis]).collect();
            AxisNoise::new(&values, period, clusters)
        });
        let varying = || axes.iter().filter(|axis| !axis.is_constant);
        let curves: Vec<&Curve> = varying().map(|axis| &axis.curve).collect();
        let of_axes: Option<Vec<&Identified>> =
            varying().map(|axis| axis.identified.as_ref()).collect();
        let identified = clusters.identify(&curves);
        let mean = AxisNoise {
            identified: identified.map(|of| within(of, &of_axes.unwrap_or_default())),
            knocks: axes.iter().map(|axis| axis.knocks).sum(),
            is_constant: curves.is_empty(),
            curve: match curves.as_slice() {
                [] => axes[0].curve.clone(),
                curves => mean(curves),
            },
        };
        Self { axes, mean }
    }

    /// Noise figures to state in a run; `None` if no process was found.
    pub fn figures(&self) -> Option<NoiseFigures> {
        let found = &self.mean.identified.as_ref()?.for_filter;
        let white = of_kind(found, Process::RandomWalk).map(|of| of.strength);
        let mut hidden = self.mean.hidden().iter();
        let limit = hidden.find(|of| of.process == Process::RandomWalk);
        let random_walk = white.or(limit.map(|of| of.limit))?;
        let gauss_markov = of_kind(found, Process::MARKOV).and_then(|of| {
            Some(GaussMarkov {
                sigma: of.strength,
                correlation_time: of.process.correlation_time()?,
            })
        });
        let longest = self.mean.curve.tau.last().copied().unwrap_or_default();
        Some(NoiseFigures {
            noise: Noise {
                random_walk,
                gauss_markov,
            },
            random_walk_is_limit: white.is_none(),
            correlation_is_open: gauss_markov
                .is_some_and(|of| PEAK * of.correlation_time > longest),
        })
    }
}

impl AxisNoise {
    fn new(values: &[f64], period: f64, clusters: &Clusters) -> Self {
        let curve = overlapping(values.iter().copied(), period, clusters.sizes());
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        let first = curve.tau.first().zip(curve.variance.first());
        let is_constant =
            first.is_none_or(|(tau, variance)| variance.sqrt() * tau <= ROUNDING * mean.abs());
        Self {
            identified: (!is_constant)
                .then(|| clusters.identify(&[&curve]))
                .flatten(),
            knocks: knocks(values),
            curve,
            is_constant,
        }
    }

    /// The processes found.
    pub fn found(&self) -> &[Found] {
        self.identified.as_ref().map_or(&[], |of| &of.found)
    }

    /// The slopes that were not found.
    pub fn hidden(&self) -> &[Hidden] {
        self.identified.as_ref().map_or(&[], |of| &of.hidden)
    }

    /// Lowest Allan deviation with its cluster time, unless this is the last one; data sheets often quote this value as
    /// bias instability.
    pub fn minimum(&self) -> Option<(f64, f64)> {
        let Curve { tau, variance } = &self.curve;
        let points = tau.iter().zip(variance);
        let (time, lowest) = points.min_by(|a, b| a.1.total_cmp(b.1))?;
        (tau.last() != Some(time)).then(|| (*time, lowest.sqrt()))
    }
}

/// Number of neighbouring samples that differ by more than noise.
fn knocks(values: &[f64]) -> usize {
    let mut steps: Vec<f64> = values.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    // If most samples are equal, the steps are due to quantisation.
    let middle = median(&mut steps).filter(|middle| *middle > 0.0);
    let limit = middle.map_or(f64::INFINITY, |middle| KNOCK * SIGMA_OF_MEDIAN * middle);
    steps.iter().filter(|step| **step > limit).count()
}

/// Result for the mean of several axes, with every process found on all axes. Figures of the mean are kept if they lie
/// within the range of the axes; otherwise they are replaced by the root mean square of the axes. The mean separates
/// processes better, but a process that is found only in the mean makes the other processes weaker.
pub fn within(mut mean: Identified, axes: &[&Identified]) -> Identified {
    if axes.is_empty() {
        return mean;
    }
    hold(&mut mean.found, axes, |of| &of.found);
    hold(&mut mean.for_filter, axes, |of| &of.for_filter);
    let Identified { found, hidden, .. } = &mut mean;
    hidden.retain(|hidden| of_kind(found, hidden.process).is_none());
    mean
}

fn hold(own: &mut Vec<Found>, axes: &[&Identified], found: fn(&Identified) -> &Vec<Found>) {
    for process in Process::SLOPES.into_iter().chain([Process::MARKOV]) {
        let of_axes = axes.iter().map(|axis| of_kind(found(axis), process));
        let Some(of_axes) = of_axes.collect::<Option<Vec<_>>>() else {
            continue;
        };
        let is_between = |own: &Found, value: fn(&Found) -> f64| {
            let mut values = of_axes.iter().map(|of| value(of));
            values.clone().any(|of| of <= value(own)) && values.any(|of| of >= value(own))
        };
        match own.iter_mut().find(|of| of.process.same_kind(process)) {
            Some(of) if is_between(of, |of| of.strength) && is_between(of, time) => {}
            Some(of) => *of = root_mean_square(&of_axes, process),
            None => own.push(root_mean_square(&of_axes, process)),
        }
    }
}

/// Correlation time, s; zero if it has none.
fn time(of: &Found) -> f64 {
    of.process.correlation_time().unwrap_or_default()
}

/// Root of the mean square of the strengths, geometric mean of the correlation times; axes are independent.
fn root_mean_square(axes: &[&Found], process: Process) -> Found {
    let count = axes.len() as f64;
    let strength = (axes.iter().map(|of| of.strength.powi(2)).sum::<f64>() / count).sqrt();
    let squares = axes.iter().map(|of| (of.strength * of.sigma).powi(2));
    let log_time = axes.iter().map(|of| time(of).ln()).sum::<f64>() / count;
    let of_times = axes.iter().map(|of| Some(of.sigma_log_time?.powi(2)));
    Found {
        // Computed at one second, as an example of any cluster time.
        process: process.stretched(log_time.exp()),
        strength,
        sigma: squares.sum::<f64>().sqrt() / (count * strength),
        sigma_log_time: of_times.sum::<Option<f64>>().map(|sum| sum.sqrt() / count),
    }
}
