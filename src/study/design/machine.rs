//! Turns of a table within its limits, or of a sensor by hand.

use std::f64::consts::PI;
use std::ops::Range;

use nalgebra::Matrix3;

use super::turn::{Place, Turn, radians};
use crate::attitude::{exp, log};
use crate::turntable::{AxesStep, BodyStep, Moves, Path, Profile, Rotation, Table};
use crate::units::DEGREE;

/// Highest rate of a designed turn of a table, °/s: precise gyros need not measure more.
const FASTEST: f64 = 100.0;
/// Rates of full turns, divided by the highest: three, because two do not separate a nonlinearity from a scale factor.
/// In the slowest turns, the errors that grow with the rate are small.
const RATES: [f64; 3] = [1.0, 0.6, 0.3];
/// Mean rates of turns by hand without their start and end, °/s.
const RATES_BY_HAND: [i32; 3] = [45, 75, 15];
/// Additional time for the start and end of a turn by hand, s.
const START_AND_END: f64 = 1.0;
/// Angular acceleration of a turn by hand, °/s².
const BY_HAND: f64 = 90.0;
/// Part of a turn after which the instrument must have turned by more than an angle in rad; this part of a number of full
/// turns is not a full turn.
const PART: f64 = 0.37;
const SEEN: f64 = 10.0 * DEGREE;
/// Turns between attitudes, in degrees: between faces, edges and corners of a cube.
const BETWEEN: [i32; 5] = [45, -45, 90, -90, 180];
/// Full turns, in degrees.
const FULL: [i32; 2] = [360, -360];

/// The machine or person that turns the instrument.
#[derive(Debug, Clone, Copy)]
pub enum Machine<'a> {
    Table(&'a Table),
    Hand,
}

