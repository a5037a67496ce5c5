//! Calibrations with other error terms on or off, from one reduction.

use nalgebra::DMatrix;

use super::evidence::Evidence;
use crate::calibration::{
    ErrorTerm, Linearisation, Model, ParameterMatrix, ParameterVector, Posterior, Prior, Problem,
    Reduction,
};

/// 1σ of the change of each parameter by an error term that is not estimated; not part of any covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnmodelledEffect {
    /// With the usual σ around zero.
    pub usual: ParameterVector,
    /// RMS, also given the evidence in the recording.
    pub shown: ParameterVector,
}

/// A term as an explanation of a recording.
pub struct Explanation {
    /// ln of the likelihood ratio of the model with this term and the others that are on to the model without any.
    pub ln_likelihood_ratio: f64,
    /// The same relative to the model with the others only.
    pub of_term: f64,
    /// Mean square change of the parameters due to all of them.
    pub added: ParameterMatrix,
}

/// Addition to the covariance of an estimate for error terms that are not estimated although the data support them;
/// `None` if they support none of `tried`.
///
/// With a term, the estimate would be `θ + Δ` with the covariance `P + P_b`, so the mean square error of `θ` is
/// `P + P_b + Δ Δᵀ`. Explanations, including that of no term, are weighted by their probabilities (Hoeting, Madigan,
/// Raftery, Volinsky 1999, "Bayesian model averaging: a tutorial", Statistical Science 14(4)). A priori, one term and
/// no term are equally probable, and so are all terms. A term that the data make less likely than its prior
/// is ignored.
pub fn seen_and_left_off(explanations: &[Explanation], tried: usize) -> Option<ParameterMatrix> {
    let spoken_for = explanations.iter().filter(|of| of.of_term > 0.0);
    let spoken_for: Vec<&Explanation> = spoken_for.collect();
    let none = (tried as f64).ln();
    let ratios = spoken_for.iter().map(|of| of.ln_likelihood_ratio);
    let best = ratios.reduce(f64::max)?.max(none);
    let weighed = spoken_for.iter().map(|of| {
        let weight = (of.ln_likelihood_ratio - best).exp();
        (weight, of.added * weight)
    });
    let (weights, sum) = weighed.fold(
        ((none - best).exp(), ParameterMatrix::zeros()),
        |(weights, sum), (weight, added)| (weights + weight, sum + added),
    );
    Some(sum / weights)
}

/// Information of a calibrated recording on every observable constant, for any choice of terms.
pub struct TermsOn<'a> {
    model: &'a Model,
    at: &'a Linearisation,
    reduction: Reduction,
    /// Prior and posterior with the terms of the model.
    pub own: With,
}

/// A problem whose reduction has columns for the constants of all terms.
pub fn with_everything<'r>(problem: &Problem<'r>) -> Problem<'r> {
    problem.with(|model| ErrorTerm::constant().for_each(|term| model.switch_on(term)))
}

/// Prior and posterior of the constants.
pub struct With {
    prior: Prior,
    pub posterior: Posterior,
}

impl<'a> TermsOn<'a> {
    /// The information of a problem at a point, with the `reduction` of its recording by [`with_everything`].
    pub fn new(problem: &'a Problem, at: &'a Linearisation, reduction: Reduction) -> Self {
        let model = &problem.model;
        Self {
            own: With::new(&reduction, model, at),
            model,
            at,
            reduction,
        }
    }

    /// With these terms on in addition to those of the model, each with its usual σ.
    pub fn with(&self, terms: &[ErrorTerm]) -> With {
        let mut model = self.model.clone();
        terms.iter().for_each(|&term| model.switch_on(term));
        With::new(&self.reduction, &model, self.at)
    }

    /// Without a term of the model.
    pub fn without(&self, term: ErrorTerm) -> With {
        let mut model = self.model.clone();
        model.switch_off(term);
        With::new(&self.reduction, &model, self.at)
    }

    /// Largest remaining part of the prior σ of any combination of a term's parameters, with the term on at its usual
    /// σ: from 0 (known) to 1 (not observed); `None` if the reduction does not include it.
    pub fn remaining(&self, term: ErrorTerm) -> Option<f64> {
        let covariance = self.over_prior(term, &self.with(&[term]));
        (!covariance.is_empty()).then(|| covariance.symmetric_eigenvalues().max().max(0.0).sqrt())
    }

