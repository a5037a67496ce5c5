//! Detection of standstills in the table log.

use std::ops::Range;

use crate::attitude::{log, mean};
use crate::recording::TableLog;
use crate::run::Run;
use crate::run::dwell::{Dwell, Position, SHORTEST};
use crate::units::ARCSEC;

/// Readings of a table at rest differ by less than this many σ of their noise.
const STANDING_SIGMAS: f64 = 6.0;
/// Readings of a table at rest may differ by this much, regardless of noise.
const STANDING_ANGLE: f64 = 2.0 * ARCSEC;
/// Time cut off at both ends, s: a table that starts smoothly has moved before two readings show
/// it, and a table that has stopped still rings.
const MARGIN: f64 = 0.2;
/// Length of the stretch at an end of a dwell whose mean reveals creep, or an early start of the next move, s.
const CREEP_STRETCH: f64 = 1.0;
/// Number of σ by which this mean reveals creep.
const CREEP_SIGMAS: f64 = 5.0;
/// Minimum time between readings that are compared to distinguish a slow turn from a standstill in a dense log, s.
const APART: f64 = 0.05;

/// Limit for the difference of two means of readings whose variances add up to `share` times that of a reading.
fn limit(run: &Run, share: f64) -> f64 {
    STANDING_ANGLE.max(STANDING_SIGMAS * run.table.reading_sigma * share.sqrt())
}

/// Whether two dwells are at the same position according to the readings.
pub fn same_reading(run: &Run, before: &Position, after: &Position) -> bool {
    let share = 1.0 / before.readings.len() as f64 + 1.0 / after.readings.len() as f64;
    log(&(after.attitude * before.attitude.transpose())).norm() < limit(run, share)
}

/// Stretches of the table log with constant readings.
pub fn standstills(run: &Run, table: &TableLog) -> Vec<Dwell> {
    // Two readings of three components each.
    let limit = limit(run, 6.0);
    let mut dwells = Vec::new();
    let (mut first, mut before) = (0, 0);
    for next in 1..=table.time.len() {
        let stands = next < table.time.len() && {
            while before + 1 < next && table.time[next] - table.time[before + 1] >= APART {
                before += 1;
            }
            let before = &table.attitude[before.max(first)];
            table.attitude[next].angle_to(before) < limit
        };
        if !stands {
            dwells.extend(dwell(run, table, first..next));
            first = next;
        }
    }
    dwells
}

fn dwell(run: &Run, table: &TableLog, standing: Range<usize>) -> Option<Dwell> {
    let settled = settled(table, run.table.reading_sigma, standing);
    // At either end of the log, it is not known whether the table moves.
    let margin = |at_end: bool| if at_end { 0.0 } else { MARGIN };
    let begin = table.time[settled.start] + margin(settled.start == 0);
    let end = table.time[settled.end - 1] - margin(settled.end == table.time.len());
    let readings = table.time.partition_point(|&time| time < begin)
        ..table.time.partition_point(|&time| time <= end);
    // If a stamp misses the edge of a sample by rounding, the sample must not be lost.
    let imu = &run.recording.imu;
    let sample = |edge: f64| edge.clamp(0.0, imu.len() as f64) as usize;
    let first = sample((imu.edge(begin) - 1e-3).ceil());
    let dwell = Dwell {
        samples: first..sample((imu.edge(end) + 1e-3).floor()),
        position: Some(Position {
            attitude: mean(table.attitude.get(readings.clone())?)?,
            readings,
        }),
    };
    (dwell.duration(imu) >= SHORTEST).then_some(dwell)
}

/// Cuts off the ends of a standstill whose mean reading differs from that of the middle.
fn settled(table: &TableLog, reading_sigma: f64, standing: Range<usize>) -> Range<usize> {
    let Range { mut start, mut end } = standing;
    let quarter = standing.len() / 4;
    let middle = start + quarter..end - quarter;
    let interval = (table.time[end - 1] - table.time[start]) / (standing.len() as f64 - 1.0);
    let stretch = (CREEP_STRETCH / interval).round();
    if !(stretch >= 1.0 && stretch <= quarter as f64) {
        return standing;
    }
    let level = mean(&table.attitude[middle.clone()]);
    let sigma = reading_sigma * (1.0 / stretch + 1.0 / middle.len() as f64).sqrt();
    let stretch = stretch as usize;
    let creeps = |readings: Range<usize>| {
        let found = mean(&table.attitude[readings]).zip(level);
        found.is_some_and(|(mean, level)| {
            log(&(mean * level.transpose())).norm() > CREEP_SIGMAS * sigma
        })
    };
    while start + stretch <= middle.start && creeps(start..start + stretch) {
        start += stretch;
    }
    while end >= middle.end + stretch && creeps(end - stretch..end) {
        end -= stretch;
    }
    start..end
}
