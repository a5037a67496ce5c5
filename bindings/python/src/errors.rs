//! Errors of the library as exceptions.

use std::fmt::Display;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use turncal::formats::{FileError, Place};

pyo3::create_exception!(
    turncal,
    Error,
    PyValueError,
    "An input that turncal cannot use: what was found, what was expected and what to do.\n\nAttributes `file`, `line` \
     and `column` give the place in a file, `row` and `column` that in a table; each is None if it does not apply."
);

/// An error without a place in a file.
pub fn raised(error: impl Display) -> PyErr {
    Error::new_err(error.to_string())
}

/// An error of the library; the place is taken from the [`FileError`] that it is or contains.
pub fn raise<E: std::error::Error + 'static>(error: E) -> PyErr {
    let mut text = error.to_string();
    let mut place = None;
    let mut cause: Option<&(dyn std::error::Error + 'static)> = Some(&error);
    while let Some(of) = cause {
        place = place.or(of.downcast_ref::<FileError>());
        cause = of.source();
        text = match &cause {
            Some(of) if !text.contains(&of.to_string()) => format!("{text}: {of}"),
            _ => text,
        };
    }
    let raised = Error::new_err(text);
    Python::attach(|py| {
        let value = raised.value(py);
        let (mut line, mut row, mut column) = (None, None, None);
        match place.map(|of| &of.place) {
            Some(Place::Line(of)) => line = Some(*of),
            Some(Place::Character { line: of, .. }) => line = Some(*of),
            Some(Place::Column {
                line: of,
                column: name,
            }) => {
                (line, column) = (Some(*of), Some(name.clone()));
            }
            Some(Place::Row {
                row: of,
                column: name,
            }) => (row, column) = (Some(*of), name.clone()),
            _ => {}
        }
        // An exception takes any attribute.
        let _ = value.setattr("file", place.map(|of| of.file.clone()));
        let _ = value.setattr("line", line);
        let _ = value.setattr("row", row);
        let _ = value.setattr("column", column);
    });
    raised
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
