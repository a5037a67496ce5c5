//! A calibration with error terms that are off tried beside it, all in one pass.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::super::auxiliary::{AUXILIARY, AuxiliaryKind, auxiliary_vector};
use super::super::error::CalibrationError;
use super::super::error_term::ErrorTerm;
use super::super::model::Model;
use super::super::outcome::Outcome;
use super::super::parameters::{PARAMETERS, ParameterMatrix, ParameterVector};
use super::super::pass::{Gate, Mode, PassResult, Tried, pass_trying};
use super::super::problem::Problem;
use super::evidence::Evidence;
use super::left_off::LeftOff;

/// How well a calibration fits, and variance of the parameters of both triads.
pub(super) struct Fit {
    pub cost: f64,
    pub variance: ParameterVector,
}

impl Fit {
    pub fn of(result: &PassResult) -> Self {
        Self {
            cost: result.cost,
            variance: result.covariance.diagonal(),
        }
    }
}

/// The last pass of a calibration, with every constant error term that is off and that the runs can hold
/// tried beside it.
pub(super) struct Joint {
    pub own: PassResult,
    /// Index among the auxiliary parameters of each that is tried.
    indices: Vec<usize>,
    /// 1σ of each.
    prior_sigma: Vec<f64>,
    tried: Option<Tried>,
}

/// The last pass of a calibration with this model, `tried` beside it.
pub(super) fn once_more(
    problem: &Problem,
    outcome: &Outcome,
    tried: &[usize],
) -> Result<PassResult, CalibrationError> {
    let mode = Mode::Held(Gate::As(&outcome.innovations));
    let (priors, at) = (&outcome.prior_attitudes, &outcome.linearised_at);
    pass_trying(problem, priors, at, mode, tried)
}

impl Joint {
    pub fn new(problem: &Problem, outcome: &Outcome) -> Result<Self, CalibrationError> {
        let mut everything = problem.model.clone();
        ErrorTerm::constant().for_each(|term| everything.switch_on(term));
        Self::beside(problem, outcome, &everything)
    }

    /// With what a model has on more than the problem's.
    pub fn beside(
        problem: &Problem,
        outcome: &Outcome,
        everything: &Model,
    ) -> Result<Self, CalibrationError> {
        let model = &problem.model;
        let sigma = |model: &Model| auxiliary_vector(&model.geometry.vector(), &model.term_sigma);
        let (own, all) = (sigma(model), sigma(everything));
        let indices: Vec<usize> = (0..AUXILIARY)
            .filter(|&k| own[k] == 0.0 && all[k] > 0.0)
            .collect();
        let mut own = once_more(problem, outcome, &indices)?;
        Ok(Self {
            prior_sigma: indices.iter().map(|&k| all[k]).collect(),
            tried: own.tried.take(),
            indices,
            own,
        })
    }

    /// Numbers among what is tried of the parameters of error terms.
    fn numbers(&self, terms: &[ErrorTerm]) -> Vec<usize> {
        let of = |&number: &usize| {
            AuxiliaryKind::of(self.indices[number])
                .is_some_and(|kind| terms.contains(&kind.error_term()))
        };
        (0..self.indices.len()).filter(of).collect()
    }

    /// The calibration with terms on that were off. `None` if that is singular.
    pub fn with(&self, terms: &[ErrorTerm]) -> Option<Fit> {
        let mut fit = Fit::of(&self.own);
        let numbers = self.numbers(terms);
        if numbers.is_empty() {
            return Some(fit);
        }
        let tried = self.tried.as_ref()?;
        let (gain, covariance) = self.estimate(tried, &numbers)?;
        fit.cost -= gain;
        for p in 0..PARAMETERS {
            let by = DVector::from_fn(numbers.len(), |i, _| tried.of_parameters[(p, numbers[i])]);
            fit.variance[p] += by.dot(&(&covariance * &by));
        }
        Some(fit)
    }

    /// What a term that is off changes the parameters by; none where it is not tried.
    pub fn left_off(&self, term: ErrorTerm) -> Option<LeftOff> {
        let tried = self.tried.as_ref()?;
        let numbers = self.numbers(&[term]);
        let effect = effect(tried, &numbers);
        let usual = ParameterVector::from_fn(|p, _| {
            let row = effect.row(p);
            let of = row.iter().zip(&numbers);
            let each = of.map(|(x, &number)| (x * self.prior_sigma[number]).powi(2));
            each.sum::<f64>().sqrt()
        });
        let shown = self.effect(&[term])?.diagonal();
        (!numbers.is_empty()).then(|| LeftOff {
            usual,
            shown: shown.map(|variance| variance.max(0.0).sqrt()),
        })
    }

