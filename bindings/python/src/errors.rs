//! Errors of the library as exceptions.

use std::fmt::Display;
use std::ops::RangeInclusive;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use turncal::calibration::{ErrorTerm, NoisePolicy};
use turncal::models::ModelError;
use turncal_input::{FileError, Place};

pyo3::create_exception!(
    turncal,
    Error,
    PyValueError,
    "An input that turncal cannot use: what was found, what was expected and what to do.\n\nAttributes `file`, `line` \
     and `column` give the place in a file, `row` and `column` that in a table; each is None if it does not apply."
);

/// Attributes of [`Error`], which are None if they do not apply.
pub const ATTRIBUTES: [&str; 4] = ["file", "line", "row", "column"];

/// An error without a place in a file.
pub fn raised(error: impl Display) -> PyErr {
    Error::new_err(error.to_string())
}

/// A text that names options of the command, with the arguments of Python in their place: `--noise stated` is
/// `noise="stated"`. Commands in backticks stay.
pub fn in_python(text: &str) -> String {
    let mut parts = text.split("--");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |before, part| {
        let begins = before.is_empty() || before.ends_with([' ', '\n', '(', '>']);
        let is_command = before.matches('`').count() % 2 == 1;
        let end = part.find(|letter: char| !letter.is_ascii_lowercase() && letter != '-');
        let (name, rest) = part.split_at(end.unwrap_or(part.len()));
        match name {
            "" => before + "--" + part,
            _ if !begins || is_command => before + "--" + part,
            "with" => before + "with_=" + &value_first(rest),
            name => before + &name.replace('-', "_") + "=" + &value_first(rest),
        }
    })
}

/// The text after an option, with its value, if it begins with one, as Python writes it.
fn value_first(text: &str) -> String {
    let Some(of) = text.strip_prefix(' ') else {
        return text.to_owned();
    };
    let terms = ErrorTerm::ALL.map(ErrorTerm::name);
    let policies = NoisePolicy::ALL.map(NoisePolicy::name);
    let known = terms.into_iter().chain(policies).chain([
        "ekf",
        "six-position",
        "table",
        "velocity",
        "none",
    ]);
    let end = of.find(|letter: char| !letter.is_ascii_alphanumeric() && letter != '-');
    let (word, rest) = of.split_at(end.unwrap_or(of.len()));
    match known.into_iter().any(|known| known == word) {
        true => format!("\"{word}\"{rest}"),
        false if of.starts_with('\'') => of.to_owned(),
        false => text.to_owned(),
    }
}

/// An error of the library, with its place in a file or a table.
pub fn raise<E: std::error::Error + 'static>(error: E) -> PyErr {
    let mut text = error.to_string();
    let mut file = None;
    let mut cause: Option<&(dyn std::error::Error + 'static)> = Some(&error);
    while let Some(of) = cause {
        file = file.or_else(|| file_error(of));
        cause = of.source();
        let further = cause.map(ToString::to_string);
        if let Some(further) = further.filter(|further| !text.contains(further)) {
            text = format!("{text}: {further}");
        }
    }
    let name = file.map(|file| file.file.display().to_string());
    let name = name.filter(|name| !name.is_empty());
    // The name of a file stays.
    let text = match &name {
        Some(name) => text
            .split(&**name)
            .map(in_python)
            .collect::<Vec<_>>()
            .join(name),
        None => in_python(&text),
    };
    let raised = Error::new_err(text);
    if let Some(file) = file {
        // An exception takes any attribute, so that none of these fails.
        let _ = Python::attach(|py| put_place(raised.value(py), file));
    }
    raised
}

fn file_error<'a>(error: &'a (dyn std::error::Error + 'static)) -> Option<&'a FileError> {
    let of_model = || match error.downcast_ref()? {
        ModelError::File(file) => Some(file),
        ModelError::Unknown { .. } => None,
    };
    error.downcast_ref().or_else(of_model)
}

fn put_place(raised: &Bound<PyAny>, error: &FileError) -> PyResult<()> {
    raised.setattr("file", error.file.clone())?;
    match &error.place {
        Place::Line(line) | Place::Character { line, .. } => raised.setattr("line", line),
        Place::Column { line, column } => {
            raised.setattr("line", line)?;
            raised.setattr("column", column)
        }
        Place::Row { row, column } => {
            raised.setattr("row", row)?;
            raised.setattr("column", column)
        }
        Place::File | Place::Byte(_) | Place::Sample { .. } => Ok(()),
    }
}

/// An argument outside its range.
pub fn wrong(name: &str, found: impl Display, expected: &str) -> PyErr {
    raised(format!("{name}: found {found}, expected {expected}"))
}

/// A number of a range, if one is given.
pub fn within(name: &str, value: Given, range: RangeInclusive<f64>) -> PyResult<Option<f64>> {
    let expected = format!("a number from {} to {}", range.start(), range.end());
    number(name, value, &expected, |value| range.contains(&value))
}

/// A finite number above zero, if one is given.
pub fn positive(name: &str, value: Given) -> PyResult<Option<f64>> {
    let expected = "a finite number above zero";
    number(name, value, expected, |value| {
        value > 0.0 && value.is_finite()
    })
}

/// An argument, if it is given.
pub type Given<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

fn number(
    name: &str,
    value: Given,
    expected: &str,
    is_expected: impl Fn(f64) -> bool,
) -> PyResult<Option<f64>> {
    let Some(value) = value else {
        return Ok(None);
    };
    match value.extract() {
        Ok(number) if is_expected(number) => Ok(Some(number)),
        _ => Err(wrong(name, value.repr()?, expected)),
    }
}

/// A name, or a sequence of names.
pub fn names(argument: &str, value: Given) -> PyResult<Vec<String>> {
    let Some(value) = value else {
        return Ok(Vec::new());
    };
    let one = value.extract().map(|name| vec![name]);
    let expected = "a name or a sequence of names";
    one.or_else(|_| value.extract())
        .or_else(|_: PyErr| Err(wrong(argument, value.repr()?, expected)))
}

/// The value with a name.
pub fn named<T: Copy>(argument: &str, name: &str, all: &[(&str, T)]) -> PyResult<T> {
    let found = all.iter().find(|(known, _)| *known == name);
    found.map(|(_, value)| *value).ok_or_else(|| {
        let names: Vec<&str> = all.iter().map(|(name, _)| *name).collect();
        wrong(
            argument,
            format_args!("{name:?}"),
            &format!("one of {}", names.join(", ")),
        )
    })
}
