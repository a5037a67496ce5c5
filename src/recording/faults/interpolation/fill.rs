//! One way to fill a hole, with its error on intact stretches.

use std::ops::Range;

use nalgebra::{Matrix4, Vector4};

use crate::recording::faults::rows::consecutive;

/// Maximum number of samples used on either side of a hole.
pub const MOST: usize = 64;
/// Maximum number of intact stretches on either side for testing a fill.
const TRIALS: usize = 16;
/// Minimum number of intact stretches on both sides together for testing a fill.
const FEWEST_TRIALS: usize = 8;
/// If the change across the hole exceeds this many times the largest change across intact stretches, those stretches do
/// not represent the hole.
const UNTRIED: f64 = 2.0;

/// A least-squares polynomial through neighbours.
pub struct Fill {
    hole: Range<usize>,
    /// Runs of consecutive neighbours; those before the hole come first.
    runs: Vec<Range<usize>>,
    /// Number of runs before the hole.
    before: usize,
    /// Weight of each neighbour in the sum over the hole.
    weights: Vec<f64>,
    /// Offsets of the nearby intact stretches, in samples.
    shifts: Vec<isize>,
    degree: usize,
    inverse: Matrix4<f64>,
    scale: f64,
}

impl Fill {
    /// A polynomial of this degree through the neighbours before and after a hole, each listed outwards.
    pub fn new(
        degree: usize,
        sides: [&[usize]; 2],
        hole: Range<usize>,
        sound: &[bool],
    ) -> Option<Self> {
        let [before, after] = sides;
        let mut runs = consecutive(before.iter().rev().copied());
        let number_before = runs.len();
        runs.extend(consecutive(after.iter().copied()));
        let first = hole.start.min(runs.first()?.start);
        let last = hole.end.max(runs.last()?.end - 1);
        let mut fill = Self {
            hole,
            runs,
            before: number_before,
            weights: Vec::new(),
            shifts: Vec::new(),
            degree,
            inverse: Matrix4::zeros(),
            scale: 2.0 / (last - first) as f64,
        };
        fill.shifts = fill.intact(sound);
        if fill.shifts.len() < FEWEST_TRIALS {
            return None;
        }
        let used = || fill.runs.iter().flat_map(Range::clone);
        let powers = used().map(|k| fill.powers(k));
        let mut normal: Matrix4<f64> = powers.map(|x| x * x.transpose()).sum();
        // Powers beyond the degree are omitted.
        for k in degree + 1..4 {
            normal[(k, k)] = 1.0;
        }
        let inverse = normal.cholesky()?.inverse();
        let in_hole: Vector4<f64> = fill.hole.clone().map(|k| fill.powers(k)).sum();
        let of_sum = inverse * in_hole;
        let weights = used().map(|k| fill.powers(k).dot(&of_sum)).collect();
        Some(Self {
            inverse,
            weights,
            ..fill
        })
    }

    fn powers(&self, k: usize) -> Vector4<f64> {
        let middle = 0.5 * (self.hole.start + self.hole.end - 1) as f64;
        let x = (k as f64 - middle) * self.scale;
        match self.degree {
            0 => Vector4::new(1.0, 0.0, 0.0, 0.0),
            1 => Vector4::new(1.0, x, 0.0, 0.0),
            _ => Vector4::new(1.0, x, x * x, x * x * x),
        }
    }

    /// Fills the hole of an axis.
    pub fn apply(&self, axis: &mut [f64]) {
        let used = self.runs.iter().flat_map(Range::clone);
        let moments: Vector4<f64> = used.map(|k| self.powers(k) * axis[k]).sum();
        let polynomial = self.inverse * moments;
        for k in self.hole.clone() {
            axis[k] = polynomial.dot(&self.powers(k));
        }
    }

