//! Drift of a sample clock relative to a uniform one.

use super::median;

/// Rows per knot: many compared with jitter, few compared with changes of the oscillator rate.
const ROWS: usize = 64;
/// Stamps closer than this fraction of a sample to their due times need no drifting clock.
const WITHIN: f64 = 0.5;

/// Neighbouring rows: mean number, median stamp deviation, s, and line of the middle row.
#[derive(Debug, Clone, Copy)]
struct Knot {
    number: f64,
    off: f64,
    line: u64,
}

/// Stamps in order, relative to a reference clock.
#[derive(Debug, Clone, Default)]
pub struct Knots {
    /// Number, deviation and line.
    rows: Vec<(usize, f64, u64)>,
    knots: Vec<Knot>,
    count: usize,
    squares: f64,
    largest: f64,
}

impl Knots {
    pub fn push(&mut self, number: usize, off: f64, line: u64) {
        self.rows.push((number, off, line));
        if self.rows.len() == ROWS {
            self.tie();
        }
    }

    /// Includes the remaining rows, if there are enough of them to separate drift from jitter.
    pub fn finish(mut self) -> Self {
        if 2 * self.rows.len() >= ROWS || self.knots.is_empty() {
            self.tie();
        }
        self
    }

    fn tie(&mut self) {
        let mut offs: Vec<f64> = self.rows.iter().map(|&(_, off, _)| off).collect();
        let Some(off) = median(&mut offs) else {
            return;
        };
        let numbers = self.rows.iter().map(|&(number, ..)| number as f64);
        let number = numbers.sum::<f64>() / self.rows.len() as f64;
        let (.., line) = self.rows[self.rows.len() / 2];
        self.knots.push(Knot { number, off, line });
        for (_, of_row, _) in self.rows.drain(..) {
            let jitter = (of_row - off).abs();
            self.count += 1;
            self.squares += jitter * jitter;
            self.largest = self.largest.max(jitter);
        }
    }

    /// RMS and largest deviation of stamps from their knots, s.
    pub fn jitter(&self) -> (f64, f64) {
        let mean = self.squares / self.count.max(1) as f64;
        (mean.sqrt(), self.largest)
    }

    /// Drift relative to a clock of this period, with an offset and a period difference to the reference clock; `None`
    /// if the stamps are close enough to it. `Err` contains the line at which the times do not increase.
    pub fn wander(&self, later: f64, longer: f64, period: f64) -> Result<Option<Wander>, u64> {
        let knots = self.knots.iter().map(|knot| {
            let off = (knot.off - later - knot.number * longer) / period;
            (knot.number, off)
        });
        let knots: Vec<_> = knots.collect();
        let wanders = knots.iter().any(|(_, off)| off.abs() > WITHIN);
        let wander = (wanders && knots.len() > 1).then_some(Wander { knots });
        match wander.as_ref().and_then(Wander::stops) {
            Some(knot) => Err(self.knots[knot].line),
            None => Ok(wander),
        }
    }
}

/// Samples of a drifting clock on the time axis of a uniform one, both in samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Wander {
    /// Number and delay, with linear interpolation.
    knots: Vec<(f64, f64)>,
}

impl Wander {
    /// Time of a sample, which may be fractional.
    pub fn time(&self, number: f64) -> f64 {
        let behind = self.knots.partition_point(|&(knot, _)| knot <= number);
        self.between(behind, |(knot, off)| (knot, knot + off), number)
    }

    /// The sample at a given time.
    pub fn number(&self, time: f64) -> f64 {
        let behind = self
            .knots
            .partition_point(|&(knot, off)| knot + off <= time);
        self.between(behind, |(knot, off)| (knot + off, knot), time)
    }

    /// The first knot after which the clock no longer increases.
    fn stops(&self) -> Option<usize> {
        let time = |(number, off): (f64, f64)| number + off;
        let forward = |pair: &[(f64, f64)]| time(pair[1]) > time(pair[0]);
        self.knots.windows(2).position(|pair| !forward(pair))
    }

    /// Largest deviation of a sample, in samples.
    pub fn largest(&self) -> f64 {
        let offs = self.knots.iter().map(|(_, off)| off.abs());
        offs.fold(0.0, f64::max)
    }

    /// Interpolates between the adjacent knots, along either axis.
    fn between(&self, behind: usize, seen: impl Fn((f64, f64)) -> (f64, f64), at: f64) -> f64 {
        let behind = behind.clamp(1, self.knots.len() - 1);
        let (x, y) = seen(self.knots[behind - 1]);
        let (next_x, next_y) = seen(self.knots[behind]);
        y + (next_y - y) * (at - x) / (next_x - x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_stops_going_on_where_its_times_do_not_increase() {
        let stops = |offs: [f64; 3]| {
            let knots = offs.into_iter().enumerate();
            let knots = knots.map(|(k, off)| (32.0 + 64.0 * k as f64, off));
            let wander = Wander {
                knots: knots.collect(),
            };
            wander.stops()
        };
        assert_eq!(stops([0.0, -60.0, 60.0]), None);
        assert_eq!(stops([0.0, 60.0, -10.0]), Some(1));
        assert_eq!(stops([0.0, -64.0, 0.0]), Some(0));
        assert_eq!(stops([0.0, f64::NAN, 0.0]), Some(0));
    }
}
