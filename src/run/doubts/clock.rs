//! Comparison of moves according to the gyros and according to the table, by angle and time.

use std::ops::Range;

use nalgebra::Vector3;

use crate::earth::ROTATION_RATE;
use crate::imu::Sensor;
use crate::recording::{TableLog, nanoseconds};
use crate::run::dwells::table::standstills;
use crate::run::turning::{self, SCALE_SIGMAS as SIGMAS, SMALLEST, STEP, tolerance};
use crate::run::{Dwell, Run};
use crate::statistics::{SIGMA_OF_MEDIAN, median, median_of_axes};
use crate::units::{DEGREE, PPM};

/// Below this angle between two readings, the table is assumed to have turned the shorter way, rad.
const SHORTER_WAY: f64 = 1.0;

/// A move from one dwell to the next.
pub struct Move {
    /// Total angle according to the gyros and to the table, counting both senses of rotation, rad.
    gyros: f64,
    table: f64,
    /// Mean time of the move according to the table, and delay of the gyros relative to the table, s.
    pub time: f64,
    pub late: f64,
    /// Tolerance for the difference of the two angles of one move, rad.
    tolerance: f64,
    /// Difference caused by the uncertainty of the bias from dwells, rad.
    zero: f64,
    /// The longest time between two readings, s.
    interval: f64,
}

impl Move {
    /// Whether the gyros and the table turn by different angles.
    pub fn differs(&self) -> bool {
        (self.gyros - self.table).abs() > self.tolerance
    }
}

/// The largest delay that readings and samples do not resolve, s.
pub fn resolved(run: &Run, moves: &[Move]) -> f64 {
    let interval = moves.iter().map(|m| m.interval).fold(0.0, f64::max);
    interval + run.recording.imu.period
}

/// Total angle of steps, rad, their mean time, s, and the maximum rate, rad/s. Each step has mid-time and duration, s,
/// and angle, rad. Steps below `noise` and below the effect of rate `zero` count as rest.
fn way(steps: impl Iterator<Item = (f64, f64, f64)>, noise: f64, zero: f64) -> [f64; 3] {
    let (mut all, mut moment, mut fastest) = (0.0, 0.0, 0.0f64);
    for (time, duration, angle) in steps {
        fastest = fastest.max(angle / duration);
        if angle > noise + zero * duration {
            moment += angle * time;
            all += angle;
        }
    }
    [all, moment / all.max(f64::MIN_POSITIVE), fastest]
}

/// Reports moves for which gyros and table differ in angle or time; if there are none, reports a gyro scale factor that
/// all moves together contradict.
///
/// This reveals missing rows in one log, clock drift and logs from different runs, for any time stamps.
pub fn clock(run: &Run) -> Option<String> {
    let moves = moves(run, run.recording.table.as_ref()?);
    let mut others = moves.iter().filter(|of| of.differs());
    if let Some(first) = others.next() {
        return Some(format!(
            "In {} of {} moves, the gyros and the table turn by different angles. In the first of these moves, at \
             {:.1} s, the gyros measure {:.1}°, the table {:.1}°. Look for lost, repeated, clipped or wrapped rows in \
             these moves, and for logs from different runs or clocks; if you find none, check gyro_unit, scale and \
             the unit of the table angles.",
            1 + others.count(),
            moves.len(),
            first.time,
            first.gyros / DEGREE,
            first.table / DEGREE
        ));
    }
    let resolved = resolved(run, &moves);
    if moves.iter().any(|m| m.late.abs() > resolved) {
        other_times(&moves, resolved, run.recording.imu.period)
    } else {
        scale(run, &moves)
    }
}

/// The common cause of time differences: an offset, a jump, or a drift of the clocks.
fn other_times(moves: &[Move], resolved: f64, period: f64) -> Option<String> {
    let by = |late: f64| {
        if late > 0.0 {
            format!("{late:.2} s later")
        } else {
            format!("{:.2} s earlier", -late)
        }
    };
    let late = || moves.iter().map(|m| m.late);
    let (low, high) = (late().reduce(f64::min)?, late().reduce(f64::max)?);
    if high - low <= resolved {
        return Some(format!(
            "In all {} moves, the gyros turn {} than the table. Convert both logs to the same clock.",
            by(low.midpoint(high)),
            moves.len()
        ));
    }
    let changes = moves
        .windows(2)
        .map(|pair| (pair[1].late - pair[0].late, pair));
    let (change, jump) = changes.max_by(|one, other| one.0.abs().total_cmp(&other.0.abs()))?;
    if change.abs() > 0.5 * (high - low) {
        return Some(format!(
            "Between the moves at {:.1} s and {:.1} s, the gyros start to turn {} than the table. Either {} about {:.0} \
             rows between these moves, or the table log jumps. Correct the wrong log.",
            jump[0].time,
            jump[1].time,
            by(change),
            if change < 0.0 {
                "the IMU log has lost"
            } else {
                "the IMU log repeats"
            },
            change.abs() / period
        ));
    }
    let (first, last) = (moves.first()?, moves.last()?);
    let apart = (last.late - first.late) / (last.time - first.time);
    let at = |of: &Move| nanoseconds((of.time * 10.0).round() / 10.0);
    Some(format!(
        "The clocks of the IMU and the table drift apart by {:.0} ppm: the gyros turn {} than the table in the move \
         at {} s, and {} in the move at {} s. The scale factors have an error of the same size. Check both logs for lost or \
         repeated rows, and check sample_period_s and the time stamps.",
        apart / PPM,
        by(first.late),
        at(first),
        by(last.late),
        at(last)
    ))
}

