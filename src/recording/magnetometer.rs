//! Magnetometer of a recording: means over short spans, with its own clock and rate.

use std::ops::Range;

use nalgebra::Vector3;

use crate::magnetic::LocalField;
use crate::statistics::{correlation_factor, median};

/// Length of a span, s.
const SPAN: f64 = 0.1;
/// Nominal counts per tesla: ten per microtesla, as of most chips within a factor of ten.
pub const MAGNETIC_COUNT: f64 = 1e7;
/// Smallest 1σ of a mean, T, below that of any magnetometer of an IMU.
const FLOOR: f64 = 1e-11;
/// Prior weight of the common variance in that of one dwell, in degrees of freedom.
const FREEDOM: f64 = 6.0;
/// Longest correlation that is looked for, in spans.
const LAGS: usize = 20;

/// Output of a magnetometer.
#[derive(Debug, Clone, PartialEq)]
pub struct Magnetometer {
    /// The file's quantity, such as `uT`.
    pub unit: String,
    /// Quantity of the file for one tesla.
    pub nominal: f64,
    /// The field at place and date of the recording, from a model; `None` if one of them is not stated.
    pub field: Option<LocalField>,
    /// Stated 1σ of the disturbance of the field in a dwell, T; zero if not stated.
    pub disturbance: f64,
    /// Step of the values on each axis, T; zero if they have none.
    pub step: Vector3<f64>,
    /// Whether the times of the values are known; otherwise, they are numbers of rows.
    pub has_times: bool,
    /// Start of the first span and length of each, s.
    start: f64,
    length: f64,
    spans: Vec<Span>,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Span {
    /// Sum of the values, T.
    sum: Vector3<f64>,
    count: u32,
}

/// White noise of the spans in dwells, and its correlation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MagneticNoise {
    /// Variance of the mean of a span, T².
    variance: Vector3<f64>,
    /// Factor by which correlation increases the variance of a long mean.
    correlation: f64,
}

/// Mean output over a time at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MagneticMean {
    /// Mean, T.
    pub output: Vector3<f64>,
    /// 1σ of the mean on each axis, T.
    pub sigma: Vector3<f64>,
}

impl MagneticMean {
    /// Centre of some outputs and their RMS distance from it, T; `None` if they are one point or beyond all numbers.
    pub fn scatter(of: impl Iterator<Item = Self> + Clone) -> Option<(Vector3<f64>, f64)> {
        let count = of.clone().count() as f64;
        let centre = of.clone().map(|of| of.output).sum::<Vector3<f64>>() / count;
        let squares = of.map(|of| (of.output - centre).norm_squared());
        let size = (squares.sum::<f64>() / count).sqrt();
        size.is_normal().then_some((centre, size))
    }
}

impl Magnetometer {
    /// A magnetometer without values.
    pub fn new(unit: &str, nominal: f64) -> Self {
        Self {
            unit: unit.to_owned(),
            nominal,
            field: None,
            disturbance: 0.0,
            step: Vector3::zeros(),
            has_times: true,
            start: 0.0,
            length: SPAN,
            spans: Vec::new(),
        }
    }

    /// Adds a value in the file's quantity; a value that is earlier than the first or far after the last is ignored.
    pub fn push(&mut self, time: f64, value: Vector3<f64>) {
        if self.spans.is_empty() {
            self.start = time;
        }
        let span = ((time - self.start) / self.length + 1e-6).floor();
        let longest = self.spans.len() as f64 + 86_400.0 / self.length;
        if !(0.0..=longest).contains(&span) || !value.iter().all(|v| v.is_finite()) {
            return;
        }
        let span = span as usize;
        if self.spans.len() <= span {
            self.spans.resize(span + 1, Span::default());
        }
        self.spans[span].sum += value / self.nominal;
        self.spans[span].count += 1;
    }

    /// Sets the length of a span, s, before the first value.
    pub fn in_spans_of(&mut self, length: f64) {
        self.length = length;
    }

    /// Stretches the clock by a factor.
    pub fn slower(&mut self, factor: f64) {
        self.start *= factor;
        self.length *= factor;
    }

