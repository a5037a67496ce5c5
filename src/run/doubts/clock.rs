//! Moves as the gyros and as the table saw them: how far, and when.

use std::ops::Range;

use nalgebra::Vector3;

use crate::earth::ROTATION_RATE;
use crate::recording::{TableLog, nanoseconds};
use crate::run::Run;
use crate::statistics::{SIGMA_OF_MEDIAN, median};
use crate::units::{DEGREE, PPM};

/// A move that differs by more than this part of it is another one …
const OTHER_ANGLE: f64 = 0.1;
/// … or that many σ of the gyros' scale and bias.
const SIGMAS: f64 = 5.0;
/// Between two readings a table that turns by less has turned the shorter way, rad.
const SHORTER_WAY: f64 = 1.0;
/// The way of the gyros is measured in steps this long, s, so that noise adds little to it.
const STEP: f64 = 0.1;
/// What turns by less has not turned, rad.
const SMALLEST: f64 = 1.0 * DEGREE;

/// A move from one dwell to the next.
#[derive(Debug, Clone, Copy)]
struct Move {
    /// How far it goes, and when, by the gyros.
    gyros: Way,
    /// The same by the table.
    table: Way,
    /// By how much the ways of the same move may differ, rad.
    tolerance: f64,
    /// By how much a bias that dwells tell makes them differ, rad.
    zero: f64,
    /// The longest time between two readings, s.
    interval: f64,
}

impl Move {
    fn is_another(&self) -> bool {
        (self.gyros.angle - self.table.angle).abs() > self.tolerance
    }

    /// By how much the gyros are later, s.
    fn late(&self) -> f64 {
        self.gyros.middle - self.table.middle
    }
}

/// Steps of a move, summed.
#[derive(Debug, Clone, Copy, Default)]
struct Way {
    /// In all, one way and the other, rad.
    angle: f64,
    /// Mean time of it, s.
    middle: f64,
    /// Rate, rad/s.
    fastest: f64,
}

impl Way {
    /// Of steps with their times in the middle, durations in s and angles in rad, but for those at rest: they
    /// turn by less than `noise` and by less than rate `zero` makes.
    fn of(steps: impl Iterator<Item = (f64, f64, f64)>, noise: f64, zero: f64) -> Self {
        let mut way = Self::default();
        for (time, duration, angle) in steps {
            way.fastest = way.fastest.max(angle / duration);
            if angle > noise + zero * duration {
                way.middle += angle * time;
                way.angle += angle;
            }
        }
        way.middle /= way.angle.max(f64::MIN_POSITIVE);
        way
    }
}

/// Moves that the gyros make by another angle than the table, or at another time.
///
/// Rows that one log has lost, clocks that run apart and a log of another run all show there, however the
/// samples are stamped.
pub(super) fn clock(run: &Run, table: &TableLog) -> Option<String> {
    let moves = moves(run, table);
    let (another, same): (Vec<Move>, Vec<Move>) = moves.iter().copied().partition(Move::is_another);
    if let Some(first) = another.first() {
        return Some(format!(
            "In {} of {} moves the gyros do not turn as far as the table, or further: the first is at {:.1} s, \
             {:.1}° by the gyros and {:.1}° by the table. Either rows are lost, repeated, clipped or wrapped there, \
             or both logs are not of one run or clock, or gyro_unit, scale or the unit of the table's angles is \
             another.",
            another.len(),
            moves.len(),
            first.table.middle,
            first.gyros.angle / DEGREE,
            first.table.angle / DEGREE
        ));
    }
    let (first, last) = (same.first()?, same.last()?);
    let late: Vec<f64> = same.iter().map(Move::late).collect();
    let (low, high) = late
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &late| {
            (low.min(late), high.max(late))
        });
    let interval = same.iter().map(|m| m.interval).fold(0.0, f64::max);
    let resolved = interval + run.recording.imu.period;
    if low.abs().max(high.abs()) <= resolved {
        return scale(run, &same);
    }
    let by = |late: f64| match late > 0.0 {
        true => format!("{late:.2} s later"),
        false => format!("{:.2} s earlier", -late),
    };
    if high - low <= resolved {
        return Some(format!(
            "The gyros turn {} than the table in all {} moves: bring both logs to one clock.",
            by(0.5 * (low + high)),
            same.len()
        ));
    }
    let steps = late.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let (place, step) = steps
        .enumerate()
        .max_by(|one, other| one.1.total_cmp(&other.1))?;
    if step > 0.5 * (high - low) {
        let (before, after) = (&same[place], &same[place + 1]);
        let change = after.late() - before.late();
        return Some(format!(
            "Against the table the gyros turn {} from the move at {:.1} s to that at {:.1} s: {} about {:.0} rows \
             in between, or the table's log jumps there.",
            by(change),
            before.table.middle,
            after.table.middle,
            match change < 0.0 {
                true => "the IMU's log has lost",
                false => "the IMU's log repeats",
            },
            change.abs() / run.recording.imu.period
        ));
    }
    let apart = (last.late() - first.late()) / (last.table.middle - first.table.middle);
    Some(format!(
        "The IMU's clock and the table's run apart by {:.0} ppm: the gyros turn {} than the table in the move at \
         {} s, {} in that at {} s. Rows are lost or repeated all along, or sample_period_s or the stamps of one log \
         are wrong; scale factors follow them.",
        apart / PPM,
        by(first.late()),
        nanoseconds((first.table.middle * 10.0).round() / 10.0),
        by(last.late()),
        nanoseconds((last.table.middle * 10.0).round() / 10.0)
    ))
}

