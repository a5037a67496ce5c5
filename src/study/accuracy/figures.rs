//! Root mean square errors over the runs, for every method, and their ratios.

use super::trial::{Filtered, Trial};
use crate::calibration::{
    AUXILIARY, AuxiliaryKind, AuxiliaryVector, ErrorTerm, Group, PARAMETERS, ParameterVector,
};
use crate::study::Ratio;

/// Figures of one kind of error over all runs, in SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Figures {
    /// RMS error of the filter.
    pub filter: f64,
    /// RMS of the σ stated by the filter.
    pub claimed: f64,
    /// RMS of the Bayesian Cramér–Rao bound.
    pub bound: f64,
    /// RMS error of the filter divided by the bound.
    pub ratio: Option<Ratio>,
    /// RMS error of the closed form in its own time.
    pub closed_form: Option<f64>,
    /// RMS error of the closed form in its own time, divided by that of the filter.
    pub gain: Option<Ratio>,
    /// RMS error of the closed form in the table time of the filter; `None` if this time is too short.
    pub closed_form_in_equal_time: Option<f64>,
    /// RMS error of the closed form in the table time of the filter, divided by that of the filter.
    pub gain_in_equal_time: Option<Ratio>,
}

/// Mean squares of one run; `None` if a method failed.
#[derive(Default)]
pub struct Squares {
    pub filter: Option<f64>,
    pub claimed: Option<f64>,
    pub bound: f64,
    pub closed_form: Option<f64>,
    pub closed_form_in_equal_time: Option<f64>,
}

impl Figures {
    pub(super) fn new(runs: impl Iterator<Item = Squares>) -> Self {
        let runs: Vec<Squares> = runs.collect();
        let of = |one: &dyn Fn(&Squares) -> Option<f64>| -> Vec<f64> {
            runs.iter().filter_map(one).collect()
        };
        let some = |squares: Vec<f64>| (!squares.is_empty()).then(|| rms(&squares));
        // A ratio uses only runs that have both errors.
        let ratio = |over: &dyn Fn(&Squares) -> Option<f64>,
                     under: &dyn Fn(&Squares) -> Option<f64>| {
            let both = runs.iter().filter_map(|s| over(s).zip(under(s)));
            let (over, under): (Vec<f64>, Vec<f64>) = both.unzip();
            Ratio::of(&over, &under)
        };
        let filter = |s: &Squares| s.filter;
        let bound = |s: &Squares| Some(s.bound);
        let own = |s: &Squares| s.closed_form;
        let equal = |s: &Squares| s.closed_form_in_equal_time;
        Self {
            filter: rms(&of(&filter)),
            claimed: rms(&of(&|s| s.claimed)),
            bound: rms(&of(&bound)),
            ratio: ratio(&filter, &bound),
            closed_form: some(of(&own)),
            gain: ratio(&own, &filter),
            closed_form_in_equal_time: some(of(&equal)),
            gain_in_equal_time: ratio(&equal, &filter),
        }
    }
}

/// Figures of each group that has a bound in any run.
pub fn of_groups(trials: &[Trial]) -> Vec<(Group, Figures)> {
    let has_bound = |&i: &usize| trials.iter().any(|trial| trial.bound[i] > 0.0);
    let of_group = |group: Group| {
        let all = (0..PARAMETERS).filter(|&i| Group::of(i) == group);
        let indices: Vec<usize> = all.filter(has_bound).collect();
        let square = |of: &ParameterVector| mean_square(of.as_slice(), &indices);
        let squares = trials.iter().map(|trial| {
            let filtered = trial.filtered.as_ref();
            let closed = trial.closed_form.each_ref();
            let [own, equal] = closed.map(|error| error.as_ref().map(square));
            Squares {
                filter: filtered.map(|f| square(&f.error)),
                claimed: filtered.map(|f| square(&f.sigma)),
                bound: square(&trial.bound),
                closed_form: own,
                closed_form_in_equal_time: equal,
            }
        });
        (!indices.is_empty()).then(|| (group, Figures::new(squares)))
    };
    Group::all().filter_map(of_group).collect()
}

/// Figures of each error term that has a bound in any run and was estimated by the filter.
pub fn of_error_terms(trials: &[Trial]) -> Vec<(ErrorTerm, Figures)> {
    let has_sigma = |&k: &usize| trials.iter().any(|trial| trial.auxiliary_bound[k] > 0.0);
    let of_term = |term: ErrorTerm| {
        let is_of = |&k: &usize| AuxiliaryKind::of(k).is_some_and(|of| of.error_term() == term);
        let indices: Vec<usize> = (0..AUXILIARY).filter(is_of).filter(has_sigma).collect();
        let square = |of: &AuxiliaryVector| mean_square(of.as_slice(), &indices);
        let runs = trials.iter().filter_map(|trial| {
            let estimated = |f: &&Filtered| square(&f.auxiliary_sigma) > 0.0;
            let filtered = trial.filtered.as_ref().filter(estimated)?;
            Some(Squares {
                filter: Some(square(&filtered.auxiliary_error)),
                claimed: Some(square(&filtered.auxiliary_sigma)),
                bound: square(&trial.auxiliary_bound),
                ..Squares::default()
            })
        });
        let runs: Vec<Squares> = runs.collect();
        (!runs.is_empty()).then(|| (term, Figures::new(runs.into_iter())))
    };
    ErrorTerm::ALL.into_iter().filter_map(of_term).collect()
}

/// Mean squares over the entries at some indices.
fn mean_square(of: &[f64], indices: &[usize]) -> f64 {
    indices.iter().map(|&k| of[k].powi(2)).sum::<f64>() / indices.len() as f64
}

/// Root of the mean; NaN for no values.
fn rms(squares: &[f64]) -> f64 {
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}
