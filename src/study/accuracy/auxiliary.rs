//! Figures of error terms of instrument and table, term by term.

use super::figures::rms;
use super::trial::{Filtered, Trial};
use crate::calibration::ErrorTerm;
use crate::calibration::{AUXILIARY, AuxiliaryKind, AuxiliaryVector};
use crate::study::Ratio;

/// Figures of one error term, RMS over its parameters and all runs, in rad or SI.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorTermAccuracy {
    /// The error term.
    pub term: ErrorTerm,
    /// RMS error of the filter.
    pub filter: f64,
    /// RMS of the σ that the filter claims.
    pub claimed: f64,
    /// RMS of the Bayesian Cramér–Rao bound.
    pub bound: f64,
    /// Filter over bound.
    pub ratio: Option<Ratio>,
}

/// Of each term that has a bound in any run and that the filter estimated.
pub(super) fn figures(trials: &[Trial]) -> Vec<ErrorTermAccuracy> {
    let terms = ErrorTerm::ALL.into_iter();
    terms.filter_map(|term| of_term(term, trials)).collect()
}

fn of_term(term: ErrorTerm, trials: &[Trial]) -> Option<ErrorTermAccuracy> {
    let has_sigma = |k: usize| trials.iter().any(|trial| trial.auxiliary_bound[k] > 0.0);
    let indices: Vec<usize> = (0..AUXILIARY)
        .filter(|&k| AuxiliaryKind::of(k).is_some_and(|kind| kind.error_term() == term))
        .filter(|&k| has_sigma(k))
        .collect();
    let square = |of: &AuxiliaryVector| {
        let sum: f64 = indices.iter().map(|&k| of[k].powi(2)).sum();
        sum / indices.len() as f64
    };
    let estimated = |f: &&Filtered| square(&f.auxiliary_sigma) > 0.0;
    let both = trials.iter().filter_map(|trial| {
        let filtered = trial.filtered.as_ref().filter(estimated)?;
        Some((filtered, square(&trial.auxiliary_bound)))
    });
    let (filtered, bound): (Vec<&Filtered>, Vec<f64>) = both.unzip();
    let of = |of: fn(&Filtered) -> &AuxiliaryVector| -> Vec<f64> {
        filtered.iter().map(|f| square(of(f))).collect()
    };
    let error = of(|f| &f.auxiliary_error);
    (!indices.is_empty() && !filtered.is_empty()).then(|| ErrorTermAccuracy {
        term,
        filter: rms(&error),
        claimed: rms(&of(|f| &f.auxiliary_sigma)),
        bound: rms(&bound),
        ratio: Ratio::of(&error, &bound),
    })
}
