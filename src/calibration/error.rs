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
    /// Table aiding without a table.
    #[error(
        "the run has no [turntable]: attitudes of a table need its log; name it in run.toml, or leave \
         --aiding table out"
    )]
    NoTable,
    /// A log with only one triad.
    #[error(
        "the log has no columns of {0}, and a calibration needs both triads: name the columns in run.toml, or see the \
         noise of the triad that is there by `turncal allan`", .sensor.name()
    )]
    OneTriad {
        /// The missing triad.
        sensor: Sensor,
    },
    /// Not enough memory for a calibration.
    #[error(
        "{samples} samples were read, and there is no memory to calibrate them, about {megabytes} MB; give it \
         more, or split the record"
    )]
    NoMemory {
        /// Number of samples of all runs.
        samples: usize,
        /// Required memory, MB.
        megabytes: usize,
    },
    /// Temperature-dependent parameters with a recording that has no temperature.
    #[error(
        "recording {number}, {recording}, has no temperature that could be used, which parameters are to follow: \
         name the column in its run.toml (columns, `temperature`), or temperature_degc in [meta] or beside the \
         recording in the campaign; or calibrate it apart"
    )]
    NoTemperature {
        /// Its name.
        recording: String,
        /// Its number, from one.
        number: usize,
    },
    /// No dwell.
    #[error(
        "no still interval (dwell) was found. Hold the sensor still for at least {LONG_ENOUGH} s between turns, at \
         best with each axis up and each axis down. Check the table's log, and reading_sigma_arcsec if it is noisier \
         than stated; without a log, the gyros' prior bias and noise figures"
    )]
    NoDwells,
    /// A prior with σ of zero, or a diverged estimate.
    #[error(
        "the {} data contradict [imu.prior.{0}] (the fit diverged: K·C became singular). Check scale and units there, \
         and whether an axis is dead, stuck or wrapped, rows are lost or the table's log is of another run",
        .sensor.name()
    )]
    Singular {
        /// Which triad.
        sensor: Sensor,
    },
    /// No usable labelled section.
    #[error(
        "of the sections {} none tells how the instrument stands or turns, or a part of each is lost; \
         name positions and turns such as `x_up`, `x_down`, `rot_x+360`, or leave [segments] out and let \
         every dwell and turn count", quoted(.labels)
    )]
    NoSections {
        /// Labels of the sections.
        labels: Vec<String>,
    },
    /// Every labelled section contradicts its label.
    #[error(
        "no labelled section does what its label says, expected at least one: {}; correct [segments], or \
         leave it out and let every dwell and turn count", .contradicted.iter().map(LabelCheck::to_string).collect::<Vec<_>>().join("; ")
    )]
    LabelsContradicted {
        /// The contradicted sections.
        contradicted: Vec<LabelCheck>,
    },
    /// Stopped by the progress callback.
    #[error("stopped before the iterations ended; nothing was written")]
    Stopped,
    /// A statement of run.toml that the record contradicts.
    #[error("{}{contradiction}", .recording.iter().map(|name| format!("{name}: ")).collect::<String>())]
    Contradicted {
        /// The run, if there are several.
        recording: Option<String>,
        /// The contradicted statement.
        contradiction: Box<Contradiction>,
    },
    /// Samples that no error within the prior explains, or unrealistic noise figures.
    #[error(
        "the filter diverged at {time:.2} s: samples and run.toml do not fit each other; check latitude, \
         units, noise figures (zero only without noise), the prior's σ, and the samples there"
    )]
    Diverged {
        /// Time in the record, s.
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
    /// Only one calibration.
    #[error("a single calibration and no truth; give a second calibration, or a truth")]
    Single,
    /// Outputs of different quantities.
    #[error(
        "{other} has the {} unit `{found}`, {name} has `{expected}`: their numbers cannot be \
         compared; give calibrations of outputs in the same unit", .sensor.name()
    )]
    Unit {
        /// Which triad.
        sensor: Sensor,
        /// The first record that states a unit.
        name: String,
        /// Its unit.
        expected: String,
        /// The record that states another one.
        other: String,
        /// The other unit.
        found: String,
    },
    /// An axis that is not near the body axis of its name.
    #[error(
        "{name}: the {} {axis} axis is a right angle or more away from body {axis} (by the sign of \
         the reference's scale factor), or the matrix K·C is singular; bring the calibrations to \
         the same body axes and signs first", .sensor.name()
    )]
    Turned {
        /// The record.
        name: String,
        /// Which triad.
        sensor: Sensor,
        /// Which axis.
        axis: char,
    },
    /// `parameters` and `covariance` that do not fit.
    #[error(
        "{name}: covariance needs one row and one column for each name in parameters, and each must \
         be a parameter of the record's installation form; write the calibration again"
    )]
    Covariance {
        /// The record.
        name: String,
    },
}
