//! Detection of spikes, which are single samples that match neither the preceding nor the following samples.

use rayon::prelude::*;

use super::chance::Limit;
use super::line::mean_and_slope;

/// Numbers of samples for the lines that are extrapolated to the next sample: few samples follow a motion, many average
/// noise.
const LINES: [usize; 5] = [2, 4, 8, 16, 32];
/// Number of samples on either side with which an extrapolated line is compared to measure its error.
const TRIALS: usize = 64;
/// Number of samples on either side from which the magnitude of second differences is taken.
const AROUND: usize = 32;
/// Minimum number of samples used on one side.
const FEWEST: usize = TRIALS / 4;
/// Number of samples examined on one side.
const SIDE: usize = TRIALS + LINES[LINES.len() - 1];

/// For each column, the rows that deviate from the lines on both sides by more than rows of a faultless recording do.
/// `steps` are the smallest differences of values in the columns.
///
/// A sample is part of the motion if the line from before or the line from after fits the sample, or if the sample lies
/// between the two lines, because then a turn started or ended at the sample. The error of a line is measured on the
/// surrounding samples, and therefore includes noise, resolution and motion. The limit follows the tail of the second
/// differences of the whole column. A knock is also motion, because it lasts longer than one sample or appears on other
/// axes too.
pub fn spikes(columns: &[&[f64]; 6], steps: &[f64], limit: Limit) -> [Vec<usize>; 6] {
    if columns[0].len() < 2 * TRIALS {
        return [const { Vec::new() }; 6];
    }
    let of_column = |(column, step): (&&[f64], &f64)| Bends::of(column, *step, limit);
    let bends: Vec<Bends> = columns.par_iter().zip(steps).map(of_column).collect();
    let mut spikes = [const { Vec::new() }; 6];
    for (axis, bent) in bends.iter().enumerate() {
        let grid = grid(steps[axis]);
        let far = bent.relative.iter().enumerate();
        let far = far.filter(|(_, relative)| **relative > 0.5 * bent.limit);
        spikes[axis] = far
            .map(|(row, _)| row)
            .filter(|&row| stands_out(columns[axis], row, grid) > bent.limit)
            .collect();
    }
    let alone = |axis: usize, row: usize| {
        let apart = [row.saturating_sub(2), row + 2];
        let near = [row.saturating_sub(1), row, row + 1];
        bends.iter().enumerate().all(|(other, bent)| {
            let quiet = |row: &usize| bent.relative.get(*row).is_none_or(|r| *r <= bent.outer);
            // The second differences of a spike extend to the adjacent rows.
            let spiked = other == axis || spikes[other].binary_search(&row).is_ok();
            apart.iter().all(quiet) && (spiked || near.iter().all(quiet))
        })
    };
    std::array::from_fn(|axis| {
        let rows = spikes[axis].iter().copied();
        rows.filter(|&row| alone(axis, row)).collect()
    })
}

/// σ of rounding: 1/√12 steps for independent values, 1/√6 if the remainder is carried into the next value.
fn grid(step: f64) -> f64 {
    step / 6f64.sqrt()
}

/// Second differences of a column.
struct Bends {
    /// Magnitude at each row relative to the σ of its surroundings, assuming white noise.
    relative: Vec<f64>,
    /// The quantile that few rows exceed.
    outer: f64,
    /// The limit that no faultless value exceeds.
    limit: f64,
}

