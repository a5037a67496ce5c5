//! The fields of one line.

/// Maximum number of columns, as in a spreadsheet.
pub const MOST_COLUMNS: usize = 16_384;
/// Maximum length of a number or name, bytes.
pub const LONGEST_FIELD: usize = 1 << 16;

/// Reason why a line is not a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Malformed {
    /// A field starts with a quote that is not closed on the same line.
    Quote,
    /// More columns than [`MOST_COLUMNS`].
    Columns,
    /// A field longer than [`LONGEST_FIELD`].
    Field,
}

/// The fields of a line, possibly quoted; no field extends beyond its line.
pub struct Row {
    delimiter: u8,
    /// The fields without their quotes, each followed by a delimiter.
    text: Vec<u8>,
    /// End of each field in the text.
    ends: Vec<usize>,
}

impl Row {
    /// A row without fields so far, with this separator.
    pub fn new(delimiter: u8) -> Self {
        Self {
            delimiter,
            text: Vec::new(),
            ends: Vec::new(),
        }
    }

    /// Splits a line without its ending into fields. Quotes enclose a field that begins with a quote; two quotes within
    /// the field stand for one.
    pub fn split(&mut self, line: &[u8]) -> Result<(), Malformed> {
        self.text.clear();
        self.ends.clear();
        // Most lines have no quotes.
        let rest = if line.contains(&b'"') {
            line
        } else {
            let ends = (0..).zip(line).filter(|(_, byte)| **byte == self.delimiter);
            self.ends.extend(ends.map(|(end, _)| end));
            self.text.extend_from_slice(line);
            &[]
        };
        let (mut begins, mut is_quoted, mut is_closed) = (true, false, false);
        for &byte in rest {
            let is_quote = byte == b'"';
            if is_quoted {
                (is_quoted, is_closed) = (!is_quote, is_quote);
                if is_quote {
                    continue;
                }
            } else if is_quote && (begins || is_closed) {
                is_quoted = true;
                if begins {
                    begins = false;
                    continue;
                }
            } else {
                begins = byte == self.delimiter;
                is_closed = false;
                if begins {
                    self.ends.push(self.text.len());
                }
            }
            self.text.push(byte);
        }
        self.ends.push(self.text.len());
        if is_quoted {
            return Err(Malformed::Quote);
        }
        if self.len() > MOST_COLUMNS {
            return Err(Malformed::Columns);
        }
        let is_long = |field: &[u8]| field.len() > LONGEST_FIELD;
        if line.len() > LONGEST_FIELD && self.fields().any(is_long) {
            return Err(Malformed::Field);
        }
        Ok(())
    }

    /// Number of fields.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// A field, without its quotes.
    pub fn get(&self, index: usize) -> Option<&[u8]> {
        let end = *self.ends.get(index)?;
        let before = index
            .checked_sub(1)
            .and_then(|before| self.ends.get(before));
        self.text.get(before.map_or(0, |before| before + 1)..end)
    }

    /// All fields in order.
    pub fn fields(&self) -> impl Iterator<Item = &[u8]> {
        (0..self.len()).filter_map(|index| self.get(index))
    }
}
