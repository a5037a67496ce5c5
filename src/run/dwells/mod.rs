//! Detection of dwells, during which the instrument is at rest, from the table readings or, without a table, from the
//! output of the instrument.

pub mod imu;
pub mod table;

use std::ops::Range;

use nalgebra::Vector3;

use super::dwell::{Dwell, SHORTEST, common};
use super::{Aiding, Run};
use crate::imu::Sensor;
use crate::recording::{LabelledMotion, Segment};
use crate::units::DEGREE;
use imu::{STILL_FORCE, STILL_RATE, STILL_SIGMAS};

/// Gyro integrals below this, beyond noise and bias drift, are not a turn, rad.
const STILL_ANGLE: f64 = 0.1 * DEGREE;

impl Run {
    /// The dwells, in order of time.
    ///
    /// The standstills of a table log are checked against the gyros. A standstill during which the gyros turn is not a
    /// dwell, because two readings may miss a full turn. Two standstills without a turn between them are merged,
    /// because they were separated only by an outlier or a knock.
    pub fn dwells(&self, aiding: Aiding) -> Vec<Dwell> {
        let imu = &self.recording.imu;
        if imu.is_of_means() {
            return (0..imu.len()).map(|k| Dwell::of(k..k + 1)).collect();
        }
        if !imu.continuous && !self.recording.segments.is_empty() {
            return self.labelled_dwells();
        }
        let standstills: Vec<Dwell> = match self.observed_table(aiding) {
            Some(table) => {
                let standstills = table::standstills(self, table).into_iter();
                let at_rest = |dwell: &Dwell| !self.turns(dwell.samples.clone(), dwell);
                standstills.filter(at_rest).collect()
            }
            None => imu::standstills(self).into_iter().map(Dwell::of).collect(),
        };
        let mut dwells: Vec<Dwell> = Vec::new();
        for dwell in standstills {
            match dwells.last_mut() {
                Some(last) if self.same_position(last, &dwell) => last.extend(&dwell),
                _ => dwells.push(dwell),
            }
        }
        dwells.retain_mut(|dwell| {
            for missing in imu.missing() {
                // The longer of the parts before and after it.
                let known = [missing.end..imu.len(), 0..missing.start];
                let parts = known.map(|known| common(&known, &dwell.samples));
                let longer = parts.into_iter().max_by_key(Range::len);
                dwell.samples = longer.unwrap_or_default();
            }
            dwell.duration(imu) >= SHORTEST
        });
        dwells
    }

    /// Dwells of a recording of concatenated sections: the sections labelled as positions, because nothing is known
    /// between sections; in a section whose label is neither position nor turn, its standstills.
    fn labelled_dwells(&self) -> Vec<Dwell> {
        let standstills = imu::standstills(self);
        let within = |segment: &Segment| {
            // A row at the edge of a section may belong to the adjacent one.
            let samples = segment.samples.start + 1..segment.samples.end.saturating_sub(1);
            let dwell = |standstill| Dwell::of(common(standstill, &samples));
            let is_long = |dwell: &Dwell| dwell.duration(&self.recording.imu) >= SHORTEST;
            match segment.motion {
                Some(LabelledMotion::Stands { .. }) => {
                    let standing = self.standing_in(&samples, &standstills);
                    vec![Dwell::of(standing.unwrap_or(samples))]
                }
                Some(LabelledMotion::Turns { .. }) => Vec::new(),
                None => standstills.iter().map(dwell).filter(is_long).collect(),
            }
        };
        let inside = self.recording.segments.iter().flat_map(within);
        inside.filter(|dwell| !dwell.samples.is_empty()).collect()
    }

    /// The longest of these standstills within some samples, if the instrument turns in the remaining samples by more
    /// than the uncertainty of a position set by hand.
    pub fn standing_in(
        &self,
        samples: &Range<usize>,
        standstills: &[Range<usize>],
    ) -> Option<Range<usize>> {
        let imu = &self.recording.imu;
        let within = standstills
            .iter()
            .map(|standstill| common(standstill, samples));
        let longest = Dwell::of(within.max_by_key(Range::len)?);
        let Range { start, end } = longest.samples;
        let limit = |count: usize| {
            let random_walk = self.instrument.noise.gyro.random_walk;
            self.segment_sigma + STILL_SIGMAS * random_walk * (count as f64 * imu.period).sqrt()
        };
        let before = imu.gyro.part(samples.start..start).into_owned();
        let turns = || {
            self.turns_beyond(before.into_iter().rev(), &longest, limit)
                || self.turns_beyond(imu.gyro.within(end..samples.end), &longest, limit)
        };
        (longest.duration(imu) >= SHORTEST && turns()).then_some(start..end)
    }

