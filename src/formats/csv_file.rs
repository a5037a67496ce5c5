//! Rows of numbers below a line of names, plain or gzipped, read row by row without keeping their text.

mod lines;

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use csv::{ByteRecord, ErrorKind, Reader, ReaderBuilder};
use flate2::read::MultiGzDecoder;

use super::error::{FileError, Place, list, nearest};
use lines::Lines;

use crate::recording::FileColumn;

/// What the names of such files end in, each also with `.gz` behind it.
const ENDINGS: [&str; 5] = [".csv", ".txt", ".tsv", ".dat", ".log"];

/// A file of rows at one of them.
///
/// Commas, semicolons, tabs or blanks part the fields, as the first row shows. Lines that begin with `#`, `%`
/// or `//` are comments. A first row of numbers makes the columns' names `1`, `2`, …; a row of units below the
/// names is passed over. Numbers may have a decimal comma where commas do not part them.
pub(super) struct CsvFile {
    file: PathBuf,
    reader: Reader<Lines>,
    header: Vec<String>,
    units: Option<Vec<String>>,
    decimal_comma: bool,
    taken: Vec<usize>,
    row: ByteRecord,
    line: u64,
}

impl CsvFile {
    /// Opens a file and reads its header.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        let name = path.to_string_lossy().to_lowercase();
        let plain = name.strip_suffix(".gz");
        if !ENDINGS
            .iter()
            .any(|end| plain.unwrap_or(&name).ends_with(end))
        {
            return Err(FileError::new(
                path,
                Place::File,
                "a file of another kind",
                format_args!(
                    "a name that ends in {}, or in one of them and .gz",
                    ENDINGS.join(", ")
                ),
                "Rename or convert the file.",
            ));
        }
        let file = File::open(path).map_err(|error| {
            FileError::io(
                path,
                "open the file",
                &error,
                "Names in run.toml are relative to run.toml; correct the name or add the file.",
            )
        })?;
        let file = BufReader::with_capacity(1 << 16, file);
        let source: Box<dyn BufRead> = if plain.is_some() {
            Box::new(BufReader::with_capacity(1 << 16, MultiGzDecoder::new(file)))
        } else {
            Box::new(file)
        };
        let (lines, heading) = Lines::open(source).map_err(|error| damaged(path, &error))?;
        let heading = heading.ok_or_else(|| {
            FileError::new(
                path,
                Place::File,
                "an empty file",
                "a line of column names and rows below it",
                "Record or export the file again.",
            )
        })?;
        Ok(Self {
            file: path.to_owned(),
            reader: ReaderBuilder::new()
                .buffer_capacity(1 << 16)
                .has_headers(false)
                .flexible(true)
                .delimiter(heading.delimiter.byte())
                .from_reader(lines),
            decimal_comma: heading.delimiter.leaves_commas(),
            header: heading.names,
            units: heading.units,
            taken: Vec::new(),
            row: ByteRecord::new(),
            line: heading.line,
        })
    }

    /// The names of the columns.
    pub fn header(&self) -> &[String] {
        &self.header
    }

    /// The row of units below the names, if there is one.
    pub fn units(&self) -> Option<&[String]> {
        self.units.as_deref()
    }

    /// The index of a named column, which nothing else may be.
    pub fn column(&mut self, name: &str) -> Result<usize, FileError> {
        let mut places = (0..self.header.len()).filter(|&i| self.header[i] == name);
        let header = || self.header.iter().map(String::as_str);
        match (places.next(), places.next()) {
            (Some(index), None) if self.taken.contains(&index) => Err(self.error_here(
                format_args!("`{name}` named for two quantities"),
                "a column of its own for each",
                "Correct `columns` in run.toml.",
            )),
            (Some(index), None) => {
                self.taken.push(index);
                Ok(index)
            }
            (Some(_), Some(_)) => Err(self.error_here(
                format_args!("two columns named `{name}`"),
                "one",
                "Rename one of them.",
            )),
            (None, _) => Err(self.error_here(
                format_args!("the columns {}", list(header())),
                format_args!("a column named `{name}`"),
                match nearest(name, header()) {
                    Some(like) => format!(
                        "Did you mean `{like}`? Correct `columns` in run.toml or this header."
                    ),
                    None => "Correct `columns` in run.toml or this header.".to_owned(),
                },
            )),
        }
    }

    /// The same of a name that a minus may precede, which turns the sign of the column's values; a column
    /// that is called so with its minus is itself meant.
    pub fn signed_column(&mut self, name: &str) -> Result<(usize, FileColumn), FileError> {
        let literal = self.header.iter().any(|known| known == name);
        let bare = name.strip_prefix('-').filter(|_| !literal);
        let column = FileColumn {
            name: bare.unwrap_or(name).to_owned(),
            reversed: bare.is_some(),
        };
        Ok((self.column(&column.name)?, column))
    }

    /// Goes to the next row; false at the end of the file.
    pub fn advance(&mut self) -> Result<bool, FileError> {
        let more = self.reader.read_byte_record(&mut self.row);
        let more = more.map_err(|error| self.unreadable(&error))?;
        if !more {
            return Ok(false);
        }
        // The reader has taken the end of the row's line, too.
        let given = self.reader.position().line() - 1;
        self.line = self.reader.get_ref().number(given);
        let (found, expected) = (self.row.len(), self.header.len());
        let ends_in_delimiter = found == expected + 1 && self.bytes(expected).is_empty();
        if found != expected && !ends_in_delimiter {
            return Err(self.error_here(
                format_args!("{found} fields"),
                format_args!("{expected}, as in the header"),
                "Complete or remove the row.",
            ));
        }
        Ok(true)
    }

    /// Line of the row.
    pub fn line(&self) -> u64 {
        self.line
    }

    /// The finite number in a column of the row.
    pub fn number(&self, column: usize) -> Result<f64, FileError> {
        std::str::from_utf8(self.bytes(column))
            .ok()
            .and_then(|text| match text.parse() {
                Err(_) if self.decimal_comma => text.replacen(',', ".", 1).parse().ok(),
                number => number.ok(),
            })
            .filter(|number: &f64| number.is_finite())
            .ok_or_else(|| self.not(column, "a finite number"))
    }

    /// The text in a column of the row, not empty.
    pub fn text(&self, column: usize) -> Result<&str, FileError> {
        std::str::from_utf8(self.bytes(column))
            .ok()
            .filter(|text| !text.is_empty())
            .ok_or_else(|| self.not(column, "a text"))
    }

    fn bytes(&self, column: usize) -> &[u8] {
        self.row.get(column).unwrap_or_default().trim_ascii()
    }

    /// The error of a row's value that is not what it should be.
    pub fn not(&self, column: usize, expected: &str) -> FileError {
        let bytes = self.bytes(column);
        let found = if bytes.is_empty() {
            "an empty field".to_owned()
        } else {
            format!("`{}`", String::from_utf8_lossy(bytes))
        };
        let place = Place::Column {
            line: self.line,
            column: self.header.get(column).cloned().unwrap_or_default(),
        };
        FileError::new(
            &self.file,
            place,
            found,
            expected,
            "Correct the value or record the file again.",
        )
    }

    /// An error of the whole file.
    pub fn error(
        &self,
        found: impl std::fmt::Display,
        expected: impl std::fmt::Display,
        advice: impl std::fmt::Display,
    ) -> FileError {
        FileError::new(&self.file, Place::File, found, expected, advice)
    }

    /// An error of the row.
    pub fn error_here(
        &self,
        found: impl std::fmt::Display,
        expected: impl std::fmt::Display,
        advice: impl std::fmt::Display,
    ) -> FileError {
        FileError::new(&self.file, Place::Line(self.line), found, expected, advice)
    }

    fn unreadable(&self, error: &csv::Error) -> FileError {
        match error.kind() {
            ErrorKind::Io(error) => damaged(&self.file, error),
            _ => FileError {
                file: self.file.clone(),
                place: Place::Line(self.line),
                message: format!("cannot read on: {error}. Correct this row."),
            },
        }
    }
}

fn damaged(file: &Path, error: &std::io::Error) -> FileError {
    FileError::io(
        file,
        "read on",
        error,
        "The file is damaged or cut off; copy or compress it again.",
    )
}

#[cfg(test)]
mod tests;
