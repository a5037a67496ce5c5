//! Rows of numbers below a line of names, plain or gzipped, read row by row without storing the text.

mod clock_text;
mod delimiter;
mod heading;
mod kind;
mod labels;
mod lines;
mod look;
mod marks;
mod names;
mod preamble;
mod row;
mod shape;
mod tags;

use std::borrow::Cow;
use std::fmt::Display;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use flate2::read::MultiGzDecoder;

use super::data_file::DataFile;
use super::rows::Rows;
use delimiter::other_number;
use heading::Heading;
pub use kind::{RowKind, is_remark};
use lines::{LONGEST, Line, Lines, Stop};
use look::Looks;
use row::{LONGEST_FIELD, MOST_COLUMNS, Malformed, Row};
use shape::{Added, Labelled, RARE, Sample, Stream};
use turncal_input::{FileError, Place, counted, excerpt};

/// First bytes of a gzipped file.
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// A file of rows with its current row.
///
/// Fields are separated by commas, semicolons, tabs or blanks, according to most rows. Lines that begin with `#`, `%`
/// or `//` are comments; comments above the names, or above rows of numbers without names, form a preamble. Columns
/// without names are called `1`, `2`, …. Numbers may have a decimal comma if commas are not separators; a time may be a
/// clock time.
pub struct CsvFile {
    file: PathBuf,
    lines: Lines,
    heading: Heading,
    /// Tag of the selected rows, and its column, for rows of several kinds.
    tag: Option<(usize, String)>,
    /// Streams, selected stream and current sample, for rows with words next to their numbers.
    labelled: Option<(Labelled, Stream, Sample)>,
    row: Row,
    /// Numbers in the used columns of the row.
    numbers: Vec<f64>,
    line: u64,
    left_out: LeftOut,
    cut: Option<Cut>,
}

/// Lines among the rows that are not rows.
#[derive(Debug, Default)]
struct LeftOut {
    /// Number of rows so far, and number of rows among the first lines.
    rows: usize,
    ahead: usize,
    count: usize,
    /// Number and text of the first such line.
    first: Option<(u64, String)>,
}

impl LeftOut {
    fn add(&mut self, line: &Line) {
        self.count += 1;
        let text = || excerpt(&String::from_utf8_lossy(&line.text));
        self.first.get_or_insert_with(|| (line.number, text()));
    }

    /// Whether lines that are not rows are so few that the rows can be distinguished from them.
    fn are_rare(&self) -> bool {
        self.count * RARE <= self.rows.max(self.ahead)
    }
}

/// Uncertainty at the end of a file without a line ending.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cut {
    /// The last row lacks fields.
    Row,
    /// The last number of its last row may lack digits.
    Number,
}

impl CsvFile {
    /// Opens a file and reads its header; if the rows are tagged, selects the rows with this tag.
    pub fn open(file: &DataFile, tag: Option<&str>) -> Result<Self, FileError> {
        let stopped = |stop: Stop| stopped(file, &stop);
        let mut lines = Lines::open(source(file)?).map_err(stopped)?;
        let labelled = Labelled::of(lines.ahead());
        if let Some(error) = not_rows(file, &lines, labelled.is_some()) {
            return Err(error);
        }
        let labelled = labelled.map(|of| {
            let stream = of
                .stream(tag)
                .ok_or_else(|| no_tag(file, tag.unwrap_or_default()));
            stream
                .cloned()
                .map(|stream| (of, stream, Sample::default()))
        });
        let labelled = labelled.transpose()?;
        let looks = match &labelled {
            Some((of, stream, _)) => Looks::of_stream(lines.ahead(), of, stream),
            None => Looks::of(lines.ahead()),
        };
        let tag = tag.filter(|_| labelled.is_none());
        let tags = tag.map(|tag| {
            let tags = looks
                .tags()
                .filter(|tags| tags.names.iter().any(|name| name == tag));
            tags.ok_or_else(|| no_tag(file, tag))
        });
        let tags = tags.transpose()?;
        let stream = labelled.as_ref().map(|(_, stream, _)| stream);
        let heading = looks.heading(tags.as_ref().zip(tag), stream);
        let heading = heading.map_err(stopped)?;
        let heading = heading.ok_or_else(|| {
            FileError::new(
                file,
                Place::File,
                "an empty file",
                "a line of column names followed by rows",
                "Record or export the file again.",
            )
        })?;
        lines.skip(heading.above);
        Ok(Self {
            file: file.to_path_buf(),
            lines,
            row: Row::new(heading.delimiter.byte()),
            tag: tags
                .zip(tag)
                .map(|(tags, tag)| (tags.column, tag.to_owned())),
            line: heading.line,
            numbers: vec![f64::NAN; heading.names.len()],
            left_out: LeftOut {
                ahead: heading.rows,
                ..LeftOut::default()
            },
            heading,
            labelled,
            cut: None,
        })
    }

