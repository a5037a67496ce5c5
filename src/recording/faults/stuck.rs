//! Axes that stand still while others go on.

use std::ops::Range;

/// A run by chance may be this probable.
const CHANCE: f64 = 1e-9;
/// How often an axis changes is seen in this many rows on either side.
const AROUND: usize = 500;
/// Where all axes repeat in more than this part of the rows, noise is not seen and a standing table
/// looks as a stuck axis does.
const NOISE_FREE: f64 = 0.1;
/// A run by chance is not longer than this many times the longest of the others around.
const LONGER: usize = 4;
/// The same on a level by which a rate may drift: pulses then repeat ever longer, then ever shorter.
const LONGER_ON_LEVEL: usize = 12;
/// Fewer rows on the level tell nothing of that.
const FEWEST: usize = 50;
/// An axis that leaves its value by no more than this many steps of its grid may stand on it, or drift
/// by it: what it does on another level says nothing of that, only rows within so many steps do.
const QUIET_STEPS: f64 = 1.5;
const SAME_LEVEL_STEPS: f64 = 3.5;
/// Rows on either side of a run whose mean …
const BESIDE: usize = 32;
/// … is this many times further from its value than that of a rate which touches it, …
const MORE_THAN_TOUCHING: f64 = 3.0;
/// Or the means of so many such blocks on either side differ by less than this many steps, …
const BLOCKS: usize = 6;
const STANDS: f64 = 0.125;
/// … a run is this many times longer than all others there, …
const LONGER_WHERE_STANDING: usize = 6;
/// … and so far that the sum over the run is wrong by this many steps. Pulses are right to a few, however
/// long they repeat.
const WRONG_STEPS: f64 = 8.0;

/// For each column the rows that repeat the one before them so long that it is no chance, the first
/// of equal values left out. `steps` are those of the columns' grids.
pub(super) fn stuck(columns: &[&[f64]; 6], steps: &[Option<f64>; 6]) -> [Vec<Range<usize>>; 6] {
    let mut found = [const { Vec::new() }; 6];
    let rows = columns[0].len();
    let frozen = (1..rows).filter(|&k| columns.iter().all(|x| x[k] == x[k - 1]));
    if frozen.count() as f64 > NOISE_FREE * rows as f64 {
        return found;
    }
    for (axis, column) in columns.iter().enumerate() {
        let changes = |k: usize| columns.iter().any(|x| x[k] != x[k - 1]);
        for run in runs(column) {
            let repeats = run.len();
            // The least that can be too long where nothing repeats in all rows around.
            if repeats >= 3 && is_stuck(column, &run, steps[axis]) && run.clone().any(changes) {
                found[axis].push(run);
            }
        }
    }
    found
}

/// Stretches of rows each equal to the one before.
fn runs(column: &[f64]) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut start = 1;
    for k in 1..=column.len() {
        if k == column.len() || column[k] != column[k - 1] {
            if k > start {
                runs.push(start..k);
            }
            start = k + 1;
        }
    }
    runs
}

fn is_stuck(column: &[f64], run: &Range<usize>, step: Option<f64>) -> bool {
    let value = column[run.start];
    let leaves = |k: Option<usize>| {
        k.and_then(|k| column.get(k))
            .map_or(0.0, |other| (other - value).abs())
    };
    // The row before the run has its value. Both sides outwards.
    let before = run.start.saturating_sub(1 + AROUND)..run.start - 1;
    let after = run.end..column.len().min(run.end + AROUND);
    let sides: [Vec<f64>; 2] = [
        column[before.clone()].iter().rev().copied().collect(),
        column[after.clone()].to_vec(),
    ];
    let step = step.filter(|step| {
        let left = leaves(before.end.checked_sub(1)).max(leaves(Some(after.start)));
        left <= QUIET_STEPS * step
    });
    let mut seen = Seen::default();
    let Some(step) = step else {
        sides.iter().for_each(|side| seen.add(side));
        return run.len() > LONGER * seen.longest && seen.chance(run.len()) < CHANCE;
    };
    let sides = sides.map(|mut side| {
        let on_level = |other: &f64| (other - value).abs() <= SAME_LEVEL_STEPS * step;
        side.truncate(side.iter().take_while(|other| on_level(other)).count());
        seen.add(&side);
        side
    });
    let by_chance = seen.chance(run.len()) > CHANCE
        || run.len() < LONGER_ON_LEVEL * seen.longest
        || seen.pairs < FEWEST;
    !by_chance || contradicts_its_level(value, run.len(), &sides, step, seen.longest)
}

