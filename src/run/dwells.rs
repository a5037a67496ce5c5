//! Where the table stands: dwells, found from its own readings.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::{ImuRecord, Run, TableRecord};
use crate::attitude::{exp, log, mean};
use crate::units::{ARCSEC, DEG_PER_H, DEGREE};

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

/// Gyros that integrate to less than this have not turned, rad …
const STILL_ANGLE: f64 = 0.1 * DEGREE;
/// … beyond their noise …
const STILL_SIGMAS: f64 = 6.0;
/// … and more than the worst bias may wander, rad/s.
const STILL_RATE: f64 = 100.0 * DEG_PER_H;

impl Run {
    /// The dwells of the table's log, in order; none without a table.
    ///
    /// The gyros have a say: a standstill of the log during which they turn is none (two readings may
    /// miss a full turn), and two between which they do not turn are one (a wild reading parted them).
    pub fn dwells(&self) -> Vec<Dwell> {
        let mut dwells: Vec<Dwell> = Vec::new();
        for dwell in self.standstills() {
            if self.turns(dwell.samples.clone(), &dwell) {
                continue;
            }
            match dwells.last_mut() {
                Some(last) if self.same_position(last, &dwell) => last.extend(&dwell),
                _ => dwells.push(dwell),
            }
        }
        dwells
    }

    fn same_position(&self, before: &Dwell, after: &Dwell) -> bool {
        let share = 1.0 / before.readings.len() as f64 + 1.0 / after.readings.len() as f64;
        let reading_sigma = self.table.as_ref().map_or(0.0, |t| t.reading_sigma);
        let limit = STANDING_ANGLE.max(STANDING_SIGMAS * reading_sigma * share.sqrt());
        log(&(after.attitude * before.attitude.transpose())).norm() < limit
            && !self.turns(before.samples.end..after.samples.start, before)
    }

    /// Whether the gyros turn during these samples, with their mean output at rest as zero.
    fn turns(&self, samples: Range<usize>, at_rest: &Dwell) -> bool {
        let gyro = &self.imu.gyro;
        let zero = gyro[at_rest.samples.clone()].iter().sum::<Vector3<f64>>()
            / at_rest.samples.len() as f64;
        let duration = samples.len() as f64 * self.imu.period;
        let limit = STILL_ANGLE
            + STILL_SIGMAS * self.noise.gyro.random_walk * duration.sqrt()
            + STILL_RATE * duration;
        let mut angle = Vector3::zeros();
        gyro[samples].iter().any(|increment| {
            angle += increment - zero;
            angle.norm() > limit
        })
    }

    /// Stretches of the log whose readings stay.
    fn standstills(&self) -> Vec<Dwell> {
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
            attitude: mean(table.attitude.get(readings.clone())?)?,
            samples,
            readings,
        })
    }
}

impl Dwell {
    /// The first seconds of it; the attitude is that of all its readings.
    pub fn first_seconds(&self, duration: f64, imu: &ImuRecord) -> Self {
        let samples = (duration / imu.period).round() as usize;
        let end = self.samples.end.min(self.samples.start + samples);
        Self {
            samples: self.samples.start..end,
            ..self.clone()
        }
    }

    /// Takes in a later dwell at the same position.
    fn extend(&mut self, later: &Self) {
        let share =
            later.readings.len() as f64 / (self.readings.len() + later.readings.len()) as f64;
        let turn = log(&(later.attitude * self.attitude.transpose()));
        self.attitude = exp(turn * share) * self.attitude;
        self.samples.end = later.samples.end;
        self.readings.end = later.readings.end;
    }
}

/// Cuts off the ends of a standstill at which the mean of the readings is not that of its middle.
fn settled(table: &TableRecord, standing: Range<usize>) -> Range<usize> {
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
    let sigma = table.reading_sigma * (1.0 / stretch as f64 + 1.0 / middle.len() as f64).sqrt();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::Scenario;

    #[test]
    fn dwells_lie_within_the_standstills_of_the_table_and_miss_little_of_them() {
        let scenario = Scenario::load("demo").unwrap();
        let run = scenario.simulate(1, 0).unwrap().run;
        let dwells = run.dwells();
        // The path: 60 s, then 15 s after each of 17 moves but the last, 30 s after that.
        assert_eq!(dwells.len(), 18);
        let standing: f64 = dwells
            .iter()
            .map(|d| d.samples.len() as f64 * run.imu.period)
            .sum();
        assert!((310.0..330.0).contains(&standing), "{standing} s");
        for dwell in &dwells {
            let rate = |k: usize| (run.imu.gyro[k] / run.imu.period).norm();
            // Earth rate and 25 °/h of bias; a table that turns is thousands of times faster.
            let fastest = dwell.samples.clone().map(rate).fold(0.0, f64::max);
            assert!(fastest < 1e-3, "{fastest} rad/s");
        }
    }

    #[test]
    fn a_reading_that_takes_up_the_next_position_before_the_turn_ends_the_dwell() {
        let mut run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
        let before = run.dwells()[0].clone();
        let table = run.table.as_mut().unwrap();
        let early = 20;
        for reading in before.readings.end - early..before.readings.end {
            table.attitude[reading] =
                exp(Vector3::new(0.0, 3.0 * ARCSEC, 0.0)) * table.attitude[reading];
        }
        let after = &run.dwells()[0];
        assert!(after.readings.end <= before.readings.end - early);
        assert!(after.readings.end + early + 20 > before.readings.end);
    }

    #[test]
    fn one_wild_reading_does_not_make_two_positions_of_one() {
        let mut run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
        let before = run.dwells();
        let table = run.table.as_mut().unwrap();
        let wild = before[3].readings.start + 40;
        table.attitude[wild] = exp(Vector3::new(0.0, 0.01, 0.0)) * table.attitude[wild];
        let after = run.dwells();
        assert_eq!(after.len(), before.len());
        assert_eq!(after[3].samples, before[3].samples);
        let moved = log(&(after[3].attitude * before[3].attitude.transpose())).norm();
        assert!(moved < 0.5 * ARCSEC, "{}″", moved / ARCSEC);
    }

    #[test]
    fn full_turns_that_end_where_they_began_part_two_positions() {
        // The first three moves of the path are two full turns each, seen by the gyros alone if the
        // table is read too seldom.
        let mut run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
        let all = run.dwells().len();
        let table = run.table.as_mut().unwrap();
        let seldom = |k: &usize| k.is_multiple_of(60);
        let kept: Vec<usize> = (0..table.time.len()).filter(seldom).collect();
        table.time = kept.iter().map(|&k| table.time[k]).collect();
        table.attitude = kept.iter().map(|&k| table.attitude[k]).collect();
        let dwells = run.dwells();
        assert!(!dwells.is_empty() && dwells.len() <= all);
        for dwell in &dwells {
            let fastest = dwell
                .samples
                .clone()
                .map(|k| run.imu.gyro[k].norm() / run.imu.period)
                .fold(0.0, f64::max);
            assert!(fastest < 1e-3, "{fastest} rad/s");
        }
    }

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
