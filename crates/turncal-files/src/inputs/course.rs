//! Samples of a stream, integrated over other intervals: between any times or, if the clock of the stream drifts, over
//! the samples of a uniform clock.

use std::ops::Range;

use turncal::imu::Output;
use turncal_logs::clock::Wander;

/// Product of the distances from the midpoint of two edges to the four nodes of the cubic.
const MIDWAY: f64 = 0.5625;

/// Edges closer than this, in samples, are equal.
const SAME: f64 = 1e-6;

/// Samples without a gap, with integrals in values times samples.
#[derive(Default)]
pub struct Course {
    /// Start of these samples, as a number of samples.
    pub begin: f64,
    pub sums: [Vec<f64>; 3],
}

impl Course {
    pub fn len(&self) -> usize {
        self.sums[0].len()
    }

    pub fn end(&self) -> f64 {
        self.begin + self.len() as f64
    }

    /// Integral between two positions, and its squared error as a fraction of the midway error; `None` if the positions
    /// are outside or not in order.
    pub fn between(&self, begin: f64, end: f64) -> Option<([f64; 3], f64)> {
        let place = |place: f64| {
            let place = place - self.begin;
            // Times are sums of many periods, so rounding moves them slightly off their edges.
            if (place - place.round()).abs() < SAME {
                place.round()
            } else {
                place
            }
        };
        let (from, to) = (place(begin), place(end));
        let last = self.len() as f64;
        if !(0.0 <= from && from <= to && to <= last) {
            return None;
        }
        let (first, behind) = (self.edge(from), self.edge(to));
        let sums = self.sums.each_ref().map(|sums| {
            let whole: f64 = sums[first..behind].iter().sum();
            whole + beyond(sums, behind, to - behind as f64)
                - beyond(sums, first, from - first as f64)
        });
        // The error of a cubic through the edges at −1, 0, 1 and 2 is proportional to this product.
        let u = to - behind as f64;
        let weight = (1.0 + u) * u * (1.0 - u) * (2.0 - u) / MIDWAY;
        Some((sums, weight * weight))
    }

    /// The edge at or before a position.
    fn edge(&self, place: f64) -> usize {
        (place as usize).min(self.len())
    }

    /// Mean square error of the integral midway between two edges.
    ///
    /// For this estimate, every second edge is omitted and interpolated from its neighbours, and every fourth edge from
    /// those two edges away. The squared error due to white noise (modelled by the filter) grows linearly with the edge
    /// distance; the squared error of a signal that the cubic does not follow grows with the eighth power of the
    /// distance. The two parts can therefore be separated; the signal part at the actual distance is 2⁻⁸ of the signal
    /// part at twice the distance.
    pub fn edge_error(&self) -> [f64; 3] {
        self.sums.each_ref().map(|sums| {
            let missed = |apart: usize| {
                let (mut squares, mut count) = (0.0, 0usize);
                for k in 3 * apart..sums.len().saturating_sub(3 * apart) {
                    let sum = |from: usize, to: usize| sums[from..to].iter().sum::<f64>();
                    // Integrals from the middle edge to those around it.
                    let (before, behind) = (-sum(k - apart, k), sum(k, k + apart));
                    let (first, last) = (-sum(k - 3 * apart, k), sum(k, k + 3 * apart));
                    let off = (9.0 * (before + behind) - (first + last)) / 16.0;
                    squares += off * off;
                    count += 1;
                }
                squares / count.max(1) as f64
            };
            // Edges that are two and four samples apart.
            let (near, far) = (missed(1), missed(2));
            let signal = ((far - 2.0 * near) / (256.0 - 2.0)).max(0.0);
            signal / 256.0
        })
    }
}

/// Integral from an edge to a position this fraction of a sample after it, from the cubic through the four surrounding
/// edges.
fn beyond(sums: &[f64], edge: usize, part: f64) -> f64 {
    if part == 0.0 {
        return 0.0;
    }
    if sums.len() < 3 {
        return sums[edge] * part;
    }
    // Differences from the first of the four edges to the others.
    let first = edge.saturating_sub(1).min(sums.len() - 3);
    let one = sums[first];
    let two = one + sums[first + 1];
    let three = two + sums[first + 2];
    let cubic = |x: f64| {
        one * x * (x - 2.0) * (x - 3.0) / 2.0 - two * x * (x - 1.0) * (x - 3.0) / 2.0
            + three * x * (x - 1.0) * (x - 2.0) / 6.0
    };
    let from = (edge - first) as f64;
    cubic(from + part) - cubic(from)
}

