//! Interpolation of missing samples on an axis from both sides, with an error measured on intact stretches.

mod fill;

use std::cell::OnceCell;
use std::ops::Range;

use fill::{Fill, MOST};

/// Polynomials tried: degree, and samples used from either side. Each further polynomial must agree with the best one
/// so far at the hole itself, because its test stretches are farther away.
const CANDIDATES: [(usize, usize); 12] = [
    (1, 1),
    (1, 2),
    (3, 2),
    (1, 4),
    (3, 4),
    (1, 8),
    (3, 8),
    (1, 16),
    (3, 16),
    (1, 32),
    (3, 32),
    (1, MOST),
];
/// Polynomials for a hole at the start or end of the recording.
const ONE_SIDED: [(usize, usize); 4] = [(0, 1), (0, 4), (0, 16), (0, MOST)];
/// A hole and its neighbours may span this many times their own length, other holes included.
const REACH: usize = 4;
/// Number of σ within which two ways to fill a hole agree.
const AGREE: f64 = 3.0;

/// The interpolations available for a range of faulty samples, on any axis.
pub struct Hole<'a> {
    sound: &'a [bool],
    samples: Range<usize>,
    /// The nearest good samples before and after, outwards.
    sides: [Vec<usize>; 2],
    candidates: &'static [(usize, usize)],
    /// The first possible candidate, and the straight line through most samples.
    extremes: OnceCell<Option<[Fill; 2]>>,
    fills: OnceCell<Vec<Fill>>,
}

impl<'a> Hole<'a> {
    /// A hole that consists of these samples; `sound` marks the usable samples of the record. No error is stated for a
    /// hole longer than `longest`.
    pub fn new(sound: &'a [bool], samples: Range<usize>, longest: usize) -> Self {
        let sides = [
            neighbours(sound, (0..samples.start).rev(), samples.len()),
            neighbours(sound, samples.end..sound.len(), samples.len()),
        ];
        let candidates: &[_] = match (
            samples.len() <= longest,
            sides.each_ref().map(Vec::is_empty),
        ) {
            (false, _) => &[],
            (true, [false, false]) => &CANDIDATES,
            (true, _) => &ONE_SIDED,
        };
        Self {
            sound,
            samples,
            sides,
            candidates,
            extremes: OnceCell::new(),
            fills: OnceCell::new(),
        }
    }

    /// Fills the hole on an axis. Returns the mean square error of the sum over the hole; `None` if it is unknown.
    ///
    /// `rounding` is the mean square of this error that rounding to whole steps can cause. If the errors are as small
    /// as this, the choice of the best fill depends on the individual steps next to the hole. Among pulses that are
    /// mostly zero, for example, a fill without any pulse seems free of error, but is biased by whole pulses. In this
    /// case, the widest fill is used for any values, because it is linear in the values and therefore unbiased.
    pub fn fill(&self, axis: &mut [f64], rounding: f64) -> Option<f64> {
        let best = self.within(axis, rounding).or_else(|| self.best(axis));
        if let Some(best) = best {
            best.fill.apply(axis);
            return Some(best.variance);
        }
        // Nothing is integrated over these samples, but values read there must not be wild.
        let [before, after] = self.sides.each_ref().map(|side| side.first());
        let [before, after] = [before, after].map(|end| end.map(|&k| axis[k]));
        let from = before.or(after).unwrap_or(0.0);
        let to = after.unwrap_or(from);
        let steps = self.samples.len() as f64 + 1.0;
        for (step, k) in self.samples.clone().enumerate() {
            axis[k] = from + (to - from) * (step as f64 + 1.0) / steps;
        }
        None
    }

    /// The widest fill, if its error is within that of rounding.
    fn within(&self, axis: &[f64], rounding: f64) -> Option<Trial<'_>> {
        if rounding <= 0.0 {
            return None;
        }
        let [narrowest, widest] = self.extremes.get_or_init(|| self.both()).as_ref()?;
        let halves = widest.measured(axis, 2.0 * rounding)?;
        // This fill was not selected by either half, so both halves show its error.
        let variance = halves.iter().sum::<f64>() / 2.0;
        let sum = widest.sum(axis);
        let apart = (sum - narrowest.sum(axis)).powi(2);
        let is_within = variance <= rounding && apart <= AGREE * AGREE * rounding;
        is_within.then_some(Trial {
            fill: widest,
            sum,
            first_half: halves[0],
            variance,
        })
    }

    /// The fill with the least error on intact stretches.
    fn best(&self, axis: &[f64]) -> Option<Trial<'_>> {
        let mut best: Option<Trial> = None;
        for fill in self.fills.get_or_init(|| self.all()) {
            let most = best.as_ref().map_or(f64::INFINITY, |best| best.first_half);
            let Some(halves) = fill.measured(axis, most) else {
                continue;
            };
            let sum = fill.sum(axis);
            let better = best.as_ref().is_none_or(|best| {
                halves[0] < best.first_half
                    && (sum - best.sum).powi(2) <= AGREE * AGREE * best.variance
            });
            if better {
                best = Some(Trial {
                    fill,
                    sum,
                    first_half: halves[0],
                    // The smallest error of many fills on the first half is too small by chance; the second half gives
                    // the actual error.
                    variance: halves[0].max(halves[1]),
                });
            }
        }
        best
    }

    fn all(&self) -> Vec<Fill> {
        let fills = self.candidates.iter();
        fills
            .filter_map(|&candidate| self.possible(candidate))
            .collect()
    }

    fn both(&self) -> Option<[Fill; 2]> {
        let mut candidates = self.candidates.iter();
        let narrowest = candidates.find_map(|&candidate| self.possible(candidate))?;
        let mut straight = self
            .candidates
            .iter()
            .rev()
            .filter(|(degree, _)| *degree < 2);
        let widest = straight.find_map(|&candidate| self.possible(candidate))?;
        Some([narrowest, widest])
    }

    fn possible(&self, (degree, count): (usize, usize)) -> Option<Fill> {
        let both = self.sides.iter().all(|side| !side.is_empty());
        let enough = |side: &Vec<usize>| side.len() >= count || (!both && side.is_empty());
        if !self.sides.iter().all(enough) {
            return None;
        }
        let sides = self
            .sides
            .each_ref()
            .map(|side| &side[..count.min(side.len())]);
        Fill::new(degree, sides, self.samples.clone(), self.sound)
    }
}

/// The nearest good samples, outwards.
fn neighbours(sound: &[bool], outwards: impl Iterator<Item = usize>, hole: usize) -> Vec<usize> {
    outwards
        .take(REACH * (MOST + hole))
        .filter(|&k| sound[k])
        .take(MOST)
        .collect()
}

/// A tested fill of a hole.
struct Trial<'a> {
    fill: &'a Fill,
    sum: f64,
    /// Mean square error on one half of the intact stretches.
    first_half: f64,
    /// The variance to be stated.
    variance: f64,
}

#[cfg(test)]
mod tests;
