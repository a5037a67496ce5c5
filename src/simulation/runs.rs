//! Many runs of a scenario; the motion of the table is computed once.

use super::drive::Drive;
use super::{Scenario, Simulated};
use crate::calibration::Difference;
use crate::imu::TermVector;
use crate::turntable::{Imperfection, TableError};

/// Many runs of a scenario. With a perfect table, all runs share one drive, which is computed once.
#[derive(Debug, Clone)]
pub struct Runs {
    scenario: Scenario,
    perfect: Drive,
}

impl Runs {
    /// The runs of a scenario.
    ///
    /// # Errors
    /// Returns an error if the table cannot follow the path.
    pub fn new(scenario: &Scenario) -> Result<Self, TableError> {
        let none = Imperfection::none(&scenario.table);
        Ok(Self {
            scenario: scenario.clone(),
            perfect: Drive::new(scenario, none, TermVector::zeros())?,
        })
    }

    /// Simulates one run, as [`Scenario::simulate`] does.
    ///
    /// # Errors
    /// Returns an error if the table cannot follow the path.
    pub fn simulate(&self, seed: u64, stream: u64) -> Result<Simulated, TableError> {
        let own = Difference::default();
        let shared = Some(&self.perfect);
        self.scenario
            .simulate_on(shared, seed, stream, stream, &own)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_on_a_shared_drive_is_the_run_alone_on_perfect_tables_and_others() {
        for name in ["demo", "real-table"] {
            let scenario = Scenario::load(name).unwrap();
            let runs = Runs::new(&scenario).unwrap();
            let alone = scenario.simulate(3, 5).unwrap();
            assert!(runs.simulate(3, 5).unwrap() == alone, "{name}");
        }
    }
}
