//! The layout of the rows of a text file, used to distinguish rows from other lines as they arrive.

use super::delimiter::Delimiter;
use super::lines::{comment, has_content};
use super::row::Row;
use turncal_input::excerpt;

/// Minimum number of columns of numbers in rows; a sentence may contain one.
const FEWEST_NUMBERS: usize = 2;

/// Delimiter of the rows of a text file, and which of their columns are numbers.
#[derive(Debug, Clone)]
pub struct RowKind {
    delimiter: Delimiter,
    are_numbers: Vec<bool>,
}

impl RowKind {
    /// The layout of a row; `None` if the line is not a row of numbers.
    pub fn of(line: &[u8]) -> Option<Self> {
        let delimiter = delimiter_of(line);
        let row = split(line, delimiter);
        let fields = row.fields().map(|field| is_number(field, delimiter));
        let are_numbers: Vec<bool> = fields.collect();
        let numbers = are_numbers.iter().filter(|is_number| **is_number).count();
        let is_row = numbers >= FEWEST_NUMBERS && !is_remark(line) && !line.contains(&0);
        is_row.then_some(Self {
            delimiter,
            are_numbers,
        })
    }

    /// Checks that a line is a row with this layout; the error states what was found and what was expected.
    pub fn check(&self, line: &[u8]) -> Result<(), String> {
        let row = split(line, self.delimiter);
        let (found, expected) = (row.len(), self.are_numbers.len());
        let ends_in_delimiter = row.get(expected).is_some_and(<[u8]>::is_empty);
        if found != expected && !(found == expected + 1 && ends_in_delimiter) {
            return Err(format!(
                "found {found} as the number of fields, expected {expected}"
            ));
        }
        let mut fields = self.are_numbers.iter().zip(row.fields()).zip(1..);
        let wrong = fields.find(|((is, field), _)| **is && !is_number(field, self.delimiter));
        if let Some(((_, field), number)) = wrong {
            let text = String::from_utf8_lossy(field);
            return Err(format!(
                "found `{}` in field {number}, expected a number",
                excerpt(text.trim())
            ));
        }
        if line.contains(&0) {
            return Err("found binary data, expected text".to_owned());
        }
        Ok(())
    }

    /// Whether a line contains a word for each column.
    pub fn is_names(&self, line: &[u8]) -> bool {
        [self.delimiter, delimiter_of(line)]
            .into_iter()
            .any(|delimiter| {
                let row = split(line, delimiter);
                let are_words = row.fields().all(|field| !is_number(field, delimiter));
                row.len() == self.are_numbers.len() && are_words
            })
    }
}

/// Whether a reader accepts a field of a column of numbers: a finite number, or the placeholder for a missing one.
fn is_number(field: &[u8], delimiter: Delimiter) -> bool {
    let text = std::str::from_utf8(field).map(str::trim);
    text.is_ok_and(|text| {
        let point = if delimiter.leaves_commas() { "," } else { "." };
        let number = text.replacen(point, ".", 1).parse();
        text.is_empty() || text.eq_ignore_ascii_case("nan") || number.is_ok_and(f64::is_finite)
    })
}

fn delimiter_of(line: &[u8]) -> Delimiter {
    Delimiter::of_row(String::from_utf8_lossy(line).trim())
}

/// The fields of a line; none if it cannot be split.
fn split(line: &[u8], delimiter: Delimiter) -> Row {
    let mut text = line.to_vec();
    while text.pop_if(|byte| b"\r\n".contains(byte)).is_some() {}
    delimiter.tidy(&mut text);
    let mut row = Row::new(delimiter.byte());
    row.split(&text)
        .map_or_else(|_| Row::new(delimiter.byte()), |()| row)
}

/// Whether a line is blank or a comment, which readers skip.
pub fn is_remark(line: &[u8]) -> bool {
    !line.contains(&0) && (comment(line).is_some() || !has_content(line))
}
