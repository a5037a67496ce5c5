//! A CSV file with a header, plain or gzipped, read row by row without keeping its text.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use csv::{ByteRecord, ErrorKind, Reader, ReaderBuilder};
use flate2::read::MultiGzDecoder;

use super::error::{Place, RunError, list, nearest};

/// A CSV file at one of its rows.
pub(super) struct CsvFile {
    file: PathBuf,
    reader: Reader<Box<dyn Read>>,
    header: Vec<String>,
    taken: Vec<usize>,
    row: ByteRecord,
    line: u64,
}

impl CsvFile {
    /// Opens a file and reads its header.
    pub fn open(path: &Path) -> Result<Self, RunError> {
        let name = path.to_string_lossy();
        let gzipped = name.ends_with(".csv.gz");
        if !gzipped && !name.ends_with(".csv") {
            return Err(RunError::new(
                path,
                Place::File,
                "a file of another kind",
                "a name that ends in .csv or .csv.gz",
                "Rename or convert the file.",
            ));
        }
        let file = File::open(path).map_err(|error| {
            RunError::io(
                path,
                "open the file",
                &error,
                "Names in run.toml are relative to run.toml; correct the name or add the file.",
            )
        })?;
        let file = BufReader::with_capacity(1 << 16, file);
        let source: Box<dyn Read> = if gzipped {
            Box::new(MultiGzDecoder::new(file))
        } else {
            Box::new(file)
        };
        let mut csv = Self {
            file: path.to_owned(),
            reader: ReaderBuilder::new()
                .buffer_capacity(1 << 16)
                .from_reader(source),
            header: Vec::new(),
            taken: Vec::new(),
            row: ByteRecord::new(),
            line: 1,
        };
        let header = csv.reader.byte_headers().map(|header| {
            header
                .iter()
                .map(|name| String::from_utf8_lossy(name.trim_ascii()).into_owned())
                .collect()
        });
        csv.header = header.map_err(|error| csv.unreadable(&error))?;
        if csv.header.is_empty() {
            return Err(csv.error(
                "an empty file",
                "a line of column names and rows below it",
                "Record or export the file again.",
            ));
        }
        Ok(csv)
    }

    /// The index of a named column, which nothing else may be.
    pub fn column(&mut self, name: &str) -> Result<usize, RunError> {
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

    /// Goes to the next row; false at the end of the file.
    pub fn advance(&mut self) -> Result<bool, RunError> {
        let more = self.reader.read_byte_record(&mut self.row);
        let more = more.map_err(|error| self.unreadable(&error))?;
        if let Some(position) = self.row.position() {
            self.line = position.line();
        }
        Ok(more)
    }

    /// Line of the row.
    pub fn line(&self) -> u64 {
        self.line
    }

    /// The finite number in a column of the row.
    pub fn number(&self, column: usize) -> Result<f64, RunError> {
        std::str::from_utf8(self.bytes(column))
            .ok()
            .and_then(|text| text.parse().ok())
            .filter(|number: &f64| number.is_finite())
            .ok_or_else(|| self.not(column, "a finite number"))
    }

    /// The text in a column of the row, not empty.
    pub fn text(&self, column: usize) -> Result<&str, RunError> {
        std::str::from_utf8(self.bytes(column))
            .ok()
            .filter(|text| !text.is_empty())
            .ok_or_else(|| self.not(column, "a text"))
    }

    fn bytes(&self, column: usize) -> &[u8] {
        self.row.get(column).unwrap_or_default().trim_ascii()
    }

    /// The error of a row's value that is not what it should be.
    pub fn not(&self, column: usize, expected: &str) -> RunError {
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
        RunError::new(
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
    ) -> RunError {
        RunError::new(&self.file, Place::File, found, expected, advice)
    }

    /// An error of the row.
    pub fn error_here(
        &self,
        found: impl std::fmt::Display,
        expected: impl std::fmt::Display,
        advice: impl std::fmt::Display,
    ) -> RunError {
        RunError::new(&self.file, Place::Line(self.line), found, expected, advice)
    }

    fn unreadable(&self, error: &csv::Error) -> RunError {
        match error.kind() {
            ErrorKind::UnequalLengths {
                pos,
                expected_len,
                len,
            } => RunError::new(
                &self.file,
                pos.as_ref()
                    .map_or(Place::File, |at| Place::Line(at.line())),
                format_args!("{len} fields"),
                format_args!("{expected_len}, as in the header"),
                "Complete or remove the row.",
            ),
            ErrorKind::Io(error) => RunError::io(
                &self.file,
                "read on",
                error,
                "The file is damaged or cut off; copy or compress it again.",
            ),
            _ => RunError {
                file: self.file.clone(),
                place: Place::Line(self.line),
                message: format!("cannot read on: {error}. Correct this row."),
            },
        }
    }
}
