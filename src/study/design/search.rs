//! Search for a path: turns are added one by one, then exchanged.

use std::slice::from_ref;

use rayon::prelude::*;

use super::expected::Sigma;
use super::goal::Goals;
use super::legs::{Legs, Stage};
use super::turn::Turn;
use crate::study::path::PathError;

/// Shortest dwell of a designed path, s.
pub const SHORTEST_DWELL: f64 = 5.0;
/// Maximum number of turns in a path.
const MOST_TURNS: usize = 32;
/// Maximum number of changes at a turn that are evaluated with their own dwells.
const CLOSEST: usize = 3;
/// Dwells for the effect of their duration on the cost, divided by those of the path.
const LONGER: f64 = 1.05;
/// Smallest relative decrease of the cost that counts as an improvement.
const WORTH: f64 = 1e-3;

/// A search for the best path within a time in s.
pub struct Search<'a, 'm> {
    pub legs: &'a mut Legs<'m>,
    pub goals: Goals,
    pub time: f64,
}

impl<'a, 'm> Search<'a, 'm> {
    pub fn new(legs: &'a mut Legs<'m>, goals: Goals, time: f64) -> Self {
        Self { legs, goals, time }
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
            let left = self.time - self.duration(&turns, dwell) - dwell;
            let mut next = self.legs.machine.turns();
            next.retain(|turn| self.legs.machine.duration(turn) <= left);
            let longer = next
                .iter()
                .map(|turn| [&turns[..], from_ref(turn)].concat());
            let longer: Vec<Vec<Turn>> = longer.collect();
            self.legs.make(longer.iter().map(Vec::as_slice))?;
            let Some((stage, now)) = self.stage(&turns, dwell) else {
                break;
            };
            if until_reached && self.goals.worst(&now, dwell) <= 1.0 {
                break;
            }
            let before = self.goals.distance(&now, dwell);
            let loss_per_second = |turn: &Turn| {
                let after = self.legs.continued(&stage, from_ref(turn), dwell)?;
                let after = self.goals.distance(&after.sigma()?, dwell);
                Some((after - before) / (self.legs.machine.duration(turn) + dwell))
            };
            let losses: Vec<Option<f64>> = next.par_iter().map(loss_per_second).collect();
            let Some(&(best, _)) = ranked(&losses).first() else {
                break;
            };
            turns.clone_from(&longer[best]);
        }
        Ok(turns)
    }

    /// A path whose legs exist, with its σ.
    fn stage(&self, turns: &[Turn], dwell: f64) -> Option<(Stage, Sigma)> {
        let stage = self
            .legs
            .continued(&self.legs.begun(dwell)?, turns, dwell)?;
        let sigma = stage.sigma()?;
        Some((stage, sigma))
    }

    /// Changes each turn in order if the path improves.
    pub fn exchange(&mut self, mut turns: Vec<Turn>) -> Result<Vec<Turn>, PathError> {
        let mut at = 0;
        while at <= turns.len() {
            if let Some(better) = self.better(&turns, at)? {
                turns = better;
            }
            at += 1;
        }
        Ok(turns)
    }

    /// The path with the best change at a turn; `None` if no change improves it. All changes are compared with the
    /// dwells of the path, so that the legs before the turn are joined once.
    fn better(&mut self, turns: &[Turn], at: usize) -> Result<Option<Vec<Turn>>, PathError> {
        let changed = self.changed(turns, at);
        self.legs.make(changed.iter().map(Vec::as_slice))?;
        let dwell = self.dwell(turns);
        let Some((cost, power)) = self.cost(turns).zip(self.power(turns)) else {
            return Ok(None);
        };
        let Some((before, _)) = self.stage(&turns[..at], dwell) else {
            return Ok(None);
        };
        let approximate = |path: &Vec<Turn>| {
            let after = self.legs.continued(&before, path.get(at..)?, dwell)?;
            let cost = self.goals.cost(&after.sigma()?, dwell);
            Some(cost * (self.dwell(path) / dwell).powf(power))
        };
        let costs: Vec<Option<f64>> = changed.par_iter().map(approximate).collect();
        let closest = ranked(&costs).into_iter().take(CLOSEST);
        let is_better = |&place: &usize| {
            let lower = self.cost(&changed[place]);
            lower.is_some_and(|lower| lower < (1.0 - WORTH) * cost)
        };
        let better = closest.map(|(place, _)| place).find(is_better);
        Ok(better.map(|place| changed[place].clone()))
    }

    /// Change of the logarithm of the cost with that of the duration of the dwells.
    fn power(&self, turns: &[Turn]) -> Option<f64> {
        let dwell = self.dwell(turns);
        let cost = |dwell| Some(self.goals.cost(&self.legs.sigma(turns, dwell)?, dwell));
        Some((cost(LONGER * dwell)? / cost(dwell)?).ln() / LONGER.ln())
    }

    /// Cost of a path that uses the whole time; `None` if its dwells are too short.
    pub fn cost(&self, turns: &[Turn]) -> Option<f64> {
        let dwell = self.dwell(turns);
        let sigma = (dwell >= SHORTEST_DWELL).then(|| self.legs.sigma(turns, dwell));
        Some(self.goals.cost(&sigma??, dwell))
    }

    /// Paths that differ in one or two turns: a turn is replaced, inserted, removed alone or with the next, or exchanged
    /// with the next.
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
            changed.push(machine.spliced(turns, at..at + 2, &[]));
        }
        changed.retain(|path| {
            let is_short = path.len() <= MOST_TURNS && self.dwell(path) >= SHORTEST_DWELL;
            is_short && machine.are_seen(path)
        });
        changed
    }
}

/// The known figures with their indices, the smallest first; in order if several are equal.
fn ranked(figures: &[Option<f64>]) -> Vec<(usize, f64)> {
    let known = figures.iter().enumerate();
    let known = known.filter_map(|(place, figure)| Some((place, (*figure)?)));
    let mut known: Vec<(usize, f64)> = known.collect();
    known.sort_by(|a, b| a.1.total_cmp(&b.1));
    known
}
