//! Search for a path: turns are added one by one, then exchanged.

use std::slice::from_ref;

use rayon::prelude::*;

use super::goal::Goals;
use super::legs::Legs;
use super::turn::Turn;
use crate::study::path::PathError;

/// Shortest dwell of a designed path, s.
pub const SHORTEST_DWELL: f64 = 5.0;
/// Most turns of a path.
const MOST_TURNS: usize = 32;
/// Most legs that the exchange makes, and most paths that it tries.
const MOST_LEGS: usize = 1500;
const MOST_PATHS: usize = 2500;
/// Smallest part of its cost by which an exchange improves a path.
const WORTH: f64 = 1e-3;

/// A search for the best path within a time in s.
pub struct Search<'a, 'm> {
    pub legs: &'a mut Legs<'m>,
    pub goals: Goals,
    pub time: f64,
    /// Number of paths tried.
    tried: usize,
}

impl<'a, 'm> Search<'a, 'm> {
    pub fn new(legs: &'a mut Legs<'m>, goals: Goals, time: f64) -> Self {
        Self {
            legs,
            goals,
            time,
            tried: 0,
        }
    }

    /// Duration of a path with dwells of this duration, s.
    pub fn duration(&self, turns: &[Turn], dwell: f64) -> f64 {
        self.moving(turns) + dwell * (turns.len() + 1) as f64
    }

    /// Duration of the dwells of a path that uses the whole time, s.
    pub fn dwell(&self, turns: &[Turn]) -> f64 {
        (self.time - self.moving(turns)) / (turns.len() + 1) as f64
    }

    fn moving(&self, turns: &[Turn]) -> f64 {
        turns
            .iter()
            .map(|turn| self.legs.machine.duration(turn))
            .sum()
    }

    /// Turns added one by one, each with the best gain per second with dwells of this duration, until the time is used
    /// or, if the goals are limits, all are reached.
    pub fn greedy(&mut self, dwell: f64, until_reached: bool) -> Result<Vec<Turn>, PathError> {
        let mut turns: Vec<Turn> = Vec::new();
        while turns.len() < MOST_TURNS {
            let Some(now) = self.legs.sigma(&turns, dwell) else {
                break;
            };
            if until_reached && self.goals.worst(&now) <= 1.0 {
                break;
            }
            let left = self.time - self.duration(&turns, dwell) - dwell;
            let mut next = self.legs.machine.turns();
            next.retain(|turn| self.legs.machine.duration(turn) <= left);
            let longer = next
                .iter()
                .map(|turn| [&turns[..], from_ref(turn)].concat());
            let longer: Vec<Vec<Turn>> = longer.collect();
            let before = self.goals.distance(&now);
            let loss_per_second = |search: &Self, path: &[Turn]| {
                let after = search.goals.distance(&search.legs.sigma(path, dwell)?);
                let time = search.legs.machine.duration(path.last()?) + dwell;
                Some((after - before) / time)
            };
            let losses = self.each(&longer, loss_per_second)?;
            let Some(best) = best(losses.into_iter()) else {
                break;
            };
            turns.clone_from(&longer[best]);
        }
        Ok(turns)
    }

    /// Exchanges, adds and removes turns as long as the path improves.
    pub fn exchange(&mut self, mut turns: Vec<Turn>) -> Result<Vec<Turn>, PathError> {
        let Some(mut cost) = self.cost(&turns) else {
            return Ok(turns);
        };
        let (mut at, mut unchanged) = (0, 0);
        self.tried = 0;
        let most = self.legs.count() + MOST_LEGS;
        while unchanged <= turns.len() && self.tried < MOST_PATHS && self.legs.count() < most {
            at %= turns.len() + 1;
            let changed = self.changed(&turns, at);
            let costs = self.each(&changed, Self::cost)?;
            at += 1;
            unchanged += 1;
            let best = best(costs.iter().copied());
            let lower = best.and_then(|best| Some((best, costs[best]?)));
            if let Some((best, lower)) = lower.filter(|of| of.1 < (1.0 - WORTH) * cost) {
                (turns, cost, unchanged) = (changed[best].clone(), lower, 0);
            }
        }
        Ok(turns)
    }

    /// Cost of a path that uses the whole time; `None` if its dwells are too short.
    pub fn cost(&self, turns: &[Turn]) -> Option<f64> {
        let dwell = self.dwell(turns);
        let sigma = (dwell >= SHORTEST_DWELL).then(|| self.legs.sigma(turns, dwell));
        Some(self.goals.cost(&sigma??))
    }

    /// Paths that differ at one place: a turn is replaced, inserted, removed, or exchanged with the next.
    fn changed(&self, turns: &[Turn], at: usize) -> Vec<Vec<Turn>> {
        let machine = &self.legs.machine;
        let mut changed = Vec::new();
        for turn in machine.turns() {
            changed.push(machine.spliced(turns, at..at, from_ref(&turn)));
            if at < turns.len() && turns[at] != turn {
                changed.push(machine.spliced(turns, at..at + 1, &[turn]));
            }
        }
        if at < turns.len() {
            changed.push(machine.spliced(turns, at..at + 1, &[]));
        }
        if let [one, other, ..] = &turns[at..] {
            changed.push(machine.spliced(turns, at..at + 2, &[other.clone(), one.clone()]));
        }
        changed.retain(|path| {
            let is_short = path.len() <= MOST_TURNS && self.dwell(path) >= SHORTEST_DWELL;
            is_short && machine.are_seen(path)
        });
        changed
    }

    /// A figure of each path, after making the legs that are missing.
    fn each(
        &mut self,
        paths: &[Vec<Turn>],
        figure: impl Fn(&Self, &[Turn]) -> Option<f64> + Sync,
    ) -> Result<Vec<Option<f64>>, PathError> {
        self.legs.make(paths.iter().map(Vec::as_slice))?;
        self.tried += paths.len();
        let search = &*self;
        Ok(paths.par_iter().map(|path| figure(search, path)).collect())
    }
}

/// Place of the smallest figure, the first if several are equal.
fn best(figures: impl Iterator<Item = Option<f64>>) -> Option<usize> {
    let known = figures.enumerate();
    let known = known.filter_map(|(place, figure)| Some((place, figure?)));
    let best = known.min_by(|a, b| a.1.total_cmp(&b.1));
    best.map(|(place, _)| place)
}
