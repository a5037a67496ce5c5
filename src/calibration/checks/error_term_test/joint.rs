//! A calibration with error terms that are off tried beside it, all in one pass.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::evidence::Evidence;
use super::left_off::LeftOff;
use crate::calibration::auxiliary::{AUXILIARY, AuxiliaryKind, auxiliary_vector};
use crate::calibration::error::CalibrationError;
use crate::calibration::error_term::ErrorTerm;
use crate::calibration::model::Model;
use crate::calibration::outcome::Outcome;
use crate::calibration::parameters::{PARAMETERS, ParameterMatrix, ParameterVector};
use crate::calibration::pass::{Gate, Mode, PassResult, Tried, pass_trying};
use crate::calibration::problem::Problem;

/// ln of the steps in which the size of a term is tried: two in a decade.
const PART_OF_DECADE: f64 = 0.5 * std::f64::consts::LN_10;

/// A term as an explanation of what a record shows.
pub struct Explanation {
    /// ln of the likelihood with it, and with others that are on, over that without any.
    pub ln_likelihood_ratio: f64,
    /// The same over that with the others alone.
    pub of_term: f64,
    /// Mean square by which all of them change the parameters.
    pub added: ParameterMatrix,
}

/// How well a calibration fits, and variance of the parameters of both triads.
pub struct Fit {
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
pub struct Joint {
    pub own: PassResult,
    /// Index among the auxiliary parameters of each that is tried.
    indices: Vec<usize>,
    /// 1σ of each.
    prior_sigma: Vec<f64>,
    tried: Option<Tried>,
}

/// The last pass of a calibration with this model, `tried` beside it.
pub fn once_more(
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
        let estimated = self.estimate(tried, &numbers)?;
        fit.cost -= estimated.gain;
        for p in 0..PARAMETERS {
            let by = DVector::from_fn(numbers.len(), |i, _| tried.of_parameters[(p, numbers[i])]);
            fit.variance[p] += by.dot(&(&estimated.covariance * &by));
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
        Some(self.estimate(tried, &numbers)?.added(tried, &numbers))
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
            false => self.estimate(tried, &before)?.gain,
        };
        let n = of.len();
        let sigma: Vec<f64> = of.iter().map(|&k| self.prior_sigma[k]).collect();
        let all: Vec<usize> = of.into_iter().chain(before).collect();
        let estimated = self.estimate(tried, &all)?;
        let covariance = estimated.covariance.view((0, 0), (n, n)).into_owned();
        Some(Evidence::new(estimated.gain - without, &covariance, &sigma))
    }

    /// Parameters on that are tried, each with its usual σ before the data.
    fn estimate(&self, tried: &Tried, numbers: &[usize]) -> Option<Estimated> {
        let sigma: Vec<f64> = numbers.iter().map(|&k| self.prior_sigma[k]).collect();
        Estimated::new(tried, numbers, &sigma)
    }

    /// What the data say of a term of any size where these others are on; none where they show nothing of it.
    ///
    /// How large the term is in an instrument nobody says: it is as likely before the data in each part of a
    /// decade, from its usual σ down to the one of which the data would show no more than they leave open.
    pub fn explanation(&self, term: ErrorTerm, on: &[ErrorTerm]) -> Option<Explanation> {
        let tried = self.tried.as_ref()?;
        let (of, others) = (self.numbers(&[term]), self.numbers(on));
        let sigma = |numbers: &[usize]| -> Vec<f64> {
            numbers.iter().map(|&k| self.prior_sigma[k]).collect()
        };
        let (of_term, of_others) = (sigma(&of), sigma(&others));
        let shown = scaled(tried, &of, &of_term).symmetric_eigenvalues();
        let shown = shown.iter().copied().fold(0.0, f64::max).sqrt();
        if shown <= 1.0 {
            return None;
        }
        let sizes = (shown.ln() / PART_OF_DECADE) as usize + 1;
        let all = [of, others.clone()].concat();
        let models = (0..sizes).map(|smaller| {
            let size = (-(smaller as f64) * PART_OF_DECADE).exp();
            let of_term = of_term.iter().map(|sigma| sigma * size);
            let sigma: Vec<f64> = of_term.chain(of_others.iter().copied()).collect();
            let estimated = Estimated::new(tried, &all, &sigma)?;
            let added = estimated.added(tried, &all);
            Some((estimated.ln_likelihood_ratio(), added))
        });
        let models: Vec<(f64, ParameterMatrix)> = models.collect::<Option<_>>()?;
        let before = self.estimate(tried, &others)?.ln_likelihood_ratio();
        let best = models.iter().map(|model| model.0).fold(before, f64::max);
        let weight = |model: &(f64, ParameterMatrix)| (model.0 - best).exp();
        let sum: f64 = models.iter().map(weight).sum();
        let added: ParameterMatrix = models.iter().map(|model| model.1 * weight(model)).sum();
        let ln_likelihood_ratio = best + (sum / sizes as f64).ln();
        Some(Explanation {
            ln_likelihood_ratio,
            of_term: ln_likelihood_ratio - before,
            added: added / sum,
        })
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

/// Parameters that are tried, after the data.
struct Estimated {
    /// By how much the cost falls with them.
    gain: f64,
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Logarithm of the determinant of their covariance before the data over that after them.
    log_determinant: f64,
}

impl Estimated {
    /// With these σ before the data. `None` if that is singular.
    fn new(tried: &Tried, numbers: &[usize], sigma: &[f64]) -> Option<Self> {
        let n = numbers.len();
        let information = scaled(tried, numbers, sigma) + DMatrix::identity(n, n);
        let score = DVector::from_fn(n, |i, _| tried.score[numbers[i]] * sigma[i]);
        let factor: Cholesky<f64, Dyn> = information.cholesky()?;
        let scaled = factor.solve(&score);
        let inverse = factor.inverse();
        Some(Self {
            gain: score.dot(&scaled),
            mean: DVector::from_fn(n, |i, _| scaled[i] * sigma[i]),
            covariance: DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * sigma[i] * sigma[j]),
            log_determinant: 2.0 * factor.l().diagonal().map(f64::ln).sum(),
        })
    }

    /// ln of the likelihood with them over that without, whatever their values are.
    fn ln_likelihood_ratio(&self) -> f64 {
        0.5 * (self.gain - self.log_determinant)
    }

    /// Mean square by which they change the parameters of both triads.
    fn added(&self, tried: &Tried, numbers: &[usize]) -> ParameterMatrix {
        let effect = effect(tried, numbers);
        let mean_square = &self.covariance + &self.mean * self.mean.transpose();
        let of_parameters = &effect * mean_square * effect.transpose();
        ParameterMatrix::from_fn(|i, j| of_parameters[(i, j)])
    }
}

/// Information of parameters that are tried, each in units of its σ.
fn scaled(tried: &Tried, numbers: &[usize], sigma: &[f64]) -> DMatrix<f64> {
    let n = numbers.len();
    DMatrix::from_fn(n, n, |i, j| {
        tried.information[(numbers[i], numbers[j])] * sigma[i] * sigma[j]
    })
}

/// What one of each parameter that is tried changes the parameters of both triads by.
fn effect(tried: &Tried, numbers: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(PARAMETERS, numbers.len(), |p, i| {
        tried.of_parameters[(p, numbers[i])]
    })
}
