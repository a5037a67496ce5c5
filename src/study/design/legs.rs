//! Bounds of many paths of one machine, joined from legs that are made once.

use std::collections::{HashMap, HashSet};

use rayon::prelude::*;

use super::expected::Sigma;
use super::machine::Machine;
use super::turn::{Place, Turn};
use crate::calibration::{AttitudePrior, Journey, Leg, Problem, coarse_start};
use crate::imu::PerSensor;
use crate::study::path::{PathError, PathStudy};

/// Duration of the dwells from which legs are made, s: one part of a dwell.
const MADE_WITH: f64 = 9.9;
/// Sample period of the recordings from which legs are made, s: no σ depends on it by more than 0.1 %.
const PERIOD: f64 = 0.1;

/// The legs made so far.
pub struct Legs<'a> {
    pub machine: Machine<'a>,
    /// The setting common to all paths.
    pub study: PathStudy,
    start: AttitudePrior,
    before: Journey,
    /// The first dwell.
    first: Vec<Leg>,
    made: HashMap<(Vec<i32>, Turn), Leg>,
}

/// A path up to the end of one of its dwells.
#[derive(Debug, Clone)]
pub struct Stage {
    journey: Journey,
    place: Place,
}

impl Stage {
    /// Expected σ; `None` if a constant is undetermined.
    pub fn sigma(&self) -> Option<Sigma> {
        Sigma::after(&self.journey)
    }
}

impl<'a> Legs<'a> {
    /// An empty set of legs, in the setting of a study; the path of the study gives the prior of the first attitude.
    pub fn new(machine: Machine<'a>, study: &PathStudy) -> Result<Self, PathError> {
        let mut study = study.clone();
        study.scenario.integrator.period = PERIOD;
        study.scenario.chamber = None;
        let (run, truth, terms) = study.record()?;
        let problem = Problem::new(&run, &study.options);
        let start = coarse_start(&problem)?.attitudes[0];
        let mut legs = Self {
            before: Journey::new(&problem, (&truth, &terms)),
            machine,
            study,
            start,
            first: Vec::new(),
            made: HashMap::new(),
        };
        legs.first = legs.recorded(&machine.start(), &[])?;
        Ok(legs)
    }

    /// The legs of a short recording.
    fn recorded(&self, from: &Place, turns: &[Turn]) -> Result<Vec<Leg>, PathError> {
        let mut study = self.study.clone();
        study.scenario.path = self.machine.path(from, turns, MADE_WITH);
        let mean = study.scenario.motion()?.at(0.0).attitude;
        let (mut run, truth, terms) = study.record()?;
        run.standstill.sigma = PerSensor::from_fn(|_| Some(0.0));
        let problem = Problem::new(&run, &study.options);
        let start = AttitudePrior { mean, ..self.start };
        Ok(Leg::all(&problem, (&truth, &terms), &[start])?)
    }

    /// Makes the missing legs of some paths.
    pub fn make<'t>(&mut self, paths: impl Iterator<Item = &'t [Turn]>) -> Result<(), PathError> {
        let mut missing: Vec<((Vec<i32>, Turn), Place)> = Vec::new();
        let mut known = HashSet::new();
        for turns in paths {
            let mut place = self.machine.start();
            for turn in turns {
                let key = (place.key(), turn.clone());
                let next = self.machine.after(&place, turn);
                if !self.made.contains_key(&key) && known.insert(key.clone()) {
                    missing.push((key, place));
                }
                place = next;
            }
        }
        let made = missing.into_par_iter().map(|(key, place)| {
            let mut legs = self.recorded(&place, std::slice::from_ref(&key.1))?;
            Ok::<_, PathError>((key, legs.pop()))
        });
        let made: Vec<_> = made.collect::<Result<_, _>>()?;
        let made = made.into_iter().filter_map(|(key, leg)| Some((key, leg?)));
        self.made.extend(made);
        Ok(())
    }

    /// A path of only the first dwell, with dwells of this duration in s.
    pub fn begun(&self, dwell: f64) -> Option<Stage> {
        let mut journey = self.before.clone();
        for leg in &self.first {
            journey.go(leg, MADE_WITH / dwell).ok()?;
        }
        Some(Stage {
            journey,
            place: self.machine.start(),
        })
    }

    /// A path continued by turns, with dwells of this duration in s; the legs must already exist.
    pub fn continued(&self, stage: &Stage, turns: &[Turn], dwell: f64) -> Option<Stage> {
        let mut stage = stage.clone();
        for turn in turns {
            let leg = self.made.get(&(stage.place.key(), turn.clone()))?;
            stage.journey.go(leg, MADE_WITH / dwell).ok()?;
            stage.place = self.machine.after(&stage.place, turn);
        }
        Some(stage)
    }

    /// Expected σ of a path with dwells of this duration in s; its legs must already exist.
    pub fn sigma(&self, turns: &[Turn], dwell: f64) -> Option<Sigma> {
        let begun = self.begun(dwell)?;
        self.continued(&begun, turns, dwell)?.sigma()
    }
}

#[cfg(test)]
mod tests {
    use super::super::expected::{along, expected};
    use super::*;
    use crate::calibration::Group;
    use crate::study::path::Named;

    /// Turns about all axes, of whole and of part turns; dwells twice as long as those of the legs have biases that vary.
    #[test]
    fn a_path_joined_from_short_recordings_has_the_sigma_of_its_own_recording() {
        for (scenario, by_hand) in [("demo", false), ("mems", true)] {
            let named = Named {
                scenario: Some(scenario),
                by_hand,
                ..Named::default()
            };
            let mut setting = PathStudy::setting(&named).unwrap();
            setting.options.auto_terms = false;
            let table = setting.scenario.table.clone();
            let machine = if by_hand {
                Machine::Hand
            } else {
                Machine::Table(&table)
            };
            let all = machine.turns();
            let turns: Vec<Turn> = (0..14).map(|k| all[7 * k % all.len()].clone()).collect();
            for (dwell, within) in [(10.0, 0.05), (20.0, 0.25)] {
                let path = machine.path(&machine.start(), &turns, dwell);
                let study = along(&setting, path).unwrap();
                let mut legs = Legs::new(machine, &study).unwrap();
                legs.make([&turns[..]].into_iter()).unwrap();
                let joined = legs.sigma(&turns, dwell).unwrap().none;
                let whole = expected(&study).unwrap().none;
                for group in Group::all() {
                    let [joined, own] = [&joined, &whole.sigma()].map(|of| group.rms(of, &whole));
                    let ratio = joined.unwrap() / own.unwrap();
                    assert!(
                        (ratio - 1.0).abs() < within,
                        "{scenario} {dwell} {group:?}: {ratio}"
                    );
                }
            }
        }
    }
}