    /// Offsets at which hole and neighbours are all usable, up to [`TRIALS`] on either side.
    fn intact(&self, sound: &[bool]) -> Vec<isize> {
        let is_sound = |run: &Range<usize>, shift| {
            let start = run.start.checked_add_signed(shift);
            let samples = start.and_then(|start| sound.get(start..start + run.len()));
            samples.is_some_and(|samples| !samples.contains(&false))
        };
        let asked = || self.runs.iter().chain(std::iter::once(&self.hole));
        let length = self.hole.len();
        let used: usize = self.runs.iter().map(Range::len).sum();
        let stride = length.div_ceil(2);
        let reach = (6 * (length + used) + MOST) as isize;
        let of_side = |direction: isize| {
            let shifts = (1..).map(move |k: isize| k * stride as isize);
            let shifts = shifts.take_while(move |&shift| shift <= reach);
            let shifts = shifts.map(move |shift| direction * shift);
            let intact = shifts.filter(|&shift| asked().all(|run| is_sound(run, shift)));
            intact.take(TRIALS)
        };
        of_side(-1).chain(of_side(1)).collect()
    }

    /// Mean square errors of the sum over nearby intact stretches, separately for the even and the odd stretches;
    /// `None` if the first exceeds `most`.
    pub fn measured(&self, axis: &[f64], most: f64) -> Option<[f64; 2]> {
        let count = self.shifts.len();
        let change = self.change(axis, 0).abs();
        let mut is_tried = false;
        let mut mean_square = |half: usize, most: f64| {
            let of_half = ((count + 1 - half) / 2) as f64;
            let mut squares = 0.0;
            for &shift in self.shifts.iter().skip(half).step_by(2) {
                let hole = self.hole.start.wrapping_add_signed(shift)
                    ..self.hole.end.wrapping_add_signed(shift);
                let error = self.sum_after(axis, shift) - axis[hole].iter().sum::<f64>();
                squares += error * error;
                if squares > most * of_half {
                    return None;
                }
                is_tried = is_tried || change <= UNTRIED * self.change(axis, shift).abs();
            }
            Some(squares / of_half)
        };
        let halves = [mean_square(0, most)?, mean_square(1, f64::INFINITY)?];
        // A change larger than any tested may have happened at any moment.
        let sudden = if is_tried {
            0.0
        } else {
            (change * self.hole.len() as f64).powi(2) / 12.0
        };
        Some(halves.map(|half| half.max(sudden)))
    }

    /// Sum of the filled values over the hole.
    pub fn sum(&self, axis: &[f64]) -> f64 {
        self.sum_after(axis, 0)
    }

    /// The sum over a hole `shift` samples later.
    fn sum_after(&self, axis: &[f64], shift: isize) -> f64 {
        let (mut weights, mut sum) = (self.weights.as_slice(), 0.0);
        for run in &self.runs {
            let (of_run, rest) = weights.split_at(run.len());
            weights = rest;
            sum += product(of_run, &axis[later(run, shift)]);
        }
        sum
    }

    /// Mean of the neighbours after the hole minus the mean of those before, `shift` samples later; zero if one
    /// side has none.
    fn change(&self, axis: &[f64], shift: isize) -> f64 {
        let (before, after) = self.runs.split_at(self.before);
        let mean = |runs: &[Range<usize>]| {
            let count: usize = runs.iter().map(Range::len).sum();
            let values = runs.iter().flat_map(|run| &axis[later(run, shift)]);
            (count > 0).then(|| values.sum::<f64>() / count as f64)
        };
        let means = mean(before).zip(mean(after));
        means.map_or(0.0, |(before, after)| after - before)
    }
}

fn later(run: &Range<usize>, shift: isize) -> Range<usize> {
    let start = run.start.wrapping_add_signed(shift);
    start..start + run.len()
}

/// Number of sums formed in parallel, so that no sum waits for another.
const BESIDE: usize = 4;

fn product(weights: &[f64], values: &[f64]) -> f64 {
    let (weights, last_weights) = weights.as_chunks::<BESIDE>();
    let (values, last_values) = values.as_chunks::<BESIDE>();
    let mut sums = [0.0; BESIDE];
    for (weights, values) in weights.iter().zip(values) {
        for (sum, (weight, value)) in sums.iter_mut().zip(weights.iter().zip(values)) {
            *sum += weight * value;
        }
    }
    let last = last_weights.iter().zip(last_values);
    let last: f64 = last.map(|(weight, value)| weight * value).sum();
    sums.iter().sum::<f64>() + last
}
