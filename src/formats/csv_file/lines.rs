//! Lines of a text of rows as programs write them, made alike for the CSV reader: without comments, rows
//! without content and runs of blanks, but each in its place, so that lines are counted as in the file.

use std::io::{self, BufRead, Read};

/// What parts a row's fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Delimiter {
    /// This byte, each time.
    Byte(u8),
    /// Spaces and tabs, however many.
    Blanks,
}

impl Delimiter {
    /// The one in a first row.
    fn of_row(row: &str) -> Self {
        let blanks = Self::Blanks.fields(row);
        if blanks.len() > 1 && blanks.iter().all(|field| is_number(field)) {
            return match row.contains('\t') && !row.contains(' ') {
                true => Self::Byte(b'\t'),
                false => Self::Blanks,
            };
        }
        // A comma with a tab behind it is a comma.
        let parts = |byte: &u8| {
            let fields = Self::Byte(*byte).fields(row);
            fields.len() > 1 && !(*byte == b'\t' && fields.iter().any(|f| f.ends_with(',')))
        };
        let byte = [b';', b'\t', b','].into_iter().find(parts);
        // A single column has no delimiter.
        byte.map_or(
            match blanks.len() {
                1 => Self::Byte(b','),
                _ => Self::Blanks,
            },
            Self::Byte,
        )
    }

    /// The byte that parts fields in the lines given out.
    pub fn byte(self) -> u8 {
        match self {
            Self::Byte(byte) => byte,
            Self::Blanks => b' ',
        }
    }

    /// Whether a comma can be part of a number.
    pub fn leaves_commas(self) -> bool {
        self.byte() != b','
    }

    /// The fields of one row, without quotes and blanks around them; an empty one behind a last delimiter
    /// is none.
    fn fields(self, row: &str) -> Vec<String> {
        let mut text = row.as_bytes().to_vec();
        if self == Self::Blanks {
            collapse_blanks(&mut text);
        }
        let mut csv = csv::ReaderBuilder::new()
            .has_headers(false)
            .delimiter(self.byte())
            .from_reader(text.as_slice());
        let mut record = csv::ByteRecord::new();
        // Bytes in memory are always read.
        let _ = csv.read_byte_record(&mut record);
        let name = |field: &[u8]| {
            let text = String::from_utf8_lossy(field);
            text.trim().trim_matches('"').trim().to_owned()
        };
        let mut fields: Vec<String> = record.iter().map(name).collect();
        if fields.len() > 1 && fields.last().is_some_and(String::is_empty) {
            fields.pop();
        }
        fields
    }
}

/// Whether a field is a number, with a point or a comma.
fn is_number(field: &str) -> bool {
    // A comma behind the last digit parts fields.
    !field.ends_with(',') && field.replacen(',', ".", 1).parse::<f64>().is_ok()
}

/// Runs of blanks outside quotes become one space, those at the ends nothing.
fn collapse_blanks(line: &mut Vec<u8>) {
    let (mut quoted, mut kept, mut pending) = (false, 0, false);
    for at in 0..line.len() {
        let byte = line[at];
        if !quoted && byte.is_ascii_whitespace() {
            pending = kept > 0;
            continue;
        }
        quoted ^= byte == b'"';
        if pending {
            line[kept] = b' ';
            kept += 1;
            pending = false;
        }
        line[kept] = byte;
        kept += 1;
    }
    line.truncate(kept);
}

/// What the first lines say of the others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Heading {
    pub delimiter: Delimiter,
    /// Names of the columns: `1`, `2`, … where the file gives none.
    pub names: Vec<String>,
    /// Its line; of the first row where there are no names.
    pub line: u64,
    /// What stands below the names where that is not numbers: units.
    pub units: Option<Vec<String>>,
}

/// The lines of a file behind its heading.
pub(super) struct Lines {
    source: Box<dyn BufRead>,
    delimiter: Delimiter,
    /// What is left of the line being given out.
    line: Vec<u8>,
    given: usize,
    /// Number in the file of the last line taken from it.
    number: u64,
    /// Number of the line given out first.
    first: u64,
}

