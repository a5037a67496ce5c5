//! Source of a model, which is a file of the user or embedded text.

use std::path::{Path, PathBuf};

use include_dir::Dir;
use serde::de::DeserializeOwned;

use turncal_input::small_file;
use turncal_input::{Document, FileError, Place as At};

/// A folder of models.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Room {
    /// Instruments: noise, pulses, and tolerances before calibration.
    Imu,
    /// Misalignment forms and sizes of their angles.
    Installation,
    /// Turntables.
    Turntable,
    /// Paths of turntables.
    Path,
    /// Whole simulated runs.
    Scenario,
    /// Simulated recordings of one instrument.
    Campaign,
    /// Trajectories to navigate along.
    Trajectory,
    /// Limits of a unit's parameters.
    Specification,
}

impl Room {
    /// All folders, the most frequently used first.
    pub const ALL: [Self; 8] = [
        Self::Scenario,
        Self::Campaign,
        Self::Path,
        Self::Turntable,
        Self::Imu,
        Self::Installation,
        Self::Trajectory,
        Self::Specification,
    ];

    /// The folder's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Imu => "imu",
            Self::Installation => "installation",
            Self::Turntable => "turntable",
            Self::Path => "path",
            Self::Scenario => "scenario",
            Self::Campaign => "campaign",
            Self::Trajectory => "trajectory",
            Self::Specification => "specification",
        }
    }

    /// Name and text of each model of the folder, in the order of their names.
    pub(super) fn embedded(self) -> impl Iterator<Item = (&'static str, &'static str)> {
        let folder = MODELS.get_dir(self.name());
        let files = folder.into_iter().flat_map(Dir::files);
        files.filter_map(|file| Some((file.path().file_stem()?.to_str()?, file.contents_utf8()?)))
    }
}

static MODELS: Dir = include_dir::include_dir!("$CARGO_MANIFEST_DIR/models");

/// Error in finding or reading a model.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The name is neither a file nor an embedded name.
    #[error(
        "{named_in}no {room} model \"{name}\"{}: it is neither a file nor one of the models {known}",
        nearest.map_or_else(String::new, |nearest| format!(" (did you mean \"{nearest}\"?)"))
    )]
    Unknown {
        /// The file that refers to the model, with a colon; empty for the command line.
        named_in: String,
        /// The folder.
        room: &'static str,
        /// Requested name.
        name: String,
        /// The most similar embedded name, if any.
        nearest: Option<&'static str>,
        /// All embedded names.
        known: String,
    },
    /// The file cannot be read or is invalid.
    #[error(transparent)]
    File(#[from] FileError),
}

/// The embedded names of a folder, in order.
pub fn names(room: Room) -> impl Iterator<Item = &'static str> {
    room.embedded().map(|(name, _)| name)
}

/// Location from which a model is referred to, which determines how the name is resolved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// The command line: the name is a path relative to the working directory, or an embedded name.
    CommandLine,
    /// This file: the name is a path relative to the folder of the file, or an embedded name.
    File(PathBuf),
    /// An embedded model: the name is an embedded name.
    Embedded,
}

/// The text of a model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Text {
    /// The file's content.
    pub text: String,
    /// File name used in messages.
    pub file: String,
    /// Location of this model, from which its references to other models are resolved.
    pub place: Place,
}

impl Text {
    /// The file name without folder and extension.
    pub fn name(&self) -> String {
        Path::new(&self.file)
            .file_stem()
            .map_or_else(|| self.file.clone(), |stem| stem.to_string_lossy().into())
    }

    /// The fields of the model.
    ///
    /// # Errors
    /// Returns an error if a field is missing, unknown or cannot be right.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, ModelError> {
        let document = self.document();
        Ok(document.fill(document.parse()?)?)
    }

    /// The text with its file name, for errors with a line number.
    pub fn document(&self) -> Document<'_> {
        Document {
            file: Path::new(&self.file),
            text: &self.text,
        }
    }

    /// Error for inconsistent values, with problem and remedy.
    pub fn inconsistent(&self, message: impl Into<String>) -> ModelError {
        inconsistent(&self.file, message)
    }
}

/// Error for inconsistent values in a named file, with problem and remedy.
pub fn inconsistent(file: &str, message: impl Into<String>) -> ModelError {
    let error = FileError {
        file: file.into(),
        place: At::File,
        message: message.into(),
    };
    error.into()
}

/// Finds a model: the file at `name_or_path` if it exists, otherwise the embedded model with that name.
///
/// # Errors
/// Returns an error if there is no file or embedded model of this name, or the file cannot be read.
pub fn text(room: Room, name_or_path: &str, named_in: &Place) -> Result<Text, ModelError> {
    let path = match named_in {
        Place::CommandLine => Some(PathBuf::from(name_or_path)),
        Place::File(file) => Some(file.with_file_name(name_or_path)),
        Place::Embedded => None,
    };
    if let Some(path) = path.filter(|path| path.is_file()) {
        let file = path.display().to_string();
        let text = small_file::read_text(&path);
        let text = text.map_err(|error| inconsistent(&file, format!("cannot be read: {error}")))?;
        return Ok(Text {
            text,
            file,
            place: Place::File(path),
        });
    }
    if let Some((name, text)) = room.embedded().find(|(name, _)| *name == name_or_path) {
        return Ok(Text {
            text: text.into(),
            file: name.into(),
            place: Place::Embedded,
        });
    }
    let lower = name_or_path.to_lowercase();
    let nearest = names(room)
        .map(|name| (strsim::jaro_winkler(name, &lower), name))
        .filter(|&(likeness, _)| likeness > 0.7)
        .max_by(|a, b| a.0.total_cmp(&b.0));
    Err(ModelError::Unknown {
        named_in: match named_in {
            Place::File(file) => format!("{}: ", file.display()),
            Place::CommandLine | Place::Embedded => String::new(),
        },
        room: room.name(),
        name: name_or_path.into(),
        nearest: nearest.map(|(_, name)| name),
        known: names(room).collect::<Vec<_>>().join(", "),
    })
}