    fn same_position(&self, before: &Dwell, after: &Dwell) -> bool {
        let between = before.samples.end..after.samples.start;
        let positions = before.position.as_ref().zip(after.position.as_ref());
        positions.is_none_or(|(before, after)| table::same_reading(self, before, after))
            && self.recording.imu.unbroken(&between)
            && if self.recording.imu.has(Sensor::Gyro) {
                !self.turns(between, before)
            } else {
                let is_same = |of: &Dwell| of.samples.is_empty() || self.same_force(before, of);
                is_same(after) && is_same(&Dwell::of(between))
            }
    }

    /// Whether the accelerometers, within noise, give the same mean force as in a dwell. Between two dwells they do if the
    /// instrument does not turn, whatever its motion, because it is at rest before and after.
    fn same_force(&self, before: &Dwell, other: &Dwell) -> bool {
        let [before, other] = [before, other].map(|dwell| dwell.mean(Sensor::Accel, self));
        let noise = (before.variance + other.variance).sqrt();
        (before.output - other.output).norm() < STILL_FORCE + STILL_SIGMAS * noise
    }

    /// Whether the gyros turn during these samples.
    fn turns(&self, samples: Range<usize>, at_rest: &Dwell) -> bool {
        let duration = samples.len() as f64 * self.recording.imu.period;
        let limit = STILL_ANGLE
            + STILL_SIGMAS * self.instrument.noise.gyro.random_walk * duration.sqrt()
            + STILL_RATE * duration;
        let increments = self.recording.imu.gyro.within(samples);
        self.turns_beyond(increments, at_rest, |_| limit)
    }

