//! What a user may edit: instruments, installations, tables, paths and scenarios as TOML files.
//!
//! The files of the `models/` folder are embedded. A path to an existing file wins over an embedded
//! name.

mod instrument;
mod machine;
mod values;

use std::path::Path;

use serde::de::DeserializeOwned;

pub use instrument::{InstallationModel, Instrument, Spread, Variation};
pub use machine::{path, turntable};
pub(crate) use values::{Finite, NonNegative, OneOrThree, Positive};

use crate::turntable::TableError;

/// A folder of models.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Room {
    /// Instruments: noise, pulses, and how they differ before calibration.
    Imu,
    /// Installation forms and how large their angles are.
    Installation,
    /// Turntables.
    Turntable,
    /// Paths of turntables.
    Path,
    /// Whole simulated runs.
    Scenario,
}

impl Room {
    /// The folder's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Imu => "imu",
            Self::Installation => "installation",
            Self::Turntable => "turntable",
            Self::Path => "path",
            Self::Scenario => "scenario",
        }
    }

    fn embedded(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Self::Imu => IMU,
            Self::Installation => INSTALLATION,
            Self::Turntable => TURNTABLE,
            Self::Path => PATH,
            Self::Scenario => SCENARIO,
        }
    }
}

macro_rules! embed {
    ($list:ident, $room:literal, $($name:literal),+ $(,)?) => {
        const $list: &[(&str, &str)] = &[
            $(($name, include_str!(concat!("../models/", $room, "/", $name, ".toml")))),+
        ];
    };
}

embed!(
    IMU,
    "imu",
    "industrial-mems",
    "navigation-fog",
    "paper",
    "ring-laser",
    "tactical-fog",
);
embed!(
    INSTALLATION,
    "installation",
    "general",
    "six-angle",
    "three-angle",
);
embed!(
    TURNTABLE,
    "turntable",
    "three-axis",
    "three-axis-with-errors",
    "two-axis",
);
embed!(
    PATH,
    "path",
    "nineteen-position",
    "six-position",
    "three-axis",
    "two-axis",
);
embed!(
    SCENARIO,
    "scenario",
    "demo",
    "demo-six-position",
    "mems",
    "nineteen-position",
    "two-axis",
);

/// Why a model cannot be had.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// Neither a file nor an embedded name.
    #[error(
        "no {room} model \"{name}\"{}: it is neither a file nor one of {known}",
        nearest.map_or_else(String::new, |nearest| format!(" (did you mean \"{nearest}\"?)"))
    )]
    Unknown {
        /// Which folder.
        room: &'static str,
        /// What was asked for.
        name: String,
        /// The nearest embedded name, if one is near.
        nearest: Option<&'static str>,
        /// All embedded names.
        known: String,
    },
    /// A file that cannot be read.
    #[error("{file}: cannot be read: {source}")]
    Unreadable {
        /// The file.
        file: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// A file that is not what it should be; the parser's message names line, column and field.
    #[error("{file}: {source}")]
    Malformed {
        /// The file.
        file: String,
        /// Where and why.
        source: Box<toml::de::Error>,
    },
    /// Values that do not fit together.
    #[error("{file}: {message}")]
    Inconsistent {
        /// The file.
        file: String,
        /// What is wrong and what to do.
        message: String,
    },
    /// A path that the table cannot be driven along.
    #[error("{file}: {source}")]
    Path {
        /// The file of the path or of the scenario that names it.
        file: String,
        /// Why not.
        source: TableError,
    },
}

/// The embedded names of a folder, in order.
pub fn names(room: Room) -> impl Iterator<Item = &'static str> {
    room.embedded().iter().map(|&(name, _)| name)
}

/// The text of a model and the name to show for it: the file at `name_or_path` if there is one, else
/// the embedded model of that name.
///
/// # Errors
/// If there is neither, or the file cannot be read.
pub fn text(room: Room, name_or_path: &str) -> Result<(String, String), ModelError> {
    if Path::new(name_or_path).is_file() {
        let text =
            std::fs::read_to_string(name_or_path).map_err(|source| ModelError::Unreadable {
                file: name_or_path.into(),
                source,
            })?;
        return Ok((text, name_or_path.into()));
    }
    if let Some(&(name, text)) = room
        .embedded()
        .iter()
        .find(|(name, _)| *name == name_or_path)
    {
        return Ok((text.into(), name.into()));
    }
    let nearest = names(room)
        .map(|name| (strsim::jaro_winkler(name, name_or_path), name))
        .filter(|&(likeness, _)| likeness > 0.7)
        .max_by(|a, b| a.0.total_cmp(&b.0));
    Err(ModelError::Unknown {
        room: room.name(),
        name: name_or_path.into(),
        nearest: nearest.map(|(_, name)| name),
        known: names(room).collect::<Vec<_>>().join(", "),
    })
}

/// Reads a model as `T`; returns the name to show beside it.
pub(crate) fn read<T: DeserializeOwned>(
    room: Room,
    name_or_path: &str,
) -> Result<(T, String), ModelError> {
    let (text, file) = text(room, name_or_path)?;
    match toml::from_str(&text) {
        Ok(model) => Ok((model, file)),
        Err(source) => Err(ModelError::Malformed {
            file,
            source: Box::new(source),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_name_lists_what_exists_and_the_nearest() {
        let message = text(Room::Imu, "navigaton-fog").unwrap_err().to_string();
        assert!(
            message.contains("did you mean \"navigation-fog\""),
            "{message}"
        );
        assert!(message.contains("ring-laser"), "{message}");
    }

    #[test]
    fn a_file_wins_over_an_embedded_name() {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        std::io::Write::write_all(
            &mut file,
            b"form = \"six-angle\"\nangles_deg = { sigma = 1 }",
        )
        .unwrap();
        let path = file.path().to_str().unwrap();
        let model = InstallationModel::load(path).unwrap();
        assert_eq!(model.form, crate::imu::InstallationForm::SixAngle);
    }
}
