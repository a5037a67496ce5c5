//! Standstills in the table's own log.

use std::ops::Range;

use super::{Dwell, Position, SHORTEST, STANDING_ANGLE, STANDING_SIGMAS};
use crate::attitude::{log, mean};
use crate::recording::TableLog;
use crate::run::Run;

/// What is cut off at both ends, s: a table that starts smoothly has moved before two readings show
/// it, and one that stops still rings.
const MARGIN: f64 = 0.2;
/// A table that creeps, or takes up its next position before it turns, shows it in the mean of this
/// long a stretch at an end of the dwell, s …
const CREEP_STRETCH: f64 = 1.0;
/// … by this many σ.
const CREEP_SIGMAS: f64 = 5.0;
/// Readings at least this far apart tell a slow turn from a standstill, however dense the log, s.
const APART: f64 = 0.05;

/// Stretches of the log whose readings stay.
pub fn standstills(run: &Run, table: &TableLog) -> Vec<Dwell> {
    // Two readings of three components each.
    let limit = STANDING_ANGLE.max(STANDING_SIGMAS * run.table.reading_sigma * 6f64.sqrt());
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
    // At either end of the log the table is not known to move.
    let margin = |at_end: bool| if at_end { 0.0 } else { MARGIN };
    let begin = table.time.get(settled.start)? + margin(settled.start == 0);
    let end =
        table.time.get(settled.end.checked_sub(1)?)? - margin(settled.end == table.time.len());

    let times = &table.time[settled.clone()];
    let readings = settled.start + times.partition_point(|&t| t < begin)
        ..settled.start + times.partition_point(|&t| t <= end);
    // A stamp that misses a sample's edge by rounding must not cost the sample.
    let imu = &run.recording.imu;
    let edge = |time: f64| imu.edge(time);
    let sample = |k: f64| k.clamp(0.0, imu.len() as f64) as usize;
    let samples = sample((edge(begin) - 1e-3).ceil())..sample((edge(end) + 1e-3).floor());
    if samples.len() as f64 * imu.period < SHORTEST {
        return None;
    }
    Some(Dwell {
        samples,
        position: Some(Position {
            attitude: mean(table.attitude.get(readings.clone())?)?,
            readings,
        }),
    })
}

/// Cuts off the ends of a standstill at which the mean of the readings is not that of its middle.
fn settled(table: &TableLog, reading_sigma: f64, standing: Range<usize>) -> Range<usize> {
    let quarter = standing.len() / 4;
    let middle = standing.start + quarter..standing.end - quarter;
    let (first, last) = (table.time[standing.start], table.time[standing.end - 1]);
    let interval = (last - first) / (standing.len() as f64 - 1.0);
    let stretch = (CREEP_STRETCH / interval).round();
    let Some(level) = mean(&table.attitude[middle.clone()]) else {
        return standing;
    };
    if !(stretch >= 1.0 && stretch <= quarter as f64) {
        return standing;
    }
    let stretch = stretch as usize;
    let sigma = reading_sigma * (1.0 / stretch as f64 + 1.0 / middle.len() as f64).sqrt();
    let creeps = |readings: Range<usize>| {
        mean(&table.attitude[readings])
            .is_some_and(|mean| log(&(mean * level.transpose())).norm() > CREEP_SIGMAS * sigma)
    };
    let mut settled = standing;
    while settled.start + stretch <= middle.start && creeps(settled.start..settled.start + stretch)
    {
        settled.start += stretch;
    }
    while settled.end >= middle.end + stretch && creeps(settled.end - stretch..settled.end) {
        settled.end -= stretch;
    }
    settled
}