    /// Whether the running sum of gyro increments, minus their mean at rest, ever exceeds the limit for the number of
    /// samples.
    fn turns_beyond(
        &self,
        increments: impl Iterator<Item = Vector3<f64>>,
        at_rest: &Dwell,
        limit: impl Fn(usize) -> f64,
    ) -> bool {
        let samples = at_rest.samples.clone();
        let zero = self.recording.imu.gyro.sum(samples.clone()) / samples.len() as f64;
        let mut angle = Vector3::zeros();
        increments.enumerate().any(|(before, increment)| {
            angle += increment - zero;
            angle.norm_squared() > limit(before + 1).powi(2)
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::imu::LONG_ENOUGH;
    use super::*;
    use crate::attitude::{exp, log};
    use crate::recording::{ImuSamples, Stretch, TableLog};
    use crate::simulation::Scenario;
    use crate::units::ARCSEC;

    fn reading(dwell: &Dwell) -> Range<usize> {
        dwell.position.clone().unwrap().readings
    }

    #[test]
    fn dwells_lie_within_the_standstills_of_the_table_and_miss_little_of_them() {
        let scenario = Scenario::load("demo").unwrap();
        let run = scenario.simulate(1, 0).unwrap().run;
        let dwells = run.dwells(run.aiding());
        // The path: 60 s, then 15 s after each of 17 moves but the last, 30 s after that.
        assert_eq!(dwells.len(), 18);
        let standing: f64 = dwells
            .iter()
            .map(|d| d.samples.len() as f64 * run.recording.imu.period)
            .sum();
        assert!((310.0..330.0).contains(&standing), "{standing} s");
        for dwell in &dwells {
            let rate = |k: usize| (run.recording.imu.gyro.at(k) / run.recording.imu.period).norm();
            // Earth rate and 25 °/h of bias; a table that turns is thousands of times faster.
            let fastest = dwell.samples.clone().map(rate).fold(0.0, f64::max);
            assert!(fastest < 1e-3, "{fastest} rad/s");
        }
    }

    #[test]
    fn a_reading_that_takes_up_the_next_position_before_the_turn_ends_the_dwell() {
        let mut run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
        let before = reading(&run.dwells(run.aiding())[0]);
        let table = run.recording.table.as_mut().unwrap();
        let early = 20;
        for reading in before.end - early..before.end {
            table.attitude[reading] =
                UnitQuaternion::new(Vector3::y() * 3.0 * ARCSEC) * table.attitude[reading];
        }
        let after = reading(&run.dwells(run.aiding())[0]);
        assert!(after.end <= before.end - early);
        assert!(after.end + early + 20 > before.end);
    }

    #[test]
    fn one_wild_reading_does_not_make_two_positions_of_one() {
        let mut run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
        let before = run.dwells(run.aiding());
        let table = run.recording.table.as_mut().unwrap();
        let wild = reading(&before[3]).start + 40;
        table.attitude[wild] = UnitQuaternion::new(Vector3::y() * 0.01) * table.attitude[wild];
        let after = run.dwells(run.aiding());
        assert_eq!(after.len(), before.len());
        assert_eq!(after[3].samples, before[3].samples);
        let attitude = |dwells: &[Dwell]| dwells[3].position.clone().unwrap().attitude;
        let moved = log(&(attitude(&after) * attitude(&before).transpose())).norm();
        assert!(moved < 0.5 * ARCSEC, "{}″", moved / ARCSEC);
    }

    #[test]
    fn full_turns_that_end_where_they_began_are_no_standstill() {
        // The first three moves of the path are two full turns each. A log that is read seldom, or at rest
        // alone, hardly shows them; the gyros do.
        let run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
        let all = run.dwells(run.aiding());
        let seldom: Vec<usize> = (0..run.recording.table.as_ref().unwrap().time.len())
            .step_by(60)
            .collect();
        let at_rest: Vec<usize> = all.iter().flat_map(reading).collect();
        for kept in [seldom, at_rest] {
            let mut run = run.clone();
            let table = run.recording.table.as_mut().unwrap();
            table.time = kept.iter().map(|&k| table.time[k]).collect();
            table.attitude = kept.iter().map(|&k| table.attitude[k]).collect();
            let dwells = run.dwells(run.aiding());
            assert!(dwells.len() > 3, "{}", dwells.len());
            // What is cut off at each end, in samples.
            let margin = (0.2 / run.recording.imu.period).round() as usize;
            for found in &dwells {
                let within = |known: &&Dwell| {
                    known.samples.start <= found.samples.start + margin
                        && found.samples.end <= known.samples.end + margin
                };
                assert_eq!(all.iter().filter(within).count(), 1, "{found:?}");
            }
        }
    }

    #[test]
    fn a_hole_in_a_dwell_makes_two_of_it_and_neither_is_lost() {
        let mut run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
        run.recording.table = None;
        let whole = run.dwells(Aiding::Velocity);
        let longest = whole
            .iter()
            .max_by_key(|dwell| dwell.samples.len())
            .unwrap();
        let imu = &mut run.recording.imu;
        let third = longest.samples.len() / 3;
        let lost = longest.samples.start + third..longest.samples.end - third;
        let after = Stretch {
            samples: lost.end..imu.len(),
            start: imu.time(lost.end),
        };
        imu.stretches[0].samples.end = lost.start;
        imu.stretches.push(after);
        let parted = run.dwells(Aiding::Velocity);
        assert_eq!(parted.len(), whole.len() + 1);
        let within = |dwell: &Dwell| {
            let Range { start, end } = dwell.samples;
            end <= lost.start || lost.end <= start
        };
        assert!(parted.iter().all(within));
    }

    #[test]
    fn where_begin_and_end_of_a_record_are_lost_nothing_rests() {
        let mut run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
        let imu = &mut run.recording.imu;
        let second = (1.0 / imu.period) as usize;
        let known = 3 * second..imu.len() - 3 * second;
        imu.stretches = vec![Stretch {
            samples: known.clone(),
            start: imu.time(known.start),
        }];
        for aiding in [Aiding::Table, Aiding::Velocity] {
            let dwells = run.dwells(aiding);
            assert!(dwells.len() > 3);
            assert_eq!(dwells[0].samples.start, known.start);
            assert!(dwells[dwells.len() - 1].samples.end <= known.end);
        }
    }

    #[test]
    fn what_stands_as_long_as_is_said_is_found_wherever_it_lies() {
        let mut run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
        run.recording.table = None;
        let (period, turn) = (0.01, 100);
        let stand = (LONG_ENOUGH / period).round() as usize;
        for early in 0..25 {
            let mut up = Vector3::z();
            let mut gyro = Vec::new();
            let mut accel = Vec::new();
            let moves = (0..8).flat_map(|_| {
                std::iter::repeat_n(0.0, stand).chain(std::iter::repeat_n(1.0, turn))
            });
            for rate in moves.skip(early) {
                let angle = Vector3::x() * rate * 60.0 * DEGREE * period;
                up = exp(-angle) * up;
                gyro.push(angle);
                accel.push(up * run.site.gravity * period);
            }
            run.recording.imu = ImuSamples::made(0.0, period, gyro, accel);
            assert_eq!(run.dwells(Aiding::Velocity).len(), 8, "{early}");
        }
    }

    #[test]
    fn a_slow_turn_between_dense_readings_is_no_standstill() {
        let mut run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
        let time: Vec<f64> = (0..60_000).map(|k| f64::from(k) * 1e-3).collect();
        // Stands for 20 s, turns by 0.5°/s for 20 s, stands again.
        let attitude = |&t: &f64| {
            let angle = (t - 20.0).clamp(0.0, 20.0) * 0.5 * DEGREE;
            UnitQuaternion::new(Vector3::z() * angle)
        };
        run.recording.table = Some(TableLog {
            attitude: time.iter().map(attitude).collect(),
            time,
            axes: Vec::new(),
        });
        let dwells = run.dwells(run.aiding());
        assert_eq!(dwells.len(), 2);
        assert!(run.recording.imu.time(dwells[0].samples.end) <= 20.0);
        assert!(run.recording.imu.time(dwells[1].samples.start) >= 40.0);
    }
}
