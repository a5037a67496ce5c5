//! The instrument's samples.

use std::ops::Range;

use nalgebra::Vector3;
use thiserror::Error;

use super::{Bridge, Fault, FaultKind, LogFacts, Series, Temperature};
use crate::imu::{Output, PerSensor, Sensor};

/// The samples of both triads, with one sample period, in one or several stretches.
#[derive(Debug, Clone, PartialEq)]
pub struct ImuSamples {
    /// Length of every sample, s.
    pub period: f64,
    /// Relative 1σ of the sample length; zero if a clock determines it.
    pub period_sigma: f64,
    /// Stretches of consecutive samples, in order; there is at least one. Between two stretches at least one sample is
    /// lost.
    pub stretches: Vec<Stretch>,
    /// Whether samples are consecutive in time; if not, they are concatenated sections, and only a labelled section or
    /// a dwell is continuous.
    pub continuous: bool,
    /// Integrals of the normalised gyro output over each sample, rad.
    pub gyro: Series,
    /// Integrals of the normalised accelerometer output over each sample, m/s.
    pub accel: Series,
    /// Size of one pulse, rad and m/s, if samples are whole pulses; zero otherwise.
    pub pulse: PerSensor<f64>,
    /// Faults of the samples in the file, in order of kind, axis and time.
    pub faults: Vec<Fault>,
    /// Interpolated samples, grouped by axes, in order of time; bridges of one axis do not
    /// overlap.
    pub bridges: Vec<Bridge>,
    /// The instrument's temperature during the recording, if known.
    pub temperature: Option<Temperature>,
    /// Statistics of the file; `None` for simulated samples.
    pub log: Option<LogFacts>,
}

/// Fewest samples of a recording; with fewer samples, dwells and turns cannot be distinguished.
pub const FEWEST_SAMPLES: usize = 100;

impl ImuSamples {
    /// Whether each sample is the mean output in one position, as in a table of the mean outputs in six positions.
    pub fn is_of_means(&self) -> bool {
        !self.continuous && self.len() < FEWEST_SAMPLES
    }

    /// Whether a triad was recorded; if not, its samples are zeros.
    pub fn has(&self, sensor: Sensor) -> bool {
        let is_named = |log: &LogFacts| !log.named.triads.get(sensor)[0].name.is_empty();
        self.log.as_ref().is_none_or(is_named)
    }
}

/// Samples without a break.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// The samples.
    pub samples: Range<usize>,
    /// Start time of the first sample, s.
    pub start: f64,
}

/// Errors in arrays of samples.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SampleError {
    /// The triads have different numbers of samples.
    #[error("{gyro} gyro samples but {accel} accelerometer samples; give one of each per period")]
    Lengths {
        /// Samples of the gyros.
        gyro: usize,
        /// Samples of the accelerometers.
        accel: usize,
    },
    /// No samples.
    #[error("no samples; give the output integrated over each period")]
    Empty,
    /// A number is not finite.
    #[error("sample {sample} is not finite; remove it, or split the recording there")]
    NotFinite {
        /// The first sample that contains a non-finite number.
        sample: usize,
    },
    /// An invalid period.
    #[error("the period is {period} s; give a sample period above zero, in s")]
    Period {
        /// The period, s.
        period: f64,
    },
}

impl ImuSamples {
    /// Increments of one triad's output.
    pub fn of(&self, sensor: Sensor) -> &Series {
        sensor.pick(&self.gyro, &self.accel)
    }

    /// Whether the samples are packed, as in long recordings.
    pub fn is_packed(&self) -> bool {
        self.gyro.is_packed()
    }