/// A gyro scale factor that contradicts all moves together: their angles differ from those of the table in the same
/// ratio. Methods that do not use turns would not notice it.
fn scale(run: &Run, moves: &[Move]) -> Option<String> {
    // The first and the last move may be cut off by the end of a log.
    let moves = moves.get(1..moves.len().saturating_sub(1))?;
    let sum = |of: fn(&Move) -> f64| moves.iter().map(of).sum::<f64>();
    let (gyros, table) = (sum(|m| m.gyros), sum(|m| m.table));
    let sigma = run.instrument.prior.gyro.scale_sigma.amax();
    let off = gyros / table - 1.0;
    (table > 0.0 && off.abs() > SIGMAS * sigma + sum(|m| m.zero) / table).then(|| {
        format!(
            "Over all {} moves, the gyros turn {:.0} ppm {} than the table, but scale_sigma_ppm of [imu.prior.gyro] \
             states {:.0} ppm. Check gyro_unit, and scale and scale_sigma_ppm in [imu.prior.gyro].",
            moves.len(),
            off.abs() / PPM,
            if off > 0.0 { "more" } else { "less" },
            sigma / PPM
        )
    })
}

/// Median over the table's dwells of the mean gyro rates: the biases plus a part of Earth rate, and their uncertainty,
/// rad/s. The prior biases may be wrong, and the dwells are timed by the table clock, which may be off.
fn bias_at_rest(run: &Run, stands: &[Dwell]) -> (Vector3<f64>, f64) {
    let prior = &run.instrument.prior.gyro;
    let known = stands
        .iter()
        .filter(|dwell| !run.recording.imu.is_lost(&dwell.samples));
    let means = known.map(|dwell| dwell.mean(Sensor::Gyro, run).output);
    let means: Vec<Vector3<f64>> = means.collect();
    let bias = median_of_axes(&means).unwrap_or(prior.bias);
    let mut off: Vec<f64> = means.iter().map(|mean| (mean - bias).norm()).collect();
    let sigma = median(&mut off).map_or(f64::INFINITY, |off| SIGMA_OF_MEDIAN * off);
    (bias, SIGMAS * sigma.min(prior.bias_sigma.norm()))
}

/// Returns the moves that both logs resolve, each from the middle of one standstill of the table to the middle of the
/// next. Also returns the spans before the first move and after the last move that both logs cover. If two moves were
/// treated as one and the scale factors of their axes differed, the move would have a time error.
pub fn moves(run: &Run, table: &TableLog) -> Vec<Move> {
    let imu = &run.recording.imu;
    let stands = standstills(run, table);
    // A single dwell does not show how wrong its bias is.
    let ([_, _, ..], [first, .., last]) = (&stands[..], &table.time[..]) else {
        return Vec::new();
    };
    let bias = bias_at_rest(run, &stands);
    let covered = |time: f64| imu.edge(time).clamp(0.0, imu.len() as f64) as usize;
    let middle = |dwell: &Dwell| dwell.samples.start.midpoint(dwell.samples.end);
    let mut edges = vec![covered(*first)];
    edges.extend(stands.iter().map(middle));
    edges.push(covered(*last));
    let between = edges.windows(2).map(|pair| pair[0]..pair[1]);
    let whole = between.filter(|samples| !samples.is_empty() && imu.unbroken(samples));
    let moves = whole.filter_map(|samples| of_samples(run, table, samples, bias));
    moves.collect()
}

