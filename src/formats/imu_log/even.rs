//! Samples of a clock that wanders, integrated over those of an even one.

use std::ops::Range;

use crate::formats::course::Course;
use crate::formats::uniform::Wander;
use crate::imu::{Output, PerSensor};
use crate::recording::faults::Repaired;

/// Samples that the cubic reaches beyond the one it ends in.
const AHEAD: f64 = 2.0;
/// Samples that it reaches back.
const BACK: usize = 2;

/// The even samples of a triad, given out as those that wander come in.
pub(super) struct Even<'a> {
    wander: &'a Wander,
    lag: f64,
    output: Output,
    held: Course,
    /// The next of them.
    next: f64,
    squares: [f64; 3],
    weights: f64,
    count: f64,
}

/// The edges of samples that wander among even samples, which begin with the first whole one; stamps come `lag` of a
/// sample after its begin.
pub(super) fn place(wander: &Wander, lag: f64, edge: usize) -> f64 {
    wander.time(edge as f64 - lag) + lag
}

/// The even samples that these reach into, counted from the first.
pub(super) fn reached(wander: &Wander, lag: f64, samples: &Range<usize>) -> Range<usize> {
    let first = place(wander, lag, 0).ceil();
    let of = |edge| place(wander, lag, edge) - first;
    of(samples.start).floor() as usize..of(samples.end).ceil() as usize
}

impl<'a> Even<'a> {
    pub fn new(wander: &'a Wander, lag: f64, output: Output) -> Self {
        Self {
            wander,
            lag,
            output,
            held: Course::default(),
            next: place(wander, lag, 0).ceil(),
            squares: [0.0; 3],
            weights: 0.0,
            count: 0.0,
        }
    }

    pub fn push(&mut self, sample: [f64; 3]) {
        for (sums, value) in self.held.sums.iter_mut().zip(sample) {
            sums.push(value);
        }
    }

    /// Gives out the samples that those which came in hold, all of them at the end, and lets go of what no later one
    /// asks for.
    pub fn give(&mut self, at_end: bool, mut take: impl FnMut([f64; 3])) {
        let until = self.held.end() - if at_end { 0.0 } else { AHEAD };
        let edge = |time: f64| self.wander.number(time - self.lag) + self.lag;
        let mut begin = edge(self.next);
        loop {
            let end = edge(self.next + 1.0);
            if end > until {
                break;
            }
            let Some((sums, weight)) = self.held.between(begin, end) else {
                break;
            };
            take(match self.output {
                Output::Rate => sums.map(|sum| sum / (end - begin)),
                Output::Increment | Output::Pulse => sums,
            });
            self.weights += weight;
            self.count += 1.0;
            self.next += 1.0;
            begin = end;
        }
        let held = self.held.len() as f64;
        for (squares, error) in self.squares.iter_mut().zip(self.held.edge_error()) {
            *squares += error * held;
        }
        let gone = ((begin - self.held.begin) as usize).saturating_sub(BACK);
        for sums in &mut self.held.sums {
            sums.drain(..gone.min(sums.len()));
        }
        self.held.begin += gone as f64;
    }

    /// RMS error of the integral at an edge, in values times samples.
    pub fn error(&self) -> [f64; 3] {
        let count = self.count.max(1.0);
        let weight = self.weights / count;
        self.squares.map(|square| (weight * square / count).sqrt())
    }
}

/// The even samples of all columns, and the RMS errors of their integrals, in values times samples.
pub(super) fn evened(
    mut repaired: Repaired,
    (wander, lag): (&Wander, f64),
    output: Output,
) -> (Repaired, PerSensor<[f64; 3]>) {
    for samples in repaired.samples_mut() {
        *samples = reached(wander, lag, samples);
    }
    let error = PerSensor::from_fn(|sensor| {
        let mut even = Even::new(wander, lag, output);
        let first = 3 * sensor as usize;
        let columns = &mut repaired.columns[first..first + 3];
        for (sums, column) in even.held.sums.iter_mut().zip(columns.iter_mut()) {
            *sums = std::mem::take(column);
        }
        even.give(true, |sample| {
            for (column, value) in columns.iter_mut().zip(sample) {
                column.push(value);
            }
        });
        even.error()
    });
    let count = repaired.columns[0].len();
    for samples in repaired.samples_mut() {
        *samples = samples.start.min(count)..samples.end.min(count);
    }
    (repaired, error)
}
