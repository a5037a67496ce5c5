//! The choice among paths by their exact σ.

use rayon::prelude::*;

use super::expected::{ByTerms, along, expected};
use super::goal::{Compared, Goals};
use super::legs::Legs;
use super::search::{SHORTEST_DWELL, Search};
use super::turn::Turn;
use super::{DesignStudy, TURN, USUAL_TIME};
use crate::calibration::Estimate;
use crate::study::path::PathError;

/// Numbers of turns in the typical time among which the dwells of a first path are chosen.
const TURNS: [f64; 3] = [14.0, 22.0, 32.0];
/// Maximum number of passes of the exchange; each begins with σ of joined legs corrected for the path so far.
const PASSES: usize = 4;
/// Dwells of the second path from which σ of joined legs are corrected, divided by those of the first.
const LONGER: f64 = 1.4;
/// Number of corrections of the dwells; they are needed because the goals refer to the σ of joined legs.
const CORRECTIONS: usize = 6;
/// Smallest difference between dwells, s.
const HUNDREDTH: f64 = 0.01;
/// Largest σ over the σ that decides a limit, with a margin for dwells in hundredths of a second.
const DECIDED: f64 = 0.998;

/// A candidate with its exact σ.
pub struct Candidate {
    pub turns: Vec<Turn>,
    pub dwell: f64,
    pub expected: ByTerms<Estimate>,
}

impl DesignStudy {
    /// The best path found, with its dwells.
    pub(super) fn best(
        &self,
        legs: &mut Legs,
        goals: &Goals,
        time: f64,
    ) -> Result<Candidate, PathError> {
        let decide = self.specification.is_some();
        let mut search = Search::new(legs, goals.clone(), time);
        let mut first = Vec::new();
        for turns in TURNS {
            let dwell = (time.min(USUAL_TIME) / turns - TURN).max(SHORTEST_DWELL);
            let turns = search.greedy(dwell, decide)?;
            let dwell = if decide { dwell } else { search.dwell(&turns) };
            first.push((turns, dwell));
        }
        let first = first.into_par_iter().map(|(turns, dwell)| {
            let candidate = search.legs.candidate(turns, dwell)?;
            self.fitted(&search, goals, candidate)
        });
        let first: Vec<Candidate> = first.collect::<Result<_, _>>()?;
        let first = first.into_iter().min_by(|a, b| {
            let [a, b] = [a, b].map(|of| self.cost(&search, goals, of));
            a.total_cmp(&b)
        });
        let Some(mut best) = first else {
            return search.legs.candidate(Vec::new(), time);
        };
        for _ in 0..PASSES {
            let Some(compared) = search.legs.compared(&best)? else {
                break;
            };
            search.goals = goals.corrected(&compared);
            // With limits, the exchange improves the σ in the time that the path takes.
            search.time = search.duration(&best.turns, best.dwell);
            let turns = search.exchange(best.turns.clone())?;
            let exchanged = search.legs.candidate(turns.clone(), search.dwell(&turns))?;
            search.time = time;
            let exchanged = self.fitted(&search, goals, exchanged)?;
            let [cost, lowest] = [&exchanged, &best].map(|of| self.cost(&search, goals, of));
            if cost >= lowest {
                break;
            }
            best = exchanged;
        }
        Ok(best)
    }

    /// The figure to minimise: the time if limits are decided, the σ in all other cases.
    fn cost(&self, search: &Search, goals: &Goals, of: &Candidate) -> f64 {
        let sigma = of.expected.sigma();
        let cost = goals.cost(&sigma, of.dwell);
        let is_decided = goals.worst(&sigma, of.dwell) <= DECIDED;
        match self.specification {
            Some(_) if is_decided => search.duration(&of.turns, of.dwell) / search.time - 2.0,
            _ => cost,
        }
    }

    /// With limits: the candidate with the shortest dwells that decide them, within the time.
    fn fitted(
        &self,
        search: &Search,
        goals: &Goals,
        mut candidate: Candidate,
    ) -> Result<Candidate, PathError> {
        if self.specification.is_none() {
            return Ok(candidate);
        }
        let longest = search.dwell(&candidate.turns);
        let mut decided: Option<Candidate> = None;
        for _ in 0..CORRECTIONS {
            let worst = goals.worst(&candidate.expected.sigma(), candidate.dwell);
            // σ decrease with the root of the time, or more slowly.
            let dwell = candidate.dwell * (worst * worst * 1.01).clamp(0.3, 3.0);
            let dwell = dwell.clamp(SHORTEST_DWELL.min(longest), longest);
            let turns = candidate.turns.clone();
            if worst <= DECIDED && decided.as_ref().is_none_or(|of| candidate.dwell < of.dwell) {
                decided = Some(candidate);
            } else if (dwell - candidate.dwell).abs() < HUNDREDTH {
                return Ok(decided.unwrap_or(candidate));
            }
            candidate = search.legs.candidate(turns, dwell)?;
        }
        Ok(decided.unwrap_or(candidate))
    }
}

impl Legs<'_> {
    /// A path with its exact σ.
    pub fn candidate(&self, turns: Vec<Turn>, dwell: f64) -> Result<Candidate, PathError> {
        let path = self.machine.path(&self.machine.start(), &turns, dwell);
        Ok(Candidate {
            expected: expected(&along(&self.study, path)?)?,
            turns,
            dwell,
        })
    }

    /// Joined and exact σ of a path, and of the same turns with longer dwells; `None` if the legs determine too little.
    pub fn compared(&self, path: &Candidate) -> Result<Option<[Compared; 2]>, PathError> {
        let longer = self.candidate(path.turns.clone(), LONGER * path.dwell)?;
        let [near, far] = [path, &longer].map(|of| {
            Some(Compared {
                dwell: of.dwell,
                joined: self.sigma(&of.turns, of.dwell)?,
                exact: of.expected.sigma(),
            })
        });
        Ok(near.zip(far).map(|(near, far)| [near, far]))
    }
}
