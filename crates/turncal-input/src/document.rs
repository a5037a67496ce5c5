//! A TOML document whose errors give line, column, field, content found and remedy.

use std::fmt::Display;
use std::ops::Range;
use std::path::Path;

use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use crate::error::{FileError, Place, list, suggestion};

/// Meanings of required fields.
const MEANINGS: [(&str, &str); 19] = [
    ("accel", "the names of three columns or of one"),
    ("accel_unit", "the unit of the values"),
    ("column", "the column that identifies the instrument"),
    ("columns", "the column names"),
    ("file", "a file name"),
    ("format", "the format name of this file"),
    ("gyro", "the names of three columns or of one"),
    ("gyro_unit", "the unit of the values"),
    (
        "imu",
        "a table that describes the log file of the instrument",
    ),
    (
        "number",
        "the value in that column for the instrument to use",
    ),
    ("output", "the quantity in a row: pulse, increment or rate"),
    ("position_sigma_arcsec", "a 1σ value in arcseconds"),
    ("reading_sigma_arcsec", "a 1σ value in arcseconds"),
    (
        "recording",
        "one [[recording]] per run, with run = \"the path of its run.toml\"",
    ),
    ("run", "the path of a run.toml"),
    ("sigma", "the 1σ of each parameter of the error term"),
    ("time", "a column name"),
    (
        "time_stamp",
        "the part of a sample that its time stamp marks",
    ),
    ("uncertainty", "the expanded uncertainty, k = 2"),
];
/// Expectations of serde, in words for users.
const KINDS: [(&str, &str); 4] = [
    ("f64", "a finite number"),
    ("a string", "text in quotes"),
    ("a boolean", "true or false"),
    ("a map", "a table"),
];

/// The text to which spans refer.
#[derive(Clone, Copy)]
pub struct Document<'a> {
    /// The file name used in errors.
    pub file: &'a Path,
    /// Text.
    pub text: &'a str,
}

impl<'a> Document<'a> {
    /// The document of a file with this text.
    pub fn of(file: &'a Path, text: &'a str) -> Self {
        Self { file, text }
    }

