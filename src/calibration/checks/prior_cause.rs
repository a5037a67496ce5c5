//! What most likely brought parameters away from their prior.

use std::fmt;

use serde::Serialize;

/// What most likely brought parameters away from their prior.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "cause", rename_all = "kebab-case")]
pub enum PriorCause {
    /// Scale factors below zero.
    Reversed {
        /// `gyro` or `accel`.
        sensor: &'static str,
        /// `x`, `y`, `z`.
        axes: Vec<char>,
    },
    /// Scale factors off alike on all axes of a triad.
    Unit {
        /// `gyro` or `accel`.
        sensor: &'static str,
        /// Their mean from nominal.
        off_ppm: f64,
    },
    /// Scale factors of some axes.
    Scale {
        /// `gyro` or `accel`.
        sensor: &'static str,
    },
    /// Both triads turned alike.
    Mount {
        /// Angle.
        angle_deg: f64,
    },
    /// A triad turned in itself.
    Turned {
        /// `gyro` or `accel`.
        sensor: &'static str,
        /// Angle.
        angle_deg: f64,
    },
    /// Axes of a triad that are not at right angles.
    Skewed {
        /// `gyro` or `accel`.
        sensor: &'static str,
    },
    /// Biases.
    Bias {
        /// `gyro` or `accel`.
        sensor: &'static str,
    },
}

impl fmt::Display for PriorCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Reversed { sensor, axes } => {
                let axes: Vec<String> = axes.iter().map(char::to_string).collect();
                write!(
                    f,
                    "{sensor} {} reversed: give the column in columns of [imu] a minus",
                    axes.join(", ")
                )
            }
            Self::Unit { sensor, off_ppm } => {
                let other = match *sensor {
                    "gyro" => "sample period",
                    _ => "gravity",
                };
                write!(
                    f,
                    "all three {sensor} scale factors off alike, by {off_ppm:+.0} ppm: {sensor}_unit, scale or \
                     {other}"
                )
            }
            Self::Scale { sensor } => write!(
                f,
                "{sensor} scale or scale_sigma_ppm as stated does not fit the instrument"
            ),
            Self::Mount { angle_deg } => write!(
                f,
                "both triads turned alike, by {angle_deg:.3}°: the instrument's mount, the table's zero, level \
                 or north, or the labels"
            ),
            Self::Turned { sensor, angle_deg } => write!(
                f,
                "the {sensor} triad turned by {angle_deg:.3}°: its mount in the instrument, or a time offset \
                 if it is the gyros"
            ),
            Self::Skewed { sensor } => write!(
                f,
                "{sensor} axes not at right angles: positions or labels that are not as stated, or an \
                 installation_sigma_arcsec too small"
            ),
            Self::Bias { sensor } => write!(
                f,
                "{sensor} bias or bias_sigma as stated does not fit the instrument; an offset of the register \
                 belongs in bias"
            ),
        }
    }
}
