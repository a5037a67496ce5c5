//! Conversion of the rows of a file to the samples of a uniform clock.

use std::ops::Range;

use super::fault::{Bridge, Fault, FaultKind};
use super::impossible::{impossible, without};
use super::interpolation::Hole;
use super::rows::{FaultyRows, Rows, ranges, sensor};
use super::search::find;
use crate::imu::Sensor;
use crate::recording::ColumnFacts;
use crate::units::DEGREE;

/// Longest hole that is bridged, s: a longer one may hide a whole move from dwell to dwell, without any sign at its
/// edges.
const LONGEST: f64 = 0.5;
/// A hole counts as short compared with a hole this many times as long.
const SHORT: usize = 8;
/// Largest attitude error that a linear filter can handle, rad.
const WORST_ANGLE: f64 = 0.2 * DEGREE;

/// The complete samples, with faults and bridges.
pub struct Repaired {
    /// The columns of [`Rows`], with a value for each sample.
    pub columns: [Vec<f64>; 6],
    /// Faults found.
    pub faults: Vec<Fault>,
    /// Gaps that were bridged.
    pub bridges: Vec<Bridge>,
}

impl Repaired {
    /// The samples of each fault and each bridge.
    pub fn samples_mut(&mut self) -> impl Iterator<Item = &mut Range<usize>> {
        let faults = self.faults.iter_mut().map(|fault| &mut fault.samples);
        faults.chain(self.bridges.iter_mut().map(|bridge| &mut bridge.samples))
    }

    /// Whether this sample is free of faults.
    pub fn is_sound(&self, sample: usize) -> bool {
        let concerns =
            |fault: &Fault| fault.kind != FaultKind::Duplicate && fault.samples.contains(&sample);
        !self.faults.iter().any(concerns)
    }
}

