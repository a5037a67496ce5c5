//! Which sources the data call for.
//!
//! A variance cannot be below zero, so fitting every source gives a small one to about half of those that
//! are not there, and their sum makes σ of the parameters too large. A source therefore stays as stated
//! where the likelihood ratio of the others alone, fitted again, is within chance.

use nalgebra::{DMatrix, DVector};

use super::factors::Factors;
use super::fit::{Fit, Likelihood, Slope};
use super::likelihood_ratio::limit;
use crate::calibration::error::CalibrationError;

/// Chance that a source leaves what is stated though it is right, beside others that are wrong.
const FALSE_ALARM: f64 = 0.05;

/// Sources that are no longer as stated, and their factors.
#[derive(Debug, Clone)]
pub struct Selection {
    pub fit: Fit,
    pub sources: Vec<usize>,
}

impl Likelihood<'_> {
    /// Fits the sources selected so far and those that the data call for beside them; then takes out what
    /// is needless.
    pub fn select(
        &self,
        start: &Factors,
        selected: Vec<usize>,
    ) -> Result<Selection, CalibrationError> {
        let fit = self.fit(start, &selected)?;
        let mut selection = Selection {
            fit,
            sources: selected,
        };
        let missing = self.missing(&selection)?;
        if !missing.is_empty() {
            selection.sources.extend(missing);
            selection.fit = self.fit(&selection.fit.factors, &selection.sources)?;
        }
        self.without_the_needless(selection)
    }

    /// What −2 ln of the likelihood ratio of one source stays below by chance. A bound at zero halves the
    /// chance that it goes beyond.
    fn limit_of_one(&self, source: usize) -> f64 {
        let bounded = usize::from(self.scale.needless(source) == 0.0);
        limit(1 - bounded, bounded, FALSE_ALARM)
    }

    /// The sources of which the score says that they have to leave what is stated.
    fn missing(&self, selection: &Selection) -> Result<Vec<usize>, CalibrationError> {
        let present = self.scale.present();
        if present.iter().all(|k| selection.sources.contains(k)) {
            return Ok(Vec::new());
        }
        let slope = self.slope(&selection.fit.factors, &present)?;
        let factors = &selection.fit.factors.0;
        let (free, asked): (Vec<usize>, Vec<usize>) =
            (0..present.len()).partition(|&i| selection.sources.contains(&present[i]));
        let free: Vec<usize> = free
            .into_iter()
            .filter(|&i| factors[present[i]] > 0.0)
            .collect();
        let called_for = asked.into_iter().filter(|&i| {
            let bounded = self.scale.needless(present[i]) == 0.0;
            slope.statistic_beside(i, &free, bounded) > self.limit_of_one(present[i])
        });
        Ok(called_for.map(|i| present[i]).collect())
    }

    /// Sets those sources back to what is stated, one after the other, that the others make needless; the
    /// least of them first.
    fn without_the_needless(
        &self,
        mut selection: Selection,
    ) -> Result<Selection, CalibrationError> {
        let as_stated = |k: &usize, fit: &Fit| fit.factors.0[*k] == self.scale.needless(*k);
        selection.sources.retain(|k| !as_stated(k, &selection.fit));
        let wald = self.wald(&selection.fit, &selection.sources)?;
        let each = selection.sources.iter().copied().zip(wald);
        // Near zero a variance's own interval is too wide: beyond the limit it is needed for sure.
        let doubtful = each.filter(|&(k, wald)| wald < self.limit_of_one(k));
        let mut doubtful: Vec<(usize, f64)> = doubtful.collect();
        doubtful.sort_by(|a, b| a.1.total_cmp(&b.1));
        for (source, _) in doubtful {
            let Selection { fit, sources } = &selection;
            let others: Vec<usize> = sources.iter().copied().filter(|&k| k != source).collect();
            let mut start = fit.factors;
            start.0[source] = self.scale.needless(source);
            let without = self.fit(&start, &others)?;
            if without.deviance - fit.deviance < self.limit_of_one(source) {
                selection = Selection {
                    fit: without,
                    sources: others,
                };
            }
        }
        Ok(selection)
    }

    /// How far each of these sources is from what is stated, squared and over its variance (Wald).
    fn wald(&self, fit: &Fit, sources: &[usize]) -> Result<Vec<f64>, CalibrationError> {
        let sigmas = self.sigma(&fit.factors, sources)?;
        let of = |(&k, sigma): (&usize, Option<f64>)| {
            let (factor, stated) = (fit.factors.0[k], self.scale.needless(k));
            let Some(sigma) = sigma else { return 0.0 };
            // 1σ is of ln σ, that of the variance twice as much of it.
            let distance = if stated > 0.0 {
                0.5 * (factor / stated).ln()
            } else {
                0.5
            };
            (distance / sigma).powi(2)
        };
        Ok(sources.iter().zip(sigmas).map(of).collect())
    }
}

impl Slope {
    /// Score statistic of one factor beside others that are free, of the score that they do not explain
    /// (Rao's efficient score). Zero where a variance at zero would fall.
    fn statistic_beside(&self, factor: usize, free: &[usize], bounded: bool) -> f64 {
        let of = |i: usize, j: usize| self.information[(i, j)];
        let among = DMatrix::from_fn(free.len(), free.len(), |i, j| of(free[i], free[j]));
        let cross = DVector::from_fn(free.len(), |i, _| of(free[i], factor));
        let scores = DVector::from_fn(free.len(), |i, _| self.score[free[i]]);
        let Some(weights) = among.cholesky().map(|root| root.solve(&cross)) else {
            return 0.0;
        };
        let score = self.score[factor] - weights.dot(&scores);
        let information = of(factor, factor) - weights.dot(&cross);
        if information <= 0.0 || (bounded && score <= 0.0) {
            return 0.0;
        }
        score.powi(2) / information
    }
}
