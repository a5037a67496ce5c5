//! Faults and bridges of samples.

use std::ops::Range;

use crate::imu::{PerSensor, Sensor};

/// Samples of a recording that do not show the instrument's input.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// The kind of fault.
    pub kind: FaultKind,
    /// Triad and body axis (right, front, up); `None` if whole rows are affected.
    pub axis: Option<(Sensor, usize)>,
    /// The faulty samples; for a duplicate, the sample that is repeated in the file.
    pub samples: Range<usize>,
    /// Line in the file: the line of the first sample, of the second of two equal rows, or of the last row before
    /// missing rows.
    pub line: u64,
    /// Whether the samples are repaired, that is, interpolated with the error given in a [`Bridge`], or dropped.
    pub bridged: bool,
}

/// The kinds of fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FaultKind {
    /// Rows that are missing from the file.
    Missing,
    /// A copy of the previous row, including its time stamp.
    Duplicate,
    /// Values at the end of the range of the axis; the true value may be beyond this end.
    Saturated,
    /// A repeated value, although the axis' noise or motion continues.
    Stuck,
    /// A single sample that fits neither the previous nor the following samples.
    Spike,
    /// A row of zeros, which is impossible under gravity.
    Zero,
    /// Values beyond the range of any instrument.
    Beyond,
}

impl FaultKind {
    /// All kinds of faults.
    pub const ALL: [Self; 7] = [
        Self::Missing,
        Self::Duplicate,
        Self::Saturated,
        Self::Stuck,
        Self::Spike,
        Self::Zero,
        Self::Beyond,
    ];

    /// Name of the kind.
    pub fn name(self) -> &'static str {
        match self {
            Self::Missing => "missing",
            Self::Duplicate => "duplicate",
            Self::Saturated => "saturated",
            Self::Stuck => "stuck",
            Self::Spike => "spike",
            Self::Zero => "zero",
            Self::Beyond => "beyond any instrument",
        }
    }
}

/// Interpolated samples on some axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Bridge {
    /// The samples.
    pub samples: Range<usize>,
    /// Variance that interpolation adds to the integral of the normalised output over all of them, along the body axes
    /// right, front and up, rad² or (m/s)².
    pub variance: PerSensor<[f64; 3]>,
    /// Which axes were interpolated.
    pub axes: PerSensor<[bool; 3]>,
}

impl Bridge {
    /// A bridge over these samples, to which axes are added later.
    pub fn new(samples: Range<usize>) -> Self {
        Self {
            samples,
            variance: PerSensor::default(),
            axes: PerSensor::default(),
        }
    }

    /// Adds an axis with its variance.
    pub fn with(mut self, sensor: Sensor, axis: usize, variance: f64) -> Self {
        self.variance.get_mut(sensor)[axis] = variance;
        self.axes.get_mut(sensor)[axis] = true;
        self
    }

    /// Sorts by axes, then by time.
    pub fn sort(bridges: &mut [Self]) {
        let axes = |bridge: &Self| (bridge.axes.gyro, bridge.axes.accel);
        bridges.sort_unstable_by_key(|bridge| (axes(bridge), bridge.samples.start));
    }

    /// The axes that were interpolated, each with its variance.
    pub fn each(&self) -> impl Iterator<Item = (Sensor, usize, f64)> {
        let all = Sensor::ALL
            .into_iter()
            .flat_map(|sensor| [0, 1, 2].map(|axis| (sensor, axis)));
        all.filter(|&(sensor, axis)| self.axes.get(sensor)[axis])
            .map(|(sensor, axis)| (sensor, axis, self.variance.get(sensor)[axis]))
    }
}

impl Fault {
    /// Sort key: kind, axis and time.
    pub fn order(&self) -> (usize, Option<(usize, usize)>, usize) {
        let axis = self.axis.map(|(sensor, axis)| (sensor as usize, axis));
        (self.kind as usize, axis, self.samples.start)
    }

    /// Whether the fault affects samples of this axis.
    pub fn concerns(&self, sensor: Sensor, axis: usize) -> bool {
        self.kind != FaultKind::Duplicate && self.axis.is_none_or(|of| of == (sensor, axis))
    }
}
