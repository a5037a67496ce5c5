//! A calibration with error terms on that were off, or off that were on, from one reduction.

use nalgebra::DMatrix;

use super::explanation::{Explanation, UnmodelledEffect};
use crate::calibration::checks::evidence::Evidence;
use crate::calibration::constants::{Posterior, Prior};
use crate::calibration::error::CalibrationError;
use crate::calibration::model::Model;
use crate::calibration::outcome::Outcome;
use crate::calibration::parameters::error_term::ErrorTerm;
use crate::calibration::parameters::{ParameterMatrix, ParameterVector};
use crate::calibration::problem::Problem;
use crate::calibration::reduction::Reduction;

/// What a calibrated record says of every constant that it can hold, whatever is on.
pub struct TermsOn<'a> {
    model: &'a Model,
    outcome: &'a Outcome,
    reduction: Reduction,
    /// With what the model has on.
    pub own: Posterior,
}

impl<'a> TermsOn<'a> {
    pub fn new(problem: &'a Problem, outcome: &'a Outcome) -> Result<Self, CalibrationError> {
        let mut everything = problem.model.clone();
        ErrorTerm::constant().for_each(|term| everything.switch_on(term));
        let reduction = outcome.reduction(&problem.with_model(everything))?.folded();
        let prior = Prior::new(&reduction.constants, &problem.model, &outcome.linearised_at);
        Ok(Self {
            own: reduction.posterior(&prior),
            model: &problem.model,
            outcome,
            reduction,
        })
    }

    /// With these terms on beside those of the model, each with its usual σ.
    pub fn with(&self, terms: &[ErrorTerm]) -> Posterior {
        let mut model = self.model.clone();
        terms.iter().for_each(|&term| model.switch_on(term));
        self.reduction.posterior(&self.prior(&model))
    }

    fn prior(&self, model: &Model) -> Prior {
        Prior::new(
            &self.reduction.constants,
            model,
            &self.outcome.linearised_at,
        )
    }

    /// The constants of a term.
    fn of(&self, term: ErrorTerm) -> Vec<usize> {
        let constants = self.reduction.constants.iter().enumerate();
        let of_term = constants.filter(|(_, constant)| constant.error_term() == Some(term));
        of_term.map(|(place, _)| place).collect()
    }

    /// Covariance of the constants of a term, each over its σ before the data.
    fn over_prior(&self, term: ErrorTerm, with: &Posterior, prior: &Prior) -> DMatrix<f64> {
        let of = self.of(term);
        DMatrix::from_fn(of.len(), of.len(), |i, j| {
            with.covariance[(of[i], of[j])] / (prior.sigma[of[i]] * prior.sigma[of[j]])
        })
    }

    /// What a term that is off changes the parameters by; absent if the reduction does not have it.
    pub fn left_off(&self, term: ErrorTerm) -> Option<UnmodelledEffect> {
        let (own, of) = (self.prior(self.model), self.of(term));
        let mut usual_model = self.model.clone();
        usual_model.switch_on(term);
        let sigma = self.prior(&usual_model).sigma;
        let shown = self.with(&[term]).added_to(&self.own).diagonal();
        let mut squares = ParameterVector::zeros();
        for &k in &of {
            let mut there = own.clone();
            there.mean[k] += sigma[k];
            let change = self.reduction.posterior(&there).parameters - self.own.parameters;
            squares += change.component_mul(&change);
        }
        (!of.is_empty()).then(|| UnmodelledEffect {
            usual: squares.map(f64::sqrt),
            shown: shown.map(|variance| variance.max(0.0).sqrt()),
        })
    }

    /// What a term explains where these others are on; absent if the reduction does not have it.
    pub fn evidence(&self, term: ErrorTerm, others: &[ErrorTerm]) -> Option<Evidence> {
        let without = self.with(others);
        let mut model = self.model.clone();
        others
            .iter()
            .chain([&term])
            .for_each(|&on| model.switch_on(on));
        let prior = self.prior(&model);
        let with = self.reduction.posterior(&prior);
        let over_prior = self.over_prior(term, &with, &prior);
        (!over_prior.is_empty()).then(|| Evidence::new(without.cost - with.cost, &over_prior))
    }

    /// A term of its usual size as an explanation where these others are on; absent if the data show less of it than
    /// they leave open.
    pub fn explanation(&self, term: ErrorTerm, others: &[ErrorTerm]) -> Option<Explanation> {
        let mut model = self.model.clone();
        model.switch_on(term);
        let alone = self.prior(&model);
        let alone = self.over_prior(term, &self.reduction.posterior(&alone), &alone);
        if alone.is_empty() || alone.symmetric_eigenvalues().min() >= 0.5 {
            return None;
        }
        let before = self.with(others);
        let with = self.with(&[others, &[term]].concat());
        Some(Explanation {
            ln_likelihood_ratio: 0.5 * (self.own.deviance - with.deviance),
            of_term: 0.5 * (before.deviance - with.deviance),
            added: with.added_to(&self.own),
        })
    }

    /// Mean square by which terms that were off change the parameters.
    pub fn added(&self, terms: &[ErrorTerm]) -> ParameterMatrix {
        self.with(terms).added_to(&self.own)
    }

    /// The calibration without a term that is on, and what the term explains.
    pub fn without(&self, term: ErrorTerm) -> (Posterior, Evidence) {
        let mut model = self.model.clone();
        model.switch_off(term);
        let without = self.reduction.posterior(&self.prior(&model));
        let over_prior = self.over_prior(term, &self.own, &self.prior(self.model));
        let evidence = Evidence::new(without.cost - self.own.cost, &over_prior);
        (without, evidence)
    }
}
