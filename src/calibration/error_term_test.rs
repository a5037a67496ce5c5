//! What each error term costs in σ, and what it explains of the data.
//!
//! One pass more, with every error term that the runs can hold, answers for all constant ones: its
//! estimates and their covariance, given that some of them are zero, are those of a pass without them.
//! Varying biases are not constant; they take a pass of their own.

use nalgebra::{DMatrix, DVector, Dyn, linalg::Cholesky};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::auxiliary::{AUXILIARY, AuxiliaryKind};
use super::error::CalibrationError;
use super::error_term::ErrorTerm;
use super::finding::Finding;
use super::group::Group;
use super::model::Model;
use super::outcome::Outcome;
use super::parameters::{PARAMETERS, ParameterVector};
use super::pass::{Gate, Mode, PassResult, pass};
use super::problem::Problem;

/// An error term against the same calibration without it.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorTermTest {
    /// The error term.
    pub term: ErrorTerm,
    /// Whether it was on in the calibration; if not, it was tried with its usual σ.
    pub on: bool,
    /// RMS σ of each of [`Group::all`] with it over that without it; none where the group has
    /// no σ.
    pub sigma_factors: [Option<f64>; 6],
    /// By how much the cost, −2 ln of likelihood and prior, falls with it; for varying biases, which
    /// are not constant, −2 ln of the likelihood of the whole record.
    pub gain: f64,
    /// What the gain stays below but for a chance of one in ten thousand if its errors are not
    /// there: χ² with as many degrees as it has parameters; a ratio of likelihoods exceeds ten thousand
    /// with no more than that chance.
    pub limit: f64,
    /// Cost per scalar observation, which is NIS, without it …
    pub without: f64,
    /// … and with it.
    pub with: f64,
}

/// Chance that a term is found significant whose errors are not there. A run tries up to eight.
const FALSE_ALARM: f64 = 1e-4;

impl ErrorTermTest {
    /// Whether the data show it.
    pub fn significant(&self) -> bool {
        self.gain > self.limit
    }

    /// Of error terms that are off and that the data show, the one that explains most: the others may
    /// explain what is left once it is on.
    pub fn most_significant(tests: &[Self]) -> Option<Finding> {
        let shown = tests.iter().filter(|test| !test.on && test.significant());
        let most = shown.max_by(|a, b| a.gain.total_cmp(&b.gain))?;
        Some(Finding::ErrorTermSignificant {
            term: most.term.name(),
            gain: most.gain,
            limit: most.limit,
            nis_without: most.without,
            nis_with: most.with,
        })
    }
}

/// The effect of every error term that the runs of a problem can hold.
///
/// Source: for the test, Van Trees, *Detection, Estimation, and Modulation Theory*, part I, §2.5; for
/// conditioning, Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and
/// Navigation*, §1.4.14.
///
/// # Errors
/// [`CalibrationError`] where the problem is not the one of the outcome.
pub fn test_error_terms(
    problem: &Problem,
    outcome: &Outcome,
) -> Result<Vec<ErrorTermTest>, CalibrationError> {
    let problem = &outcome.with_noise(problem);
    let model = &problem.model;
    let scalars = 3.0 * outcome.innovations.len() as f64;
    let mut everything = model.clone();
    ErrorTerm::constant().for_each(|term| everything.switch_on(term));
    let varying = ErrorTerm::GaussMarkovBias;
    let mut otherwise = model.clone();
    if model.has(varying) {
        otherwise.switch_off(varying);
    } else {
        otherwise.switch_on(varying);
    }
    let again = |model: Model| once_more(&problem.with_model(model), outcome);
    let (joint, otherwise) = rayon::join(|| again(everything), || again(otherwise));
    let (joint, otherwise) = (Joint(joint?), otherwise?);
    let test = |term: ErrorTerm, with: &Fit, without: &Fit| ErrorTermTest {
        term,
        on: model.has(term),
        sigma_factors: sigma_factors(&with.variance, &without.variance),
        gain: without.cost - with.cost,
        limit: ChiSquared::new(term.states() as f64)
            .map_or(f64::INFINITY, |chi2| chi2.inverse_cdf(1.0 - FALSE_ALARM)),
        without: without.cost / scalars,
        with: with.cost / scalars,
    };

    let mut tests = Vec::new();
    if let Some(own) = joint.given(|term| model.has(term)) {
        let deviance = own.cost + outcome.log_determinant;
        let other_deviance = otherwise.cost + otherwise.log_determinant;
        let otherwise = Fit::of(&otherwise);
        let (with, without, gain) = if model.has(varying) {
            (&own, &otherwise, other_deviance - deviance)
        } else {
            (&otherwise, &own, deviance - other_deviance)
        };
        tests.push(ErrorTermTest {
            gain,
            limit: -2.0 * FALSE_ALARM.ln(),
            ..test(varying, with, without)
        });
    }
    for term in ErrorTerm::constant().filter(|&term| model.can_have(term)) {
        let on = |other: ErrorTerm| model.has(other) && other != term;
        let fits = joint
            .given(|other| on(other) || other == term)
            .zip(joint.given(on));
        tests.extend(fits.map(|(with, without)| test(term, &with, &without)));
    }
    Ok(tests)
}

