//! Fields of a TOML file, each of which knows its line and column.

use std::ops::Range;
use std::path::Path;

use nalgebra::Vector3;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{FileError, Place, list, suggestion};

/// The text that spans refer to.
#[derive(Clone, Copy)]
pub(super) struct Document<'a> {
    pub file: &'a Path,
    pub text: &'a str,
}

impl<'a> Document<'a> {
    /// Parses the text; the table stays with the caller, for fields borrow from it.
    pub fn parse(self) -> Result<Spanned<DeTable<'a>>, FileError> {
        DeTable::parse(self.text).map_err(|error| {
            self.error(
                error.span(),
                format_args!("TOML that cannot be read ({})", error.message()),
                "a TOML document",
                "Correct this line.",
            )
        })
    }

    fn error(
        self,
        span: Option<Range<usize>>,
        found: impl std::fmt::Display,
        expected: impl std::fmt::Display,
        advice: impl std::fmt::Display,
    ) -> FileError {
        let place = match span.and_then(|span| self.text.get(..span.start)) {
            Some(before) => Place::Character {
                line: 1 + before.matches('\n').count() as u64,
                column: 1 + before.chars().rev().take_while(|&c| c != '\n').count() as u64,
            },
            None => Place::File,
        };
        FileError::new(self.file, place, found, expected, advice)
    }
}

/// A table whose field names are all known.
pub(super) struct Fields<'a> {
    document: Document<'a>,
    name: String,
    span: Option<Range<usize>>,
    entries: &'a DeTable<'a>,
}

impl<'a> Fields<'a> {
    /// The whole document.
    pub fn top(
        document: Document<'a>,
        table: &'a Spanned<DeTable<'a>>,
        known: &[&str],
    ) -> Result<Self, FileError> {
        Self::of(document, table).with_only(known)
    }

    /// The same where names are not checked here.
    pub fn of(document: Document<'a>, table: &'a Spanned<DeTable<'a>>) -> Self {
        Self {
            document,
            name: String::new(),
            span: None,
            entries: table.get_ref(),
        }
    }

    /// Refuses a field that is not among the known ones.
    fn with_only(self, known: &[&str]) -> Result<Self, FileError> {
        for key in self.entries.keys() {
            let name: &str = key.get_ref();
            if !known.contains(&name) {
                return Err(self.document.error(
                    Some(key.span()),
                    format_args!("the unknown field `{name}`{}", self.place()),
                    format_args!("one of {}", list(known.iter().copied())),
                    suggestion(name, known.iter().copied(), "Remove or rename it."),
                ));
            }
        }
        Ok(self)
    }

    fn place(&self) -> String {
        if self.name.is_empty() {
            String::new()
        } else {
            format!(" in [{}]", self.name)
        }
    }

    fn full_name(&self, name: &str) -> String {
        if self.name.is_empty() {
            name.to_owned()
        } else {
            format!("{}.{name}", self.name)
        }
    }

