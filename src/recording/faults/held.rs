//! Axes that an end of their range holds while the instrument rests.
//!
//! An axis that is clipped over whole dwells has its extreme there again and again, so often that the most silent part
//! of its rows has no noise by which a repeat would be improbable. Noise is therefore measured where axes are not at
//! their extremes. Where one is, its noise is as much smaller as that of the triad's other axes, which tell whether all
//! is more silent there.

use super::chance::Limit;
use super::stuck::{Column, runs};

/// σ of the noise of a triad's axis, where an extreme of it comes in a row more often than chance makes it: by the
/// smallest value, and by the largest. `None` where it does not, or where no noise is to be seen.
pub(super) fn held(triad: [&Column; 3], axis: usize, limit: Limit) -> [Option<f64>; 2] {
    let extremes = triad.map(|column| extremes(column.values));
    let longest = extremes[axis].map(|end| longest(triad[axis].values, end));
    if longest == [0; 2] {
        return [None; 2];
    }
    let column = triad[axis];
    // Block by block.
    let at = [0, 1, 2].map(|k| {
        let has = |block: &[f64], end| block.contains(&extremes[k][end]);
        let blocks = triad[k].blocks();
        Vec::from_iter(blocks.map(|block| [0, 1].map(|end| has(block, end))))
    });
    let is_free = |k: usize, block: usize| at[k][block] == [false; 2];
    let noise = |of: usize, among: &dyn Fn(usize) -> bool| {
        let blocks = triad[of].blocks().enumerate();
        let blocks = blocks.filter(|(block, _)| among(*block));
        triad[of].noise_at_rest(blocks.map(|(_, block)| block))
    };
    let elsewhere = column.blocks().enumerate();
    let elsewhere = elsewhere.filter(|(block, _)| is_free(axis, *block));
    let elsewhere: Vec<f64> = elsewhere.flat_map(|(_, rows)| rows).copied().collect();
    let elsewhere = Column {
        values: &elsewhere,
        ..*column
    };
    let usual = noise(axis, &|block| is_free(axis, block));
    [0, 1].map(|end| {
        let quieter = |other: usize| {
            let there = |block: usize| at[axis][block][end] && is_free(other, block);
            let elsewhere = |block: usize| is_free(axis, block) && is_free(other, block);
            match noise(other, &elsewhere) {
                // It tells nothing.
                0.0 => 0.0,
                usual => (noise(other, &there) / usual).min(1.0),
            }
        };
        let others = (0..3).filter(|&other| other != axis);
        let variance = usual * others.map(quieter).fold(1.0, f64::min);
        if variance == 0.0 {
            return None;
        }
        let probability = elsewhere.repeat_probability(variance);
        let is_held = longest[end] as f64 > limit.nats / probability.recip().ln();
        is_held.then(|| variance.sqrt() * column.step)
    })
}

fn extremes(values: &[f64]) -> [f64; 2] {
    let extreme = |of: fn(f64, f64) -> f64| values.iter().copied().fold(f64::NAN, of);
    [extreme(f64::min), extreme(f64::max)]
}

/// How often a value repeats itself in a row.
fn longest(values: &[f64], value: f64) -> usize {
    let runs = runs(values).into_iter();
    let of_value = runs.filter(|run| values[run.start] == value);
    of_value.map(|run| run.len()).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    const ROWS: usize = 18_000;
    /// A third of the record at this level.
    const HIGH: Range<usize> = 6_000..12_000;

    /// Three axes on a grid of one, with noise of these σ where the first is high and elsewhere.
    fn triad(level: f64, sigma: f64, there: [f64; 3]) -> [Vec<f64>; 3] {
        let mut random = ChaCha8Rng::seed_from_u64(8);
        [0, 1, 2].map(|axis| {
            let mut row = |k: usize| {
                let (mean, sigma) = match HIGH.contains(&k) {
                    true => (if axis == 0 { level } else { 300.0 }, there[axis]),
                    false => (100.0, sigma),
                };
                let normal: f64 = StandardNormal.sample(&mut random);
                (mean + sigma * normal).round()
            };
            (0..ROWS).map(&mut row).collect()
        })
    }

    fn held_by(triad: &[Vec<f64>; 3]) -> [Option<f64>; 2] {
        let columns = [0, 1, 2].map(|axis| Column {
            values: &triad[axis],
            step: 1.0,
            pulses: false,
        });
        held(
            [0, 1, 2].map(|axis| &columns[axis]),
            0,
            Limit::of_rows(ROWS),
        )
    }

    #[test]
    fn an_axis_clipped_while_it_rests_is_held_however_far_the_truth_is_beyond() {
        for beyond in [0.5, 1.0, 50.0] {
            let mut triad = triad(1000.0 + 3.0 * beyond, 3.0, [3.0; 3]);
            for value in &mut triad[0] {
                *value = value.min(1000.0);
            }
            let [low, high] = held_by(&triad);
            assert_eq!(low, None);
            assert!((high.unwrap() - 3.0).abs() < 0.5, "{beyond} {high:?}");
        }
    }

    #[test]
    fn an_extreme_that_noise_reaches_holds_nothing() {
        assert_eq!(held_by(&triad(1000.0, 3.0, [3.0; 3])), [None; 2]);
        assert_eq!(held_by(&triad(1000.0, 0.3, [0.3; 3])), [None; 2]);
        assert_eq!(held_by(&triad(1000.0, 0.0, [0.0; 3])), [None; 2]);
    }

    #[test]
    fn where_all_axes_are_more_silent_the_same_value_again_is_no_end() {
        assert_eq!(held_by(&triad(1000.0, 3.0, [0.1; 3])), [None; 2]);
        assert!(held_by(&triad(1000.0, 3.0, [0.1, 3.0, 3.0]))[1].is_some());
    }
}
