//! The definition of the body axes.

use serde::{Deserialize, Serialize};

/// The definition of the body axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BodyFrame {
    /// Axes of the mounting face, given by the table or by labelled positions.
    #[default]
    Table,
    /// Accelerometer x along body x, accelerometer y in the xy plane.
    Accelerometer,
}

impl BodyFrame {
    /// The frame to which all given calibrations can be converted: the accelerometer frame if any calibration is in
    /// this frame.
    pub fn common(mut all: impl Iterator<Item = Self>) -> Self {
        if all.any(|frame| frame == Self::Accelerometer) {
            Self::Accelerometer
        } else {
            Self::Table
        }
    }

    /// A short description.
    pub fn words(self) -> &'static str {
        match self {
            Self::Table => "mounting face",
            Self::Accelerometer => {
                "x along accelerometer x, y in the plane of accelerometers x and y"
            }
        }
    }
}
