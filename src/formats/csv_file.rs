//! Rows of numbers below a line of names, plain or gzipped, read row by row without keeping their text.

mod ahead;
mod lines;
mod row;

use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use flate2::read::MultiGzDecoder;

use super::error::{FileError, Place};
use super::names::Names;
use crate::room;
use ahead::Ahead;
use lines::{LONGEST, Lines, Stop};
use row::{LONGEST_FIELD, MOST_COLUMNS, Malformed, Row};

/// What the names of such files end in, each also with `.gz` behind it.
const ENDINGS: [&str; 5] = [".csv", ".txt", ".tsv", ".dat", ".log"];

/// Bytes that a value takes while a record is read: it is held as it stands, repaired and in SI. To ask for
/// what a calibration takes would refuse what may find room.
const BYTES_A_VALUE: usize = 32;
/// The same where no column is taken, for all are only looked at.
const BYTES_LOOKED_AT: usize = 16;
/// The same where rows are packed as they come.
const BYTES_PACKED: usize = 4;
/// So many rows always find room.
const FEW_ROWS: usize = 1 << 12;

/// A file of rows at one of them.
///
/// Commas, semicolons, tabs or blanks part the fields, as the first row shows. Lines that begin with `#`, `%`
/// or `//` are comments. A first row of numbers makes the columns' names `1`, `2`, …; a row of units below the
/// names is passed over. Numbers may have a decimal comma where commas do not part them.
pub(super) struct CsvFile {
    file: PathBuf,
    lines: Lines,
    names: Names,
    units: Option<Vec<String>>,
    decimal_comma: bool,
    row: Row,
    rows: usize,
    packed: bool,
    line: u64,
    cut: Option<Cut>,
}

/// What the end of a file without a line end leaves open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cut {
    /// Its last row lacks fields.
    Row,
    /// The last number of its last row may lack digits.
    Number,
}