    /// Resolution of rates along body axes, rad/s or m/s²; zero if not rounded, or if rows are integrals, which may
    /// carry the remainder.
    pub fn resolution(&self, sensor: Sensor) -> Vector3<f64> {
        // Means of positions are few, so their steps are not those of rounding.
        let is_rounded = self.has(sensor) && !self.is_of_means();
        let of_rates = |log: &&LogFacts| is_rounded && log.output == Output::Rate;
        let Some(log) = self.log.as_ref().filter(of_rates) else {
            return Vector3::zeros();
        };
        let columns = log.columns.get(sensor);
        Vector3::from_fn(|axis, _| columns[axis].step_rate(self.period).unwrap_or(0.0))
    }

    /// Consecutive samples without a gap; the first begins at `start`, s.
    ///
    /// # Errors
    /// Returns [`SampleError`], as in [`super::Recording::from_samples`].
    pub fn new(
        start: f64,
        period: f64,
        gyro: impl Into<Series>,
        accel: impl Into<Series>,
    ) -> Result<Self, SampleError> {
        let (gyro, accel) = (gyro.into(), accel.into());
        if gyro.len() != accel.len() {
            return Err(SampleError::Lengths {
                gyro: gyro.len(),
                accel: accel.len(),
            });
        }
        if gyro.is_empty() {
            return Err(SampleError::Empty);
        }
        if !(period > 0.0 && period.is_finite() && start.is_finite()) {
            return Err(SampleError::Period { period });
        }
        let finite = |v: Vector3<f64>| v.iter().all(|x| x.is_finite());
        let not_finite = gyro
            .iter()
            .zip(accel.iter())
            .position(|(rate, force)| !(finite(rate) && finite(force)));
        if let Some(sample) = not_finite {
            return Err(SampleError::NotFinite { sample });
        }
        Ok(Self::made(start, period, gyro, accel))
    }

    /// A copy of samples of rates, with another sample period that has this relative 1σ.
    pub fn with_period(mut self, period: f64, sigma: f64) -> Self {
        let longer = period / self.period;
        for triad in [&mut self.gyro, &mut self.accel] {
            triad
                .to_mut()
                .iter_mut()
                .for_each(|sample| *sample *= longer);
        }
        for stretch in &mut self.stretches {
            stretch.start *= longer;
        }
        Self {
            period,
            period_sigma: sigma,
            ..self
        }
    }

    /// Simulated samples, which need no checks.
    pub fn made(
        start: f64,
        period: f64,
        gyro: impl Into<Series>,
        accel: impl Into<Series>,
    ) -> Self {
        let (gyro, accel) = (gyro.into(), accel.into());
        Self {
            period,
            period_sigma: 0.0,
            stretches: vec![Stretch {
                samples: 0..gyro.len(),
                start,
            }],
            continuous: true,
            gyro,
            accel,
            pulse: PerSensor::default(),
            faults: Vec::new(),
            bridges: Vec::new(),
            temperature: None,
            log: None,
        }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.gyro.len()
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.gyro.is_empty()
    }

    /// Start time of the first sample, s.
    pub fn start(&self) -> f64 {
        self.time(0)
    }

    /// End time of the last sample, s.
    pub fn end(&self) -> f64 {
        self.time(self.len())
    }

    /// Start time of sample `k` in s, or end time of the last sample of its stretch; the clock of the first stretch is
    /// extrapolated backwards.
    pub fn time(&self, k: usize) -> f64 {
        let begun = self.stretches.partition_point(|s| s.samples.start <= k);
        self.stretches
            .get(begun.saturating_sub(1))
            .map_or(0.0, |s| {
                s.start + (k as f64 - s.samples.start as f64) * self.period
            })
    }

    /// Time of these samples, s.
    pub fn times(&self, samples: &Range<usize>) -> Range<f64> {
        let begin = self.time(samples.start);
        begin..begin + samples.len() as f64 * self.period
    }