/// Samples integrated over intervals other than those of their stream, with the resulting error.
pub struct Resampled {
    output: Output,
    /// Sum of squared errors at the edges of all samples.
    weights: f64,
    count: f64,
    /// Mean square errors midway between edges, weighted by the number of samples.
    squares: [f64; 3],
    samples: f64,
}

impl Resampled {
    pub fn new(output: Output) -> Self {
        Self {
            output,
            weights: 0.0,
            count: 0.0,
            squares: [0.0; 3],
            samples: 0.0,
        }
    }

    /// Row value for the interval between two positions; `None` if the interval is outside the data.
    pub fn sample(&mut self, course: &Course, begin: f64, end: f64) -> Option<[f64; 3]> {
        let (sums, weight) = course.between(begin, end)?;
        self.weights += weight;
        self.count += 1.0;
        Some(match self.output {
            // If both clocks are the same, the values are returned unchanged, to the last bit.
            Output::Rate if (end - begin - 1.0).abs() > 1e-9 => sums.map(|sum| sum / (end - begin)),
            _ => sums,
        })
    }

    /// Measures the error on a course.
    pub fn measure(&mut self, course: &Course) {
        let samples = course.len() as f64;
        self.samples += samples;
        for (squares, error) in self.squares.iter_mut().zip(course.edge_error()) {
            *squares += error * samples;
        }
    }

    /// RMS error of the integral at an edge, in values times samples.
    pub fn error(&self) -> [f64; 3] {
        let weight = self.weights / self.count.max(1.0);
        let of = |square: f64| (weight * square / self.samples.max(1.0)).sqrt();
        self.squares.map(of)
    }
}

/// Number of samples that the cubic extends beyond the last one.
const AHEAD: f64 = 2.0;
/// Number of samples that the cubic extends before the first one.
const BACK: usize = 2;

/// Uniform samples of a triad, which are computed as drifting samples arrive.
pub struct Even {
    wander: Wander,
    lag: f64,
    held: Course,
    /// The next sample.
    next: f64,
    resampled: Resampled,
}

/// Edges of drifting samples relative to uniform samples; the uniform samples start with the first whole one. Each time
/// stamp is `lag` samples after the start of its sample.
pub fn place(wander: &Wander, lag: f64, edge: usize) -> f64 {
    wander.time(edge as f64 - lag) + lag
}

/// Number of uniform samples that these drifting samples cover, from the first.
pub fn reached(wander: &Wander, lag: f64, samples: &Range<usize>) -> Range<usize> {
    let first = place(wander, lag, 0).ceil();
    let of = |edge| place(wander, lag, edge) - first;
    of(samples.start).floor() as usize..of(samples.end).ceil() as usize
}

impl Even {
    pub fn new(wander: &Wander, lag: f64, output: Output) -> Self {
        Self {
            next: place(wander, lag, 0).ceil(),
            wander: wander.clone(),
            lag,
            held: Course::default(),
            resampled: Resampled::new(output),
        }
    }

    pub fn push(&mut self, sample: [f64; 3]) {
        for (sums, value) in self.held.sums.iter_mut().zip(sample) {
            sums.push(value);
        }
    }

    /// Returns the samples that the input covers (at the end, all samples), and releases data that are no longer
    /// needed.
    pub fn give(&mut self, at_end: bool, mut take: impl FnMut([f64; 3])) {
        let until = self.held.end() - if at_end { 0.0 } else { AHEAD };
        let edge = |time: f64| self.wander.number(time - self.lag) + self.lag;
        let mut begin = edge(self.next);
        loop {
            let end = edge(self.next + 1.0);
            if end > until {
                break;
            }
            let Some(sample) = self.resampled.sample(&self.held, begin, end) else {
                break;
            };
            take(sample);
            self.next += 1.0;
            begin = end;
        }
        self.resampled.measure(&self.held);
        let gone = ((begin - self.held.begin) as usize).saturating_sub(BACK);
        for sums in &mut self.held.sums {
            sums.drain(..gone.min(sums.len()));
        }
        self.held.begin += gone as f64;
    }

    /// RMS error of the integral at an edge, in values times samples.
    pub fn error(&self) -> [f64; 3] {
        self.resampled.error()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the edges of samples are by a clock that goes back.
    #[test]
    fn there_is_no_integral_from_a_later_place_to_an_earlier_one() {
        let course = Course {
            begin: 10.0,
            sums: [vec![1.0; 8], vec![2.0; 8], vec![3.0; 8]],
        };
        assert_eq!(course.between(12.0, 15.0).unwrap().0, [3.0, 6.0, 9.0]);
        assert!(course.between(15.0, 12.0).is_none());
        assert!(course.between(f64::NAN, 12.0).is_none());
    }
}
