//! Values of `--with`: auto, none, or error terms.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::error::ErrorKind;
use serde::Serializer;

use super::error_term::{listed, named};
use turncal::calibration::ErrorTerm;

/// A value of `--with`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum With {
    /// Every error term, averaged over being absent and having its usual sizes.
    Auto,
    /// K, E and D alone.
    None,
    /// This term, estimated regardless of the data.
    Term(ErrorTerm),
}

impl With {
    fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::None => "none",
            Self::Term(term) => term.name(),
        }
    }

    fn term(self) -> Option<ErrorTerm> {
        match self {
            Self::Term(term) => Some(term),
            Self::Auto | Self::None => None,
        }
    }

    /// The terms that were given by name.
    pub fn terms(all: &[Self]) -> impl Iterator<Item = ErrorTerm> {
        all.iter().filter_map(|of| of.term())
    }

    /// Whether the result is averaged over all terms (the default).
    pub fn is_auto(all: &[Self]) -> bool {
        all.iter().all(|of| *of == Self::Auto)
    }

    /// Exits with the wrong-usage status if auto or none is combined with another value.
    pub fn check(all: &[Self]) {
        let Some(&alone) = all.iter().find(|of| of.term().is_none()) else {
            return;
        };
        let others = all.iter().filter(|of| **of != alone);
        let others: Vec<&str> = others.map(|of| of.name()).collect();
        if others.is_empty() {
            return;
        }
        let (alone, others) = (alone.name(), others.join(","));
        let message = format!(
            "--with {alone} and --with {others} exclude each other; write --with {alone} alone, or --with {others} \
             without {alone}\n"
        );
        clap::Error::raw(ErrorKind::ArgumentConflict, message).exit();
    }

    /// Writes the names of the values. For `auto`, the list is empty, as without `--with`, because both describe the
    /// same job.
    pub fn names<S: Serializer>(all: &[Self], serializer: S) -> Result<S::Ok, S::Error> {
        let stated = all.iter().filter(|of| **of != Self::Auto);
        serializer.collect_seq(stated.map(|of| of.name()))
    }
}

/// Parses a value of `--with`.
pub fn with_value() -> impl TypedValueParser<Value = With> {
    let words = [
        PossibleValue::new("auto")
            .help("Every error term, averaged over being absent and having its usual sizes"),
        PossibleValue::new("none").help("K, E and D alone"),
    ];
    let values = words.into_iter().chain(ErrorTerm::ALL.map(listed));
    PossibleValuesParser::new(values).map(|name| match name.as_str() {
        "auto" => With::Auto,
        "none" => With::None,
        name => With::Term(named(name)),
    })
}
