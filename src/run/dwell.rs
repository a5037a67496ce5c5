//! A dwell, during which the instrument is at rest, with the outputs of the sensors and the table.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::Run;
use crate::attitude::{exp, log};
use crate::imu::Sensor;
use crate::recording::ImuSamples;

/// Shortest dwell that is used, s.
pub const SHORTEST: f64 = 0.5;

/// Samples during which the instrument is at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Dwell {
    /// Samples that lie completely within the dwell.
    pub samples: Range<usize>,
    /// Position of the table; `None` without a table.
    pub position: Option<Position>,
}

/// A position of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Position {
    /// Readings of the table within the dwell.
    pub readings: Range<usize>,
    /// Mean reading, `C_b_n`.
    pub attitude: Matrix3<f64>,
}

/// Mean output of a triad over a dwell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanOutput {
    /// Normalised output per second, rad/s or m/s².
    pub output: Vector3<f64>,
    /// Variance per axis from instrument noise, pulses and, if samples were interpolated, interpolation on the axis
    /// with the most interpolated samples.
    pub variance: f64,
}

impl Dwell {
    /// A dwell over these samples, without a table.
    pub fn of(samples: Range<usize>) -> Self {
        Self {
            samples,
            position: None,
        }
    }

    /// Duration, s.
    pub fn duration(&self, imu: &ImuSamples) -> f64 {
        self.samples.len() as f64 * imu.period
    }

    /// Start and end, s.
    pub fn times(&self, run: &Run) -> [f64; 2] {
        let imu = &run.recording.imu;
        let begin = imu.time(self.samples.start);
        [begin, begin + self.duration(imu)]
    }

    /// Mean output of a triad over the dwell.
    pub fn mean(&self, sensor: Sensor, run: &Run) -> MeanOutput {
        let imu = &run.recording.imu;
        let duration = self.duration(imu);
        let interpolated = imu.bridged(&self.samples).map(|(bridge, part)| {
            let variance = Vector3::from(*bridge.variance.get(sensor));
            variance * part
        });
        let span = self.times(run);
        let noise = run.instrument.noise.get(sensor);
        MeanOutput {
            output: imu.of(sensor).sum(self.samples.clone()) / duration,
            variance: noise.covariance_of_means(span, span)
                + imu.pulse.get(sensor).powi(2) / (6.0 * duration * duration)
                + interpolated.sum::<Vector3<f64>>().max() / (duration * duration),
        }
    }

    /// Mean specific force along body axes, from nominal scales and prior biases, m/s².
    pub fn force(&self, run: &Run) -> Vector3<f64> {
        self.mean(Sensor::Accel, run).output - run.instrument.prior.accel.bias
    }

    /// Returns the first part of the dwell; the attitude remains the mean of all readings in the dwell.
    pub fn first_part(&self, part: f64, imu: &ImuSamples) -> Self {
        let samples = (part * self.duration(imu) / imu.period).round() as usize;
        let end = self.samples.end.min(self.samples.start + samples);
        Self {
            samples: self.samples.start..end,
            ..self.clone()
        }
    }

    /// Merges a later dwell at the same position into this one.
    pub fn extend(&mut self, later: &Self) {
        self.samples.end = later.samples.end;
        if let (Some(position), Some(later)) = (&mut self.position, &later.position) {
            let (own, added) = (position.readings.len(), later.readings.len());
            let turn = log(&(later.attitude * position.attitude.transpose()));
            let share = added as f64 / (own + added) as f64;
            position.attitude = exp(turn * share) * position.attitude;
            position.readings.end = later.readings.end;
        }
    }
}

/// The samples that two ranges have in common; an empty range if there are none.
pub fn common(one: &Range<usize>, other: &Range<usize>) -> Range<usize> {
    one.start.max(other.start)..one.end.min(other.end)
}
