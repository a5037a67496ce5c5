//! Messages about statements in `run.toml` that the recording contradicts.

use std::fmt;

use super::sensitivity::Sensitivity;
use super::statement::Mounting;

/// A statement in `run.toml` that the recording contradicts.
#[derive(Debug, Clone, PartialEq)]
pub enum Contradiction {
    /// Axes are swapped, reversed or left-handed.
    Axes(Mounting),
    /// A triad has a sensitivity different from the stated one.
    Sensitivity(Sensitivity),
    /// Table quaternions are in a different order or inverted; contains a description in words.
    Quaternions(String),
    /// No hypothesis explains the motion.
    Unexplained,
    /// The gyro and accelerometer columns are swapped.
    Exchanged,
}

impl fmt::Display for Contradiction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Axes(mounting) => mounting.fmt(f),
            Self::Sensitivity(sensitivity) => sensitivity.fmt(f),
            Self::Quaternions(said) => f.write_str(said),
            Self::Unexplained => f.write_str(
                "the gyros, the accelerometers and the motion stated in run.toml contradict each other, and no \
                 different axis order or sensitivity removes the contradiction. Compare with the turns that turncal \
                 check shows: the logs may be from different runs or clocks, rows may be lost, labels may be wrong, \
                 or an axis may be dead",
            ),
            Self::Exchanged => f.write_str(
                "the gyro and accelerometer columns are swapped: gravity appears in the columns that run.toml names \
                 for the gyros. Swap gyro and accel in columns of [imu], and swap their units and [imu.prior]",
            ),
        }
    }
}