/// Whether rows on the level of a value do not stay on it for so many repeats, and those next to them have
/// another mean.
///
/// A rate that only touches the level, `a t²` off, makes a pulse of another size when `a T³ / 12 = 1`
/// over a run of T rows, and is `12 (T/2 + t)² / T³` off in steps t rows beside it.
///
/// Where a table stands the rate stays, and no more is needed than that.
fn contradicts_its_level(
    value: f64,
    repeats: usize,
    levels: &[Vec<f64>; 2],
    step: f64,
    longest: usize,
) -> bool {
    let (mut stays, mut at_value) = (0.0, 0.0);
    let mut least = f64::INFINITY;
    let mut means = Vec::new();
    for level in levels {
        for pair in level.windows(2).filter(|pair| pair[0] == value) {
            at_value += 1.0;
            stays += f64::from(u8::from(pair[1] == value));
        }
        let blocks = level.chunks_exact(BESIDE).take(BLOCKS);
        let of_level: Vec<f64> = blocks
            .map(|block| block.iter().sum::<f64>() / (BESIDE as f64 * step))
            .collect();
        let Some(next) = of_level.first() else {
            return false;
        };
        least = least.min((next - value / step).abs());
        means.push(of_level);
    }
    let stands = means.iter().all(|of_level| of_level.len() == BLOCKS) && {
        let all = || means.iter().flatten().copied();
        all().fold(f64::NEG_INFINITY, f64::max) - all().fold(f64::INFINITY, f64::min) < STANDS
    };
    let again: f64 = (stays + 1.0) / (at_value + 2.0);
    let rows = repeats as f64;
    let touching = 12.0 * (0.5 * (rows + BESIDE as f64)).powi(2) / rows.powi(3);
    let unlikely = again.powf(rows) < CHANCE || repeats > LONGER_WHERE_STANDING * longest;
    unlikely && least * rows > WRONG_STEPS && (stands || least > MORE_THAN_TOUCHING * touching)
}

/// How often rows repeat the one before.
#[derive(Debug, Default)]
struct Seen {
    pairs: usize,
    repeats: usize,
    /// Repeats next to a repeat.
    again: usize,
    /// Most repeats in a row.
    longest: usize,
}

impl Seen {
    fn add(&mut self, rows: &[f64]) {
        let mut row = 0;
        for pair in rows.windows(2) {
            let repeat = pair[0] == pair[1];
            self.pairs += 1;
            self.repeats += usize::from(repeat);
            self.again += usize::from(repeat && row > 0);
            row = if repeat { row + 1 } else { 0 };
            self.longest = self.longest.max(row);
        }
    }

    /// Of a run with so many repeats. A repeat may make the next more probable, as where a table
    /// stands and noise is below the grid.
    fn chance(&self, repeats: usize) -> f64 {
        let once = (self.repeats as f64 + 1.0) / (self.pairs as f64 + 2.0);
        let again = (self.again as f64 + once) / (self.repeats as f64 + 1.0);
        once * once.max(again).powf(repeats as f64 - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Six columns of noise on a grid of one, with this σ.
    fn noise(sigma: f64) -> Vec<Vec<f64>> {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut column = || {
            let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
            (0..20_000)
                .map(|_| (sigma * normal() + 0.3).round())
                .collect()
        };
        (0..6).map(|_| column()).collect()
    }

    fn find(columns: &[Vec<f64>]) -> [Vec<Range<usize>>; 6] {
        let columns = std::array::from_fn(|k| columns[k].as_slice());
        stuck(&columns, &[Some(1.0); 6])
    }

    #[test]
    fn an_axis_that_stands_still_is_found_and_no_other() {
        for sigma in [0.5, 1.0, 10.0] {
            let mut columns = noise(sigma);
            assert!(find(&columns).iter().all(Vec::is_empty), "σ {sigma}");
            let held = columns[2][7000];
            columns[2][7000..7100].fill(held);
            let found = find(&columns);
            let [run] = found[2].as_slice() else {
                panic!("σ {sigma}: {found:?}");
            };
            assert!(run.start <= 7001 && (7100..7110).contains(&run.end));
            assert_eq!(found.iter().map(Vec::len).sum::<usize>(), 1);
        }
    }

    #[test]
    fn pulses_that_stop_to_change_while_the_table_stands_are_found() {
        for (rate, held) in [(2.34, 3.0), (1.11, 1.0)] {
            let mut columns = noise(1.0);
            for (k, value) in columns[0].iter_mut().enumerate() {
                let angle = |k: usize| (rate * k as f64).round();
                *value = angle(k + 1) - angle(k);
            }
            assert!(find(&columns).iter().all(Vec::is_empty));
            columns[0][7000..7100].fill(held);
            assert_eq!(find(&columns)[0].len(), 1, "{rate}");
        }
    }

    #[test]
    fn a_grid_that_is_coarser_than_noise_is_no_fault() {
        for sigma in [0.05, 0.2] {
            assert!(find(&noise(sigma)).iter().all(Vec::is_empty), "σ {sigma}");
        }
    }

    #[test]
    fn a_rate_that_drifts_through_a_step_is_no_fault() {
        // Pulses of an angle whose rate passes 10 a row, where they come in tens for a long time.
        let mut columns = noise(1.0);
        let angle = |k: usize| 10.0 * k as f64 + 2e-6 * (k as f64 - 10_000.0).powi(2);
        for (k, value) in columns[0].iter_mut().enumerate() {
            *value = angle(k + 1).round() - angle(k).round();
        }
        assert!(find(&columns).iter().all(Vec::is_empty));
    }

    #[test]
    fn a_quiet_dwell_between_turns_is_no_fault() {
        // A turn, a dwell so near the middle of a step that nothing is seen of noise, and a turn.
        let mut columns = noise(1.0);
        for (k, value) in columns[0].iter_mut().enumerate() {
            let turned = 9800.0 - k as f64;
            *value = match k {
                0..9800 => turned.round(),
                9800..10_200 => 0.0,
                _ => (turned + 400.0).round(),
            };
        }
        assert!(find(&columns).iter().all(Vec::is_empty));
    }
}
