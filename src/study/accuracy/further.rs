//! Figures of the constants beside the parameters, block by block.

use super::figures::rms;
use super::trial::{Filtered, Trial};
use crate::calibration::{AUXILIARY, AuxiliaryKind, AuxiliaryVector};
use crate::calibration::ErrorTerm;
use crate::study::Ratio;

/// Figures of one block of constants, RMS over them and all runs, in rad or SI.
#[derive(Debug, Clone, PartialEq)]
pub struct FurtherAccuracy {
    /// The block.
    pub block: ErrorTerm,
    /// RMS error of the filter.
    pub filter: f64,
    /// RMS of the σ that the filter claims.
    pub claimed: f64,
    /// RMS of the Bayesian Cramér–Rao bound.
    pub bound: f64,
    /// Filter over bound.
    pub ratio: Option<Ratio>,
}

/// Of each block that has a bound in any run and that the filter estimated.
pub(super) fn figures(trials: &[Trial]) -> Vec<FurtherAccuracy> {
    let blocks = ErrorTerm::ALL.into_iter();
    blocks.filter_map(|block| of_block(block, trials)).collect()
}

fn of_block(block: ErrorTerm, trials: &[Trial]) -> Option<FurtherAccuracy> {
    let has_sigma = |k: usize| trials.iter().any(|trial| trial.further_bound[k] > 0.0);
    let indices: Vec<usize> = (0..AUXILIARY)
        .filter(|&k| AuxiliaryKind::of(k).is_some_and(|kind| kind.error_term() == block))
        .filter(|&k| has_sigma(k))
        .collect();
    let square = |of: &AuxiliaryVector| {
        let sum: f64 = indices.iter().map(|&k| of[k].powi(2)).sum();
        sum / indices.len() as f64
    };
    let estimated = |f: &&Filtered| square(&f.term_sigma) > 0.0;
    let both = trials.iter().filter_map(|trial| {
        let filtered = trial.filtered.as_ref().filter(estimated)?;
        Some((filtered, square(&trial.further_bound)))
    });
    let (filtered, bound): (Vec<&Filtered>, Vec<f64>) = both.unzip();
    let of = |of: fn(&Filtered) -> &AuxiliaryVector| -> Vec<f64> {
        filtered.iter().map(|f| square(of(f))).collect()
    };
    let error = of(|f| &f.further_error);
    (!indices.is_empty() && !filtered.is_empty()).then(|| FurtherAccuracy {
        block,
        filter: rms(&error),
        claimed: rms(&of(|f| &f.term_sigma)),
        bound: rms(&bound),
        ratio: Ratio::of(&error, &bound),
    })
}
