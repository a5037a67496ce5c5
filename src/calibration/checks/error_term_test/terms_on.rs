//! A calibration with error terms on that were off, or off that were on, from one reduction.

use nalgebra::DMatrix;

use super::evidence::Evidence;
use super::explanation::{Explanation, UnmodelledEffect};
use crate::calibration::{
    CalibrationError, ErrorTerm, Linearisation, Model, Outcome, ParameterVector, Posterior, Prior,
    Problem, Reduction,
};

/// What a calibrated record says of every constant that it can hold, whatever is on.
pub struct TermsOn<'a> {
    model: &'a Model,
    at: &'a Linearisation,
    reduction: Reduction,
    /// With what the model has on.
    pub own: With,
}

/// What is known of the constants before and with the data.
pub struct With {
    prior: Prior,
    pub posterior: Posterior,
}

impl<'a> TermsOn<'a> {
    pub fn new(problem: &'a Problem, outcome: &'a Outcome) -> Result<Self, CalibrationError> {
        let (model, at) = (&problem.model, &outcome.linearised_at);
        let everything =
            problem.with(|model| ErrorTerm::constant().for_each(|term| model.switch_on(term)));
        let reduction = outcome.reduction(&everything)?.folded();
        Ok(Self {
            own: With::new(&reduction, model, at),
            model,
            at,
            reduction,
        })
    }

    /// With these terms on beside those of the model, each with its usual σ.
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

    /// The constants of a term.
    fn of(&self, term: ErrorTerm) -> Vec<usize> {
        let constants = self.reduction.constants.iter().enumerate();
        let of_term = constants.filter(|(_, constant)| constant.error_term() == Some(term));
        of_term.map(|(place, _)| place).collect()
    }

    /// Covariance of the constants of a term that is on, each over its σ before the data.
    fn over_prior(&self, term: ErrorTerm, With { prior, posterior }: &With) -> DMatrix<f64> {
        let of = self.of(term);
        DMatrix::from_fn(of.len(), of.len(), |i, j| {
            posterior.covariance[(of[i], of[j])] / (prior.sigma[of[i]] * prior.sigma[of[j]])
        })
    }

    /// What a term that is off changes the parameters by; absent if the reduction does not have it.
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

    /// What a term explains, with it and without; absent if the reduction does not have it.
    pub fn evidence(&self, term: ErrorTerm, with: &With, without: &With) -> Option<Evidence> {
        let over_prior = self.over_prior(term, with);
        let gain = without.posterior.cost - with.posterior.cost;
        (!over_prior.is_empty()).then(|| Evidence::new(gain, &over_prior))
    }

    /// A term of its usual size as an explanation where these others are on; absent if the data show less of it than
    /// they leave open.
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
    fn new(reduction: &Reduction, model: &Model, at: &Linearisation) -> Self {
        let prior = Prior::new(&reduction.constants, model, at);
        let posterior = reduction.posterior(&prior);
        Self { prior, posterior }
    }
}