    /// The fields of a document of this format, without the format field.
    pub fn of_format(self, format: &str) -> Result<Spanned<DeTable<'a>>, FileError> {
        let mut table = self.parse()?;
        match table.get_mut().remove("format") {
            Some(said) if said.get_ref().as_str() == Some(format) => Ok(table),
            Some(_) => Err(self.wrong("format", format_args!("`{format}`"), "Set this format.")),
            None => Err(self.missing("format", "")),
        }
    }

    /// All fields.
    pub fn parse(self) -> Result<Spanned<DeTable<'a>>, FileError> {
        DeTable::parse(self.text).map_err(|error| {
            let found = format_args!("invalid TOML ({})", error.message());
            self.error(error.span(), found, "a TOML document", "Correct this line.")
        })
    }

    /// The fields of a document, converted to a type.
    pub fn fill<T: Deserialize<'a>>(self, table: Spanned<DeTable<'a>>) -> Result<T, FileError> {
        T::deserialize(Deserializer::from(table)).map_err(|error| self.refused(&error))
    }

    /// A number or a date (also in tables) as written in the file.
    pub fn as_written(self, value: &mut Spanned<DeValue<'a>>) {
        let span = value.span();
        match value.get_mut() {
            DeValue::Table(table) => {
                let values = table.iter_mut();
                values.for_each(|(_, value)| self.as_written(value));
            }
            DeValue::Array(_) | DeValue::String(_) => (),
            other => *other = DeValue::String(self.written(span).into()),
        }
    }

    /// The text of a value in the file, first line only.
    pub fn written(self, span: Range<usize>) -> &'a str {
        let text = self.text.get(span).and_then(|text| text.lines().next());
        text.unwrap_or("a value")
    }

    /// The text of a field, `table.name`.
    pub fn written_at(self, path: &str) -> &'a str {
        let span = self.span_of(path);
        span.map_or("nothing", |span| self.written(span))
    }

    /// The error for an existing field, `table.name`.
    pub fn wrong(self, path: &str, expected: impl Display, advice: impl Display) -> FileError {
        let found = format_args!("{path} = {}", self.written_at(path));
        self.error(self.span_of(path), found, expected, advice)
    }

    /// The error for a missing field, `table.name`; `meaning` describes its content.
    pub fn missing(self, path: &str, meaning: &str) -> FileError {
        let (table, name) = path.rsplit_once('.').unwrap_or(("", path));
        let tables = std::iter::successors(Some(table), |of| Some(of.rsplit_once('.')?.0));
        let span = tables.into_iter().find_map(|table| self.span_of(table));
        self.no_field(span, table, name, meaning)
    }

    /// Refuses field names in a table, `table.table`, that are not among the known names.
    pub fn only(
        self,
        path: &str,
        names: impl IntoIterator<Item: AsRef<str>>,
        known: &[impl AsRef<str>],
    ) -> Result<(), FileError> {
        let known: Vec<&str> = known.iter().map(AsRef::as_ref).collect();
        let mut names = names.into_iter();
        match names.find(|name| !known.contains(&name.as_ref())) {
            Some(name) => {
                let name = name.as_ref();
                let span = self.span_of(&format!("{path}.{name}"));
                Err(self.unknown(span, path, name, &known))
            }
            None => Ok(()),
        }
    }

    fn unknown(
        self,
        span: Option<Range<usize>>,
        table: &str,
        name: &str,
        known: &[&str],
    ) -> FileError {
        let known = || known.iter().copied();
        self.error(
            span,
            format_args!("the unknown field `{name}`{}", within(table)),
            format_args!("one of {}", list(known())),
            suggestion(name, known(), "Remove or rename it."),
        )
    }

    fn no_field(
        self,
        span: Option<Range<usize>>,
        table: &str,
        name: &str,
        meaning: &str,
    ) -> FileError {
        let known = MEANINGS.iter().find(|(known, _)| *known == name);
        let meaning = match (meaning, known) {
            ("", Some((_, known))) => known,
            ("", None) => "a value",
            _ => meaning,
        };
        if meaning.starts_with("a table") {
            let found = format_args!("no [{name}]{}", within(table));
            return self.error(span, found, meaning, format_args!("Add [{name}]."));
        }
        let found = format_args!("no `{name}`{}", within(table));
        self.error(span, found, meaning, format_args!("Add `{name}`."))
    }

    fn span_of(self, path: &str) -> Option<Range<usize>> {
        let table = self.parse().ok()?;
        let mut names = path.split('.');
        let mut value: &Spanned<DeValue> = table.get_ref().get(names.next()?)?;
        for name in names {
            value = value.get_ref().as_table()?.get(name)?;
        }
        Some(value.span())
    }

    /// Converts an error of serde.
    fn refused(self, error: &toml::de::Error) -> FileError {
        let (message, span) = (error.message(), error.span());
        let told = error.to_string();
        let keys = told.rsplit_once("\nin `").map_or("", |(_, keys)| keys);
        let path = keys.trim_end().trim_end_matches('`');
        let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
        if let ("missing field ", [name]) = (message.split('`').next().unwrap_or(""), &quoted[..]) {
            return self.no_field(span, path, name, "");
        }
        if let (true, [name, known @ ..]) = (message.starts_with("unknown field"), &quoted[..]) {
            return self.unknown(span, path, name, known);
        }
        let source = span.clone().map_or("a value", |span| self.written(span));
        let found = format_args!("{path} = {source}");
        if let (true, [name, known @ ..]) = (message.starts_with("unknown variant"), &quoted[..]) {
            let known = || known.iter().copied();
            let expected = format_args!("one of {}", list(known()));
            let advice = suggestion(name, known(), "Choose one of them.");
            return self.error(span, found, expected, advice);
        }
        let expected = message.rsplit_once("expected ").map_or(message, |of| of.1);
        let in_words = KINDS.iter().find(|(kind, _)| *kind == expected);
        let expected = match in_words {
            Some((_, words)) => words,
            None if expected.starts_with("struct ") => "a table",
            None => expected,
        };
        self.error(span, found, expected, "Correct this value.")
    }

    fn error(
        self,
        span: Option<Range<usize>>,
        found: impl Display,
        expected: impl Display,
        advice: impl Display,
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

fn within(table: &str) -> String {
    match table {
        "" => String::new(),
        _ => format!(" in [{table}]"),
    }
}
