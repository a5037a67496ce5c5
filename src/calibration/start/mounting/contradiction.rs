//! What `run.toml` states and the record contradicts, in words.

use std::fmt;

use super::sensitivity::Sensitivity;
use super::statement::Mounting;

/// What `run.toml` states and the record contradicts.
#[derive(Debug, Clone, PartialEq)]
pub enum Contradiction {
    /// Axes that are swapped, reversed or left-handed.
    Axes(Mounting),
    /// A triad that is this many times as sensitive as stated.
    Sensitivity(Sensitivity),
    /// Quaternions of the table in another order, or of the inverse, in words.
    Quaternions(String),
    /// Motion that nothing explains that is tried.
    Unexplained,
    /// Columns of gyros named for accelerometers, and the other way round.
    Exchanged,
}

impl fmt::Display for Contradiction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Axes(mounting) => mounting.fmt(f),
            Self::Sensitivity(sensitivity) => sensitivity.fmt(f),
            Self::Quaternions(said) => f.write_str(said),
            Self::Unexplained => f.write_str(
                "the gyros, the accelerometers and the motion stated in run.toml contradict each other, and no other \
                 axis order or sensitivity resolves this. Look at the turns in turncal check for logs of different \
                 runs or clocks, lost rows, wrong labels or a dead axis",
            ),
            Self::Exchanged => f.write_str(
                "the gyro and accelerometer columns are swapped: gravity appears in the columns that run.toml names \
                 for the gyros. Swap gyro and accel in columns of [imu], with their units and [imu.prior]",
            ),
        }
    }
}
