//! The noise of a standing instrument: every axis, and each triad as a whole.

use nalgebra::Vector3;

use super::allan::{Curve, cluster_sizes, overlapping};
use super::identify::{Clusters, Found, Hidden, Identified, mean, of_kind};
use super::process::Process;
use super::standing::Stretch;
use crate::imu::{GaussMarkov, Noise, PerSensor, Sensor};
use crate::run::Run;
use crate::statistics::{SIGMA_OF_MEDIAN, median};

/// Neighbouring samples that differ by more than this many σ are no noise.
const KNOCK: f64 = 8.0;
/// What varies by less than this part of itself is rounding.
const ROUNDING: f64 = 1e-9;

/// What a record's standing shows of its noise.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseAnalysis {
    /// What was examined.
    pub stretch: Stretch,
    /// Length of a sample, s.
    pub period: f64,
    /// Size of one pulse, rad and m/s; zero where samples are no pulses.
    pub pulse: PerSensor<f64>,
    /// Both triads.
    pub triads: PerSensor<TriadNoise>,
}

/// The noise of a triad.
#[derive(Debug, Clone, PartialEq)]
pub struct TriadNoise {
    /// x, y, z.
    pub axes: [AxisNoise; 3],
    /// The mean of the Allan variances of all axes that vary, and what it shows: where they are alike it
    /// sees more than each alone. What all axes show lies within what they show.
    pub mean: AxisNoise,
}

/// The noise of one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisNoise {
    /// Its Allan variance.
    pub curve: Curve,
    /// What it shows; none if samples do not vary at all.
    pub identified: Option<Identified>,
    /// Samples that jump farther than noise does.
    pub knocks: usize,
    /// Whether its samples do not vary but for rounding.
    pub is_constant: bool,
}

/// Noise figures for a run, and where they come from.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseFigures {
    /// As `[imu.noise]` has them.
    pub noise: Noise,
    /// Whether the random walk is a limit only: its slope was not found.
    pub random_walk_is_limit: bool,
    /// Whether the curve does not show the end of the correlation: a longer one would do as well.
    pub correlation_is_open: bool,
}

impl NoiseAnalysis {
    /// Examines a stretch of a run.
    pub fn new(run: &Run, stretch: Stretch) -> Self {
        let period = run.recording.imu.period;
        let sizes = cluster_sizes(stretch.samples.len());
        let clusters = Clusters::new(stretch.samples.len(), period, sizes);
        let triads = PerSensor::from_fn(|sensor| {
            let all = run.recording.imu.of(sensor);
            let samples = all.part(stretch.samples.clone());
            TriadNoise::new(&samples, period, &clusters)
        });
        Self {
            period,
            pulse: run.recording.imu.pulse,
            triads,
            stretch,
        }
    }

    /// Length of what was examined, s.
    pub fn duration(&self) -> f64 {
        self.stretch.samples.len() as f64 * self.period
    }

    /// What a run should state of a triad; none if nothing was found.
    pub fn figures(&self, sensor: Sensor) -> Option<NoiseFigures> {
        self.triads.get(sensor).figures()
    }
}

impl TriadNoise {
    /// Of integrals over samples of `period` s, at rest.
    pub(crate) fn new(samples: &[Vector3<f64>], period: f64, clusters: &Clusters) -> Self {
        let axes = [0, 1, 2].map(|axis| {
            let values = || samples.iter().map(|sample| sample[axis]);
            let curve = overlapping(values(), period, clusters.sizes());
            let is_constant = is_constant(values(), &curve);
            AxisNoise {
                identified: if is_constant {
                    None
                } else {
                    clusters.identify(&[&curve])
                },
                knocks: knocks(values()),
                curve,
                is_constant,
            }
        });
        let varying: Vec<&AxisNoise> = axes.iter().filter(|axis| !axis.is_constant).collect();
        let identified: Option<Vec<&Identified>> = varying
            .iter()
            .map(|axis| axis.identified.as_ref())
            .collect();
        let varying: Vec<&Curve> = varying.iter().map(|axis| &axis.curve).collect();
        let mean = AxisNoise {
            identified: clusters
                .identify(&varying)
                .map(|of| of.within(&identified.unwrap_or_default())),
            knocks: axes.iter().map(|axis| axis.knocks).sum(),
            is_constant: varying.is_empty(),
            curve: if varying.is_empty() {
                axes[0].curve.clone()
            } else {
                mean(&varying)
            },
        };
        Self { axes, mean }
    }

    /// What a run should state of it; none if nothing was found.
    pub fn figures(&self) -> Option<NoiseFigures> {
        let mean = &self.mean;
        let identified = mean.identified.as_ref()?;
        let white = of_kind(&identified.for_filter, Process::RandomWalk);
        let limit = || {
            let mut hidden = identified.hidden.iter();
            hidden.find(|h| h.process == Process::RandomWalk)
        };
        let random_walk = white
            .map(|found| found.strength)
            .or(limit().map(|h| h.limit))?;
        let longest = mean.curve.tau.last().copied().unwrap_or_default();
        let gauss_markov = identified
            .for_filter
            .iter()
            .find_map(|found| match found.process {
                Process::GaussMarkov { correlation_time } => Some(GaussMarkov {
                    sigma: found.strength,
                    correlation_time,
                }),
                _ => None,
            });
        Some(NoiseFigures {
            noise: Noise {
                random_walk,
                gauss_markov,
            },
            random_walk_is_limit: white.is_none(),
            // The hump of its Allan deviation is at 1.89 correlation times.
            correlation_is_open: gauss_markov
                .is_some_and(|gauss_markov| 1.89 * gauss_markov.correlation_time > longest),
        })
    }
}

impl AxisNoise {
    /// The processes found.
    pub fn found(&self) -> &[Found] {
        self.identified.as_ref().map_or(&[], |of| &of.found)
    }

    /// The slopes not found.
    pub fn hidden(&self) -> &[Hidden] {
        self.identified.as_ref().map_or(&[], |of| &of.hidden)
    }

    /// Lowest Allan deviation with its cluster time, if it is not the last: what is read off a curve as
    /// bias instability.
    pub fn minimum(&self) -> Option<(f64, f64)> {
        let Curve { tau, variance } = &self.curve;
        let points = tau.iter().zip(variance);
        let (time, lowest) = points.min_by(|a, b| a.1.total_cmp(b.1))?;
        (tau.last() != Some(time)).then(|| (*time, lowest.sqrt()))
    }
}

/// Whether increments vary by rounding alone.
fn is_constant(values: impl Iterator<Item = f64>, curve: &Curve) -> bool {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, count), v| (sum + v, count + 1));
    let mean = (sum / count.max(1) as f64).abs();
    match (curve.tau.first(), curve.variance.first()) {
        (Some(tau), Some(variance)) => variance.sqrt() * tau <= ROUNDING * mean,
        _ => true,
    }
}

/// How many times neighbouring samples differ by what is no noise.
fn knocks(values: impl Iterator<Item = f64>) -> usize {
    let values: Vec<f64> = values.collect();
    let mut steps: Vec<f64> = values.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let median = median(&mut steps).unwrap_or(0.0);
    // Where most samples are equal the steps are those of quantisation.
    let limit = KNOCK * SIGMA_OF_MEDIAN * median;
    steps
        .iter()
        .filter(|step| median > 0.0 && **step > limit)
        .count()
}