    /// Middle of each span that has values, s, and their mean in the file's quantity.
    pub fn values(&self) -> impl Iterator<Item = (f64, Vector3<f64>)> + '_ {
        let mean = |span: &Span| span.sum / f64::from(span.count) * self.nominal;
        self.times().map(move |(time, span)| (time, mean(span)))
    }

    fn times(&self) -> impl Iterator<Item = (f64, &Span)> {
        let middle = |k: usize| self.start + (k as f64 + 0.5) * self.length;
        let spans = self.spans.iter().enumerate().filter(|(_, of)| of.count > 0);
        spans.map(move |(k, span)| (middle(k), span))
    }

    /// Means of the spans that lie within a time, s.
    fn means(&self, time: &Range<f64>) -> Vec<Vector3<f64>> {
        let first = ((time.start - self.start) / self.length - 1e-6)
            .ceil()
            .max(0.0) as usize;
        let end = ((time.end - self.start) / self.length + 1e-6)
            .floor()
            .max(0.0) as usize;
        let spans = self.spans.get(first..end.min(self.spans.len()));
        let known = spans
            .unwrap_or_default()
            .iter()
            .filter(|span| span.count > 0);
        known.map(|span| span.sum / f64::from(span.count)).collect()
    }

    /// Noise in these dwells: the median variance, and the correlation of all.
    pub fn noise(&self, dwells: impl Iterator<Item = Range<f64>>) -> MagneticNoise {
        let mut variances = [(); 3].map(|()| Vec::new());
        let (mut products, mut pairs) = ([0.0; LAGS], 0);
        for time in dwells {
            let means = self.means(&time);
            let (mean, variance) = moments(&means);
            if means.len() < 3 {
                continue;
            }
            pairs += 3 * means.len();
            for axis in 0..3 {
                variances[axis].push(variance[axis]);
                // A dwell with motion must not hide the correlation of the others.
                let unit = variance[axis].max(FLOOR.powi(2)) * (means.len() - 1) as f64;
                let off: Vec<f64> = means.iter().map(|of| of[axis] - mean[axis]).collect();
                for (lag, sum) in products.iter_mut().enumerate().take(off.len()) {
                    let pairs = off.iter().zip(&off[lag..]);
                    *sum += pairs.map(|(a, b)| a * b).sum::<f64>() / unit;
                }
            }
        }
        let correlations = products[1..].iter().map(|sum| sum / products[0]);
        MagneticNoise {
            variance: Vector3::from(variances.map(|mut of| median(&mut of).unwrap_or(0.0))),
            correlation: correlation_factor(correlations, pairs),
        }
    }

    /// Mean output over a time at rest, s; `None` without values.
    pub fn mean(&self, time: &Range<f64>, noise: &MagneticNoise) -> Option<MagneticMean> {
        let means = self.means(time);
        let (output, own) = moments(&means);
        let count = means.len() as f64;
        let of_mean = |axis: usize| {
            let known = (count - 1.0).max(0.0);
            let sum = FREEDOM * noise.variance[axis] + known * own[axis];
            // The mean of the inverse gamma distribution of the variance.
            let variance = sum / (FREEDOM + known - 2.0);
            let rounding = rounding(self.step[axis], variance);
            // The mean of a correlated series hides a part of its variance.
            let correlation = noise.correlation.min(0.5 * (count + 1.0));
            let hidden = ((count - 1.0) / (count - correlation)).max(1.0);
            let of_noise = variance * hidden * correlation / count;
            (of_noise + rounding + FLOOR.powi(2)).sqrt()
        };
        (!means.is_empty()).then(|| MagneticMean {
            output,
            sigma: Vector3::from_fn(|axis, _| of_mean(axis)),
        })
    }
}

/// Mean and variance on each axis.
fn moments(values: &[Vector3<f64>]) -> (Vector3<f64>, Vector3<f64>) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<Vector3<f64>>() / count.max(1.0);
    let squares = values.iter().map(|value| (value - mean).map(|of| of * of));
    (mean, squares.sum::<Vector3<f64>>() / (count - 1.0).max(1.0))
}

/// Variance of the rounding error that remains in a mean of values with this step and scatter (Widrow and Kollár,
/// *Quantization Noise*, 2008).
fn rounding(step: f64, variance: f64) -> f64 {
    if step == 0.0 {
        return 0.0;
    }
    let harmonic = |k: f64| {
        let exponent = -4.0 * (std::f64::consts::PI * k / step).powi(2) * variance;
        exponent.exp() / (k * k)
    };
    let sum: f64 = [1.0, 2.0, 3.0, 4.0].map(harmonic).iter().sum();
    0.5 * (step / std::f64::consts::PI).powi(2) * sum
}

#[cfg(test)]
mod tests;