/// The move over these samples according to both logs; `None` if readings are too far apart, or if there is no
/// rotation.
fn of_samples(
    run: &Run,
    table: &TableLog,
    samples: Range<usize>,
    (bias, off): (Vector3<f64>, f64),
) -> Option<Move> {
    let imu = &run.recording.imu;
    let (begin, end) = (imu.time(samples.start), imu.time(samples.end));
    let [from, to] = [begin, end].map(|edge| table.time.partition_point(|&time| time < edge));
    let (times, attitudes) = (&table.time[from..to], &table.attitude[from..to]);
    let (first, last) = (*times.first()?, *times.last()?);
    let intervals = times.windows(2).map(|pair| pair[1] - pair[0]);
    let interval = intervals.fold((first - begin).max(end - last), f64::max);
    let steps = times.windows(2).zip(attitudes.windows(2));
    let steps = steps.map(|(time, attitude)| {
        let angle = attitude[1].angle_to(&attitude[0]);
        (time[0].midpoint(time[1]), time[1] - time[0], angle)
    });
    // Two readings of three components each, as in the search for standstills.
    let noise = SIGMAS * run.table.reading_sigma * 6f64.sqrt();
    let [by_table, time, table_rate] = way(steps, noise, 0.0);
    // A move cut off by the end of a log is observed as far as both logs extend.
    let covered = |time: f64| (imu.edge(time).max(0.0) as usize).clamp(samples.start, samples.end);
    let steps = turning::steps(imu, covered(first)..covered(last), bias);
    let steps = steps.map(|(time, duration, turned)| (time, duration, turned.norm()));
    let noise = SIGMAS * run.instrument.noise.gyro.random_walk * (3.0 * STEP).sqrt()
        + 3f64.sqrt() * imu.pulse.gyro;
    // A bias from dwells also contains Earth rate.
    let zero = SIGMAS * run.instrument.prior.gyro.bias_sigma.norm() + 2.0 * ROTATION_RATE;
    let [by_gyros, time_by_gyros, gyro_rate] = way(steps, noise, zero);
    let is_resolved = gyro_rate.max(table_rate) * interval < SHORTER_WAY;
    let longest = by_gyros.max(by_table);
    let tolerance = tolerance(run) * longest + zero * (end - begin) + table_rate * imu.period;
    (is_resolved && longest > SMALLEST).then_some(Move {
        gyros: by_gyros,
        table: by_table,
        time,
        late: time_by_gyros - time,
        tolerance,
        zero: (off + 2.0 * ROTATION_RATE) * (end - begin),
        interval,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::Scenario;

    fn said(spoil: impl Fn(&mut Run)) -> Option<String> {
        let mut run = Scenario::load("mems").unwrap().simulate(1, 0).unwrap().run;
        spoil(&mut run);
        clock(&run)
    }

    fn lose(run: &mut Run, lost: impl Fn(usize) -> bool) {
        let imu = &mut run.recording.imu;
        let count = imu.len();
        for triad in [imu.gyro.to_mut(), imu.accel.to_mut()] {
            let mut number = 0..count;
            triad.retain(|_| !lost(number.next().unwrap()));
        }
        let kept = imu.len();
        imu.stretches[0].samples.end = kept;
    }

    #[test]
    fn both_logs_of_a_sound_run_agree() {
        assert_eq!(said(|_| {}), None);
        // It begins with a move; with these seeds the scale factors of the first two moves differ most.
        let scenario = Scenario::load("demo-six-position").unwrap();
        for seed in [1, 4, 10] {
            let run = scenario.simulate(seed, 0).unwrap().run;
            assert_eq!(clock(&run), None);
        }
    }

    #[test]
    fn a_prior_that_turns_contradict_is_named_and_no_rows_are() {
        let sure = said(|run| {
            let prior = &mut run.instrument.prior.gyro;
            prior.scale_sigma *= 0.01;
            prior.bias_sigma *= 0.01;
        });
        let sure = sure.unwrap();
        assert!(sure.contains("states 50 ppm"), "{sure}");
        let off = said(|run| {
            let imu = &mut run.recording.imu;
            imu.gyro.to_mut().iter_mut().for_each(|row| *row *= 1.05);
        });
        let off = off.unwrap();
        assert!(off.contains("ppm more than the table"), "{off}");
    }

    #[test]
    fn rows_that_are_lost_are_counted_wherever_they_were() {
        let at_rest = said(|run| lose(run, |k| (31_200..31_250).contains(&k))).unwrap();
        assert!(at_rest.contains("has lost about 50 rows"), "{at_rest}");
        let all_along = said(|run| lose(run, |k| k % 1000 == 0)).unwrap();
        let words = all_along.split_whitespace();
        let ppm: f64 = words
            .skip_while(|word| *word != "by")
            .nth(1)
            .unwrap()
            .parse()
            .unwrap();
        assert!((ppm + 1000.0).abs() < 20.0, "{all_along}");
    }

    #[test]
    fn a_table_log_that_is_late_or_of_another_run_is_named() {
        let table = |run: &mut Run, late: f64| {
            let table = run.recording.table.as_mut().unwrap();
            table.time.iter_mut().for_each(|time| *time += late);
        };
        let late = said(|run| table(run, 0.5)).unwrap();
        assert!(late.contains("0.50 s earlier than the table"), "{late}");
        let of_another = said(|run| table(run, 60.0)).unwrap();
        assert!(of_another.contains("different runs"), "{of_another}");
    }
}