/// The last pass of a calibration with another model.
fn once_more(problem: &Problem, outcome: &Outcome) -> Result<PassResult, CalibrationError> {
    let mode = Mode::Held(Gate::As(&outcome.innovations));
    pass(
        problem,
        &outcome.prior_attitudes,
        &outcome.linearised_at,
        mode,
    )
}

/// How well a calibration fits, and variance of the parameters of both triads.
struct Fit {
    cost: f64,
    variance: ParameterVector,
}

impl Fit {
    fn of(result: &PassResult) -> Self {
        Self {
            cost: result.cost,
            variance: result.covariance.diagonal(),
        }
    }
}

/// A calibration with every constant error term that the runs can hold.
struct Joint(PassResult);

impl Joint {
    /// The calibration with those terms alone: the parameters of all others are zero. `None` if their
    /// covariance is singular.
    fn given(&self, on: impl Fn(ErrorTerm) -> bool) -> Option<Fit> {
        let auxiliary = &self.0.auxiliary;
        let is_off = |k: &usize| {
            let term = AuxiliaryKind::of(*k).map(AuxiliaryKind::error_term);
            auxiliary.prior_sigma[*k] > 0.0 && term.is_some_and(|term| !on(term))
        };
        let off: Vec<usize> = (0..AUXILIARY).filter(is_off).collect();
        let mut fit = Fit::of(&self.0);
        if off.is_empty() {
            return Some(fit);
        }
        let n = off.len();
        let covariance = DMatrix::from_fn(n, n, |i, j| auxiliary.covariance[(off[i], off[j])]);
        let values = DVector::from_fn(n, |i, _| auxiliary.values[off[i]]);
        let cross = DMatrix::from_fn(n, PARAMETERS, |i, p| auxiliary.cross[(p, off[i])]);
        let covariance: Cholesky<f64, Dyn> = covariance.cholesky()?;
        fit.cost += values.dot(&covariance.solve(&values));
        let known = covariance.solve(&cross);
        for p in 0..PARAMETERS {
            fit.variance[p] -= cross.column(p).dot(&known.column(p));
        }
        Some(fit)
    }
}

fn sigma_factors(with: &ParameterVector, without: &ParameterVector) -> [Option<f64>; 6] {
    let mut cost = [None; 6];
    for (cost, group) in cost.iter_mut().zip(Group::all()) {
        let of_group = |i: &usize| Group::of(*i) == group;
        let sum =
            |of: &ParameterVector| -> f64 { (0..PARAMETERS).filter(of_group).map(|i| of[i]).sum() };
        let ratio = (sum(with) / sum(without)).sqrt();
        *cost = ratio.is_finite().then_some(ratio);
    }
    cost
}

#[cfg(test)]
mod tests {
    use super::super::{Options, estimate};
    use super::*;
    use crate::imu::Term;
    use crate::simulation::Scenario;
    use approx::assert_relative_eq;

    #[test]
    fn conditioning_on_zero_is_a_pass_without_the_term() {
        let order = ErrorTerm::Instrument(Term::AccelSecondOrder);
        let scenario = Scenario::load("real-table").unwrap().with_error_term(order);
        let run = scenario.simulate(23, 0).unwrap().run;
        let problem = Problem::new(&run, &Options::default());
        let outcome = estimate(&problem, &|_| {}).unwrap();
        let tests = test_error_terms(&problem, &outcome).unwrap();
        let with = Fit::of(&once_more(&problem, &outcome).unwrap());
        for term in [order, ErrorTerm::TableBase, ErrorTerm::TableAxes] {
            let mut other = problem.model.clone();
            other.switch_off(term);
            let other = problem.with_model(other);
            let without = Fit::of(&once_more(&other, &outcome).unwrap());
            let test = tests.iter().find(|e| e.term == term).unwrap();
            println!("{term:?}: {} {}", test.gain, without.cost - with.cost);
            assert!(test.on);
            assert_relative_eq!(test.gain, without.cost - with.cost, max_relative = 1e-3);
            for (a, b) in test
                .sigma_factors
                .iter()
                .zip(sigma_factors(&with.variance, &without.variance))
            {
                assert_relative_eq!(a.unwrap(), b.unwrap(), max_relative = 1e-4);
            }
        }
    }
}
