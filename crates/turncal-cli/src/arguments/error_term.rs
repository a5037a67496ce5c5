//! Error terms as command-line arguments.

use anyhow::bail;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::error::ErrorKind;

use turncal::calibration::{ErrorTerm, Problem};
use turncal::run::Aiding;
use turncal::turntable::AxisError;

/// Parses the name of an error term.
pub fn error_term() -> impl TypedValueParser<Value = ErrorTerm> {
    PossibleValuesParser::new(ErrorTerm::ALL.map(listed)).map(|name| named(&name))
}

/// An error term in a list of possible values.
pub fn listed(term: ErrorTerm) -> PossibleValue {
    let value = PossibleValue::new(term.name()).help(help(term));
    match term {
        ErrorTerm::GaussMarkovBias => value.alias("wandering-bias"),
        _ => value,
    }
}

/// The error term with a listed name; only Gauss–Markov biases have an alias.
pub fn named(name: &str) -> ErrorTerm {
    let mut all = ErrorTerm::ALL.into_iter();
    all.find(|term| term.name() == name)
        .unwrap_or(ErrorTerm::GaussMarkovBias)
}

fn help(term: ErrorTerm) -> &'static str {
    match term {
        ErrorTerm::GaussMarkovBias => "Gauss–Markov biases",
        ErrorTerm::TableBase => "Level and north errors of the table base",
        ErrorTerm::TableAxes(AxisError::Tilt) => "Non-orthogonality of the table axes",
        ErrorTerm::TableAxes(AxisError::Wobble) => {
            "Wobble of the table axes, at once and twice per turn"
        }
        ErrorTerm::TableAxes(AxisError::Encoder) => {
            "Errors of the table encoders, at once and twice per turn"
        }
        ErrorTerm::Instrument(term) => term.entry().help,
    }
}

/// Exits with the status for wrong usage if the term is a table error and the table is not observed.
pub fn needs_table(term: ErrorTerm, aiding: Option<Aiding>) {
    let of_table = matches!(term, ErrorTerm::TableBase | ErrorTerm::TableAxes(_));
    if of_table && aiding == Some(Aiding::Velocity) {
        let message = format!(
            "--aiding velocity does not use the table, so {} has no effect; omit one of the two options\n",
            term.name()
        );
        clap::Error::raw(ErrorKind::ArgumentConflict, message).exit();
    }
}

/// Fails if a run lacks the data that an error term needs.
pub fn supported(term: ErrorTerm, problem: &Problem) -> anyhow::Result<()> {
    if !problem.model.can_have(term) {
        bail!(
            "{}: --with {} needs {}. Omit this term, or add this to the run",
            problem.run().recording.name,
            term.name(),
            match problem.model.aiding {
                Aiding::Table => "the axis angles in the table log, not a quaternion",
                Aiding::Velocity => "the table log",
            }
        );
    }
    Ok(())
}