impl Bends {
    fn of(column: &[f64], step: f64, limit: Limit) -> Self {
        let rows = column.len();
        let bend = |k: usize| (column[k] - 0.5 * (column[k - 1] + column[k + 1])).abs();
        // Number of rows before each.
        let mut sums = vec![0.0; 2];
        let mut sum = 0.0;
        for k in 1..rows - 1 {
            sum += bend(k);
            sums.push(sum);
        }
        let mean = |begin: usize, end: usize| match end.checked_sub(begin) {
            Some(count) if count >= FEWEST => (sums[end] - sums[begin]) / count as f64,
            _ => 0.0,
        };
        // σ of white noise divided by the mean magnitude, and σ of a second difference divided by that of its values.
        let normal = (std::f64::consts::PI / 2.0).sqrt();
        let least = grid(step) * 1.5f64.sqrt();
        let relative = |k: usize| {
            // The second differences next to a spike belong to the spike.
            let before = mean(
                k.saturating_sub(AROUND + 1).max(1),
                k.saturating_sub(1).max(1),
            );
            let after = mean((k + 2).min(rows - 1), (k + 2 + AROUND).min(rows - 1));
            let sigma = (normal * before.max(after)).max(least);
            if sigma > 0.0 { bend(k) / sigma } else { 0.0 }
        };
        let ends = [0.0];
        let inner = (1..rows - 1).map(relative);
        let relative: Vec<f64> = ends.into_iter().chain(inner).chain(ends).collect();
        let (outer, limit) = limit.of_tail(&mut relative.clone());
        Self {
            relative,
            outer,
            limit,
        }
    }
}

/// Distance of a row from the range predicted by lines from its two sides, in σ of the most accurate line; zero if
/// any line fits it.
fn stands_out(column: &[f64], row: usize, grid: f64) -> f64 {
    let before: Vec<f64> = column[..row].iter().rev().take(SIDE).copied().collect();
    let after: Vec<f64> = column[row + 1..].iter().take(SIDE).copied().collect();
    let value = column[row];
    let (mut least, mut best) = (f64::INFINITY, 0.0);
    for points in LINES {
        let sides = [&before, &after].map(|side| Line::of(side, points, grid));
        let [Some(before), Some(after)] = sides else {
            continue;
        };
        let low = before.next.min(after.next);
        let high = before.next.max(after.next);
        // If the motion changes from one slope to the other, the distance is at least half of the difference of the
        // slopes.
        let turned = 0.5 * (before.slope + after.slope).abs();
        let out = (value - high).max(low - value) - turned;
        let error = before.error.max(after.error);
        let out = match error > 0.0 {
            true => out / error,
            false if out > 0.0 => f64::INFINITY,
            false => 0.0,
        };
        if out < LEADS {
            return 0.0;
        }
        if error < least {
            (least, best) = (error, out);
        }
    }
    best
}

/// A line fits a sample if it comes within this many σ of it.
const LEADS: f64 = 1.0;

/// σ beyond which a tenth of normal variates lie, two-sided.
const TENTH: f64 = 1.645;

/// A line through the nearest samples of a side, given in order of their distance.
struct Line {
    /// Value extrapolated to the sample before the nearest.
    next: f64,
    /// Slope towards that sample, per sample.
    slope: f64,
    /// σ of `next` against the sample there, measured along the side.
    error: f64,
}

impl Line {
    fn of(side: &[f64], points: usize, grid: f64) -> Option<Self> {
        let trials = side.len().checked_sub(points)?.min(TRIALS);
        if trials < FEWEST {
            return None;
        }
        let (next, slope) = carried_on(&side[..points]);
        let error = |k: usize| (side[k] - carried_on(&side[k + 1..k + 1 + points]).0).abs();
        let mut errors: Vec<f64> = (0..trials).map(error).collect();
        // On a coarse grid, most errors are zero; a tenth may be due to other spikes.
        let (_, error, _) = errors.select_nth_unstable_by(trials * 9 / 10, f64::total_cmp);
        // On a grid, the value is uncertain by one step.
        let error = (*error / TENTH).hypot(grid);
        Some(Self { next, slope, error })
    }
}

