//! A calibration with error terms tried that are off, all in one pass.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::evidence::Evidence;
use super::explanation::{Explanation, LeftOff};
use crate::calibration::error::CalibrationError;
use crate::calibration::model::Model;
use crate::calibration::outcome::Outcome;
use crate::calibration::parameters::auxiliary::{AUXILIARY, AuxiliaryKind, auxiliary_vector};
use crate::calibration::parameters::error_term::ErrorTerm;
use crate::calibration::parameters::{PARAMETERS, ParameterMatrix, ParameterVector};
use crate::calibration::pass::{Gate, Mode, PassResult, Tried, pass_trying};
use crate::calibration::problem::Problem;

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

/// The last pass of a calibration with this model, with auxiliary parameters tried that are off.
pub fn last_pass(
    problem: &Problem,
    outcome: &Outcome,
    tried: &[usize],
) -> Result<PassResult, CalibrationError> {
    let mode = Mode::Held(Gate::As(&outcome.innovations));
    let (priors, at) = (&outcome.prior_attitudes, &outcome.linearised_at);
    pass_trying(problem, priors, at, mode, tried)
}

/// The last pass of a calibration, with every constant error term tried that is off and that the runs can hold.
pub struct Joint {
    pub own: PassResult,
    /// Index among the auxiliary parameters of each that is tried.
    indices: Vec<usize>,
    /// 1σ of each.
    prior_sigma: Vec<f64>,
    tried: Tried,
}

impl Joint {
    pub fn new(problem: &Problem, outcome: &Outcome) -> Result<Self, CalibrationError> {
        let mut everything = problem.model.clone();
        ErrorTerm::constant().for_each(|term| everything.switch_on(term));
        Self::with_model(problem, outcome, &everything)
    }

    /// With what this model has on more than the problem's.
    pub fn with_model(
        problem: &Problem,
        outcome: &Outcome,
        everything: &Model,
    ) -> Result<Self, CalibrationError> {
        let sigma = |model: &Model| auxiliary_vector(&model.geometry.vector(), &model.term_sigma);
        let (own, all) = (sigma(&problem.model), sigma(everything));
        let is_tried = |&k: &usize| own[k] == 0.0 && all[k] > 0.0;
        let indices: Vec<usize> = (0..AUXILIARY).filter(is_tried).collect();
        let mut own = last_pass(problem, outcome, &indices)?;
        let nothing = || Tried {
            information: DMatrix::zeros(0, 0),
            score: DVector::zeros(0),
            of_parameters: DMatrix::zeros(PARAMETERS, 0),
        };
        Ok(Self {
            prior_sigma: indices.iter().map(|&k| all[k]).collect(),
            tried: own.tried.take().unwrap_or_else(nothing),
            indices,
            own,
        })
    }

    /// Numbers among the parameters tried, and 1σ, of those of terms.
    fn numbers(&self, terms: &[ErrorTerm]) -> (Vec<usize>, Vec<f64>) {
        let of = |number: &usize| {
            let kind = AuxiliaryKind::of(self.indices[*number]);
            kind.is_some_and(|kind| terms.contains(&kind.error_term()))
        };
        let tried = 0..self.tried.score.len();
        let numbers = tried.filter(of);
        numbers
            .map(|number| (number, self.prior_sigma[number]))
            .unzip()
    }

    /// Terms on that were off, each with its usual σ before the data. `None` if that is singular.
    pub fn on(&self, terms: &[ErrorTerm]) -> Option<TermsOn> {
        TermsOn::new(&self.tried, self.numbers(terms))
    }

    /// The calibration with terms on that were off. `None` if that is singular.
    pub fn with(&self, terms: &[ErrorTerm]) -> Option<Fit> {
        let (own, on) = (Fit::of(&self.own), self.on(terms)?);
        let added = &on.effect * &on.covariance * on.effect.transpose();
        Some(Fit {
            cost: own.cost - on.gain,
            variance: ParameterVector::from_fn(|p, _| own.variance[p] + added[(p, p)]),
        })
    }

    /// What a term that is off changes the parameters by; absent if it is not tried.
    pub fn left_off(&self, term: ErrorTerm) -> Option<LeftOff> {
        let on = self.on(&[term]).filter(|on| !on.sigma.is_empty())?;
        let sigma = DVector::from_column_slice(&on.sigma).transpose();
        let usual = |p: usize| on.effect.row(p).component_mul(&sigma).norm();
        let shown = on.added().diagonal();
        Some(LeftOff {
            usual: ParameterVector::from_fn(|p, _| usual(p)),
            shown: shown.map(|variance| variance.max(0.0).sqrt()),
        })
    }