    /// Tags of rows of several kinds.
    pub fn tags(file: &DataFile) -> Result<Vec<String>, FileError> {
        let lines = Lines::open(source(file)?).map_err(|stop| stopped(file, &stop))?;
        Ok(match Labelled::of(lines.ahead()) {
            Some(labelled) => labelled.names(),
            None => (Looks::of(lines.ahead()).tags()).map_or_else(Vec::new, |tags| tags.names),
        })
    }

    /// Reads the numbers of these columns; false if a field of numbers has something else.
    fn parse(&mut self, used: &[usize]) -> bool {
        let mut are_numbers = true;
        for &column in used {
            let number = self.number(column);
            if let Some(of_column) = self.numbers.get_mut(column) {
                *of_column = number;
            }
            let is_number = self.heading.numbers.get(column) == Some(&true);
            are_numbers &= !is_number || !number.is_nan() || self.is_blank(column);
        }
        are_numbers
    }

    /// The number in a column of the row; NaN if there is none.
    fn number(&self, column: usize) -> f64 {
        let text = std::str::from_utf8(self.bytes(column)).unwrap_or_default();
        let clock = self.heading.clocks.get(column).copied().flatten();
        let number = match (clock, text.parse()) {
            (Some(clock), _) => clock.seconds(text),
            (None, number) => number.ok().or_else(|| other_number(text)),
        };
        number.unwrap_or(f64::NAN)
    }

    fn bytes(&self, column: usize) -> &[u8] {
        self.row.get(column).unwrap_or_default().trim_ascii()
    }

    fn error_here(&self, found: impl Display, expected: impl Display, advice: &str) -> FileError {
        FileError::new(&self.file, self.place(None), found, expected, advice)
    }
}

/// The error for a text file with a first line that shows another kind of file.
fn not_rows(file: &DataFile, lines: &Lines, is_labelled: bool) -> Option<FileError> {
    let first = lines.ahead().next()?.text.trim_ascii_start();
    let is_array = first.starts_with(b"[{") || first.trim_ascii_end() == b"[";
    let (found, advice) = match first.first()? {
        b'[' if is_array => (
            "a JSON array",
            "Write each object in a line of its own, for example by jq -c '.[]' FILE > log.jsonl",
        ),
        // Rows may be objects, one on each line.
        b'{' if first.len() == 1 || !is_labelled => (
            "JSON",
            "Give a log. To show a calibration, run turncal show FILE.",
        ),
        0 => (
            "NUL bytes at its beginning",
            "The log was not written completely, or its memory was erased. Copy the log again.",
        ),
        _ => return None,
    };
    Some(FileError::of(file, found, "rows of numbers", advice))
}

impl Rows for CsvFile {
    fn file(&self) -> &Path {
        &self.file
    }

    fn header(&self) -> &[String] {
        &self.heading.names
    }

    fn units(&self) -> &[String] {
        self.heading.units.as_deref().unwrap_or_default()
    }

    fn rate(&self) -> Option<f64> {
        self.heading.rate
    }

    fn remarks(&self) -> &[String] {
        &self.heading.remarks
    }

    /// The result is also false at a truncated last row.
    fn advance(&mut self, used: &[usize]) -> Result<bool, FileError> {
        loop {
            let more = self.lines.advance(self.labelled.is_some());
            if !more.map_err(|stop| stopped(&self.file, &stop))? {
                return Ok(false);
            }
            let line = self.lines.line();
            self.line = line.number;
            if let Some((labelled, stream, sample)) = &mut self.labelled {
                match sample.add(labelled, stream, &mut line.text) {
                    Added::Complete => {}
                    Added::Part | Added::Other => continue,
                    Added::Nothing => {
                        let is_comment = line.comment().is_some();
                        if !is_comment && self.left_out.rows > 0 && line.is_ended {
                            self.left_out.add(line);
                        }
                        continue;
                    }
                }
            }
            self.heading.delimiter.tidy(&mut line.text);
            let split = self.row.split(&line.text);
            match &self.tag {
                Some((column, tag)) if self.bytes(*column) != tag.as_bytes() => continue,
                _ => {}
            }
            let (found, expected) = (self.row.len(), self.heading.names.len());
            let is_cut = split == Err(Malformed::Quote) || found < expected;
            if is_cut && !self.lines.is_ended() {
                self.cut = Some(Cut::Row);
                return Ok(false);
            }
            let ends_in_delimiter = found == expected + 1 && self.bytes(expected).is_empty();
            let is_whole = split.is_ok() && (found == expected || ends_in_delimiter);
            if is_whole && self.parse(used) {
                self.left_out.rows += 1;
                if !self.lines.is_ended() && used.contains(&(expected - 1)) && !ends_in_delimiter {
                    self.cut = Some(Cut::Number);
                }
                return Ok(true);
            }
            self.left_out.add(self.lines.line());
            if !self.left_out.are_rare() {
                split.map_err(|what| malformed(&self.file, self.line, what))?;
                if is_whole {
                    return Ok(true);
                }
                return Err(self.error_here(
                    format_args!("{found} fields"),
                    format_args!("{expected} as in the header"),
                    "Complete or remove the row.",
                ));
            }
        }
    }