/// Value of a line through these values at the position before the first, and its slope towards that position.
fn carried_on(values: &[f64]) -> (f64, f64) {
    let (mean, slope) = mean_and_slope(values);
    (mean - slope * 0.5 * (values.len() as f64 + 1.0), -slope)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    const ROWS: usize = 60_000;

    /// White noise of σ one about a motion, a column each.
    fn noise(seed: u64, motion: impl Fn(f64) -> f64) -> Vec<Vec<f64>> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut column = |_| {
            let value = |k| {
                let normal: f64 = StandardNormal.sample(&mut random);
                motion(k as f64) + normal
            };
            (0..ROWS).map(value).collect()
        };
        (0..6).map(&mut column).collect()
    }

    fn find(columns: &[Vec<f64>], step: f64) -> [Vec<usize>; 6] {
        let columns = std::array::from_fn(|k| columns[k].as_slice());
        spikes(&columns, &[step; 6], Limit::of_rows(ROWS))
    }

    #[test]
    fn one_sample_is_found_by_ten_sigma_at_rest_and_by_twenty_in_a_turn() {
        let turn = |t: f64| 3000.0 * (t / 200.0).sin();
        for (motion, size) in [(&(|_| 0.0) as &dyn Fn(f64) -> f64, 10.0), (&turn, 20.0)] {
            let mut columns = noise(1, motion);
            assert!(find(&columns, 0.0).iter().all(Vec::is_empty));
            let rows: Vec<usize> = (0..36).map(|k| 300 + 1600 * k).collect();
            rows.iter().for_each(|&row| columns[row % 3][row] += size);
            let found = find(&columns, 0.0);
            let missed = rows
                .iter()
                .filter(|&row| !found[row % 3].contains(row))
                .count();
            assert!(missed <= 7, "{missed} of {size} σ");
            assert_eq!(
                found.iter().map(Vec::len).sum::<usize>(),
                rows.len() - missed
            );
        }
    }

    #[test]
    fn begin_and_end_of_a_turn_are_no_spikes() {
        // Rates that ramp, jump, and turn round at once, each many times, without noise and with little.
        for sigma in [0.0, 0.01, 1.0] {
            for shape in [
                &(|t: f64| 50.0 * (t.rem_euclid(700.0) - 300.0).clamp(0.0, 40.0))
                    as &dyn Fn(f64) -> f64,
                &|t| {
                    if t.rem_euclid(900.0) < 400.0 {
                        0.0
                    } else {
                        500.0
                    }
                },
                &|t| 30.0 * (t.rem_euclid(600.0) - 300.0).abs(),
            ] {
                let mut columns = noise(4, |_| 0.0);
                for column in &mut columns {
                    for (k, value) in column.iter_mut().enumerate() {
                        *value = sigma * *value + shape(k as f64);
                    }
                }
                assert!(find(&columns, 0.0).iter().all(Vec::is_empty), "{sigma}");
            }
        }
    }

    #[test]
    fn a_knock_moves_more_than_one_axis_or_more_than_one_sample() {
        let mut columns = noise(2, |_| 0.0);
        for (axis, row, size) in [
            (0, 5000, 60.0),
            (3, 5001, 30.0),
            (1, 9000, 60.0),
            (1, 9002, 25.0),
        ] {
            columns[axis][row] += size;
        }
        assert!(find(&columns, 0.0).iter().all(Vec::is_empty));
    }

    #[test]
    fn a_row_that_is_wrong_in_all_axes_is_a_spike_in_each() {
        let mut columns = noise(3, |_| 0.0);
        columns.iter_mut().for_each(|column| column[7000] = -300.0);
        let found = find(&columns, 0.0);
        assert!(found.iter().all(|rows| rows == &[7000]), "{found:?}");
    }

    #[test]
    fn a_coarse_grid_goes_a_step_up_and_down() {
        let mut columns = noise(6, |t| 1e-3 * t);
        for column in &mut columns {
            column
                .iter_mut()
                .for_each(|value| *value = (0.3 * *value).round());
        }
        assert!(find(&columns, 1.0).iter().all(Vec::is_empty));
        columns[4][4000] += 5.0;
        assert_eq!(find(&columns, 1.0)[4], [4000]);
    }
}
