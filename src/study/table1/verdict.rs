//! Whether the paper's figures are reproduced.

use super::paper::{Published, SAMPLES};
use super::quantity::ByQuantity;
use super::reading::{Kind, Reading};
use super::response::Moments;

/// Two means agree if they differ by no more than this many standard errors of their difference: 99 %
/// of the normal distribution.
pub const AGREEMENT: f64 = 2.576;
/// A figure that ought to be zero is rounding if it is less than this part of the same figure of the
/// three-angle form.
const ROUNDING: f64 = 1e-6;

/// What can be said of one of the paper's four columns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Verdict {
    /// All five means agree as stated.
    Reproduced,
    /// Both are zero but for rounding.
    Zero,
    /// All five agree under another reading that a correct program may have.
    UnderAnotherReading(&'static Reading),
    /// They do not agree under any reading of a correct program; the mistake under which they do, if
    /// one is known.
    NotReproducible(Option<&'static Reading>),
}

/// Difference of the paper's mean from that of a population of `n`, in standard errors of the
/// difference: `(m_paper − m) / (s √(1/50 + 1/n))`, with the standard deviation of the population for
/// both samples.
pub(super) fn difference(paper: &Moments, population: &Moments, n: usize) -> f64 {
    let error = population.std * (1.0 / SAMPLES as f64 + 1.0 / n as f64).sqrt();
    (paper.mean - population.mean) / error
}

/// The verdict on a column of the table from the differences of each of its readings; `three_angle` is
/// the column of the three-angle form of the same triad.
pub(super) fn verdict(
    published: &'static Published,
    three_angle: &Published,
    differences: &[ByQuantity<f64>],
) -> Verdict {
    let fits = |kind: Kind| {
        let readings = published.readings.iter().zip(differences);
        readings
            .filter(move |(reading, _)| reading.kind == kind)
            .find(|(_, z)| z.iter().all(|z| z.abs() <= AGREEMENT))
            .map(|(reading, _)| reading)
    };
    if fits(Kind::Stated).is_some() {
        return Verdict::Reproduced;
    }
    let mut pairs = published.moments().into_iter().zip(three_angle.moments());
    if pairs.all(|(own, three)| own.mean < ROUNDING * three.mean) {
        return Verdict::Zero;
    }
    match fits(Kind::Assumption) {
        Some(reading) => Verdict::UnderAnotherReading(reading),
        None => Verdict::NotReproducible(fits(Kind::Slip)),
    }
}
