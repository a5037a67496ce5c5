//! The parsed first lines of a text file, and the layout that most rows have.

use std::collections::{BTreeMap, BTreeSet};

use super::delimiter::{Delimiter, is_number};
use super::lines::{Line, Stop};
use super::row::Malformed;
use super::shape::{Added, Labelled, SEPARATOR, Sample, Stream};

/// Number of rows at the end of the first lines that define the row format.
const ROWS: usize = 64;

/// A line with its fields.
pub struct Look {
    pub number: u64,
    pub is_comment: bool,
    pub delimiter: Delimiter,
    pub text: String,
    pub fields: Result<Vec<String>, Malformed>,
}

impl Look {
    pub fn of(line: &Line) -> Self {
        // A mark with a separator behind it is the name of the first column.
        let is_inside = |of: &&[u8]| !matches!(of.first(), Some(b',' | b';' | b'\t'));
        let comment = line.comment().filter(is_inside);
        let text = text_of(comment.unwrap_or(&line.text));
        // Tabs may stand for fields without a value.
        let text = text.trim_matches(' ').to_owned();
        let delimiter = Delimiter::of_row(&text);
        Self {
            number: line.number,
            is_comment: line.comment().is_some(),
            delimiter,
            fields: delimiter.fields(&text),
            text,
        }
    }

    /// The fields if their number matches, with any delimiter; an empty field at the end is ignored.
    pub fn fields(&self, delimiter: Delimiter, count: usize) -> Option<Vec<String>> {
        let fits = |mut fields: Vec<String>| {
            if fields.len() == count + 1 {
                fields.pop_if(|last| last.is_empty());
            }
            (fields.len() == count).then_some(fields)
        };
        // The words of a sentence are not fields.
        let is_sentence = self.delimiter == Delimiter::Blanks;
        let own = || {
            self.fields
                .clone()
                .ok()
                .filter(|_| !is_sentence)
                .and_then(fits)
        };
        delimiter
            .fields(&self.text)
            .ok()
            .and_then(fits)
            .or_else(own)
    }

    /// A line with the same number of words, for names or units.
    pub fn words(&self, delimiter: Delimiter, count: usize) -> Option<Vec<String>> {
        let fields = self.fields(delimiter, count)?;
        let filled = fields.iter().filter(|field| !field.is_empty()).count();
        let are_words = 2 * filled >= count && !fields.iter().any(|field| is_number(field));
        are_words.then_some(fields)
    }

    pub fn field(&self, column: usize) -> Option<&str> {
        self.fields.as_ref().ok()?.get(column).map(String::as_str)
    }

    pub fn malformed(&self) -> Option<Stop> {
        let what = *self.fields.as_ref().err()?;
        Some(Stop::Malformed {
            line: self.number,
            what,
        })
    }
}

/// The parsed first lines of a text file.
pub struct Looks(pub Vec<Look>);

impl Looks {
    pub fn of<'a>(lines: impl Iterator<Item = &'a Line>) -> Self {
        Self(lines.map(Look::of).collect())
    }

    /// The samples of a labelled stream, and the other lines.
    pub fn of_stream<'a>(
        lines: impl Iterator<Item = &'a Line>,
        labelled: &Labelled,
        stream: &Stream,
    ) -> Self {
        let mut sample = Sample::default();
        let looks = lines.filter_map(|line| {
            let mut text = line.text.clone();
            match sample.add(labelled, stream, &mut text) {
                Added::Complete => {
                    let text = text_of(&text);
                    Some(Look {
                        number: line.number,
                        is_comment: false,
                        delimiter: Delimiter::Byte(SEPARATOR),
                        fields: Delimiter::Byte(SEPARATOR).fields(&text),
                        text,
                    })
                }
                Added::Part | Added::Other => None,
                Added::Nothing => Some(Look::of(line)),
            }
        });
        Self(looks.collect())
    }
}

/// The layout that most rows have.
pub struct Layout {
    pub delimiter: Delimiter,
    /// Whether a column holds numbers.
    pub numbers: Vec<bool>,
}

impl Layout {
    /// The layout is taken from the last rows, because names may be among the first; a last column that is always empty
    /// must have a name.
    pub fn of(rows: &[&Look], all: &[Look]) -> Option<Self> {
        let rows = &rows[rows.len() - ROWS.min(rows.len().div_ceil(2))..];
        // The separator is common to the rows and separates numbers; a note may contain other separators.
        let mut shapes = BTreeMap::<_, (usize, usize)>::new();
        let own = rows.iter().map(|row| row.delimiter);
        let delimiters = own.chain([b',', b';', b'\t'].map(Delimiter::Byte));
        let delimiters: BTreeSet<Delimiter> = delimiters.collect();
        let pairs = delimiters.into_iter();
        for (delimiter, row) in pairs.flat_map(|of| rows.iter().map(move |row| (of, row))) {
            if let Ok(fields) = delimiter.fields(&row.text) {
                let (rows, numbers) = shapes.entry((delimiter, fields.len())).or_default();
                *rows += 1;
                *numbers += fields.iter().filter(|field| is_number(field)).count();
            }
        }
        let most = shapes
            .into_iter()
            .max_by_key(|((delimiter, columns), (rows, numbers))| {
                // Blanks may stand within a field, as in a date.
                let is_byte = *delimiter != Delimiter::Blanks;
                (*columns > 1, *rows, *numbers, is_byte)
            });
        let ((delimiter, mut columns), _) = most?;
        let rows = rows.iter().filter_map(|row| row.fields(delimiter, columns));
        let rows: Vec<Vec<String>> = rows.collect();
        let ends_empty = |fields: &Vec<String>| fields.last().is_some_and(String::is_empty);
        let mut names = all.iter().filter_map(|look| look.words(delimiter, columns));
        if columns > 1 && rows.iter().all(ends_empty) && names.all(|names| ends_empty(&names)) {
            columns -= 1;
        }
        let are_numbers = |column: usize| {
            let filled = rows
                .iter()
                .map(|row| &row[column])
                .filter(|field| !field.is_empty());
            let numbers = filled.clone().filter(|field| is_number(field)).count();
            numbers > 0 && 2 * numbers >= filled.count()
        };
        let numbers = (0..columns).map(are_numbers).collect();
        Some(Self { delimiter, numbers })
    }

    /// The fields of a line with numbers in the same columns as rows, and the same number of columns.
    pub fn row(&self, look: &Look) -> Option<Vec<String>> {
        let fields = look
            .fields(self.delimiter, self.numbers.len())
            .filter(|_| !look.is_comment)?;
        let mut numbers = fields
            .iter()
            .zip(&self.numbers)
            .filter(|(field, is_number)| **is_number && !field.is_empty());
        let has_some = numbers.clone().next().is_some();
        (has_some && numbers.all(|(field, _)| is_number(field))).then_some(fields)
    }
}

/// A text in UTF-8, otherwise in Latin 1 (the first 256 characters of Unicode).
fn text_of(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&byte| char::from(byte)).collect(),
    }
}
