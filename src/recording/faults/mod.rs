//! Faults in the rows of a log, and their repair.

mod chance;
mod impossible;
mod interpolation;
mod notes;
mod pinned;
mod repair;
mod slower;
mod spikes;

use std::ops::Range;

use rayon::prelude::*;

use crate::imu::{PerSensor, Sensor};
use crate::recording::{ColumnFacts, ImuSamples};
use chance::Limit;
pub use notes::notes;
use pinned::{Axis, saturated};
pub use repair::{Repaired, Rows};
pub use slower::Slower;
use spikes::spikes;

/// Samples of a recording that do not show the instrument's input.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// The kind of fault.
    pub kind: FaultKind,
    /// Triad and body axis (right, front, up); `None` if whole rows are affected.
    pub axis: Option<(Sensor, usize)>,
    /// The samples; for a duplicate, the sample that occurs twice in the file.
    pub samples: Range<usize>,
    /// Line in the file: of the first sample, of the second of two equal rows, or of the last row
    /// before missing ones.
    pub line: u64,
    /// Whether the samples are repaired: interpolated with the error in a [`Bridge`], or dropped.
    pub bridged: bool,
}

/// The kinds of fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FaultKind {
    /// Rows that are missing from the file.
    Missing,
    /// A copy of the previous row, including its time stamp.
    Duplicate,
    /// Values at the end of the axis' range; the true value may lie beyond.
    Saturated,
    /// A repeated value, although the axis' noise or motion continues.
    Stuck,
    /// A single sample that fits neither the previous nor the following samples.
    Spike,
    /// A row of zeros, although gravity is not zero.
    Zero,
    /// Values beyond the range of any instrument.
    Beyond,
}

impl FaultKind {
    /// All of them.
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
    /// Variance that interpolation adds to the integral of the normalised output over all of them, along each
    /// body axis right, front, up, rad² or (m/s)².
    pub variance: PerSensor<[f64; 3]>,
    /// Which axes were interpolated.
    pub axes: PerSensor<[bool; 3]>,
}

impl Bridge {
    /// A bridge over these samples, without an axis yet.
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
    pub(crate) fn sort(bridges: &mut [Self]) {
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

/// Faulty rows of one column, or whole rows.
struct Found {
    kind: FaultKind,
    column: Option<usize>,
    rows: Range<usize>,
}

impl Found {
    /// The columns that it concerns.
    fn columns(&self) -> Range<usize> {
        self.column.map_or(0..6, |column| column..column + 1)
    }
}

/// Searches for saturated and stuck values and spikes in the columns of gyro x, y, z and accelerometer x, y, z.
fn find(
    columns: &[Vec<f64>; 6],
    facts: &[ColumnFacts; 6],
    full_scale: &[Option<f64>; 6],
    pulses: bool,
) -> Vec<Found> {
    let limit = Limit::of_rows(columns[0].len());
    let step_of = |(facts, column): (&ColumnFacts, &Vec<f64>)| {
        facts.step.unwrap_or_else(|| last_digit(column))
    };
    let steps: Vec<f64> = facts.par_iter().zip(columns).map(step_of).collect();
    let spikes = spikes(
        &std::array::from_fn(|k| columns[k].as_slice()),
        &steps,
        limit,
    );
    let axis = |k: usize| Axis::of(&columns[k], &facts[k], steps[k], pulses);
    let axes: Vec<Axis> = (0..columns.len()).into_par_iter().map(axis).collect();
    let of_column = |column: usize| {
        let spikes = &spikes[column];
        let stuck = axes[column].stuck(limit);
        let triad = [0, 1, 2].map(|axis| &axes[column - column % 3 + axis]);
        let saturated = saturated(triad, column % 3, full_scale[column], spikes, limit);
        // The row before a run has its value.
        let free = |rows: &Range<usize>| {
            !saturated
                .iter()
                .any(|known| known.start < rows.end && rows.start < known.end)
        };
        let spikes = spikes.iter().map(|&row| row..row + 1);
        let spikes = spikes.filter(free).map(|rows| (FaultKind::Spike, rows));
        let stuck = stuck.iter().filter(|&rows| free(rows));
        let stuck = stuck.map(|rows| (FaultKind::Stuck, rows.clone()));
        let kinds: Vec<_> = spikes.chain(stuck).collect();
        let saturated = saturated
            .into_iter()
            .map(|rows| (FaultKind::Saturated, rows));
        let found = saturated.chain(kinds);
        let column = Some(column);
        let found = found.map(|(kind, rows)| Found { kind, column, rows });
        found.collect::<Vec<_>>()
    };
    let found: Vec<_> = (0..columns.len()).into_par_iter().map(of_column).collect();
    found.into_iter().flatten().collect()
}

/// Resolution, at its largest values, of a column of numbers with a fixed number of digits. It follows from the
/// smallest change relative to the value; a last digit is up to ten times that.
fn last_digit(values: &[f64]) -> f64 {
    let changes = values.windows(2).filter(|pair| pair[0] != pair[1]);
    let relative = changes.map(|pair| (pair[1] - pair[0]).abs() / pair[0].abs().max(pair[1].abs()));
    let largest = values
        .iter()
        .fold(0.0, |largest, value| value.abs().max(largest));
    match relative.reduce(f64::min) {
        Some(least) => 10.0 * least * largest,
        None => 0.0,
    }
}

/// Mean of values, and slope of the line through them.
fn mean_and_slope(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let middle = 0.5 * (count - 1.0);
    let moments = values.iter().enumerate();
    let moment: f64 = moments.map(|(k, value)| (k as f64 - middle) * value).sum();
    (
        mean(values),
        moment * 12.0 / (count * (count * count - 1.0)),
    )
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Runs of rows or samples for which `is` is true.
pub fn ranges(count: usize, is: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    consecutive((0..count).filter(|&row| is(row)))
}

/// Increasing numbers as runs of consecutive ones.
fn consecutive(rows: impl Iterator<Item = usize>) -> Vec<Range<usize>> {
    let mut ranges: Vec<Range<usize>> = Vec::new();
    for row in rows {
        match ranges.last_mut() {
            Some(last) if last.end == row => last.end += 1,
            _ => ranges.push(row..row + 1),
        }
    }
    ranges
}