    /// A time as a real number of samples from the first one. If the time between two stretches is longer than the
    /// number of lost samples explains, times after all lost samples between them are mapped to the last lost sample.
    pub fn edge(&self, time: f64) -> f64 {
        let begun = self.stretches.partition_point(|s| s.start <= time);
        let stretch = self.stretches.get(begun.saturating_sub(1));
        let number = stretch.map_or(0.0, |s| {
            s.samples.start as f64 + (time - s.start) / self.period
        });
        match self.stretches.get(begun) {
            Some(next) if number > next.samples.start as f64 => next.samples.start as f64 - 1.0,
            _ => number,
        }
    }

    /// Whether these samples are consecutive, without a break.
    pub fn unbroken(&self, samples: &Range<usize>) -> bool {
        self.continuous && !self.is_lost(samples)
    }

    /// Whether any of these samples are lost.
    pub fn is_lost(&self, samples: &Range<usize>) -> bool {
        let begun = |stretch: &Stretch| stretch.samples.start <= samples.start;
        let begun = self.stretches.partition_point(begun);
        let stretch = self.stretches.get(begun.wrapping_sub(1));
        stretch.is_none_or(|stretch| samples.end > stretch.samples.end)
    }

    /// The lost samples before, between and after stretches.
    pub fn missing(&self) -> impl Iterator<Item = Range<usize>> {
        let ends = self.stretches.iter().map(|stretch| stretch.samples.end);
        let starts = self.stretches.iter().map(|stretch| stretch.samples.start);
        let all = [0].into_iter().chain(ends).zip(starts.chain([self.len()]));
        all.map(|(end, start)| end..start)
            .filter(|missing| !missing.is_empty())
    }

    /// The samples that have no row in the log, whether interpolated or not, in order.
    pub fn lost(&self) -> Vec<Range<usize>> {
        let faults = self.faults.iter();
        let bridged = faults.filter(|fault| fault.kind == FaultKind::Missing);
        let mut lost: Vec<_> = bridged.map(|fault| fault.samples.clone()).collect();
        let is_new = |missing: &Range<usize>| !lost.contains(missing);
        let others: Vec<_> = self.missing().filter(is_new).collect();
        lost.extend(others);
        lost.sort_by_key(|lost| lost.start);
        lost
    }

    /// Duration of the samples, s.
    pub fn duration(&self) -> f64 {
        self.len() as f64 * self.period
    }
}

/// The stretches, among `count` samples of a uniform clock, between faults that are not bridged.
pub fn stretches_between(count: usize, start: f64, period: f64, faults: &[Fault]) -> Vec<Stretch> {
    let unbridged = faults.iter().filter(|fault| !fault.bridged);
    let mut lost: Vec<Range<usize>> = unbridged.map(|fault| fault.samples.clone()).collect();
    lost.sort_by_key(|samples| samples.start);
    lost.push(count..count);
    let mut stretches = Vec::new();
    let mut begin = 0;
    for lost in lost {
        if lost.start > begin {
            stretches.push(Stretch {
                samples: begin..lost.start,
                start: start + begin as f64 * period,
            });
        }
        begin = begin.max(lost.end);
    }
    stretches
}

impl ImuSamples {
    /// The bridges that overlap these samples, each with the overlapping fraction of the bridge.
    pub fn bridged(&self, samples: &Range<usize>) -> impl Iterator<Item = (&Bridge, f64)> {
        let mut rest = self.bridges.as_slice();
        let touched = std::iter::from_fn(move || {
            let first = rest.first()?;
            let of_axes = |bridge: &Bridge| bridge.axes == first.axes;
            let (alike, others) = rest.split_at(rest.partition_point(of_axes));
            rest = others;
            let begin = alike.partition_point(|b| b.samples.end <= samples.start);
            let touched = alike[begin..].partition_point(|b| b.samples.start < samples.end);
            Some(&alike[begin..begin + touched])
        });
        touched.flatten().map(|bridge| {
            let Range { start, end } = bridge.samples;
            let common = end.min(samples.end) - start.max(samples.start);
            (bridge, common as f64 / (end - start) as f64)
        })
    }
}