/// A scale that all moves together contradict: what differs from the table in each of them alike. A method
/// that does without turns would not tell.
fn scale(run: &Run, moves: &[Move]) -> Option<String> {
    // The first and the last may be cut by the end of a log.
    let moves = moves.get(1..moves.len().saturating_sub(1))?;
    let sum = |of: fn(&Move) -> f64| moves.iter().map(of).sum::<f64>();
    let (gyros, table) = (sum(|m| m.gyros.angle), sum(|m| m.table.angle));
    if table <= 0.0 {
        return None;
    }
    let sigma = run.instrument.prior.gyro.scale_sigma.amax();
    let off = gyros / table - 1.0;
    (off.abs() > SIGMAS * sigma + sum(|m| m.zero) / table).then(|| {
        format!(
            "Over all {} moves the gyros turn {:.0} ppm {} than the table, where scale_sigma_ppm of \
             [imu.prior.gyro] states {:.0} ppm: its scale or scale_sigma_ppm, or gyro_unit, does not fit the \
             instrument.",
            moves.len(),
            off.abs() / PPM,
            if off > 0.0 { "further" } else { "less far" },
            sigma / PPM
        )
    })
}

/// Mean rates of the gyros while the table stands, the middle one of each axis: their biases, with a part of
/// Earth rate, and how far off these may be, rad/s. The prior's may be wrong; stands are where the clocks are.
fn bias_at_rest(run: &Run, stands: &[Range<usize>]) -> (Vector3<f64>, f64) {
    let prior = &run.instrument.prior.gyro;
    let imu = &run.recording.imu;
    let known = stands.iter().filter(|s| !s.is_empty() && !imu.is_lost(s));
    let means: Vec<Vector3<f64>> = known
        .map(|s| imu.gyro.sum(s.clone()) / (s.len() as f64 * imu.period))
        .collect();
    let bias = Vector3::from_fn(|axis, _| {
        let mut of_axis: Vec<f64> = means.iter().map(|mean| mean[axis]).collect();
        median(&mut of_axis).unwrap_or(prior.bias[axis])
    });
    let mut off: Vec<f64> = means.iter().map(|mean| (mean - bias).norm()).collect();
    let sigma = median(&mut off).map_or(f64::INFINITY, |off| SIGMA_OF_MEDIAN * off);
    (bias, SIGMAS * sigma.min(prior.bias_sigma.norm()))
}