    /// A field, if it is there.
    pub fn get(&self, name: &str) -> Option<Field<'a>> {
        self.entries.get(name).map(|value| Field {
            document: self.document,
            name: self.full_name(name),
            value,
        })
    }

    /// A field that must be there; `meaning` says what it holds.
    pub fn need(&self, name: &str, meaning: &str) -> Result<Field<'a>, FileError> {
        self.get(name).ok_or_else(|| self.missing(name, meaning))
    }

    /// The error of a missing field.
    pub fn missing(&self, name: &str, meaning: &str) -> FileError {
        self.document.error(
            self.span.clone(),
            format_args!("no `{name}`{}", self.place()),
            meaning,
            format_args!("Add `{name}`."),
        )
    }

    /// A table below this one, if it is there.
    pub fn table(&self, name: &str, known: &[&str]) -> Result<Option<Self>, FileError> {
        self.open_table(name)?
            .map(|table| table.with_only(known))
            .transpose()
    }

    /// A table below this one whose names are not checked here.
    pub fn open_table(&self, name: &str) -> Result<Option<Self>, FileError> {
        let Some(field) = self.get(name) else {
            return Ok(None);
        };
        let entries = field
            .value
            .get_ref()
            .as_table()
            .ok_or_else(|| field.wrong_kind("a table"))?;
        Ok(Some(Self {
            document: self.document,
            name: field.name,
            span: Some(field.value.span()),
            entries,
        }))
    }

    /// A table below this one that must be there.
    pub fn need_table(&self, name: &str, known: &[&str], meaning: &str) -> Result<Self, FileError> {
        self.table(name, known)?.ok_or_else(|| {
            let full = self.full_name(name);
            self.document.error(
                self.span.clone(),
                format_args!("no [{full}]"),
                meaning,
                format_args!("Add [{full}] with {}.", list(known.iter().copied())),
            )
        })
    }

    /// An array of tables that must be there and not be empty.
    pub fn need_tables(
        &self,
        name: &str,
        known: &[&str],
        meaning: &str,
    ) -> Result<Vec<Self>, FileError> {
        let field = self.need(name, meaning)?;
        let of = |value: &'a Spanned<DeValue<'a>>| match value.get_ref() {
            DeValue::Table(entries) => Some(Self {
                document: self.document,
                name: self.full_name(name),
                span: Some(value.span()),
                entries,
            }),
            _ => None,
        };
        let tables = match field.value.get_ref() {
            DeValue::Array(values) => values.iter().map(of).collect::<Option<Vec<_>>>(),
            _ => None,
        };
        let tables = tables.filter(|tables| !tables.is_empty());
        let tables = tables.ok_or_else(|| field.wrong_kind(meaning))?;
        tables
            .into_iter()
            .map(|table| table.with_only(known))
            .collect()
    }

    /// The names of all fields here, each with its value.
    pub fn all(&self) -> impl Iterator<Item = (&'a str, Field<'a>)> + '_ {
        self.entries.iter().map(|(key, value)| {
            let name: &str = key.get_ref();
            let field = Field {
                document: self.document,
                name: self.full_name(name),
                value,
            };
            (name, field)
        })
    }
}

/// A value in a TOML file.
pub(super) struct Field<'a> {
    document: Document<'a>,
    name: String,
    value: &'a Spanned<DeValue<'a>>,
}

impl<'a> Field<'a> {
    /// An error at this value.
    pub fn error(
        &self,
        expected: impl std::fmt::Display,
        advice: impl std::fmt::Display,
    ) -> FileError {
        self.document.error(
            Some(self.value.span()),
            format_args!("{} = {}", self.name, self.source()),
            expected,
            advice,
        )
    }

    fn wrong_kind(&self, expected: &str) -> FileError {
        self.error(expected, "Correct this value.")
    }

