//! Evidence for error terms, and the findings on terms that are present and terms that a path does not show.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::calibration::sizes::{Candidates, Weighed};
use crate::calibration::{
    Candidate, ErrorTerm, Finding, FindingKind as Kind, Group, Model, OBSERVED_BELOW, PARAMETERS,
    Posterior,
};
use crate::number::three_digits;
use crate::statistics::FALSE_ALARM;

/// A term that a path does not show is reported if it increases the σ of a group by more than this factor.
const NAMED: f64 = 1.25;

/// Whether a candidate with this probability of absence counts as present, given the number of candidates.
pub fn is_shown(absent: f64, candidates: usize) -> bool {
    absent < FALSE_ALARM / candidates.max(1) as f64
}

/// Evidence for an error term.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TermEvidence {
    /// The error term.
    pub term: ErrorTerm,
    /// Probability that the term is present; one if the term is stated or requested.
    pub present: f64,
    /// Whether the data show the term although it was not requested (false-alarm rate 1 in 1000 recordings).
    pub shown: bool,
    /// Largest remaining part of the usual size of the term, from 0 (known) to 1 (not shown by the recording).
    pub remaining: f64,
    /// RMS σ of each of [`Group::all`] with the term, divided by RMS σ if the term were known to be absent; `None` if
    /// the group has no σ.
    pub sigma_factors: [Option<f64>; 6],
}

impl TermEvidence {
    /// The evidence for every term that may be present.
    pub(in crate::calibration) fn all(
        of: &Weighed,
        candidates: &Candidates,
        model: &Model,
    ) -> Vec<Self> {
        let count = candidates.absent().count();
        let absent = |term: ErrorTerm| {
            let candidate = Candidate::Term(term.alike());
            let mut absent = candidates.absent();
            absent
                .find(|(other, _)| *other == candidate)
                .map(|found| found.1)
        };
        let terms = ErrorTerm::constant().filter_map(|term| {
            let asked = model.has(term);
            let absent = absent(term).filter(|_| !asked && model.may_have.contains(&term));
            if !asked && absent.is_none() {
                return None;
            }
            let (n, m) = (of.prior.constants.len(), of.prior.candidates);
            let constants = of.prior.constants.iter().enumerate();
            let own = constants.filter(|(_, of)| of.error_term() == Some(term));
            let own: Vec<usize> = own.map(|(k, _)| k).collect();
            let candidates: Vec<usize> = own.iter().filter_map(|k| k.checked_sub(n - m)).collect();
            let remaining = if asked {
                let sigma = own
                    .iter()
                    .map(|&k| of.posterior.covariance[(k, k)].max(0.0).sqrt() / of.prior.sigma[k]);
                sigma.fold(0.0, f64::max)
            } else {
                of.known.effect_of(&candidates)?.1
            };
            // Almost certain is not certain.
            let most = 1.0 - f64::EPSILON;
            Some(Self {
                shown: absent.is_some_and(|absent| is_shown(absent, count)),
                term,
                present: absent.map_or(1.0, |absent| (1.0 - absent).min(most)),
                remaining,
                sigma_factors: factors(&of.posterior, &own),
            })
        });
        terms.collect()
    }

    /// The findings on terms that were not requested: one on terms that are present, one on terms that are not shown.
    pub(in crate::calibration) fn findings(all: &[Self]) -> Vec<Finding> {
        let candidates = all.iter().filter(|of| of.present < 1.0);
        let (shown, others): (Vec<&Self>, Vec<&Self>) = candidates.partition(|of| of.shown);
        let widens = |of: &&Self| {
            of.remaining >= OBSERVED_BELOW && of.widest().is_some_and(|(_, factor)| factor >= NAMED)
        };
        let others: Vec<&Self> = others.into_iter().filter(widens).collect();
        [estimated(&shown), not_shown(&others)]
            .into_iter()
            .flatten()
            .collect()
    }

    /// The group whose σ the term increases most.
    pub fn widest(&self) -> Option<(Group, f64)> {
        let groups = Group::all().zip(self.sigma_factors);
        let groups = groups.filter_map(|(group, factor)| Some((group, factor?)));
        groups.max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// The finding on terms that the data show, if any. If two terms are alike, the data show one or the other.
fn estimated(shown: &[&TermEvidence]) -> Option<Finding> {
    let groups = shown.chunk_by(|one, other| one.term.alike() == other.term.alike());
    let names = groups.map(|group| {
        let names: Vec<&str> = group.iter().map(|of| of.term.name()).collect();
        names.join(" or ")
    });
    let names: Vec<String> = names.collect();
    let text = format!(
        "The data show errors that scale factors, misalignments and biases cannot explain: {} (probability above 99.9 \
         %). turncal estimated these error terms too, as if they had been given with --with. Apply the calibration \
         with `turncal apply`; exports without these terms leave the errors in the data.",
        names.join(", ")
    );
    let finding = || Finding::new(Kind::ErrorTermEstimated, text, figures(shown));
    (!shown.is_empty()).then(finding)
}

/// The finding on terms that the recording does not show but that increase σ, if any.
fn not_shown(terms: &[&TermEvidence]) -> Option<Finding> {
    let each = terms.iter().filter_map(|of| {
        let (group, factor) = of.widest()?;
        let (name, group, times) = (of.term.name(), group.title(), three_digits(factor));
        Some(format!("{name} ({group}: {times} times)"))
    });
    let each: Vec<String> = each.collect();
    let mut shown_by: Vec<&str> = terms.iter().map(|of| of.term.shown_by()).collect();
    shown_by.sort_unstable();
    shown_by.dedup();
    let text = format!(
        "This recording cannot show these possible errors, so they increase the σ: {}. Add {}, or use --with none if \
         you know that the sensor has none of these errors.",
        each.join(", "),
        shown_by.join(", ")
    );
    (!terms.is_empty()).then(|| Finding::new(Kind::TermNotShown, text, figures(terms)))
}

fn figures(terms: &[&TermEvidence]) -> Value {
    let each = terms.iter().map(
        |of| json!({ "term": of.term.name(), "present": of.present, "remaining": of.remaining }),
    );
    json!({ "terms": each.collect::<Value>() })
}

/// σ of each group, divided by its σ if the constants at these positions were known.
fn factors(posterior: &Posterior, places: &[usize]) -> [Option<f64>; 6] {
    let covariance = &posterior.covariance;
    let across = covariance.select_columns(places);
    let own = across.select_rows(places);
    let scale = own.diagonal().map(|variance| variance.sqrt().recip());
    let scaled = nalgebra::DMatrix::from_fn(places.len(), places.len(), |i, j| {
        own[(i, j)] * scale[i] * scale[j]
    });
    let across = across * nalgebra::DMatrix::from_diagonal(&scale);
    let Some(factor) = scaled.cholesky() else {
        return [None; 6];
    };
    let known = covariance - &across * factor.solve(&across.transpose());
    let [with, without] = [covariance, &known]
        .map(|of| crate::calibration::of_parameters(&posterior.constants, of).diagonal());
    let mut each = Group::all().map(|group| {
        let of_group = (0..PARAMETERS).filter(|&i| Group::of(i) == group);
        let sums = of_group.map(|i| [with[i], without[i].max(0.0)]);
        let [with, without] = sums.fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
        Some((with / without).sqrt()).filter(|ratio: &f64| ratio.is_finite())
    });
    std::array::from_fn(|_| each.next().flatten())
}
