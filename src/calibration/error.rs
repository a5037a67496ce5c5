//! Errors of calibrations and of comparisons.

use thiserror::Error;

use crate::calibration::Contradiction;
use crate::imu::Sensor;
use crate::run::LONG_ENOUGH;
use crate::run::motion::LabelCheck;

/// Errors of a calibration. Each message states the problem, the expectation
/// and the remedy.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CalibrationError {
    /// Table observations were requested, but there is no table.
    #[error(
        "the run has no [turntable], which --aiding table requires. Add the table log to run.toml, or omit --aiding \
         table"
    )]
    NoTable,
    /// The log contains only one triad.
    #[error(
        "the log has no {0} columns, and {1}. Name the columns in run.toml, or analyse the noise of the other triad with \
         `turncal allan`",
        .sensor.name(),
        .sensor.pick("with a table or a temperature, a calibration needs both triads", "every calibration needs gravity")
    )]
    OneTriad {
        /// The missing triad.
        sensor: Sensor,
    },
    /// Parameters depend on temperature, but a recording has no temperature.
    #[error(
        "recording {number}, {recording}, has no usable temperature, which the temperature model needs. Name the \
         column in its run.toml (columns, `temperature`), state temperature_degc in [meta] or for this recording in \
         the campaign, or calibrate it separately"
    )]
    NoTemperature {
        /// Name.
        recording: String,
        /// Number, from one.
        number: usize,
    },
    /// No dwell.
    #[error(
        "no still interval (dwell) was found. Hold the sensor still for at least {LONG_ENOUGH} s between turns, \
         preferably with each axis up and down. With a table, check its log and reading_sigma_arcsec; without one, \
         check the prior gyro bias and the noise figures"
    )]
    NoDwells,
    /// A prior σ is zero, or the estimate diverged.
    #[error(
        "the {} data contradict [imu.prior.{0}] (the fit diverged: K·C became singular). Check scale and units \
         there. Also check for dead, stuck or wrapped axes, lost rows, and a table log from a different run",
        .sensor.name()
    )]
    Singular {
        /// The triad.
        sensor: Sensor,
    },
    /// The run has no usable labelled section.
    #[error(
        "none of the sections {} has a label for a position or turn, or each is partly missing. Use labels such as \
         `x_up`, `x_down` and `rot_x+360`, or remove [segments] so that turncal uses every dwell and \
         turn", quoted(.labels)
    )]
    NoSections {
        /// Labels of the sections.
        labels: Vec<String>,
    },
    /// Every labelled section contradicts its label.
    #[error(
        "no labelled section matches its label: {}. Correct [segments], or remove [segments] so that turncal uses \
         every dwell and turn", .contradicted.iter().map(LabelCheck::to_string).collect::<Vec<_>>().join("; ")
    )]
    LabelsContradicted {
        /// The contradicted sections.
        contradicted: Vec<LabelCheck>,
    },
    /// The progress callback stopped the work.
    #[error("stopped before the iterations ended; nothing was written")]
    Stopped,
    /// The recording contradicts a statement in run.toml.
    #[error("{}{contradiction}", .recording.iter().map(|name| format!("{name}: ")).collect::<String>())]
    Contradicted {
        /// The run, if there are several.
        recording: Option<String>,
        /// The contradicted statement.
        contradiction: Box<Contradiction>,
    },
    /// No error within the prior can explain the samples, or the noise figures are unrealistic.
    #[error(
        "the filter diverged at {time:.2} s because the samples do not fit run.toml. Check latitude, units, noise \
         figures (zero only for noise-free data), the prior σ, and the samples at that time"
    )]
    Diverged {
        /// Time in the recording, s.
        time: f64,
    },
}

fn quoted(labels: &[String]) -> String {
    let quoted: Vec<String> = labels.iter().map(|label| format!("`{label}`")).collect();
    quoted.join(", ")
}

/// Errors of a comparison of calibrations.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ComparisonError {
    /// The outputs are different quantities.
    #[error(
        "{other} has the {} unit `{found}` and {name} has `{expected}`, so they cannot be compared. Give \
         calibrations in the same unit", .sensor.name()
    )]
    Unit {
        /// The triad.
        sensor: Sensor,
        /// Name of the first calibration that states a unit.
        name: String,
        /// Unit.
        expected: String,
        /// Name of the calibration that states a different unit.
        other: String,
        /// The other unit.
        found: String,
    },
    /// An axis is far from the body axis after which it is named.
    #[error(
        "{name}: the {} {axis} axis is 90° or more from body {axis} (by the sign of the scale factor in the \
         reference), or the matrix K·C is singular. Convert the calibrations to the same body axes and signs \
         first", .sensor.name()
    )]
    Turned {
        /// The record.
        name: String,
        /// The triad.
        sensor: Sensor,
        /// The axis.
        axis: char,
    },
    /// `parameters` and `covariance` do not match.
    #[error(
        "{name}: covariance needs one row and one column per entry of parameters, and each entry must be a parameter \
         of the misalignment form. Write the calibration again"
    )]
    Covariance {
        /// The record.
        name: String,
    },
}
