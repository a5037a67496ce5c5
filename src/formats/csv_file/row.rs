//! One line as fields.

use csv_core::{ReadRecordResult, Reader, ReaderBuilder, Terminator};

/// Maximum number of columns, as in a spreadsheet.
pub const MOST_COLUMNS: usize = 16_384;
/// Maximum length of a number or name, bytes.
pub const LONGEST_FIELD: usize = 1 << 16;

/// Reason why a line is not a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Malformed {
    /// A field starts with a quote that is not closed in its line.
    Quote,
    /// More columns than [`MOST_COLUMNS`].
    Columns,
    /// A field longer than [`LONGEST_FIELD`].
    Field,
}

/// The fields of a line, possibly quoted; no field extends beyond its line.
pub struct Row {
    parser: Reader,
    text: Vec<u8>,
    /// End of each field in the text, with spare capacity.
    ends: Vec<usize>,
    count: usize,
}

impl Row {
    /// No fields yet, with this separator.
    pub fn new(delimiter: u8) -> Self {
        Self {
            parser: ReaderBuilder::new()
                .delimiter(delimiter)
                .terminator(Terminator::Any(b'\n'))
                .build(),
            text: Vec::new(),
            ends: vec![0; 64],
            count: 0,
        }
    }

    /// Splits a line without its ending into fields.
    pub fn split(&mut self, line: &[u8]) -> Result<(), Malformed> {
        self.parser.reset();
        self.count = 0;
        // Fields together are never longer than their line.
        self.text.resize(line.len() + 1, 0);
        let (mut length, mut rest, mut ended) = (0, line, false);
        loop {
            let (result, read, written, ends) = self.parser.read_record(
                rest,
                &mut self.text[length..],
                &mut self.ends[self.count..],
            );
            rest = &rest[read..];
            length += written;
            self.count += ends;
            match result {
                ReadRecordResult::Record | ReadRecordResult::End => break,
                ReadRecordResult::InputEmpty if ended => return Err(Malformed::Quote),
                ReadRecordResult::InputEmpty => (rest, ended) = (b"\n", true),
                ReadRecordResult::OutputFull => self.text.push(0),
                ReadRecordResult::OutputEndsFull if self.count > MOST_COLUMNS => {
                    return Err(Malformed::Columns);
                }
                ReadRecordResult::OutputEndsFull => self.ends.resize(2 * self.ends.len(), 0),
            }
        }
        if self.count > MOST_COLUMNS {
            return Err(Malformed::Columns);
        }
        match self.fields().any(|field| field.len() > LONGEST_FIELD) {
            true => Err(Malformed::Field),
            false => Ok(()),
        }
    }

    /// Number of fields.
    pub fn len(&self) -> usize {
        self.count
    }

    /// A field, without its quotes.
    pub fn get(&self, index: usize) -> Option<&[u8]> {
        let end = *self.ends[..self.count].get(index)?;
        let start = match index.checked_sub(1) {
            Some(before) => self.ends[before],
            None => 0,
        };
        self.text.get(start..end)
    }

    /// All fields in order.
    pub fn fields(&self) -> impl Iterator<Item = &[u8]> {
        (0..self.count).filter_map(|index| self.get(index))
    }
}