/// Moves that both logs resolve, from the middle of one standstill of the table to that of the next, and what there
/// is before the first and behind the last of what both logs cover. Two moves in one would be wrong in time by what
/// the scale factors of their axes differ.
fn moves(run: &Run, table: &TableLog) -> Vec<Move> {
    let imu = &run.recording.imu;
    let stands: Vec<Range<usize>> = run
        .standstills_of_table(table)
        .into_iter()
        .map(|standstill| standstill.samples)
        .collect();
    // One alone does not tell how far off the bias is that it shows.
    if stands.len() < 2 {
        return Vec::new();
    }
    let covered = |time: Option<&f64>| {
        let edge = imu.edge(time.copied().unwrap_or(0.0));
        edge.clamp(0.0, imu.len() as f64) as usize
    };
    let (first, last) = (covered(table.time.first()), covered(table.time.last()));
    let (bias, off) = bias_at_rest(run, &stands);
    let middles = stands.iter().map(|s| s.start.midpoint(s.end));
    let edges: Vec<usize> = [first].into_iter().chain(middles).chain([last]).collect();
    let between = edges.windows(2).filter_map(|edges| {
        let samples = edges[0]..edges[1];
        let is_whole = !samples.is_empty() && imu.unbroken(&samples) && !imu.is_lost(&samples);
        is_whole
            .then(|| of_samples(run, table, samples, (&bias, off)))
            .flatten()
    });
    between.collect()
}

/// What both logs say of these samples; none where readings are too far apart, or nothing turns.
fn of_samples(
    run: &Run,
    table: &TableLog,
    samples: Range<usize>,
    (bias, off): (&Vector3<f64>, f64),
) -> Option<Move> {
    let imu = &run.recording.imu;
    let prior = &run.instrument.prior.gyro;
    let (begin, end) = (imu.time(samples.start), imu.time(samples.end));
    let readings =
        table.time.partition_point(|&t| t < begin)..table.time.partition_point(|&t| t < end);
    let (times, attitudes) = (&table.time[readings.clone()], &table.attitude[readings]);
    let (first, last) = (*times.first()?, *times.last()?);
    let intervals = times.windows(2).map(|pair| pair[1] - pair[0]);
    let interval = intervals.fold((first - begin).max(end - last), f64::max);
    let steps = times.windows(2).zip(attitudes.windows(2));
    let by_table = steps.map(|(time, attitude)| {
        let angle = attitude[1].angle_to(&attitude[0]);
        (time[0].midpoint(time[1]), time[1] - time[0], angle)
    });
    // Two readings of three components each, as where standstills are found.
    let by_table = Way::of(
        by_table,
        SIGMAS * run.table.reading_sigma * 6f64.sqrt(),
        0.0,
    );
    // A move that the end of a log cuts is seen as far as both logs go.
    let covered = |time: f64| (imu.edge(time).max(0.0) as usize).clamp(samples.start, samples.end);
    let samples = covered(first)..covered(last);
    let length = ((STEP / imu.period).round() as usize).max(1);
    let starts = samples.clone().step_by(length);
    let by_gyros = starts.map(|start| {
        let part = start..(start + length).min(samples.end);
        let duration = part.len() as f64 * imu.period;
        let sum = imu.gyro.sum(part.clone());
        let time = imu.time(part.start) + 0.5 * duration;
        (time, duration, (sum - bias * duration).norm())
    });
    let noise = SIGMAS * run.instrument.noise.gyro.random_walk * (3.0 * STEP).sqrt()
        + 3f64.sqrt() * imu.pulse.gyro;
    // A bias from dwells has Earth rate in it, too.
    let zero = SIGMAS * prior.bias_sigma.norm() + 2.0 * ROTATION_RATE;
    let by_gyros = Way::of(by_gyros, noise, zero);
    let is_resolved = by_gyros.fastest.max(by_table.fastest) * interval < SHORTER_WAY;
    let part = OTHER_ANGLE.max(SIGMAS * prior.scale_sigma.amax());
    let longest = by_gyros.angle.max(by_table.angle);
    (is_resolved && longest > SMALLEST).then_some(Move {
        gyros: by_gyros,
        table: by_table,
        tolerance: part * longest + zero * (end - begin) + by_table.fastest * imu.period,
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
        clock(&run, run.recording.table.as_ref().unwrap())
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
            assert_eq!(clock(&run, run.recording.table.as_ref().unwrap()), None);
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
        assert!(off.contains("ppm further than the table"), "{off}");
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
        assert!(of_another.contains("not of one run"), "{of_another}");
    }
}
