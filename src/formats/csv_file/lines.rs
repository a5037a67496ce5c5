//! Rows of a text as programs write them: a line each, without comments, lines without content and runs of
//! blanks. What a file may make its reader hold is limited here, for all callers alike.

use std::io::{self, BufRead, Read};

use super::row::{Malformed, Row};

/// Within so many bytes a row ends, comments and empty lines before it counted; what does not is no log.
pub(super) const LONGEST: u64 = 1 << 20;

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
        let blanks = Self::Blanks.fields(row).unwrap_or_default();
        if blanks.len() > 1 && blanks.iter().all(|field| is_number(field)) {
            return match row.contains('\t') && !row.contains(' ') {
                true => Self::Byte(b'\t'),
                false => Self::Blanks,
            };
        }
        // A comma with a tab behind it is a comma.
        let parts = |byte: &u8| match Self::Byte(*byte).fields(row) {
            Ok(fields) => {
                fields.len() > 1 && !(*byte == b'\t' && fields.iter().any(|f| f.ends_with(',')))
            }
            // Whoever reads the row by it says what is wrong.
            Err(_) => row.as_bytes().contains(byte),
        };
        let byte = [b';', b'\t', b','].into_iter().find(parts);
        // A single column has no delimiter.
        byte.map_or(
            match blanks.len() {
                0 | 1 => Self::Byte(b','),
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
    fn fields(self, line: &str) -> Result<Vec<String>, Malformed> {
        let mut text = line.as_bytes().to_vec();
        if self == Self::Blanks {
            collapse_blanks(&mut text);
        }
        let mut row = Row::new(self.byte());
        row.split(&text)?;
        let name = |field: &[u8]| {
            let text = String::from_utf8_lossy(field);
            text.trim().trim_matches('"').trim().to_owned()
        };
        let mut fields: Vec<String> = row.fields().map(name).collect();
        if fields.len() > 1 && fields.last().is_some_and(String::is_empty) {
            fields.pop();
        }
        Ok(fields)
    }
}

/// Whether a field is a number, with a point or a comma.
fn is_number(field: &str) -> bool {
    // A comma behind the last digit parts fields.
    !field.ends_with(',') && field.replacen(',', ".", 1).parse::<f64>().is_ok()
}

/// The rate in Hz that a comment such as `Update Rate: 100.0Hz` states.
fn rate(remark: &str) -> Option<f64> {
    let remark = remark.to_lowercase();
    let (_, rest) = remark.split_once("rate").or(remark.split_once("freq"))?;
    let begin = rest.find(|c: char| c.is_ascii_digit())?;
    let number = &rest[begin..];
    let end = number.find(|c: char| !c.is_ascii_digit() && c != '.');
    let (number, unit) = number.split_at(end.unwrap_or(number.len()));
    let in_hertz = unit.trim_start().starts_with("hz") || rest[..begin].contains("hz");
    let rate = number.parse().ok().filter(|rate| *rate > 0.0);
    rate.filter(|_| in_hertz)
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

/// The names of both rows together where the first, of groups, names several columns alike and both together do not.
fn names_of_groups(groups: &[String], names: &[String]) -> Option<Vec<String>> {
    if groups.len() != names.len() || are_distinct(groups) {
        return None;
    }
    let pairs = groups.iter().zip(names);
    let both = pairs.map(|(group, name)| format!("{group} {name}").trim().to_owned());
    Some(both.collect()).filter(|both: &Vec<String>| are_distinct(both))
}

/// Whether each names one column: units of two columns are often one word.
fn are_distinct(names: &[String]) -> bool {
    let mut sorted: Vec<&str> = names.iter().map(String::as_str).collect();
    sorted.retain(|name| !name.is_empty());
    sorted.sort_unstable();
    sorted.windows(2).all(|pair| pair[0] != pair[1])
}

/// Names of so many columns in comments above the rows, and the units in the comment below them.
fn names_in_comments(
    remarks: &[Option<String>; 2],
    columns: usize,
) -> (Vec<String>, Option<Vec<String>>) {
    let fields = |remark: &Option<String>| {
        let remark = remark.as_deref().unwrap_or_default();
        let fields = Delimiter::of_row(remark).fields(remark);
        fields
            .ok()
            .filter(|fields| fields.len() == columns && columns > 1)
    };
    match remarks.each_ref().map(fields) {
        [Some(names), Some(units)] if are_distinct(&names) && !are_distinct(&units) => {
            (names, Some(units))
        }
        [_, last] => (last.unwrap_or_default(), None),
    }
}

/// Why lines cannot be read on.
#[derive(Debug)]
pub(super) enum Stop {
    /// The system or the decompression says so.
    System(io::Error),
    /// From this line on no row ends within [`LONGEST`].
    Endless { line: u64 },
    /// This line has no fields.
    Malformed { line: u64, what: Malformed },
}

impl From<io::Error> for Stop {
    fn from(error: io::Error) -> Self {
        Self::System(error)
    }
}

/// The rows of a file behind its heading, a line each.
pub(super) struct Lines {
    source: Box<dyn BufRead>,
    delimiter: Delimiter,
    /// The row, without what ends it.
    line: Vec<u8>,
    /// Its number in the file.
    number: u64,
    /// Whether the file goes on behind it.
    ended: bool,
    /// Whether it is still to be given out.
    pending: bool,
    /// The last two comments before it.
    remarks: [Option<String>; 2],
    /// What comments say of the rate of rows, Hz.
    rate: Option<f64>,
    /// A row that was looked at before its turn, with its number and whether it is ended.
    ahead: Option<(Vec<u8>, u64, bool)>,
}

impl Lines {
    /// Reads the heading; none of an empty file.
    pub fn open(source: Box<dyn BufRead>) -> Result<(Self, Option<Heading>), Stop> {
        let mut lines = Self {
            source,
            delimiter: Delimiter::Byte(b','),
            line: Vec::new(),
            number: 0,
            ended: false,
            pending: false,
            remarks: [None, None],
            rate: None,
            ahead: None,
        };
        let heading = lines.heading()?;
        if let Some(heading) = &heading {
            lines.delimiter = heading.delimiter;
        }
        lines.tidy();
        Ok((lines, heading))
    }

    /// Goes to the next row; false at the end of the file.
    pub fn advance(&mut self) -> Result<bool, Stop> {
        if std::mem::take(&mut self.pending) {
            return Ok(true);
        }
        let more = self.take()?;
        self.tidy();
        Ok(more)
    }

    /// The row.
    pub fn line(&self) -> &[u8] {
        &self.line
    }

    /// Number of its line in the file.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// Whether something ends its line, so that it is all there.
    pub fn is_ended(&self) -> bool {
        self.ended
    }

    /// Leaves the first row that is not part of it as the current one.
    fn heading(&mut self) -> Result<Option<Heading>, Stop> {
        if !self.take()? {
            return Ok(None);
        }
        let line = self.number;
        let malformed = |what| Stop::Malformed { line, what };
        let row = String::from_utf8_lossy(&self.line).into_owned();
        let delimiter = Delimiter::of_row(&row);
        let mut names = delimiter.fields(&row).map_err(malformed)?;
        // Some programs write the names as a comment.
        let remarks = std::mem::take(&mut self.remarks);
        let (remarked, units) = names_in_comments(&remarks, names.len());
        let numbers = names.iter().filter(|name| is_number(name)).count();
        let is_named = !remarked.is_empty()
            && (numbers == names.len() || !remarked.iter().any(|name| is_number(name)));
        let is_row = numbers == names.len()
            || (numbers > 0 && (is_named || self.is_like_the_next(&names, delimiter)?));
        if is_row {
            names = match is_named {
                true => remarked,
                false => (1..=names.len()).map(|n| n.to_string()).collect(),
            };
            self.pending = true;
            return Ok(Some(Heading {
                delimiter,
                names,
                line,
                units: units.filter(|_| is_named),
            }));
        }
        self.pending = self.take()?;
        let mut below = self.words(delimiter);
        // Names of groups, and what each of a group is.
        if let Some(whole) = below
            .as_ref()
            .and_then(|below| names_of_groups(&names, below))
        {
            names = whole;
            self.pending = self.take()?;
            below = self.words(delimiter);
        }
        if below.is_some() {
            self.pending = self.take()?;
        }
        Ok(Some(Heading {
            delimiter,
            names,
            line,
            units: below,
        }))
    }

    /// The fields of the current line if they are words, not numbers.
    fn words(&self, delimiter: Delimiter) -> Option<Vec<String>> {
        // What is wrong with it is said where it is read.
        let fields = delimiter.fields(&String::from_utf8_lossy(&self.line));
        fields
            .ok()
            .filter(|fields| fields.len() > 1 && !fields.iter().any(|field| is_number(field)))
    }

    /// Whether the next row has numbers and texts in the same places, as rows have and names have not.
    fn is_like_the_next(&mut self, row: &[String], delimiter: Delimiter) -> Result<bool, Stop> {
        let first = (std::mem::take(&mut self.line), self.number, self.ended);
        let more = self.take()?;
        let next = delimiter.fields(&String::from_utf8_lossy(&self.line));
        let kinds = |row: &[String]| row.iter().map(|field| is_number(field)).collect::<Vec<_>>();
        let is_like = more && next.is_ok_and(|next| kinds(&next) == kinds(row));
        if more {
            self.ahead = Some((std::mem::take(&mut self.line), self.number, self.ended));
        }
        (self.line, self.number, self.ended) = first;
        Ok(is_like)
    }

    /// What comments say of the rate of rows, Hz.
    pub fn rate(&self) -> Option<f64> {
        self.rate
    }

    /// Takes the next row; false at the end of the file.
    fn take(&mut self) -> Result<bool, Stop> {
        if let Some(ahead) = self.ahead.take() {
            (self.line, self.number, self.ended) = ahead;
            return Ok(true);
        }
        let first = self.number + 1;
        let mut left = LONGEST;
        loop {
            self.line.clear();
            let mut source = self.source.by_ref().take(left + 1);
            let length = source.read_until(b'\n', &mut self.line)? as u64;
            if length == 0 {
                return Ok(false);
            }
            if length > left {
                return Err(Stop::Endless { line: first });
            }
            left -= length;
            self.number += 1;
            self.ended = self.line.last() == Some(&b'\n');
            while matches!(self.line.last(), Some(b'\n' | b'\r')) {
                self.line.pop();
            }
            if self.number == 1 && self.line.starts_with(b"\xef\xbb\xbf") {
                self.line.drain(..3);
            }
            // Most rows begin with a digit, and need no look.
            if self.line.first().is_some_and(u8::is_ascii_digit) || self.has_content() {
                return Ok(true);
            }
            if let Some(text) = self.comment() {
                let remark = String::from_utf8_lossy(text).into_owned();
                self.rate = self.rate.or_else(|| rate(&remark));
                let [_, last] = &mut self.remarks;
                let above = last.replace(remark);
                self.remarks[0] = above;
            }
        }
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

    /// Leaves one delimiter between two fields.
    fn tidy(&mut self) {
        if self.delimiter == Delimiter::Blanks {
            collapse_blanks(&mut self.line);
        }
    }
}
