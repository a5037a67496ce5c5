//! One way to fill a hole, and the error that it makes where there is no hole.

use std::ops::Range;

use nalgebra::{Matrix4, Vector4};

use crate::recording::faults::sound::{Pattern, Sound};

/// Intact stretches that are filled as the hole is, on either side at most …
const TRIALS: usize = 16;
/// … and on both together at least.
const FEWEST_TRIALS: usize = 8;
/// A change across the hole that is this many times the largest across intact stretches is not known
/// from them.
const UNTRIED: f64 = 2.0;

/// A polynomial through neighbours by least squares.
pub(super) struct Fill {
    hole: Range<usize>,
    /// Neighbours that follow one another, all those before the hole first.
    runs: Vec<Range<usize>>,
    /// How many of the runs are before the hole.
    before: usize,
    /// Of each neighbour in the sum over the hole.
    weights: Vec<f64>,
    /// By how many samples later or earlier intact stretches near by are.
    shifts: Vec<isize>,
    degree: usize,
    inverse: Matrix4<f64>,
    scale: f64,
}

impl Fill {
    /// Of this degree through the nearest of the neighbours before and after a hole, each outwards.
    pub fn new(
        degree: usize,
        sides: [&[usize]; 2],
        hole: Range<usize>,
        sound: &Sound,
    ) -> Option<Self> {
        let [before, after] = sides;
        let runs_before = runs(before.iter().rev());
        let number_before = runs_before.len();
        let runs: Vec<_> = runs_before.into_iter().chain(runs(after.iter())).collect();
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
        // Powers beyond the degree stay out.
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

    /// By how much later the same samples are all sound, for so many places on either side as are tried.
    fn intact(&self, sound: &Sound) -> Vec<isize> {
        let (before, after) = self.runs.split_at(self.before);
        let hole = std::slice::from_ref(&self.hole);
        let pattern = Pattern::new(&[before, hole, after].concat());
        let length = self.hole.len();
        let used: usize = self.runs.iter().map(Range::len).sum();
        let stride = length.div_ceil(2);
        let reach = (6 * (length + used) + super::MOST) as isize;
        let of_side = |direction: isize| {
            let shifts = (1..).map(move |k: isize| k * stride as isize);
            let shifts = shifts.take_while(move |&shift| shift <= reach);
            let shifts = shifts.map(move |shift| direction * shift);
            let intact = shifts.filter(|&shift| pattern.is_sound(sound, shift));
            intact.take(TRIALS)
        };
        of_side(-1).chain(of_side(1)).collect()
    }

    /// Mean square of the sum's error over intact stretches near by, every other and the rest; none if the
    /// first is more than `most`.
    pub fn measured(&self, axis: &[f64], most: f64) -> Option<[f64; 2]> {
        let length = self.hole.len();
        let count = self.shifts.len();
        let mut largest_change = 0f64;
        let mut mean_square = |half: usize, most: f64| {
            let of_half = ((count + 1 - half) / 2) as f64;
            let mut squares = 0.0;
            for &shift in self.shifts.iter().skip(half).step_by(2) {
                let hole = self.hole.start.wrapping_add_signed(shift)
                    ..self.hole.end.wrapping_add_signed(shift);
                let (sum, change) = self.sum_and_change(axis, shift);
                let error = sum - axis[hole].iter().sum::<f64>();
                squares += error * error;
                largest_change = largest_change.max(change.abs());
                if squares > most * of_half {
                    return None;
                }
            }
            Some(squares / of_half)
        };
        let halves = [mean_square(0, most)?, mean_square(1, f64::INFINITY)?];
        // A larger change than any tried may have come at any moment.
        let change = self.sum_and_change(axis, 0).1.abs();
        let sudden = if change > UNTRIED * largest_change {
            (change * length as f64).powi(2) / 12.0
        } else {
            0.0
        };
        Some(halves.map(|half| half.max(sudden)))
    }

    /// Sum over the hole as it is filled.
    pub fn sum(&self, axis: &[f64]) -> f64 {
        self.sum_and_change(axis, 0).0
    }

    /// Sum over the hole, and mean of the neighbours after less that of those before, `shift` samples later.
    fn sum_and_change(&self, axis: &[f64], shift: isize) -> (f64, f64) {
        let (before, after) = self.runs.split_at(self.before);
        let mut weights = self.weights.as_slice();
        let mut of_side = |runs: &[Range<usize>]| {
            let mut all = (0.0, 0.0, 0);
            for run in runs {
                let (of_run, rest) = weights.split_at(run.len());
                weights = rest;
                let start = run.start.wrapping_add_signed(shift);
                let (weighted, sum) = sums(of_run, &axis[start..start + run.len()]);
                all = (all.0 + weighted, all.1 + sum, all.2 + run.len());
            }
            all
        };
        let before = of_side(before);
        let after = of_side(after);
        let change = match (before.2, after.2) {
            (0, _) | (_, 0) => 0.0,
            (of_before, of_after) => after.1 / of_after as f64 - before.1 / of_before as f64,
        };
        (before.0 + after.0, change)
    }
}

/// Runs of samples that follow one another, of increasing samples.
fn runs<'a>(samples: impl Iterator<Item = &'a usize>) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for &k in samples {
        match runs.last_mut() {
            Some(run) if run.end == k => run.end += 1,
            _ => runs.push(k..k + 1),
        }
    }
    runs
}

/// Sums that are formed beside each other, so that none waits for another.
const BESIDE: usize = 4;

/// Sum of the values with their weights, and as they are.
fn sums(weights: &[f64], values: &[f64]) -> (f64, f64) {
    let (weights, last_weights) = weights.as_chunks::<BESIDE>();
    let (values, last_values) = values.as_chunks::<BESIDE>();
    let mut of_lanes = [[0.0; BESIDE]; 2];
    for (weights, values) in weights.iter().zip(values) {
        for lane in 0..BESIDE {
            of_lanes[0][lane] += weights[lane] * values[lane];
            of_lanes[1][lane] += values[lane];
        }
    }
    let [mut weighted, mut sum] = of_lanes.map(|lanes| lanes.iter().sum::<f64>());
    for (weight, value) in last_weights.iter().zip(last_values) {
        weighted += weight * value;
        sum += value;
    }
    (weighted, sum)
}
