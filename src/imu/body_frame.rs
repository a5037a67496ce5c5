//! What fixes the body axes.

use serde::{Deserialize, Serialize};

/// What fixes the body axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BodyFrame {
    /// The mounting face, of the table or of labelled positions.
    #[default]
    Table,
    /// Accelerometer x along body x, accelerometer y in the xy plane.
    Accelerometer,
}

impl BodyFrame {
    /// In a few words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Table => "mounting face",
            Self::Accelerometer => {
                "x along accelerometer x, y in the plane of accelerometers x and y"
            }
        }
    }
}