impl Lines {
    /// Reads the heading; none of an empty file.
    pub fn open(source: Box<dyn BufRead>) -> io::Result<(Self, Option<Heading>)> {
        let mut lines = Self {
            source,
            delimiter: Delimiter::Byte(b','),
            line: Vec::new(),
            given: 0,
            number: 0,
            first: 1,
        };
        let heading = lines.heading()?;
        if let Some(heading) = &heading {
            lines.delimiter = heading.delimiter;
        }
        lines.first = lines.number;
        lines.tidy();
        Ok((lines, heading))
    }

    /// Number in the file of the n-th line given out.
    pub fn number(&self, given: u64) -> u64 {
        self.first + given - 1
    }

    /// Leaves the first line that is not part of it as the current one.
    fn heading(&mut self) -> io::Result<Option<Heading>> {
        let mut remark = String::new();
        while self.take()? && !self.has_content() {
            if let Some(text) = self.comment() {
                remark = String::from_utf8_lossy(text).into_owned();
            }
        }
        if self.line.is_empty() {
            return Ok(None);
        }
        let line = self.number;
        let row = String::from_utf8_lossy(&self.line).into_owned();
        let delimiter = Delimiter::of_row(&row);
        let mut names = delimiter.fields(&row);
        if names.iter().all(|name| is_number(name)) {
            // Some programs write the names as a comment.
            let remarked = Delimiter::of_row(&remark).fields(&remark);
            names = match remarked.len() == names.len() && remarked.len() > 1 {
                true => remarked,
                false => (1..=names.len()).map(|n| n.to_string()).collect(),
            };
            return Ok(Some(Heading {
                delimiter,
                names,
                line,
                units: None,
            }));
        }
        while self.take()? && !self.has_content() {}
        let below = delimiter.fields(&String::from_utf8_lossy(&self.line));
        let is_units = below.len() > 1 && !below.iter().any(|field| is_number(field));
        if is_units {
            self.take()?;
        }
        Ok(Some(Heading {
            delimiter,
            names,
            line,
            units: is_units.then_some(below),
        }))
    }

    /// Takes the next line, without what ends it; false at the end of the file.
    fn take(&mut self) -> io::Result<bool> {
        self.line.clear();
        self.given = 0;
        if self.source.read_until(b'\n', &mut self.line)? == 0 {
            return Ok(false);
        }
        self.number += 1;
        while matches!(self.line.last(), Some(b'\n' | b'\r')) {
            self.line.pop();
        }
        if self.number == 1 && self.line.starts_with(b"\xef\xbb\xbf") {
            self.line.drain(..3);
        }
        Ok(true)
    }

    /// The text of the line if it is a comment.
    fn comment(&self) -> Option<&[u8]> {
        let text = self.line.trim_ascii_start();
        let marks = [&b"#"[..], b"%", b"//"];
        marks.iter().find_map(|mark| text.strip_prefix(*mark))
    }

    /// Whether the line is a row: no comment, and more than delimiters.
    fn has_content(&self) -> bool {
        let empty = |byte: &u8| byte.is_ascii_whitespace() || matches!(byte, b',' | b';');
        self.comment().is_none() && !self.line.iter().all(empty)
    }

    /// Makes the line ready to be given out.
    fn tidy(&mut self) {
        // Most lines begin with a digit, and need no look.
        if !self.line.first().is_some_and(u8::is_ascii_digit) && !self.has_content() {
            self.line.clear();
        }
        if self.delimiter == Delimiter::Blanks {
            collapse_blanks(&mut self.line);
        }
        self.line.push(b'\n');
    }
}

impl Read for Lines {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut filled = 0;
        while filled < buffer.len() {
            if self.given == self.line.len() {
                if !self.take()? {
                    break;
                }
                self.tidy();
            }
            let left = &self.line[self.given..];
            let length = left.len().min(buffer.len() - filled);
            buffer[filled..filled + length].copy_from_slice(&left[..length]);
            self.given += length;
            filled += length;
        }
        Ok(filled)
    }
}