    /// The value as it stands in the file, its first line.
    fn source(&self) -> &'a str {
        self.document
            .text
            .get(self.value.span())
            .and_then(|text| text.lines().next())
            .unwrap_or("a value")
    }

    /// Whether it is a table with this field.
    pub fn has(&self, name: &str) -> bool {
        let table = self.value.get_ref().as_table();
        table.is_some_and(|table| table.get(name).is_some())
    }

    /// Whether it is a table with fields of its own.
    pub fn is_table(&self) -> bool {
        self.value.get_ref().is_table()
    }

    /// A finite number.
    pub fn number(&self) -> Result<f64, FileError> {
        self.number_at(self.value)
    }

    fn number_at(&self, value: &Spanned<DeValue<'_>>) -> Result<f64, FileError> {
        let number = match value.get_ref() {
            DeValue::Float(float) => float.as_str().parse().ok(),
            DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix())
                .ok()
                .map(|whole| whole as f64),
            _ => None,
        };
        let number = number
            .filter(|number: &f64| number.is_finite())
            .ok_or_else(|| self.wrong_kind("a finite number"))?;
        // Squares and quotients of such numbers are still numbers.
        let has_size = number == 0.0 || (1e-30..=1e30).contains(&number.abs());
        match has_size {
            true => Ok(number),
            false => Err(self.wrong_kind("a number whose magnitude is from 1e-30 to 1e30")),
        }
    }

    /// A number above zero.
    pub fn positive(&self) -> Result<f64, FileError> {
        let number = self.number()?;
        if number > 0.0 {
            Ok(number)
        } else {
            Err(self.wrong_kind("a number above zero"))
        }
    }

    /// A number above zero that no larger one can be.
    pub fn positive_to(&self, most: f64) -> Result<f64, FileError> {
        let number = self.positive()?;
        if number <= most {
            Ok(number)
        } else {
            Err(self.wrong_kind(&format!("a number above zero, at most {most}")))
        }
    }

    /// A number that is zero or above.
    pub fn not_negative(&self) -> Result<f64, FileError> {
        let number = self.number()?;
        if number >= 0.0 {
            Ok(number)
        } else {
            Err(self.wrong_kind("zero or a number above it"))
        }
    }

    /// A number within limits, both of them allowed.
    pub fn within(&self, low: f64, high: f64) -> Result<f64, FileError> {
        let number = self.number()?;
        if (low..=high).contains(&number) {
            Ok(number)
        } else {
            Err(self.wrong_kind(&format!("a number from {low} to {high}")))
        }
    }

    /// Three numbers, or one that stands for all three axes.
    pub fn triple(&self) -> Result<Vector3<f64>, FileError> {
        match self.value.get_ref() {
            DeValue::Array(array) if array.len() == 3 => {
                let mut triple = Vector3::zeros();
                for (entry, value) in triple.iter_mut().zip(array.iter()) {
                    *entry = self.number_at(value)?;
                }
                Ok(triple)
            }
            DeValue::Array(_) => Err(self.wrong_kind("three numbers, or one for all axes")),
            _ => self.number().map(Vector3::repeat),
        }
    }

    /// Three numbers above zero that no larger ones can be, or one.
    pub fn positive_triple_to(&self, most: f64) -> Result<Vector3<f64>, FileError> {
        let triple = self.triple()?;
        if triple.iter().any(|&number| number <= 0.0) {
            Err(self.wrong_kind("numbers above zero"))
        } else if triple.iter().any(|&number| number > most) {
            Err(self.wrong_kind(&format!("numbers above zero, at most {most}")))
        } else {
            Ok(triple)
        }
    }

    /// A text.
    pub fn text(&self) -> Result<&'a str, FileError> {
        self.value
            .get_ref()
            .as_str()
            .ok_or_else(|| self.wrong_kind("a text in quotes"))
    }

    /// A list of texts.
    pub fn texts(&self) -> Result<Vec<&'a str>, FileError> {
        self.value
            .get_ref()
            .as_array()
            .and_then(|array| array.iter().map(|value| value.get_ref().as_str()).collect())
            .ok_or_else(|| self.wrong_kind("a list of texts in quotes"))
    }

    /// Lists of texts in a list; none if it is anything else.
    #[cfg(feature = "certificate")]
    pub fn rows_of_texts(&self) -> Option<Vec<Vec<&'a str>>> {
        let rows = self.value.get_ref().as_array()?.iter();
        let row = |row: &'a Spanned<DeValue<'a>>| -> Option<Vec<&'a str>> {
            let texts = row.get_ref().as_array()?.iter();
            texts.map(|text| text.get_ref().as_str()).collect()
        };
        rows.map(row).collect()
    }

    /// Three texts.
    pub fn three_texts(&self) -> Result<[&'a str; 3], FileError> {
        self.texts()?
            .try_into()
            .map_err(|_| self.wrong_kind("three texts in quotes"))
    }

    /// True or false.
    pub fn flag(&self) -> Result<bool, FileError> {
        self.value
            .get_ref()
            .as_bool()
            .ok_or_else(|| self.wrong_kind("true or false"))
    }

    /// One of a few words.
    pub fn choice<T: Copy>(&self, choices: &[(&str, T)]) -> Result<T, FileError> {
        let word = self.text()?;
        let words = choices.iter().map(|&(word, _)| word);
        match choices.iter().find(|(choice, _)| *choice == word) {
            Some(&(_, meaning)) => Ok(meaning),
            None => Err(self.error(
                format_args!("one of {}", list(words.clone())),
                suggestion(word, words, "Choose one of them."),
            )),
        }
    }

    /// A text, or a number or date as it is written.
    pub fn as_written(&self) -> Result<String, FileError> {
        match self.value.get_ref() {
            DeValue::Array(_) | DeValue::Table(_) => {
                Err(self.wrong_kind("a text, a number or a date"))
            }
            DeValue::String(text) => Ok(text.clone().into_owned()),
            _ => Ok(self.source().to_owned()),
        }
    }
}