    /// The constants of a term.
    fn of(&self, term: ErrorTerm) -> Vec<usize> {
        let constants = self.reduction.constants.iter().enumerate();
        let of_term = constants.filter(|(_, constant)| constant.error_term() == Some(term));
        of_term.map(|(place, _)| place).collect()
    }

    /// Covariance of the constants of a term that is on, each in units of its prior σ.
    fn over_prior(&self, term: ErrorTerm, With { prior, posterior }: &With) -> DMatrix<f64> {
        let of = self.of(term);
        DMatrix::from_fn(of.len(), of.len(), |i, j| {
            posterior.covariance[(of[i], of[j])] / (prior.sigma[of[i]] * prior.sigma[of[j]])
        })
    }

    /// Change of the parameters by a term that is off; `None` if the reduction does not include it.
    pub fn left_off(&self, term: ErrorTerm) -> Option<UnmodelledEffect> {
        let (of, with) = (self.of(term), self.with(&[term]));
        let own = &self.own.posterior;
        let mut squares = ParameterVector::zeros();
        for &k in &of {
            let mut there = self.own.prior.clone();
            there.mean[k] += with.prior.sigma[k];
            let change = self.reduction.posterior(&there).parameters - own.parameters;
            squares += change.component_mul(&change);
        }
        let shown = with.posterior.added_to(own).diagonal();
        (!of.is_empty()).then(|| UnmodelledEffect {
            usual: squares.map(f64::sqrt),
            shown: shown.map(|variance| variance.max(0.0).sqrt()),
        })
    }

    /// Evidence of a term from the calibrations with and without it; `None` if the reduction does not include it.
    pub fn evidence(&self, term: ErrorTerm, with: &With, without: &With) -> Option<Evidence> {
        let over_prior = self.over_prior(term, with);
        let gain = without.posterior.cost - with.posterior.cost;
        (!over_prior.is_empty()).then(|| Evidence::new(gain, &over_prior))
    }

    /// A term of usual size as an explanation with these others on; `None` if the data determine less than half of it.
    pub fn explanation(&self, term: ErrorTerm, others: &[ErrorTerm]) -> Option<Explanation> {
        let alone = self.over_prior(term, &self.with(&[term]));
        if alone.is_empty() || alone.symmetric_eigenvalues().min() >= 0.5 {
            return None;
        }
        let before = self.with(others).posterior;
        let with = self.with(&[others, &[term]].concat()).posterior;
        Some(Explanation {
            ln_likelihood_ratio: 0.5 * (self.own.posterior.deviance - with.deviance),
            of_term: 0.5 * (before.deviance - with.deviance),
            added: with.added_to(&self.own.posterior),
        })
    }
}

impl With {
    pub fn new(reduction: &Reduction, model: &Model, at: &Linearisation) -> Self {
        let prior = Prior::new(&reduction.constants, model, at);
        let posterior = reduction.posterior(&prior);
        Self { prior, posterior }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// One parameter changes by 3 with a term that the data support, and by 100 with a term that they contradict.
    #[test]
    fn explanations_count_as_much_as_each_is_likely() {
        let of = |ratio: f64, squared: f64| Explanation {
            ln_likelihood_ratio: ratio.ln(),
            of_term: ratio.ln(),
            added: ParameterMatrix::from_diagonal_element(squared),
        };
        let added = seen_and_left_off(&[of(10.0, 9.0), of(0.5, 1e4)], 5);
        assert_relative_eq!(
            added.unwrap()[(0, 0)],
            9.0 * 10.0 / 15.0,
            max_relative = 1e-12
        );
        // If a term is beyond doubt, only its effect counts.
        let added = seen_and_left_off(&[of(1e300, 9.0), of(10.0, 1e4)], 5);
        assert_relative_eq!(added.unwrap()[(0, 0)], 9.0, max_relative = 1e-12);
        assert_eq!(seen_and_left_off(&[of(0.5, 1e4)], 5), None);
    }
}
