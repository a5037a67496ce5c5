//! The one error of this room: where, what was found, what was expected, what to do.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::shown::{self, LONGEST, excerpt};

/// Why a file could not be read or written, in one sentence or a few.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}{place}: {message}", shown::path(file))]
pub struct FileError {
    /// The file at fault.
    pub file: PathBuf,
    /// Where in the file.
    pub place: Place,
    /// What was found, what was expected, what to do.
    pub message: String,
}

/// A place in a file; lines and columns count from one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line.
    Line(u64),
    /// A line and a character of it.
    Character {
        /// Line.
        line: u64,
        /// Character in the line.
        column: u64,
    },
    /// A line and a named column of a CSV file.
    Column {
        /// Line.
        line: u64,
        /// Name in the header.
        column: String,
    },
    /// A byte of a binary file; the first is 0.
    Byte(u64),
    /// A sample of a stream of such a file.
    Sample {
        /// Its number, from one.
        number: u64,
        /// The stream.
        stream: String,
        /// Where it is in the file.
        byte: u64,
        /// The column that is at fault, if one is.
        column: Option<String>,
    },
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(line) => write!(f, ", line {line}"),
            Self::Character { line, column } => write!(f, ", line {line}, column {column}"),
            Self::Column { line, column } => {
                write!(f, ", line {line}, column `{}`", excerpt(column))
            }
            Self::Byte(byte) => write!(f, ", byte {byte}"),
            Self::Sample {
                number,
                stream,
                byte,
                column,
            } => {
                write!(f, ", `{}`, sample {number}", excerpt(stream))?;
                if *byte > 0 {
                    write!(f, " at byte {byte}")?;
                }
                match column {
                    Some(column) => write!(f, ", column `{}`", excerpt(column)),
                    None => Ok(()),
                }
            }
        }
    }
}

impl FileError {
    /// An error at a place: `found …, expected …. What to do.` What was found is cut where it is long.
    pub(super) fn new(
        file: &Path,
        place: Place,
        found: impl fmt::Display,
        expected: impl fmt::Display,
        advice: impl fmt::Display,
    ) -> Self {
        Self {
            file: file.to_owned(),
            place,
            message: format!(
                "found {}, expected {expected}. {advice}",
                excerpt(&found.to_string())
            ),
        }
    }

    /// The same of the file as a whole.
    pub(super) fn of(
        file: &Path,
        found: impl fmt::Display,
        expected: impl fmt::Display,
        advice: impl fmt::Display,
    ) -> Self {
        Self::new(file, Place::File, found, expected, advice)
    }

    /// The system did not let a file be written.
    pub(super) fn unwritten(file: &Path, error: &std::io::Error) -> Self {
        let advice = "Free some disk space or choose another location.";
        Self::io(file, "write the file", error, advice)
    }

    /// The system refused to do something with a file.
    pub(super) fn io(file: &Path, doing: &str, error: &std::io::Error, advice: &str) -> Self {
        Self {
            file: file.to_owned(),
            place: Place::File,
            message: format!("cannot {doing}: {error}. {advice}"),
        }
    }
}

/// The candidate most like a misspelt name, if one is like it at all.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    candidates
        .into_iter()
        .map(|candidate| (likeness(name, candidate), candidate))
        .filter(|&(likeness, _)| likeness >= 0.5)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

/// How much like a name another is, from 0 to 1.
fn likeness(name: &str, other: &str) -> f64 {
    // This takes the product of both lengths, and those of names that are alike differ little.
    if name.len() > LONGEST || other.len() > 4 * name.len() {
        return 0.0;
    }
    strsim::normalized_damerau_levenshtein(&name.to_lowercase(), &other.to_lowercase())
}

/// `Did you mean … ?`, or else the advice given.
pub fn suggestion<'a>(
    name: &str,
    candidates: impl IntoIterator<Item = &'a str>,
    otherwise: &str,
) -> String {
    nearest(name, candidates).map_or_else(
        || otherwise.to_owned(),
        |candidate| format!("Did you mean `{candidate}`?"),
    )
}

/// So many characters of names that could be meant are shown.
const ROOM: usize = 2 * LONGEST;

/// All names that could be meant, where there is room for them; else those most like the one that is wanted first,
/// and how many others there are.
pub fn choice<'a>(wanted: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.into_iter().collect();
    let all = list(names.iter().copied());
    if all.chars().count() <= ROOM {
        return all;
    }
    let alike = names.iter().map(|name| (likeness(wanted, name), *name));
    let mut alike: Vec<(f64, &str)> = alike.collect();
    alike.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut room = ROOM;
    let has_room = |(_, name): &&(f64, &str)| {
        let length = list([*name]).chars().count() + ", ".len();
        let has_room = length <= room;
        room = room.saturating_sub(length);
        has_room
    };
    let shown: Vec<&str> = alike.iter().take_while(has_room).map(|of| of.1).collect();
    let others = names.len() - shown.len();
    format!("{} and {others} more", list(shown))
}

/// Names in backquotes, separated by commas.
pub fn list<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let quoted: Vec<String> = names
        .into_iter()
        .map(|name| format!("`{}`", excerpt(name)))
        .collect();
    quoted.join(", ")
}
