//! Why a calibration cannot be had.

use thiserror::Error;

use crate::imu::Sensor;

/// Why a calibration cannot be had from a run. Each message says what was found, what was expected
/// and what to do.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CalibrationError {
    /// Table aiding without a table.
    #[error(
        "the run has no [turntable]: calibration with table aiding needs the table's log; \
         name it in run.toml"
    )]
    NoTable,
    /// Not enough standing positions.
    #[error(
        "{found} dwells found in the table's log, at least {needed} expected: the table must stand \
         for a second or more between turns; check the log, and reading_sigma_arcsec if it is \
         noisier than stated"
    )]
    TooFewDwells {
        /// Dwells found.
        found: usize,
        /// Dwells needed.
        needed: usize,
    },
    /// Sections laid end to end.
    #[error(
        "the record is not continuous (continuous = false), but the filter navigates from its \
         beginning to its end; use --method six-position, or give one unbroken record"
    )]
    NotContinuous,
    /// A prior of σ zero or an estimate that went astray.
    #[error(
        "the sensitivity matrix K·C of the {} became singular: the data and [imu.prior.{0}] \
         do not fit each other; check scale and units there", .sensor.name()
    )]
    Singular {
        /// Which triad.
        sensor: Sensor,
    },
    /// Dwells that do not span what is to be found.
    #[error(
        "the {} dwells used for the {} do not determine its three scale factors, installation and \
         biases: positions with every body axis up and down (accelerometers) or along Earth rate \
         (gyros) are needed", .dwells, .sensor.name()
    )]
    Degenerate {
        /// Which triad.
        sensor: Sensor,
        /// Dwells used.
        dwells: usize,
    },
    /// Rounding or absurd noise figures.
    #[error(
        "the filter's covariance lost its positive definiteness at {time:.2} s: check the noise \
         figures and σ in run.toml"
    )]
    NotPositive {
        /// Time in the record, s.
        time: f64,
    },
}
