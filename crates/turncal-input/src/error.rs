//! Error type of this module: location, content found, content expected, remedy.

use std::fmt;
use std::path::{Path, PathBuf};

/// Most characters of an input that a message shows.
const LONGEST: usize = 200;
/// Longest file name of any file system.
const LONGEST_NAME: usize = 255;

/// An input, shortened to fit into a message.
pub fn excerpt(text: &str) -> String {
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{} …", &text[..end]),
        None => text.to_owned(),
    }
}

/// A path as given, except that names too long for a file are cut.
fn shown(path: &Path) -> String {
    let names = || {
        path.components()
            .map(|name| name.as_os_str().to_string_lossy())
    };
    if names().all(|name| name.chars().count() <= LONGEST_NAME) {
        return path.display().to_string();
    }
    let names: PathBuf = names().map(|name| excerpt(&name)).collect();
    names.display().to_string()
}

/// Error in reading or writing a file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}{place}: {message}", shown(file))]
pub struct FileError {
    /// The file at fault.
    pub file: PathBuf,
    /// Location of the error in the file.
    pub place: Place,
    /// Content found, content expected, remedy.
    pub message: String,
}

/// A place in a file; lines and columns count from one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// The whole file.
    File,
    /// A line.
    Line(u64),
    /// A line and a character of this line.
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
    /// A row and a column of a table in memory; rows count from zero.
    Row {
        /// Row.
        row: u64,
        /// Name of the column at fault, if any.
        column: Option<String>,
    },
    /// A byte of a binary file; the first is 0.
    Byte(u64),
    /// A sample of a stream in a binary file.
    Sample {
        /// Number of the sample, from one.
        number: u64,
        /// The stream.
        stream: String,
        /// Position of the sample in the file.
        byte: u64,
        /// The column at fault, if any.
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
            Self::Row { row, column } => {
                write!(f, ", row {row}")?;
                match column {
                    Some(column) => write!(f, ", column `{}`", excerpt(column)),
                    None => Ok(()),
                }
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
    /// An error at a place: `found …, expected …. Remedy.` Long content is shortened.
    pub fn new(
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

    /// An error that concerns the whole file.
    pub fn of(
        file: &Path,
        found: impl fmt::Display,
        expected: impl fmt::Display,
        advice: impl fmt::Display,
    ) -> Self {
        Self::new(file, Place::File, found, expected, advice)
    }

    /// An error for a quantity that a file does not contain: `… is unknown: reason. Remedy.`
    pub fn unknown(file: &Path, what: &str, why: &str, advice: &str) -> Self {
        Self {
            file: file.to_owned(),
            place: Place::File,
            message: format!("{what} is unknown: {why}. {advice}"),
        }
    }

    /// The system refused to write a file.
    pub fn unwritten(file: &Path, error: &std::io::Error) -> Self {
        let advice = "Free some disk space or choose another location.";
        Self::io(file, "write the file", error, advice)
    }

    /// The system refused an operation on a file.
    pub fn io(file: &Path, doing: &str, error: &std::io::Error, advice: &str) -> Self {
        Self {
            file: file.to_owned(),
            place: Place::File,
            message: format!("cannot {doing}: {error}. {advice}"),
        }
    }
}

/// A count with its noun, such as `1 row` or `3 rows`.
pub fn counted(count: usize, name: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {name}{plural}")
}

/// The candidate most similar to a misspelt name, if any.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    candidates
        .into_iter()
        .map(|candidate| (likeness(name, candidate), candidate))
        .filter(|&(likeness, _)| likeness >= 0.5)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

/// Similarity of two names, from 0 to 1.
fn likeness(name: &str, other: &str) -> f64 {
    // The time is proportional to the product of both lengths; similar names have similar lengths.
    if name.len() > LONGEST || other.len() > 4 * name.len() {
        return 0.0;
    }
    strsim::normalized_damerau_levenshtein(&name.to_lowercase(), &other.to_lowercase())
}

/// `Did you mean … ?`, otherwise the given advice.
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

/// Maximum number of characters of candidate names shown.
const ROOM: usize = 2 * LONGEST;

/// All candidate names if they fit into the message; otherwise the most similar names and the number of the others.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_shown_as_it_is_except_names_that_no_file_has() {
        for short in ["/a/b c/run.toml", "../run.toml", "./run.toml", "run.toml"] {
            assert_eq!(shown(Path::new(short)), short);
        }
        let long = format!("/a/{}/run.toml", "x".repeat(5_000));
        assert!(shown(Path::new(&long)).chars().count() < LONGEST + 20);
    }

    #[test]
    fn an_excerpt_ends_between_two_characters() {
        assert_eq!(excerpt("µg"), "µg");
        let long = excerpt(&"µ".repeat(1_000_000));
        assert_eq!(long.chars().filter(|&c| c == 'µ').count(), LONGEST);
    }
}
