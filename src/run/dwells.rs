//! Where the table stands: dwells, found from its own readings.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::{Run, TableRecord};
use crate::attitude::{exp, log};
use crate::units::ARCSEC;

/// A stretch of samples during which the table stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Dwell {
    /// Samples that lie wholly within it.
    pub samples: Range<usize>,
    /// Readings of the table within it.
    pub readings: Range<usize>,
    /// Mean reading, `C_b_n`.
    pub attitude: Matrix3<f64>,
}

/// Shortest dwell worth a name, s.
const SHORTEST: f64 = 0.5;
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
/// Readings of a standing table differ by less than this many σ of their noise …
const STANDING_SIGMAS: f64 = 6.0;
/// … or this much, whatever the noise.
const STANDING_ANGLE: f64 = 2.0 * ARCSEC;

impl Run {
    /// The dwells of the table's log, in order; none without a table.
    pub fn dwells(&self) -> Vec<Dwell> {
        let Some(table) = &self.table else {
            return Vec::new();
        };
        // Two readings of three components each.
        let limit = STANDING_ANGLE.max(STANDING_SIGMAS * table.reading_sigma * 6f64.sqrt());
        let mut dwells = Vec::new();
        let (mut first, mut before) = (0, 0);
        for next in 1..=table.time.len() {
            let stands = next < table.time.len() && {
                while before + 1 < next && table.time[next] - table.time[before + 1] >= APART {
                    before += 1;
                }
                let before = &table.attitude[before.max(first)];
                log(&(table.attitude[next] * before.transpose())).norm() < limit
            };
            if !stands {
                dwells.extend(self.dwell(table, first..next));
                first = next;
            }
        }
        dwells
    }

    fn dwell(&self, table: &TableRecord, standing: Range<usize>) -> Option<Dwell> {
        let settled = settled(table, standing);
        // At either end of the log the table is not known to move.
        let margin = |at_end: bool| if at_end { 0.0 } else { MARGIN };
        let begin = table.time.get(settled.start)? + margin(settled.start == 0);
        let end =
            table.time.get(settled.end.checked_sub(1)?)? - margin(settled.end == table.time.len());

        let times = &table.time[settled.clone()];
        let readings = settled.start + times.partition_point(|&t| t < begin)
            ..settled.start + times.partition_point(|&t| t <= end);
        // A stamp that misses a sample's edge by rounding must not cost the sample.
        let edge = |time: f64| (time - self.imu.start) / self.imu.period;
        let sample = |k: f64| k.clamp(0.0, self.imu.len() as f64) as usize;
        let samples = sample((edge(begin) - 1e-3).ceil())..sample((edge(end) + 1e-3).floor());
        if samples.len() as f64 * self.imu.period < SHORTEST {
            return None;
        }
        Some(Dwell {
            attitude: mean_attitude(table.attitude.get(readings.clone())?)?,
            samples,
            readings,
        })
    }
}

/// Cuts off the ends of a standstill at which the mean of the readings is not that of its middle.
fn settled(table: &TableRecord, standing: Range<usize>) -> Range<usize> {
    let quarter = standing.len() / 4;
    let middle = standing.start + quarter..standing.end - quarter;
    let (first, last) = (table.time[standing.start], table.time[standing.end - 1]);
    let interval = (last - first) / (standing.len() as f64 - 1.0);
    let stretch = (CREEP_STRETCH / interval).round();
    let Some(level) = mean_attitude(&table.attitude[middle.clone()]) else {
        return standing;
    };
    if !(stretch >= 1.0 && stretch <= quarter as f64) {
        return standing;
    }
    let stretch = stretch as usize;
    let sigma = table.reading_sigma * (1.0 / stretch as f64 + 1.0 / middle.len() as f64).sqrt();
    let creeps = |readings: Range<usize>| {
        mean_attitude(&table.attitude[readings])
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

/// The mean of attitudes that lie close together; `None` of none.
pub(crate) fn mean_attitude(attitudes: &[Matrix3<f64>]) -> Option<Matrix3<f64>> {
    let first = attitudes.first()?;
    let sum: Vector3<f64> = attitudes
        .iter()
        .map(|attitude| log(&(attitude * first.transpose())))
        .sum();
    Some(exp(sum / attitudes.len() as f64) * first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::Scenario;
    use crate::units::DEGREE;

    #[test]
    fn a_slow_turn_between_dense_readings_is_no_standstill() {
        let mut run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
        let time: Vec<f64> = (0..60_000).map(|k| f64::from(k) * 1e-3).collect();
        // Stands for 20 s, turns by 0.5°/s for 20 s, stands again.
        let attitude = |&t: &f64| {
            let angle = (t - 20.0).clamp(0.0, 20.0) * 0.5 * DEGREE;
            exp(Vector3::new(0.0, 0.0, angle))
        };
        run.table = Some(TableRecord {
            attitude: time.iter().map(attitude).collect(),
            time,
            position_sigma: ARCSEC,
            reading_sigma: 0.5 * ARCSEC,
        });
        let dwells = run.dwells();
        assert_eq!(dwells.len(), 2);
        assert!(run.imu.time(dwells[0].samples.end) <= 20.0);
        assert!(run.imu.time(dwells[1].samples.start) >= 40.0);
    }
}