impl Rows<'_> {
    /// Finds and bridges faults.
    pub fn repair(mut self) -> Repaired {
        let mut faults = self.faults(&self.found());
        let mut columns = std::mem::take(&mut self.columns).map(|rows| placed(rows, &self.numbers));
        let mut bridges = Vec::new();
        for holes in holes_of_columns(&faults, &self.body_axes, columns[0].len()) {
            bridges.extend(self.fill(holes, &mut columns, &mut faults));
        }
        Bridge::sort(&mut bridges);
        Repaired {
            columns,
            faults,
            bridges,
        }
    }

    /// Every fault, in order of kind, axis and time.
    fn faults(&self, found: &[FaultyRows]) -> Vec<Fault> {
        let fault = |kind, axis, rows: &Range<usize>| Fault {
            kind,
            axis,
            samples: self.samples(rows),
            line: self.lines[rows.start],
            bridged: true,
        };
        let duplicates = self.duplicates.iter().map(|&(row, line)| Fault {
            line,
            ..fault(FaultKind::Duplicate, None, &(row - 1..row))
        });
        let found = found.iter().map(|FaultyRows { kind, column, rows }| {
            let axis = column.map(|column| (sensor(column), self.body_axes[column]));
            fault(*kind, axis, rows)
        });
        let mut faults = self.missing();
        faults.extend(duplicates.chain(found));
        faults.sort_by_key(Fault::order);
        faults
    }

    /// Bridges the holes that columns share, short ones first; the remaining faults are marked as not bridged.
    fn fill(
        &self,
        Holes { of, mut sound }: Holes,
        columns: &mut [Vec<f64>; 6],
        faults: &mut [Fault],
    ) -> Vec<Bridge> {
        let longest = (LONGEST / self.period) as usize;
        let mut holes = ranges(sound.len(), |k| !sound[k]);
        holes.sort_by_key(Range::len);
        let mut filled = 0;
        let mut bridges = Vec::new();
        for (number, samples) in holes.iter().enumerate() {
            // Next to a long hole, short holes that are filled count as good samples.
            while filled < number && SHORT * holes[filled].len() <= samples.len() {
                sound[holes[filled].clone()].fill(true);
                filled += 1;
            }
            let hole = Hole::new(&sound, samples.clone(), longest);
            let mut bridge = Bridge::new(samples.clone());
            for &k in &of {
                let (sensor, axis) = (sensor(k), self.body_axes[k]);
                let variance = hole.fill(&mut columns[k], self.rounding(k, samples.len()));
                let variance = variance.map(|variance| variance * self.units[k].powi(2));
                let linear =
                    |variance: &f64| sensor == Sensor::Accel || variance.sqrt() <= WORST_ANGLE;
                match variance.filter(linear) {
                    Some(variance) => bridge = bridge.with(sensor, axis, variance),
                    None => {
                        let within = |fault: &&mut Fault| {
                            fault.concerns(sensor, axis)
                                && fault.samples.start < samples.end
                                && samples.start < fault.samples.end
                        };
                        faults
                            .iter_mut()
                            .filter(within)
                            .for_each(|fault| fault.bridged = false);
                    }
                }
            }
            if bridge.each().next().is_some() {
                bridges.push(bridge);
            }
        }
        bridges
    }

    /// Variance of the rounding of a sum of samples: within one step for the whole sum if the remainder is carried,
    /// otherwise within one step per sample.
    fn rounding(&self, column: usize, samples: usize) -> f64 {
        let step = self.facts[column].step.unwrap_or(0.0);
        step * step * if self.pulses { 1.0 } else { samples as f64 }
    }

    /// Impossible values, and faults that the other values reveal.
    fn found(&self) -> Vec<FaultyRows> {
        let impossible = impossible(self);
        if impossible.is_empty() {
            return find(&self.columns, self.facts, &self.full_scale, self.pulses);
        }
        let columns = without(&self.columns, &impossible);
        let facts = std::array::from_fn(|k| {
            let ColumnFacts { name, unit, .. } = &self.facts[k];
            ColumnFacts::of(name, &columns[k], *unit)
        });
        let mut found = find(&columns, &facts, &self.full_scale, self.pulses);
        let mut marked = columns.each_ref().map(|values| vec![false; values.len()]);
        for other in &impossible {
            for column in other.columns() {
                marked[column][other.rows.clone()].fill(true);
            }
        }
        found.retain(|other| {
            let mut columns = other.columns();
            !columns.any(|column| marked[column][other.rows.clone()].contains(&true))
        });
        found.extend(impossible);
        found
    }

    /// The samples of consecutive rows.
    fn samples(&self, rows: &Range<usize>) -> Range<usize> {
        self.numbers[rows.start]..self.numbers[rows.end - 1] + 1
    }

    fn missing(&self) -> Vec<Fault> {
        let pairs = self.numbers.windows(2).zip(&self.lines);
        pairs
            .filter(|(pair, _)| pair[1] > pair[0] + 1)
            .map(|(pair, &line)| Fault {
                kind: FaultKind::Missing,
                axis: None,
                samples: pair[0] + 1..pair[1],
                line,
                bridged: true,
            })
            .collect()
    }
}

/// Columns with the same holes.
struct Holes {
    of: Vec<usize>,
    /// Whether each sample is usable.
    sound: Vec<bool>,
}

/// Groups columns with the same holes: missing rows affect all columns.
fn holes_of_columns(faults: &[Fault], body_axes: &[usize; 6], samples: usize) -> Vec<Holes> {
    let mut all: Vec<Holes> = Vec::new();
    for (k, &axis) in body_axes.iter().enumerate() {
        let concerned = |fault: &&Fault| fault.concerns(sensor(k), axis);
        if !faults.iter().any(|fault| concerned(&fault)) {
            continue;
        }
        let mut sound = vec![true; samples];
        for fault in faults.iter().filter(concerned) {
            sound[fault.samples.clone()].fill(false);
        }
        match all.iter_mut().find(|holes| holes.sound == sound) {
            Some(holes) => holes.of.push(k),
            None => all.push(Holes { of: vec![k], sound }),
        }
    }
    all
}

/// Places the values of rows at their samples; values in between are arbitrary.
fn placed(rows: Vec<f64>, numbers: &[usize]) -> Vec<f64> {
    let count = numbers.last().map_or(0, |last| last + 1);
    if count == rows.len() {
        return rows;
    }
    let mut samples = vec![0.0; count];
    for (value, &number) in rows.into_iter().zip(numbers) {
        samples[number] = value;
    }
    samples
}