impl Machine<'_> {
    /// An error if an axis is too slow for turns at whole degrees per second.
    pub fn check(&self) -> Result<(), String> {
        let Self::Table(table) = self else {
            return Ok(());
        };
        let slow = table.axes.iter().find(|axis| axis.max_rate < DEGREE);
        slow.map_or(Ok(()), |axis| {
            Err(format!(
                "axis {} of the table: found max_rate_deg_per_s = {}, expected 1 or more. State this axis without \
                 its turns, as part of mount_deg.",
                axis.name,
                axis.max_rate / DEGREE
            ))
        })
    }

    /// The first attitude.
    pub fn start(&self) -> Place {
        match self {
            Self::Table(table) => Place::Table(vec![0; table.axes.len()]),
            Self::Hand => Place::Hand(Matrix3::identity()),
        }
    }

    /// The attitude after a turn.
    pub fn after(&self, place: &Place, turn: &Turn) -> Place {
        match place {
            Place::Table(angles) => {
                let pairs = angles.iter().zip(&turn.degrees);
                Place::Table(pairs.map(|(angle, by)| angle + by).collect())
            }
            Place::Hand(attitude) => Place::Hand(attitude * exp(turn.vector())),
        }
    }

    /// Whether every turn of a path turns the instrument: turns of two parallel table axes may cancel.
    pub fn are_seen(&self, turns: &[Turn]) -> bool {
        let mut place = self.start();
        turns.iter().all(|turn| {
            let from = place.clone();
            place = self.after(&from, turn);
            let (Self::Table(table), Place::Table(angles)) = (self, &from) else {
                return true;
            };
            let attitude = |part: f64| {
                let axes = table.axes.iter().zip(angles).zip(&turn.degrees);
                let each = axes.map(|((axis, &from), &by)| {
                    let angle = f64::from(from) + part * f64::from(by);
                    exp(axis.direction * (angle * DEGREE))
                });
                each.product::<Matrix3<f64>>()
            };
            log(&(attitude(0.0).transpose() * attitude(PART))).norm() > SEEN
        })
    }

    /// Every turn that a path may have next.
    pub fn turns(&self) -> Vec<Turn> {
        let mut turns = Vec::new();
        let axes = match self {
            Self::Table(table) => table.axes.len(),
            Self::Hand => 3,
        };
        for axis in 0..axes {
            let mut add = |angles: &[i32], rate: i32| {
                turns.extend(angles.iter().map(|&angle| {
                    let degrees = (0..axes).map(|k| if k == axis { angle } else { 0 });
                    let degrees = degrees.collect();
                    Turn { degrees, rate }
                }));
            };
            let rates = self.rates(axis);
            add(&BETWEEN, rates[0]);
            add(&BETWEEN, rates[2]);
            rates.iter().for_each(|&rate| add(&FULL, rate));
        }
        turns
    }

    /// Rates of the turns about an axis, °/s; the first is that of turns between attitudes.
    fn rates(&self, axis: usize) -> [i32; 3] {
        match self {
            Self::Table(table) => {
                let fastest = (table.axes[axis].max_rate / DEGREE).min(FASTEST);
                RATES.map(|part| ((part * fastest) as i32).max(1))
            }
            Self::Hand => RATES_BY_HAND,
        }
    }

    /// Peak acceleration of all turns, °/s².
    pub fn acceleration(&self) -> f64 {
        match self {
            Self::Table(table) => {
                let limits = table.axes.iter().map(|axis| axis.max_acceleration);
                let limit = limits.fold(f64::INFINITY, f64::min) / DEGREE;
                // Three decimals, which a path file states exactly.
                (1e3 * limit + 1e-6).floor() / 1e3
            }
            Self::Hand => BY_HAND,
        }
    }

    /// Duration of a turn, s.
    pub fn duration(&self, turn: &Turn) -> f64 {
        let acceleration = self.acceleration() * DEGREE;
        let rate = f64::from(turn.rate) * DEGREE;
        match self {
            Self::Table(_) => {
                let angles = turn.degrees.iter().map(|&angle| f64::from(angle) * DEGREE);
                let each = angles.map(|angle| Profile::limited(angle, rate, acceleration));
                each.map(|profile| profile.duration()).fold(0.0, f64::max)
            }
            Self::Hand => {
                let angle = turn.vector().norm();
                let usual = START_AND_END + angle / rate;
                let shortest = (2.0 * PI * angle / acceleration).sqrt();
                // In tenths of a second, and beyond rounding.
                (10.0 * usual.max(shortest) + 1e-6).ceil() / 10.0
            }
        }
    }

    /// Two quarter turns about every axis.
    pub fn tour(&self) -> Vec<Turn> {
        let turns = self.turns().into_iter();
        let quarters = turns.filter(|turn| turn.degrees.iter().sum::<i32>() == 90);
        let mut once: Vec<Turn> = quarters.collect();
        once.dedup_by_key(|turn| turn.degrees.clone());
        [&once[..], &once].concat()
    }

    /// Turns of which some are replaced. On a table, the attitudes after the next turn do not change: the next turn
    /// starts from the new attitude and ends at the old one. By hand, where a turn is about one axis, all later
    /// attitudes change.
    pub fn spliced(&self, turns: &[Turn], range: Range<usize>, by: &[Turn]) -> Vec<Turn> {
        let mut spliced = turns[..range.start].to_vec();
        spliced.extend_from_slice(by);
        let mut later = turns[range.end..].to_vec();
        if let (Self::Table(table), Some(next)) = (self, later.first_mut()) {
            for axis in 0..table.axes.len() {
                let sum = |of: &[Turn]| of.iter().map(|turn| turn.degrees[axis]).sum::<i32>();
                let missing = (sum(&turns[range.clone()]) - sum(by)).rem_euclid(360);
                let missing = if missing > 180 {
                    missing - 360
                } else {
                    missing
                };
                next.degrees[axis] += missing;
                if next.degrees[axis] != 0 {
                    next.rate = next.rate.min(self.rates(axis)[0]);
                }
            }
        }
        spliced.extend(later);
        spliced.retain(|turn| turn.degrees.iter().any(|&angle| angle != 0));
        spliced
    }

    /// The path with these turns, and dwells of this duration in s before, between and after them.
    pub fn path(&self, start: &Place, turns: &[Turn], dwell: f64) -> Path {
        let acceleration = self.acceleration() * DEGREE;
        let moves = match start {
            Place::Table(angles) => Moves::Axes {
                start: radians(angles),
                steps: turns
                    .iter()
                    .map(|turn| AxesStep {
                        angles: radians(&turn.degrees),
                        rate: f64::from(turn.rate) * DEGREE,
                        acceleration,
                        dwell,
                    })
                    .collect(),
            },
            Place::Hand(attitude) => Moves::Body {
                start: *attitude,
                steps: turns
                    .iter()
                    .map(|turn| BodyStep {
                        rotation: Rotation::By(turn.vector()),
                        duration: self.duration(turn),
                        acceleration,
                        dwell,
                    })
                    .collect(),
            },
        };
        Path {
            first_dwell: dwell,
            moves,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::{Place as From, turntable};

    #[test]
    fn a_turn_that_is_exchanged_leaves_the_later_positions_of_a_table() {
        let (table, _) = turntable("two-axis", &From::Embedded).unwrap();
        let machine = Machine::Table(&table);
        let all = machine.turns();
        let path: Vec<Turn> = (0..6).map(|k| all[5 * k % all.len()].clone()).collect();
        let end = |turns: &[Turn]| {
            let place = |place, turn: &Turn| machine.after(&place, turn);
            turns.iter().fold(machine.start(), place).key()
        };
        for turn in &all {
            assert!(machine.are_seen(std::slice::from_ref(turn)), "{turn:?}");
            for at in 0..5 {
                let other = machine.spliced(&path, at..at + 1, std::slice::from_ref(turn));
                assert_eq!(end(&other), end(&path), "{at} {turn:?}");
                // The tilt axis is slower than the table axis.
                let slow = other.iter().filter(|turn| turn.degrees[0] != 0);
                assert!({ slow }.all(|turn| turn.rate <= 60));
            }
        }
    }
    /// The outer and the inner axis are parallel, and antiparallel after half a turn of the middle axis.
    #[test]
    fn turns_of_parallel_axes_that_cancel_are_not_seen() {
        let (mut table, _) = turntable("three-axis", &From::Embedded).unwrap();
        table.axes[2].direction = nalgebra::Vector3::z();
        let machine = Machine::Table(&table);
        let turn = |degrees: [i32; 3]| Turn {
            degrees: degrees.to_vec(),
            rate: 30,
        };
        let flipped = |degrees| machine.are_seen(&[turn([0, 180, 0]), turn(degrees)]);
        assert!(
            !machine.are_seen(&[turn([360, 0, -360])]) && machine.are_seen(&[turn([360, 0, 360])])
        );
        assert!(!flipped([45, 0, 45]) && flipped([45, 0, -45]) && flipped([45, 0, 90]));
    }
}
