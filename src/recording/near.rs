//! Samples of both triads near the current sample.

use std::borrow::Cow;
use std::ops::Range;

use nalgebra::Vector3;

use super::ImuSamples;
use crate::imu::PerSensor;

/// Number of samples that are unpacked ahead.
const AHEAD: usize = 1024;

/// A moving window over the samples of a recording; if the recording is not packed, the window contains all samples.
#[derive(Debug, Clone)]
pub struct Near<'a> {
    imu: &'a ImuSamples,
    first: usize,
    triads: PerSensor<Cow<'a, [Vector3<f64>]>>,
}

impl<'a> Near<'a> {
    /// A window at the start of a recording.
    pub fn new(imu: &'a ImuSamples) -> Self {
        let mut near = Self {
            imu,
            first: 0,
            triads: PerSensor {
                gyro: Cow::Borrowed(&[]),
                accel: Cow::Borrowed(&[]),
            },
        };
        let many = if imu.is_packed() { 0 } else { imu.len() };
        near.load(0..many);
        near
    }

    /// Moves the window to these samples and those that follow.
    #[inline]
    pub fn reach(&mut self, samples: &Range<usize>) {
        let end = samples.end.min(self.imu.len());
        if samples.start < self.first || end > self.first + self.triads.gyro.len() {
            self.load(samples.start..end.max(samples.start + AHEAD));
        }
    }

    fn load(&mut self, samples: Range<usize>) {
        self.first = samples.start;
        self.triads = PerSensor {
            gyro: self.imu.gyro.part(samples.clone()),
            accel: self.imu.accel.part(samples),
        };
    }

    /// Increments of both triads in a sample within the window.
    #[inline]
    pub fn at(&self, k: usize) -> PerSensor<Vector3<f64>> {
        let PerSensor { gyro, accel } = &self.triads;
        PerSensor {
            gyro: gyro[k - self.first],
            accel: accel[k - self.first],
        }
    }
}
