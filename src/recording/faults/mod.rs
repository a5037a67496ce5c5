//! What is wrong with a log's rows, and what was done about it.

mod interpolation;
mod notes;
mod repair;
mod saturated;
mod stuck;

use std::ops::Range;

use crate::imu::Sensor;
use crate::recording::{ColumnFacts, ImuSamples};
pub(crate) use notes::notes;
pub(crate) use repair::{Repaired, Rows};
use saturated::Column;

/// Samples of a record that are not what the instrument sensed.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// What is wrong.
    pub kind: FaultKind,
    /// Triad and body axis (right, front, up); none where whole rows are concerned.
    pub axis: Option<(Sensor, usize)>,
    /// The samples; for a duplicate the one that the file has twice.
    pub samples: Range<usize>,
    /// Line of the file: of the first sample, of the second of two equal rows, or of the last row
    /// before missing ones.
    pub line: u64,
    /// Whether the samples can be used: filled in with an error that [`Bridge`] knows, or dropped.
    pub bridged: bool,
}

/// What can be wrong with samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FaultKind {
    /// The file lacks the rows.
    Missing,
    /// The row before again, stamp and all.
    Duplicate,
    /// At the end of the axis' range, so that the truth may be beyond.
    Saturated,
    /// The same value again and again, while others change.
    Stuck,
}

impl FaultKind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Missing, Self::Duplicate, Self::Saturated, Self::Stuck];

    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Missing => "missing",
            Self::Duplicate => "duplicate",
            Self::Saturated => "saturated",
            Self::Stuck => "stuck",
        }
    }
}

/// Samples of one axis that were interpolated.
#[derive(Debug, Clone, PartialEq)]
pub struct Bridge {
    /// Which triad.
    pub sensor: Sensor,
    /// Body axis: right, front, up.
    pub axis: usize,
    /// The samples.
    pub samples: Range<usize>,
    /// Variance that interpolation adds to the integral of the normalised output over all of them,
    /// rad² or (m/s)².
    pub variance: f64,
}

impl ImuSamples {
    /// The bridges that these samples touch, each with the part of it that they are.
    pub fn bridged(&self, samples: &Range<usize>) -> impl Iterator<Item = (&Bridge, f64)> {
        let mut rest = self.bridges.as_slice();
        let touched = std::iter::from_fn(move || {
            let first = rest.first()?;
            let of_axis = |b: &Bridge| (b.sensor, b.axis) == (first.sensor, first.axis);
            let (axis, others) = rest.split_at(rest.partition_point(of_axis));
            rest = others;
            let begin = axis.partition_point(|b| b.samples.end <= samples.start);
            let touched = axis[begin..].partition_point(|b| b.samples.start < samples.end);
            Some(&axis[begin..begin + touched])
        });
        touched.flatten().map(|bridge| {
            let Range { start, end } = bridge.samples;
            let common = end.min(samples.end) - start.max(samples.start);
            (bridge, common as f64 / (end - start) as f64)
        })
    }
}

/// Rows of one column that are not what the instrument sensed.
struct Found {
    kind: FaultKind,
    column: usize,
    rows: Range<usize>,
}

/// Looks for saturated and stuck values in the columns of gyro x, y, z and accelerometer x, y, z.
fn find(
    columns: &[Vec<f64>; 6],
    facts: &[ColumnFacts; 6],
    full_scale: &[Option<f64>; 6],
) -> Vec<Found> {
    let mut found = Vec::new();
    let mut add = |kind, column, rows: &Range<usize>| {
        let rows = rows.clone();
        found.push(Found { kind, column, rows });
    };
    let mut saturated = [const { Vec::new() }; 6];
    for (k, facts) in facts.iter().enumerate() {
        let column = Column {
            values: &columns[k],
            smallest: facts.smallest,
            largest: facts.largest,
            step: facts.step,
            full_scale: full_scale[k],
        };
        saturated[k] = column.saturated();
        saturated[k]
            .iter()
            .for_each(|rows| add(FaultKind::Saturated, k, rows));
    }
    let all = std::array::from_fn(|k| columns[k].as_slice());
    let stuck = stuck::stuck(&all, &std::array::from_fn(|k| facts[k].step));
    for (k, runs) in stuck.iter().enumerate() {
        for run in runs {
            let known = |rows: &Range<usize>| rows.start < run.end && run.start < rows.end;
            if saturated[k].iter().any(known) {
                continue;
            }
            let value = columns[k][run.start];
            let at_end = [facts[k].smallest, facts[k].largest].contains(&value);
            if at_end && !is_level(&columns[k], run) {
                // The value before it is at the end of the range as well.
                add(FaultKind::Saturated, k, &(run.start - 1..run.end));
            } else {
                add(FaultKind::Stuck, k, run);
            }
        }
    }
    found
}

/// Rows on either side of a run that tell whether its value is one of theirs …
const BESIDE: usize = 16;
/// … within this many times what they change by from row to row.
const OF_LEVEL: f64 = 3.0;

/// Whether a run lies on a level that goes on beside it, as that of a steady turn; at the end of a range
/// the truth comes from below and goes back there.
fn is_level(column: &[f64], run: &Range<usize>) -> bool {
    let value = column[run.start];
    let before = &column[run.start.saturating_sub(1 + BESIDE)..run.start - 1];
    let after = &column[run.end..column.len().min(run.end + BESIDE)];
    [before, after].into_iter().all(|side| {
        let count = side.len().max(1) as f64;
        let off = side.iter().map(|other| value - other).sum::<f64>() / count;
        let changes = side.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        off.abs() <= OF_LEVEL * changes.sum::<f64>() / count
    })
}