    fn value(&self, column: usize) -> f64 {
        match self.numbers.get(column) {
            Some(number) if !number.is_nan() => *number,
            _ => self.number(column),
        }
    }

    fn shown(&self, column: usize) -> Cow<'_, str> {
        String::from_utf8_lossy(self.bytes(column))
    }

    /// The result is also true for placeholders of loggers.
    fn is_blank(&self, column: usize) -> bool {
        let bytes = self.bytes(column);
        bytes.is_empty() || bytes.eq_ignore_ascii_case(b"nan")
    }

    fn line(&self) -> u64 {
        self.line
    }

    fn place(&self, column: Option<usize>) -> Place {
        let line = self.line;
        let name = column.map(|column| self.header().get(column).cloned().unwrap_or_default());
        name.map_or(Place::Line(line), |column| Place::Column { line, column })
    }

    fn place_of_names(&self) -> Place {
        Place::Line(self.heading.line)
    }

    fn may_be_cut(&self) -> bool {
        self.cut == Some(Cut::Number)
    }

    fn left_out(&self) -> Option<String> {
        let (number, text) = self.left_out.first.as_ref()?;
        let (file, count) = (self.file.display(), self.left_out.count);
        Some(format!(
            "{file}: turncal left out {} that {} no row like the others (line {number}: `{text}`).",
            counted(count, "line"),
            if count == 1 { "is" } else { "are" }
        ))
    }

    fn cut_off(&self, done: &str) -> Option<String> {
        let (file, line) = (self.file.display(), self.line);
        let what = match self.cut? {
            Cut::Row => "has too few fields because it is truncated, so turncal ignored it",
            Cut::Number => {
                &format!("has no line ending, so its last number may lack digits. {done}")
            }
        };
        Some(format!(
            "The last row of {file} (line {line}) {what}. Check that the file is complete."
        ))
    }
}

/// Error for a tag in a file without tagged rows.
fn no_tag(path: &Path, tag: &str) -> FileError {
    FileError::new(
        path,
        Place::File,
        "rows of text",
        format_args!("a log with a stream `{tag}`"),
        "Omit `stream`, or name another file.",
    )
}

/// The bytes of a file, unzipped.
fn source(file: &DataFile) -> Result<Box<dyn BufRead>, FileError> {
    let mut plain = BufReader::with_capacity(1 << 16, file.open()?);
    let begin = plain
        .fill_buf()
        .map_err(|error| stopped(file, &Stop::System(error)))?;
    Ok(if begin.starts_with(&GZIP) {
        Box::new(BufReader::with_capacity(
            1 << 16,
            MultiGzDecoder::new(plain),
        ))
    } else {
        Box::new(plain)
    })
}

fn stopped(file: &Path, stop: &Stop) -> FileError {
    match stop {
        Stop::System(error) => FileError::io(
            file,
            "continue reading",
            error,
            "The file is damaged or truncated. Copy or compress it again.",
        ),
        Stop::Endless { line } => FileError::new(
            file,
            Place::Line(*line),
            format_args!("more than {} KiB without an end of line", LONGEST / 1024),
            "one row of numbers per line",
            "Is this the right file? Record or export it again.",
        ),
        Stop::Malformed { line, what } => malformed(file, *line, *what),
        Stop::Binary => FileError::new(
            file,
            Place::File,
            "binary data of an unknown format",
            "a text log or a supported binary log",
            "Convert the file.",
        ),
    }
}

fn malformed(file: &Path, line: u64, what: Malformed) -> FileError {
    let (found, expected, advice) = match what {
        Malformed::Quote => (
            "an unclosed quote".to_owned(),
            "one row per line, with every quotation mark closed".to_owned(),
            "Remove the quotation mark, or close it.",
        ),
        Malformed::Columns => (
            "too many columns".to_owned(),
            format!("at most {MOST_COLUMNS} columns"),
            "Is this the right file? Export only the columns that are needed.",
        ),
        Malformed::Field => (
            format!("a field longer than {} KiB", LONGEST_FIELD / 1024),
            "short numbers or names".to_owned(),
            "Is this the right file? Record or export it again.",
        ),
    };
    FileError::new(file, Place::Line(line), found, expected, advice)
}

#[cfg(test)]
mod tests;
