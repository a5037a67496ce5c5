//! The field separator of a row.

use super::row::{Malformed, Row};

/// Field separator of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Delimiter {
    /// A single byte.
    Byte(u8),
    /// Fields are separated by any number of spaces and tabs.
    Blanks,
}

impl Delimiter {
    /// The separator used in a first row.
    pub fn of_row(row: &str) -> Self {
        let blanks = Self::Blanks.fields(row).unwrap_or_default();
        if blanks.len() > 1 && blanks.iter().all(|field| is_number(field)) {
            return if row.contains('\t') && !row.contains(' ') {
                Self::Byte(b'\t')
            } else {
                Self::Blanks
            };
        }
        // A comma followed by a tab counts as a comma.
        let parts = |byte: &u8| match Self::Byte(*byte).fields(row) {
            _ if !row.as_bytes().contains(byte) => false,
            Ok(fields) => {
                fields.iter().filter(|field| !field.is_empty()).count() > 1
                    && !(*byte == b'\t' && fields.iter().any(|f| f.ends_with(',')))
            }
            // The code that reads the row with this separator reports the fault.
            Err(_) => true,
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

    /// The byte that separates fields in the returned lines.
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

    /// Reduces the delimiters between two fields to one.
    pub fn tidy(self, line: &mut Vec<u8>) {
        if self == Self::Blanks {
            collapse_blanks(line);
        }
    }

    /// The fields of one row, without quotes and blanks around them.
    pub fn fields(self, line: &str) -> Result<Vec<String>, Malformed> {
        let mut text = line.as_bytes().to_vec();
        self.tidy(&mut text);
        let name = |field: &[u8]| {
            let text = String::from_utf8_lossy(field);
            text.trim().trim_matches('"').trim().to_owned()
        };
        let mut row = Row::new(self.byte());
        row.split(&text)?;
        Ok(row.fields().map(name).collect())
    }
}

/// Replaces runs of blanks outside quotes by one space and trims the ends.
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

/// Whether a field is a number, with a point or a comma.
pub fn is_number(field: &str) -> bool {
    // A comma after the last digit separates fields.
    !field.ends_with(',') && (field.parse::<f64>().is_ok() || other_number(field).is_some())
}

/// A number with a decimal comma, or with an exponent as in Fortran.
pub fn other_number(text: &str) -> Option<f64> {
    let is_digit = |c: char| c.is_ascii_digit() || "+-.,dDeE".contains(c);
    let has_digit = text.contains(|c: char| c.is_ascii_digit());
    (has_digit && text.chars().all(is_digit)).then_some(())?;
    let text = text.replacen(',', ".", 1).replacen(['d', 'D'], "e", 1);
    text.parse().ok()
}
