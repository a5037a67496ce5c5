//! Verdicts on the reproduction of the paper's figures.

use super::paper::{Kind, Published, Reading, SAMPLES};
use super::quantity::{ByQuantity, Moments};

/// Two means agree if they differ by no more than this many standard errors of their difference, the 99 % limit of the
/// normal distribution.
pub const AGREEMENT: f64 = 2.576;
/// A figure that should be zero counts as rounding if it is below this fraction of the same figure of the three-angle
/// form.
const ROUNDING: f64 = 1e-6;

/// Verdict on one of the paper's four columns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Verdict {
    /// All five means agree as stated.
    Reproduced,
    /// The computed and the published errors are zero except for rounding.
    Zero,
    /// All five means agree under another reading that a correct program may implement.
    UnderAnotherReading(&'static Reading),
    /// The figures do not agree under any reading that a correct program may implement; contains the mistake that
    /// reproduces them, if known.
    NotReproducible(Option<&'static Reading>),
}

/// Mean of the paper minus mean of a population of `n` samples, in standard errors of the difference: `(m_paper − m) /
/// (s √(1/50 + 1/n))`, with the standard deviation of the population for both samples.
pub fn difference(paper: &Moments, population: &Moments, n: usize) -> f64 {
    let error = population.std * (1.0 / SAMPLES as f64 + 1.0 / n as f64).sqrt();
    (paper.mean - population.mean) / error
}

/// The verdict on a column of the table, from its figures under the stated reading with their differences, and from the
/// differences under its other readings. `three_angle` is the column of the three-angle form of the same triad.
pub fn verdict(
    published: &Published,
    three_angle: &Published,
    (stated, differences): (&ByQuantity<Moments>, &ByQuantity<f64>),
    others: &[(&'static Reading, ByQuantity<f64>)],
) -> Verdict {
    let agree = |differences: &ByQuantity<f64>| differences.iter().all(|z| z.abs() <= AGREEMENT);
    let fits = |kind: Kind| {
        let mut readings = others.iter().filter(|(reading, _)| reading.kind == kind);
        readings
            .find(|(_, z)| agree(z))
            .map(|(reading, _)| *reading)
    };
    if agree(differences) {
        return Verdict::Reproduced;
    }
    let three_angle = three_angle.moments();
    let zero = |figures: &ByQuantity<Moments>| {
        let mut pairs = figures.iter().zip(&three_angle);
        pairs.all(|(own, three)| own.mean < ROUNDING * three.mean)
    };
    if zero(stated) && zero(&published.moments()) {
        return Verdict::Zero;
    }
    match fits(Kind::Assumption) {
        Some(reading) => Verdict::UnderAnotherReading(reading),
        None => Verdict::NotReproducible(fits(Kind::Slip)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::paper::TABLE;
    use super::*;

    const NEAR: ByQuantity<f64> = [2.0, -2.5, 0.0, 1.0, -1.0];
    const FAR: ByQuantity<f64> = [0.0, 0.0, 0.0, 0.0, 2.6];
    const NOTHING: ByQuantity<Moments> = [Moments {
        mean: 0.0,
        std: 0.0,
    }; 5];

    #[test]
    fn one_figure_of_five_that_is_apart_forbids_to_call_a_column_reproduced() {
        let three = &TABLE[1];
        let [wide, long, ..] = three.others else {
            panic!("two readings");
        };
        let judge = |stated, first, second| {
            let others = [(wide, first), (long, second)];
            verdict(three, three, (&three.moments(), &stated), &others)
        };
        assert_eq!(judge(NEAR, FAR, FAR), Verdict::Reproduced);
        assert_eq!(judge(FAR, FAR, NEAR), Verdict::UnderAnotherReading(long));
        assert_eq!(judge(FAR, FAR, FAR), Verdict::NotReproducible(None));
    }

    #[test]
    fn a_slip_that_gives_the_figures_does_not_make_them_reproducible() {
        let (six, three) = (&TABLE[0], &TABLE[1]);
        let slip = &six.others[0];
        assert_eq!(
            verdict(six, three, (&NOTHING, &FAR), &[(slip, NEAR)]),
            Verdict::NotReproducible(Some(slip))
        );
    }

    #[test]
    fn zero_is_said_only_where_both_figures_are() {
        let (six, three) = (&TABLE[2], &TABLE[3]);
        let judge = |stated| verdict(six, three, (stated, &FAR), &[]);
        assert_eq!(judge(&NOTHING), Verdict::Zero);
        assert_eq!(judge(&three.moments()), Verdict::NotReproducible(None));
    }

    #[test]
    fn the_error_of_a_difference_counts_both_samples() {
        let [paper, ours] = [4.0, 1.0].map(|mean| Moments { mean, std: 5.0 });
        assert!((difference(&paper, &ours, SAMPLES) - 3.0).abs() < 1e-12);
    }
}
