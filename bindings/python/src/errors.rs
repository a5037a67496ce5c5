//! Errors of the library as exceptions.

use std::fmt::Display;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use turncal::formats::{FileError, Place};
use turncal::models::ModelError;

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

/// A text that names options of the command, with the arguments of Python in their place.
fn in_python(text: &str) -> String {
    let words = text.split(' ').map(|word| {
        let (open, option) = match word.strip_prefix('(') {
            Some(inside) => ("(", inside),
            None => ("", word),
        };
        match option.strip_prefix("--") {
            Some(name) => format!("{open}{}", name.replace('-', "_")),
            None => word.to_owned(),
        }
    });
    words.collect::<Vec<_>>().join(" ")
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
    let raised = Error::new_err(in_python(&text));
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

/// A number from `low` to `high`, if one is given.
pub fn within(name: &str, value: Option<f64>, [low, high]: [f64; 2]) -> PyResult<Option<f64>> {
    match value {
        Some(value) if !(low..=high).contains(&value) => Err(wrong(
            name,
            value,
            &format!("a number from {low} to {high}"),
        )),
        value => Ok(value),
    }
}

/// A finite number above zero, if one is given.
pub fn positive(name: &str, value: Option<f64>) -> PyResult<Option<f64>> {
    match value {
        Some(value) if !(value > 0.0 && value.is_finite()) => {
            Err(wrong(name, value, "a finite number above zero"))
        }
        value => Ok(value),
    }
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