    /// What a term explains where these others are on; absent if it is not tried.
    pub fn evidence(&self, term: ErrorTerm, others: &[ErrorTerm]) -> Option<Evidence> {
        let (of, before) = (self.numbers(&[term]), self.numbers(others));
        let n = of.0.len();
        if n == 0 {
            return None;
        }
        let without = TermsOn::new(&self.tried, before.clone())?.gain;
        let sigma = of.1.clone();
        let on = TermsOn::new(&self.tried, joined(of, before))?;
        let covariance = on.covariance.view((0, 0), (n, n)).into_owned();
        Some(Evidence::new(on.gain - without, &covariance, &sigma))
    }

    /// A term of its usual size as an explanation where these others are on; absent if the data show less of it than
    /// they leave open.
    pub fn explanation(&self, term: ErrorTerm, others: &[ErrorTerm]) -> Option<Explanation> {
        let (of, others) = (self.numbers(&[term]), self.numbers(others));
        if of.0.is_empty() || scaled(&self.tried, &of).symmetric_eigenvalues().max() <= 1.0 {
            return None;
        }
        let before = TermsOn::new(&self.tried, others.clone())?;
        let with = TermsOn::new(&self.tried, joined(of, others))?;
        let ln_likelihood_ratio = with.ln_likelihood_ratio();
        Some(Explanation {
            ln_likelihood_ratio,
            of_term: ln_likelihood_ratio - before.ln_likelihood_ratio(),
            added: with.added(),
        })
    }

    /// The calibration without a term that is on, and what the term explains. `None` if that is singular.
    pub fn without(&self, term: ErrorTerm) -> Option<(Fit, Evidence)> {
        let auxiliary = &self.own.auxiliary;
        let of_term =
            |k: &usize| AuxiliaryKind::of(*k).is_some_and(|kind| kind.error_term() == term);
        let off: Vec<usize> = auxiliary.estimated().filter(of_term).collect();
        let covariance = auxiliary.covariance.select_rows(&off).select_columns(&off);
        let values = DVector::from_iterator(off.len(), off.iter().map(|&k| auxiliary.values[k]));
        let cross = auxiliary.cross.select_columns(&off).transpose();
        let sigma: Vec<f64> = off.iter().map(|&k| auxiliary.prior_sigma[k]).collect();
        let factor = covariance.clone().cholesky()?;
        let gain = values.dot(&factor.solve(&values));
        let known = factor.solve(&cross);
        let mut fit = Fit::of(&self.own);
        fit.cost += gain;
        for p in 0..PARAMETERS {
            fit.variance[p] -= cross.column(p).dot(&known.column(p));
        }
        Some((fit, Evidence::new(gain, &covariance, &sigma)))
    }
}

/// Numbers and σ of two sets of parameters.
fn joined(one: (Vec<usize>, Vec<f64>), other: (Vec<usize>, Vec<f64>)) -> (Vec<usize>, Vec<f64>) {
    ([one.0, other.0].concat(), [one.1, other.1].concat())
}

/// Parameters that were off, after the data.
pub struct TermsOn {
    /// 1σ of each before the data.
    sigma: Vec<f64>,
    /// By how much the cost falls with them.
    gain: f64,
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Logarithm of the determinant of their covariance before the data over that after them.
    log_determinant: f64,
    /// What one of each changes the parameters of both triads by.
    effect: DMatrix<f64>,
}

impl TermsOn {
    /// By their numbers and σ. `None` if that is singular.
    fn new(tried: &Tried, (numbers, sigma): (Vec<usize>, Vec<f64>)) -> Option<Self> {
        let n = numbers.len();
        let score = DVector::from_fn(n, |i, _| tried.score[numbers[i]] * sigma[i]);
        let effect = tried.of_parameters.select_columns(&numbers);
        let information = scaled(tried, &(numbers, sigma.clone())) + DMatrix::identity(n, n);
        let factor: Cholesky<f64, Dyn> = information.cholesky()?;
        let scaled = factor.solve(&score);
        let inverse = factor.inverse();
        Some(Self {
            gain: score.dot(&scaled),
            mean: DVector::from_fn(n, |i, _| scaled[i] * sigma[i]),
            covariance: DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * sigma[i] * sigma[j]),
            log_determinant: 2.0 * factor.l().diagonal().map(f64::ln).sum(),
            effect,
            sigma,
        })
    }

    /// ln of the likelihood with them over that without, whatever their values are.
    fn ln_likelihood_ratio(&self) -> f64 {
        0.5 * (self.gain - self.log_determinant)
    }

    /// Mean square by which they change the parameters of both triads.
    pub fn added(&self) -> ParameterMatrix {
        let mean_square = &self.covariance + &self.mean * self.mean.transpose();
        let of_parameters = &self.effect * mean_square * self.effect.transpose();
        ParameterMatrix::from_fn(|i, j| of_parameters[(i, j)])
    }
}

/// Information of parameters that are tried, each in units of its σ.
fn scaled(tried: &Tried, (numbers, sigma): &(Vec<usize>, Vec<f64>)) -> DMatrix<f64> {
    let n = numbers.len();
    DMatrix::from_fn(n, n, |i, j| {
        tried.information[(numbers[i], numbers[j])] * sigma[i] * sigma[j]
    })
}
