//! Paths designed for a table or for a sensor turned by hand.
//!
//! Turns are added one by one, each with the best gain per second, then exchanged (Fedorov 1972, *Theory of Optimal
//! Experiments*). The bound of each path is that of its recording: the legs of the chain of dwells are made once and
//! joined, so that a path takes a millisecond.

mod choice;
mod expected;
mod goal;
mod legs;
mod machine;
mod search;
mod shipped;
mod text;
mod turn;

#[cfg(test)]
mod tests;

use super::path::{Evaluation, PathError, PathStudy};
use crate::calibration::Estimate;
use crate::lot::Specification;
pub use expected::{ByTerms, Sigma};
use expected::{along, expected};
use goal::Goals;
use legs::Legs;
use machine::Machine;
use search::SHORTEST_DWELL;
pub use shipped::Shipped;

/// Time of a path without a specification, s.
const USUAL_TIME: f64 = 600.0;
/// Longest time for a specification, s.
const LONGEST: f64 = 3600.0;
/// Shortest time that allows a few turns, s.
pub const SHORTEST: f64 = 60.0;
/// Usual duration of a turn, s.
const TURN: f64 = 8.0;

/// A path to design.
#[derive(Debug, Clone)]
pub struct DesignStudy {
    /// The setting; its path has no effect.
    pub setting: PathStudy,
    /// The limits that the path must decide; `None` to make every group better than on the paths for comparison.
    pub specification: Option<Specification>,
    /// The longest time, s; `None` for the usual one.
    pub time: Option<f64>,
}

/// A designed path with its expected results.
#[derive(Debug, Clone)]
pub struct Design {
    /// The path in its setting.
    pub study: PathStudy,
    /// Expected results.
    pub evaluation: Evaluation,
    /// Expected σ as those of the other paths.
    pub expected: ByTerms<Estimate>,
    /// Other paths in the same time.
    pub shipped: Vec<Shipped>,
    /// The path file.
    pub text: String,
}

impl DesignStudy {
    /// Designs the path.
    ///
    /// # Errors
    /// [`PathError`] if the setting does not allow a calibration.
    pub fn design(&self) -> Result<Design, PathError> {
        // The verdict on a limit is about the stated terms.
        let mut setting = self.setting.clone();
        setting.options.auto_terms &= self.specification.is_none();
        let setting = &setting;
        let table = setting.scenario.table.clone();
        let machine = if setting.by_hand {
            Machine::Hand
        } else {
            Machine::Table(&table)
        };
        machine.check().map_err(PathError::Words)?;
        let is_limited = self.specification.is_some();
        let usual = if is_limited { LONGEST } else { USUAL_TIME };
        let time = self.time.unwrap_or(usual);
        let tour = machine.tour();
        let dwell = (time / (tour.len() + 1) as f64 - TURN).max(SHORTEST_DWELL);
        let tour = along(setting, machine.path(&machine.start(), &tour, dwell))?;
        let mut legs = Legs::new(machine, &tour)?;
        let goals = self.goals(setting, &tour, time)?;
        let best = self.best(&mut legs, &goals, time)?;
        let dwell = (best.dwell * 100.0).floor() / 100.0;
        let path = machine.path(&machine.start(), &best.turns, dwell);
        let study = along(setting, path)?;
        let duration = study.scenario.duration()?;
        Ok(Design {
            text: text::text(&machine, &best.turns, dwell, &self.comment(duration)),
            evaluation: study.evaluate()?,
            expected: expected(&study)?,
            shipped: Shipped::all(setting, duration)?,
            study,
        })
    }

    /// The σ that decide every limit; without limits, the best of each group on the embedded paths.
    fn goals(&self, setting: &PathStudy, tour: &PathStudy, time: f64) -> Result<Goals, PathError> {
        if let Some(specification) = &self.specification {
            return Ok(Goals::of_limits(specification, &expected(tour)?.none));
        }
        let shipped = Shipped::all(setting, time)?.into_iter();
        let mut paths: Vec<ByTerms<Estimate>> = shipped.filter_map(|of| of.expected).collect();
        if paths.is_empty() {
            paths.push(expected(tour)?);
        }
        Ok(Goals::of_best(&paths))
    }

    /// First sentence of the path file.
    fn comment(&self, duration: f64) -> String {
        let scenario = &self.setting.scenario;
        let machine = if self.setting.by_hand {
            "a sensor turned by hand".to_owned()
        } else {
            format!("the table {}", scenario.table_name)
        };
        let terms = self.setting.options.terms.iter();
        let terms: Vec<&str> = terms.map(|term| term.name()).collect();
        let with = if terms.is_empty() {
            ""
        } else {
            " and the error terms "
        };
        format!(
            "Designed for the instrument {}{with}{} on {machine}; {duration:.1} s.",
            scenario.instrument.name,
            terms.join(", ")
        )
    }
}
