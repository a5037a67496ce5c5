//! The baseline of the comparison: the closed form on the static positions described in the paper, with the same
//! instrument and noise.

use crate::calibration::{
    Options, ParameterVector, Problem, in_body_frame, in_general_form, six_position_of, to_vector,
};
use crate::imu::InstallationForm;
use crate::models;
use crate::models::{ModelError, Place};
use crate::run::Dwell;
use crate::simulation::{Scenario, Simulated};
use crate::study::StudyError;
use crate::turntable::Table;

/// The runs of the closed form. The closed form is also evaluated on the first part of every dwell, as if the dwells
/// were short enough for the filter's table time.
#[derive(Debug, Clone)]
pub struct Baseline {
    /// The simulated scenario.
    pub scenario: Scenario,
    /// Length of the run, s.
    pub table_time: f64,
    /// Total time of the dwells in the run, s.
    standing: f64,
    /// Fraction of each dwell for which the table time equals that of the filter; one if the filter needs more than the
    /// whole run, `None` if it needs less than the moves between the positions.
    equal: Option<f64>,
}

impl Baseline {
    /// The baseline of a scenario: its instrument and table on the paper's positions; if the table has too
    /// few axes, a table with three axes and the same errors. The axes are orthogonal, because the
    /// positions are given as turns about body axes.
    pub(super) fn new(scenario: &Scenario) -> Result<Self, StudyError> {
        let filter_time = scenario.duration()?;
        let mut square = scenario.clone();
        square.table.errors.nonorthogonality = 0.0;
        square.table.errors.wobble = 0.0;
        square.table.errors.wobble_harmonics = 0.0;
        square.table.errors.encoder_harmonics = 0.0;
        let scenario = match square.clone().with_path(PATH) {
            Ok(on_its_table) => on_its_table,
            Err(_) => on_three_axes(&square)?,
        };
        let (table_time, standing) = (scenario.duration()?, scenario.standing_time()?);
        let part = (filter_time - (table_time - standing)) / standing;
        Ok(Self {
            scenario,
            table_time,
            standing,
            equal: (part > 0.0).then(|| part.min(1.0)),
        })
    }

    /// Table time of the closed form in the comparison at equal time, s.
    pub fn equal_time(&self) -> Option<f64> {
        let part = self.equal?;
        Some(self.table_time - (1.0 - part) * self.standing)
    }

    /// Errors of the closed form in one of its runs, in its own time and in the filter's; `None` if it fails.
    pub(super) fn errors(
        &self,
        Simulated { run, truth, .. }: Simulated,
        form: InstallationForm,
    ) -> [Option<ParameterVector>; 2] {
        let truth = to_vector(&in_general_form(&truth));
        let problem = Problem::new(&run, &Options::default().installation(form));
        let dwells: Vec<Dwell> = problem.dwells().cloned().collect();
        [Some(1.0), self.equal].map(|part| {
            let part = part?;
            let shorter = |dwell: &Dwell| dwell.first_part(part, &run.recording.imu);
            let dwells: Vec<Dwell> = dwells.iter().map(shorter).collect();
            let closed_form = six_position_of(&problem, &dwells).ok()?;
            let estimate = in_general_form(&closed_form.estimate.triads);
            Some(to_vector(&in_body_frame(&estimate, self.scenario.body_frame)) - truth)
        })
    }
}

/// The paper's static positions.
const PATH: &str = "six-position";

fn on_three_axes(scenario: &Scenario) -> Result<Scenario, ModelError> {
    let (table, table_name) = models::turntable("three-axis", &Place::CommandLine)?;
    let with_table = Scenario {
        table: Table {
            errors: scenario.table.errors,
            ..table
        },
        table_name,
        ..scenario.clone()
    };
    with_table.with_path(PATH)
}