impl CsvFile {
    /// Opens a file and reads its header.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        let is_gzipped = is_gzipped_by_name(path)?;
        let source = source(path, is_gzipped)?;
        let (lines, heading) = Lines::open(source).map_err(|stop| stopped(path, &stop))?;
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
            lines,
            row: Row::new(heading.delimiter.byte()),
            decimal_comma: heading.delimiter.leaves_commas(),
            names: Names::new(&heading.names),
            units: heading.units,
            rows: 0,
            packed: false,
            line: heading.line,
            cut: None,
        })
    }

    /// The names of the columns.
    pub fn header(&self) -> &[String] {
        self.names.all()
    }

    /// The file's path.
    pub fn path(&self) -> &Path {
        &self.file
    }

    /// What comments say of the rate of rows, Hz.
    pub fn rate(&self) -> Option<f64> {
        self.lines.rate()
    }

    /// The row of units below the names, if there is one.
    pub fn units(&self) -> Option<&[String]> {
        self.units.as_deref()
    }

    /// The index of a named column, which nothing else may be.
    pub fn column(&mut self, name: &str) -> Result<usize, FileError> {
        let found = self.names.find(name);
        found.map_err(|wrong| self.error_here(wrong.found, wrong.expected, wrong.advice))
    }

    /// Goes to the next row; false at the end of the file, and at a last row that the end of the file cuts
    /// off.
    pub fn advance(&mut self) -> Result<bool, FileError> {
        let more = self.lines.advance();
        if !more.map_err(|stop| stopped(&self.file, &stop))? {
            return Ok(false);
        }
        self.line = self.lines.number();
        self.rows += 1;
        self.reserve()?;
        let split = self.row.split(self.lines.line());
        let (found, expected) = (self.row.len(), self.header().len());
        let is_cut = split == Err(Malformed::Quote) || found < expected;
        if is_cut && !self.lines.is_ended() {
            self.cut = Some(Cut::Row);
            return Ok(false);
        }
        split.map_err(|what| malformed(&self.file, self.line, what))?;
        let ends_in_delimiter = found == expected + 1 && self.bytes(expected).is_empty();
        if found != expected && !ends_in_delimiter {
            return Err(self.error_here(
                format_args!("{found} fields"),
                format_args!("{expected}, as in the header"),
                "Complete or remove the row.",
            ));
        }
        let last_is_used = self.names.taken().contains(&(expected - 1));
        if !self.lines.is_ended() && last_is_used && !ends_in_delimiter {
            self.cut = Some(Cut::Number);
        }
        Ok(true)
    }

    /// Whether the row is the last and no line end shows that its last number is whole.
    pub fn may_be_cut(&self) -> bool {
        self.cut == Some(Cut::Number)
    }

    /// What the end of the file leaves open, in a sentence, with what was done about its last row.
    pub fn cut_off(&self, done: &str) -> Option<String> {
        let (file, line) = (self.file.display(), self.line);
        let what = match self.cut? {
            Cut::Row => "is cut off: fields are missing. It is left out",
            Cut::Number => &format!("has no line end, so its last number may lack digits. {done}"),
        };
        Some(format!(
            "The last row of {file}, line {line}, {what}; look whether the file is whole."
        ))
    }

    /// Makes sure, as rows become more, that there is room for what is made of them.
    fn reserve(&self) -> Result<(), FileError> {
        if self.rows < FEW_ROWS || !self.rows.is_power_of_two() {
            return Ok(());
        }
        let a_row = match self.names.taken().len() {
            0 => self.header().len() * BYTES_LOOKED_AT,
            taken if self.packed => taken * BYTES_PACKED,
            taken => taken * BYTES_A_VALUE,
        };
        if room::is_there((2 * self.rows).saturating_mul(a_row)) {
            return Ok(());
        }
        Err(self.error_here(
            format_args!("row {}, and no memory for as many more", self.rows),
            "a record that fits into memory",
            "Give it more memory, or split the record.",
        ))
    }

    /// Takes less memory for granted: rows are packed as they come.
    pub fn pack(&mut self) {
        self.packed = true;
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

    /// Whether nothing stands in a column of the row, or what loggers write for that.
    pub fn is_blank(&self, column: usize) -> bool {
        let bytes = self.bytes(column);
        bytes.is_empty() || bytes.eq_ignore_ascii_case(b"nan")
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
            column: self.header().get(column).cloned().unwrap_or_default(),
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
}

/// Whether the name says that the file is gzipped; an error if it is none of a file of rows.
fn is_gzipped_by_name(path: &Path) -> Result<bool, FileError> {
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
    Ok(plain.is_some())
}

/// The bytes of a regular file, unzipped.
fn source(path: &Path, is_gzipped: bool) -> Result<Box<dyn BufRead>, FileError> {
    let refused = |error| {
        FileError::io(
            path,
            "open the file",
            &error,
            "Names in run.toml are relative to run.toml; correct the name or add the file.",
        )
    };
    // To open a pipe would wait for whoever writes into it.
    let kind = fs::metadata(path).map_err(refused)?;
    if !kind.is_file() {
        return Err(FileError::new(
            path,
            Place::File,
            match kind.is_dir() {
                true => "a directory",
                false => "a device or pipe",
            },
            "a regular file, for a log may be read more than once",
            "Copy what it gives into a file and name that.",
        ));
    }
    let opened = || {
        let file = File::open(path).map_err(refused)?;
        Ok(BufReader::with_capacity(1 << 16, file))
    };
    Ok(if is_gzipped {
        match Ahead::of(MultiGzDecoder::new(opened()?)) {
            Ok(ahead) => Box::new(ahead),
            // The system lets no thread be started.
            Err(_) => {
                let decoder = MultiGzDecoder::new(opened()?);
                Box::new(BufReader::with_capacity(1 << 16, decoder))
            }
        }
    } else {
        Box::new(opened()?)
    })
}

fn stopped(file: &Path, stop: &Stop) -> FileError {
    match stop {
        Stop::System(error) => FileError::io(
            file,
            "read on",
            error,
            "The file is damaged or cut off; copy or compress it again.",
        ),
        Stop::Endless { line } => FileError::new(
            file,
            Place::Line(*line),
            format_args!("more than {} KiB without a row that ends", LONGEST / 1024),
            "rows of numbers, a line each",
            "Is this the right file? Record or export it again.",
        ),
        Stop::Malformed { line, what } => malformed(file, *line, *what),
    }
}

fn malformed(file: &Path, line: u64, what: Malformed) -> FileError {
    let (found, expected, advice) = match what {
        Malformed::Quote => (
            "a quote that is not closed".to_owned(),
            "a row in each line, and fields in quotes closed in it".to_owned(),
            "Remove the quote or close it.",
        ),
        Malformed::Columns => (
            "more columns than any log has".to_owned(),
            format!("at most {MOST_COLUMNS}"),
            "Is this the right file? Export the columns that are needed.",
        ),
        Malformed::Field => (
            format!("a field of more than {} KiB", LONGEST_FIELD / 1024),
            "numbers and names".to_owned(),
            "Is this the right file? Record or export it again.",
        ),
    };
    FileError::new(file, Place::Line(line), found, expected, advice)
}

#[cfg(test)]
mod tests;
