//! Lines of a text in UTF-8 or UTF-16 with any usual line ending. This module limits the memory used per file, for all
//! callers.

use std::collections::VecDeque;
use std::io::{self, BufRead, BufReader, ErrorKind, Read};

use super::row::Malformed;

/// Longest row in bytes, including comments and empty lines before it; a file with a longer one is not a log.
pub const LONGEST: u64 = 1 << 20;
/// Most lines and bytes that are read to identify the format of the file.
const MOST_AHEAD: usize = 1 << 11;
const BYTES_AHEAD: usize = 1 << 18;

/// A line that is not empty, without its line ending.
#[derive(Debug, Clone, Default)]
pub struct Line {
    pub text: Vec<u8>,
    /// Number in the file.
    pub number: u64,
    /// Whether the line has an ending, so that it is complete.
    pub is_ended: bool,
}

impl Line {
    /// The text of the comment, if the line is a comment.
    pub fn comment(&self) -> Option<&[u8]> {
        comment(&self.text)
    }
}

/// The text of the comment, if the line is a comment.
pub fn comment(line: &[u8]) -> Option<&[u8]> {
    let text = line.trim_ascii_start();
    let marks = [&b"#"[..], b"%", b"//"];
    marks.iter().find_map(|mark| text.strip_prefix(*mark))
}

/// Whether a line contains more than delimiters.
pub fn has_content(line: &[u8]) -> bool {
    let empty = |byte: &u8| byte.is_ascii_whitespace() || matches!(byte, b',' | b';');
    !line.iter().all(empty)
}

/// Reason why reading stopped.
#[derive(Debug)]
pub enum Stop {
    /// Error of the system or of decompression.
    System(io::Error),
    /// From this line on, no row ends within [`LONGEST`].
    Endless { line: u64 },
    /// A line that cannot be split into fields.
    Malformed { line: u64, what: Malformed },
    /// The bytes are not text.
    Binary,
}

impl From<io::Error> for Stop {
    fn from(error: io::Error) -> Self {
        Self::System(error)
    }
}

/// The lines of a file; the first lines can be examined before they are read.
pub struct Lines {
    source: Box<dyn BufRead>,
    /// Line ending.
    end: u8,
    ahead: VecDeque<Line>,
    /// The remaining input.
    stop: Option<Stop>,
    /// Number of the last line read, and of the last row returned.
    number: u64,
    row: u64,
    line: Line,
}

impl Lines {
    /// Reads the first lines.
    pub fn open(mut source: Box<dyn BufRead>) -> Result<Self, Stop> {
        let begin = source.fill_buf()?;
        let utf16 = match begin {
            [0xff, 0xfe, ..] => Some(u16::from_le_bytes as fn([u8; 2]) -> u16),
            [0xfe, 0xff, ..] => Some(u16::from_be_bytes as fn([u8; 2]) -> u16),
            _ if begin.contains(&0) && begin.contains(&b'\n') => return Err(Stop::Binary),
            _ => None,
        };
        if let Some(unit) = utf16 {
            source = Box::new(BufReader::new(Utf16 { source, unit }));
        }
        let begin = source.fill_buf()?;
        let only_returns = begin.contains(&b'\r') && !begin.contains(&b'\n');
        let mut lines = Self {
            source,
            end: if only_returns { b'\r' } else { b'\n' },
            ahead: VecDeque::new(),
            stop: None,
            number: 0,
            row: 0,
            line: Line::default(),
        };
        let mut bytes = 0;
        while lines.ahead.len() < MOST_AHEAD && bytes < BYTES_AHEAD {
            match lines.take(&mut LONGEST.clone()) {
                Ok(true) => {}
                Ok(false) => break,
                Err(stop) => {
                    lines.stop = Some(stop);
                    break;
                }
            }
            let line = std::mem::take(&mut lines.line);
            if line.comment().is_none() {
                lines.row = line.number;
            }
            bytes += line.text.len();
            lines.ahead.push_back(line);
        }
        match lines.stop.take() {
            Some(stop) if lines.ahead.is_empty() => Err(stop),
            stop => {
                lines.stop = stop;
                Ok(lines)
            }
        }
    }

    /// The first lines.
    pub fn ahead(&self) -> impl Iterator<Item = &Line> + Clone {
        self.ahead.iter()
    }

    /// Skips this many of the first lines.
    pub fn skip(&mut self, lines: usize) {
        let passed = self.ahead.drain(..lines).next_back();
        self.row = passed.map_or(0, |line| line.number);
    }

    /// Advances to the next line that is not a comment, or to any line; false at the end of the file.
    pub fn advance(&mut self, any: bool) -> Result<bool, Stop> {
        let mut left = LONGEST;
        loop {
            match self.ahead.pop_front() {
                Some(line) => self.line = line,
                None => {
                    if let Some(stop) = self.stop.take() {
                        return Err(stop);
                    }
                    if !self.take(&mut left)? {
                        return Ok(false);
                    }
                }
            }
            // Most rows begin with a digit and need no further test.
            let is_row = self.line.text.first().is_some_and(u8::is_ascii_digit);
            if is_row || any || self.line.comment().is_none() {
                self.row = self.line.number;
                return Ok(true);
            }
        }
    }

    /// The line.
    pub fn line(&mut self) -> &mut Line {
        &mut self.line
    }

    /// Whether the line has an ending, so that it is complete.
    pub fn is_ended(&self) -> bool {
        self.line.is_ended
    }

    /// Reads the next non-empty line, within `left` bytes; false at the end of the file.
    fn take(&mut self, left: &mut u64) -> Result<bool, Stop> {
        loop {
            let line = &mut self.line;
            line.text.clear();
            let mut source = self.source.by_ref().take(*left + 1);
            let length = source.read_until(self.end, &mut line.text)? as u64;
            if length == 0 {
                return Ok(false);
            }
            if length > *left {
                return Err(Stop::Endless { line: self.row + 1 });
            }
            *left -= length;
            self.number += 1;
            line.number = self.number;
            line.is_ended = line.text.last() == Some(&self.end);
            while matches!(line.text.last(), Some(b'\n' | b'\r')) {
                line.text.pop();
            }
            if self.number == 1 && line.text.starts_with(b"\xef\xbb\xbf") {
                line.text.drain(..3);
            }
            if has_content(&line.text) {
                return Ok(true);
            }
        }
    }
}

/// Converts UTF-16 to UTF-8; surrogate pairs are lost (they do not occur in numbers or names here).
struct Utf16 {
    source: Box<dyn BufRead>,
    unit: fn([u8; 2]) -> u16,
}

impl Read for Utf16 {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let mut written = 0;
        while written + 3 <= into.len() {
            let mut unit = [0; 2];
            match self.source.read_exact(&mut unit) {
                Err(error) if error.kind() == ErrorKind::UnexpectedEof => break,
                read => read?,
            }
            let letter = char::from_u32(u32::from((self.unit)(unit)));
            let letter = letter.unwrap_or(char::REPLACEMENT_CHARACTER);
            written += letter.encode_utf8(&mut into[written..]).len();
        }
        Ok(written)
    }
}