    /// Mean square of what these terms, each as the record shows it, change the parameters by; zero where
    /// none of them is tried.
    pub fn effect(&self, terms: &[ErrorTerm]) -> Option<ParameterMatrix> {
        let numbers = self.numbers(terms);
        let Some(tried) = self.tried.as_ref().filter(|_| !numbers.is_empty()) else {
            return Some(ParameterMatrix::zeros());
        };
        let effect = effect(tried, &numbers);
        let (_, covariance) = self.estimate(tried, &numbers)?;
        let score = DVector::from_fn(numbers.len(), |i, _| tried.score[numbers[i]]);
        let mean = &covariance * score;
        let mean_square = covariance + &mean * mean.transpose();
        let of_parameters = &effect * mean_square * effect.transpose();
        Some(ParameterMatrix::from_fn(|i, j| of_parameters[(i, j)]))
    }

    /// What a term explains where these others are on.
    pub fn evidence(&self, term: ErrorTerm, on: &[ErrorTerm]) -> Option<Evidence> {
        let tried = self.tried.as_ref()?;
        let (of, before) = (self.numbers(&[term]), self.numbers(on));
        if of.is_empty() {
            return None;
        }
        let without = match before.is_empty() {
            true => 0.0,
            false => self.estimate(tried, &before)?.0,
        };
        let n = of.len();
        let sigma: Vec<f64> = of.iter().map(|&k| self.prior_sigma[k]).collect();
        let all: Vec<usize> = of.into_iter().chain(before).collect();
        let (gain, covariance) = self.estimate(tried, &all)?;
        let covariance = covariance.view((0, 0), (n, n)).into_owned();
        Some(Evidence::new(gain - without, &covariance, &sigma))
    }

    /// By how much the cost falls with parameters on that are tried, and their covariance.
    fn estimate(&self, tried: &Tried, numbers: &[usize]) -> Option<(f64, DMatrix<f64>)> {
        let n = numbers.len();
        let sigma = |i: usize| self.prior_sigma[numbers[i]];
        let information = DMatrix::from_fn(n, n, |i, j| {
            let of_prior = f64::from(u8::from(i == j));
            let of_data = tried.information[(numbers[i], numbers[j])];
            of_prior + of_data * sigma(i) * sigma(j)
        });
        let score = DVector::from_fn(n, |i, _| tried.score[numbers[i]] * sigma(i));
        let factor: Cholesky<f64, Dyn> = information.cholesky()?;
        let gain = score.dot(&factor.solve(&score));
        let inverse = factor.inverse();
        let covariance = DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * sigma(i) * sigma(j));
        Some((gain, covariance))
    }

    /// The calibration without a term that is on, and what the term explains. `None` if that is singular.
    pub fn without(&self, term: ErrorTerm) -> Option<(Fit, Evidence)> {
        let auxiliary = &self.own.auxiliary;
        let of_term = |k: &usize| {
            let kind = AuxiliaryKind::of(*k);
            auxiliary.prior_sigma[*k] > 0.0 && kind.is_some_and(|kind| kind.error_term() == term)
        };
        let off: Vec<usize> = (0..AUXILIARY).filter(of_term).collect();
        let n = off.len();
        let covariance = DMatrix::from_fn(n, n, |i, j| auxiliary.covariance[(off[i], off[j])]);
        let values = DVector::from_fn(n, |i, _| auxiliary.values[off[i]]);
        let cross = DMatrix::from_fn(n, PARAMETERS, |i, p| auxiliary.cross[(p, off[i])]);
        let sigma: Vec<f64> = off.iter().map(|&k| auxiliary.prior_sigma[k]).collect();
        let factor: Cholesky<f64, Dyn> = covariance.clone().cholesky()?;
        let gain = values.dot(&factor.solve(&values));
        let mut fit = Fit::of(&self.own);
        fit.cost += gain;
        let known = factor.solve(&cross);
        for p in 0..PARAMETERS {
            fit.variance[p] -= cross.column(p).dot(&known.column(p));
        }
        Some((fit, Evidence::new(gain, &covariance, &sigma)))
    }
}

/// What one of each parameter that is tried changes the parameters of both triads by.
fn effect(tried: &Tried, numbers: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(PARAMETERS, numbers.len(), |p, i| {
        tried.of_parameters[(p, numbers[i])]
    })
}
