//! Test of every error term: its cost in σ, its improvement of the fit, and the best explanation.
//!
//! One reduction serves all constant terms, in any combination (see [`crate::calibration::reduction`]). Varying
//! biases are not constant and need a reduction of their own.

mod bias_variation;
mod evidence;
mod terms_on;

use serde::{Deserialize, Serialize};
use serde_json::json;

use super::finding::widened_by;
use crate::calibration::{
    CalibrationError, ErrorTerm, Finding, FindingKind as Kind, Group, Outcome, PARAMETERS,
    ParameterMatrix, Posterior, Problem,
};
use crate::statistics::{FALSE_ALARM, ln_survival};
pub use bias_variation::{bias_variation, biases_may_vary};
pub use evidence::Evidence;
use terms_on::{Explanation, With, seen_and_left_off};
pub use terms_on::{TermsOn, UnmodelledEffect, with_everything};

/// Comparison of a calibration with and without an error term.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ErrorTermTest {
    /// The error term.
    pub term: ErrorTerm,
    /// Whether it was on in the calibration; if not, it was tested with its usual σ.
    pub on: bool,
    /// RMS σ of each of [`Group::all`] with the term divided by that without it; `None` if the group has no σ.
    pub sigma_factors: [Option<f64>; 6],
    /// Decrease of the cost, −2 ln of likelihood and prior, with the term; for varying biases, which
    /// are not constant, decrease of −2 ln of the likelihood of the whole recording.
    pub gain: f64,
    /// Limit of the gain at this term's share of the false-alarm rate: χ² with as many degrees of freedom as the
    /// term has observed states; for varying biases, from the rule that a likelihood ratio exceeds 1/p with probability
    /// p at most.
    pub limit: f64,
    /// −2 ln of the p-value of the gain, by which terms with different numbers of states
    /// are compared.
    pub significance: f64,
    /// Its role as an explanation of the recording.
    pub role: Role,
    /// Cost per scalar observation, which is NIS, without it …
    pub without: f64,
    /// … and with it.
    pub with: f64,
    /// Possible effect on the estimate of leaving it off; `None` if it is on, or not constant.
    #[serde(skip)]
    pub left_off: Option<UnmodelledEffect>,
}

/// Test result for an error term that is off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Role {
    /// None: it is on, or not observed, or another term explains the same.
    None,
    /// The most likely explanation of the recording.
    Likeliest,
    /// An explanation that cannot be distinguished from the most likely one.
    Alternative,
    /// Still significant with the most likely one on.
    Further,
}

/// Two explanations are distinguished if one is this many times more likely.
const ODDS: f64 = 20.0;

impl ErrorTermTest {
    /// The comparison of a calibration with the term and one without, before the roles are decided.
    fn new(term: ErrorTerm, on: bool, with: &Posterior, without: &Posterior) -> Self {
        let factor = |group: Group| {
            let of_group = (0..PARAMETERS).filter(|&i| Group::of(i) == group);
            let both = [with, without].map(|of| of.parameter_covariance.diagonal());
            let sums = of_group.map(|i| both.map(|variance| variance[i]));
            let [with, without] = sums.fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
            Some(f64::sqrt(with / without)).filter(|ratio| ratio.is_finite())
        };
        let mut factors = Group::all().map(factor);
        Self {
            term,
            on,
            sigma_factors: std::array::from_fn(|_| factors.next().flatten()),
            gain: without.cost - with.cost,
            limit: f64::INFINITY,
            significance: 0.0,
            role: Role::None,
            without: without.cost,
            with: with.cost,
            left_off: None,
        }
    }

    /// Whether the term is significant. A decrease of the cost by less than one corresponds to less than 1σ.
    pub fn significant(&self) -> bool {
        self.gain > self.limit.max(1.0)
    }

    /// Finding about the most likely disabled error term, with the terms that cannot be distinguished from it and those
    /// that remain significant with it on. `growth` is the factor by which σ were widened because these terms are off;
    /// `None` if σ do not include it.
    pub fn most_significant(tests: &[Self], growth: Option<f64>) -> Option<Finding> {
        let likeliest = tests.iter().find(|test| test.role == Role::Likeliest)?;
        let names = |role: Role| -> Vec<&str> {
            let of_role = tests.iter().filter(|test| test.role == role);
            of_role.map(|test| test.term.name()).collect()
        };
        let (alternatives, further) = (names(Role::Alternative), names(Role::Further));
        let (term, gain, limit) = (likeliest.term.name(), likeliest.gain, likeliest.limit);
        let mut text = format!(
            "An unmodelled error is visible, best explained by {term} (χ² falls by {gain:.0}; limit {limit:.0})."
        );
        for (names, words) in [
            (&alternatives, "This path cannot separate it from"),
            (&further, "With it on, also significant"),
        ] {
            if !names.is_empty() {
                text += &format!(" {words}: {}.", names.join(", "));
            }
        }
        if let Some(growth) = growth {
            text += &format!(" turncal widened σ {} to cover it.", widened_by(growth));
        }
        text += &format!(" Rerun with --with {term}.");
        let figures = json!({
            "term": term, "alternatives": alternatives, "further": further, "gain": gain, "limit": limit,
            "nis_without": likeliest.without, "nis_with": likeliest.with, "growth": growth
        });
        Some(Finding::new(Kind::ErrorTermSignificant, text, figures))
    }
}

/// The effect of every error term observable in the runs of a problem, and the addition to the covariance of the
/// estimate for terms that are not estimated although the data support them.
///
/// If the noise was estimated, terms are also tested with the stated noise, because a fit of noise alone treats
/// unmodelled errors as noise. A term that explains more than the estimated noise is the cause.
///
/// Source: for the test, Van Trees, *Detection, Estimation, and Modulation Theory*, part I, §2.5; for
/// conditioning, Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and
/// Navigation*, §1.4.14.
///
/// # Errors
/// [`CalibrationError`] if the problem is not the one of the outcome.
pub fn test_error_terms(
    problem: &Problem,
    outcome: &Outcome,
) -> Result<(Vec<ErrorTermTest>, Option<ParameterMatrix>), CalibrationError> {
    let as_calibrated = outcome.as_calibrated(problem);
    let of_record = Tested::new(&as_calibrated, outcome)?;
    if outcome.noise.learnt {
        let as_stated = outcome.with_prior(problem);
        let stated = Tested::new(&as_stated, outcome)?;
        let likeliest = stated.tests.iter().find(|t| t.role == Role::Likeliest);
        if likeliest.is_some_and(|test| test.significance > significance_of_noise(outcome)) {
            let left_off = of_record.left_off(&stated);
            return Ok((stated.tests, left_off));
        }
    }
    // What no term is significant for leaves σ as they are.
    let shown = of_record
        .tests
        .iter()
        .any(|test| test.role == Role::Likeliest);
    let left_off = shown.then(|| of_record.left_off(&of_record)).flatten();
    Ok((of_record.tests, left_off))
}

/// −2 ln of the p-value of the estimated noise, if the stated noise is correct.
fn significance_of_noise(outcome: &Outcome) -> f64 {
    let noise = &outcome.noise;
    let ratio = noise.test.map_or(0.0, |test| test.ratio);
    -2.0 * ln_survival(noise.sources.len().max(1) as f64, ratio)
}

/// Varying biases, the only term that is not constant.
const VARYING: ErrorTerm = ErrorTerm::GaussMarkovBias;

/// The tests of all terms with one noise model.
struct Tested<'a> {
    tests: Vec<ErrorTermTest>,
    terms: TermsOn<'a>,
    /// The posterior with varying biases if they are constant in the model, and vice versa.
    otherwise: With,
}

impl<'a> Tested<'a> {
    fn new(problem: &'a Problem, outcome: &'a Outcome) -> Result<Self, CalibrationError> {
        let model = &problem.model;
        let other = &problem.with(|other| {
            if model.has(VARYING) {
                other.switch_off(VARYING)
            } else {
                other.switch_on(VARYING)
            }
        });
        // The longer of the two first: a thread that is done with something else can take the other.
        let (otherwise, terms): (Result<With, CalibrationError>, Result<_, CalibrationError>) =
            rayon::join(
                || {
                    let reduction = outcome.reduction(other)?;
                    Ok(With::new(&reduction, &other.model, &outcome.linearised_at))
                },
                || {
                    let reduction = outcome.reduction(&with_everything(problem))?.folded();
                    Ok(TermsOn::new(problem, &outcome.linearised_at, reduction))
                },
            );
        let mut tested = Self {
            terms: terms?,
            otherwise: otherwise?,
            tests: Vec::new(),
        };
        let tried = ErrorTerm::ALL.into_iter();
        let tried: Vec<ErrorTerm> = tried.filter(|&term| model.can_have(term)).collect();
        let off = tried.iter().filter(|&&term| !model.has(term)).count();
        let chance = FALSE_ALARM / off.max(1) as f64;
        let scalars = 3.0 * outcome.innovations.len() as f64;
        let tests = tried.into_iter().filter_map(|term| {
            let test = tested.test(term, model.has(term), chance)?;
            Some(ErrorTermTest {
                without: test.without / scalars,
                with: test.with / scalars,
                ..test
            })
        });
        tested.tests = tests.collect();
        tested.decide(chance);
        Ok(tested)
    }

    /// The test of a term, with the costs of the whole record; `None` if the reduction does not include it.
    fn test(&self, term: ErrorTerm, on: bool, chance: f64) -> Option<ErrorTermTest> {
        let (terms, own) = (&self.terms, &self.terms.own);
        let other = match (term, on) {
            (VARYING, _) => &self.otherwise,
            (_, true) => &terms.without(term),
            (_, false) => &terms.with(&[term]),
        };
        let (with, without) = if on { (own, other) } else { (other, own) };
        let of_costs = ErrorTermTest::new(term, on, &with.posterior, &without.posterior);
        if term == VARYING {
            let gain = without.posterior.deviance - with.posterior.deviance;
            return Some(ErrorTermTest {
                gain,
                limit: -2.0 * chance.ln(),
                significance: gain,
                ..of_costs
            });
        }
        let evidence = terms.evidence(term, with, without)?;
        Some(ErrorTermTest {
            limit: evidence.limit(chance),
            significance: evidence.significance(),
            left_off: (!on).then(|| terms.left_off(term)).flatten(),
            ..of_costs
        })
    }

    /// Gives each test its role: the most likely explanation first, then terms that are significant with it on, until
    /// none is.
    fn decide(&mut self, chance: f64) {
        let Self { tests, terms, .. } = self;
        let shown = tests.iter_mut().filter(|t| !t.on && t.significant());
        let Some(likeliest) = shown.max_by(|a, b| a.significance.total_cmp(&b.significance)) else {
            return;
        };
        likeliest.role = Role::Likeliest;
        let mut on = vec![likeliest.term];
        let told_apart = likeliest.significance - 2.0 * ODDS.ln();
        let limit = -2.0 * chance.ln();
        while !on.contains(&VARYING) {
            let others = tests.iter_mut();
            let others = others.filter(|test| !test.on && !on.contains(&test.term));
            let without: With = terms.with(&on);
            let others = others.filter_map(|test| {
                let with = terms.with(&[&on[..], &[test.term]].concat());
                let evidence = terms.evidence(test.term, &with, &without)?;
                Some((evidence.significance(), test))
            });
            match others.max_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((significance, test)) if significance > limit => {
                    test.role = Role::Further;
                    on.push(test.term);
                }
                _ => break,
            }
        }
        for test in tests {
            let alike = test.significant() && test.significance > told_apart;
            if test.role == Role::None && !test.on && alike {
                test.role = Role::Alternative;
            }
        }
    }

    /// Addition to the covariance of the estimate for terms that are off. The probability of each, and the other terms
    /// that are present, may come from a test with another noise model.
    fn left_off(&self, weights: &Self) -> Option<ParameterMatrix> {
        let terms = |which: &dyn Fn(&ErrorTermTest) -> bool| -> Vec<ErrorTerm> {
            let tests = weights.tests.iter().filter(|test| which(test));
            tests.map(|test| test.term).collect()
        };
        let (off, further) = (terms(&|t| !t.on), terms(&|t| t.role == Role::Further));
        let explanations = off.iter().filter_map(|&term| {
            let others: Vec<ErrorTerm> = further.iter().copied().filter(|&f| f != term).collect();
            let weight = weights.explanation(term, &others)?;
            let added = self.explanation(term, &others)?.added;
            Some(Explanation { added, ..weight })
        });
        let explanations: Vec<Explanation> = explanations.collect();
        seen_and_left_off(&explanations, off.len())
    }

    fn explanation(&self, term: ErrorTerm, others: &[ErrorTerm]) -> Option<Explanation> {
        if term != VARYING {
            return self.terms.explanation(term, others);
        }
        let is_on = |test: &ErrorTermTest| test.term == VARYING && test.on;
        if self.tests.iter().any(is_on) {
            return None;
        }
        let own = &self.terms.own.posterior;
        let otherwise = &self.otherwise.posterior;
        let ratio = 0.5 * (own.deviance - otherwise.deviance);
        let of_others = self.terms.with(others).posterior.added_to(own);
        Some(Explanation {
            ln_likelihood_ratio: ratio,
            of_term: ratio,
            added: otherwise.added_to(own) + of_others,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::pass::{Gate, PassResult, pass};
    use crate::calibration::reduction::Script;
    use crate::calibration::{Options, UNWATCHED, estimate};
    use crate::imu::Term;
    use crate::simulation::Scenario;
    use crate::turntable::AxisError;
    use approx::assert_relative_eq;

    /// A pass of the filter that has all that is on among its states.
    fn last_pass(problem: &Problem, outcome: &Outcome) -> PassResult {
        let at = &outcome.linearised_at;
        let script = Script::new(problem, &outcome.prior_attitudes, at).unwrap();
        pass(problem, &script, Gate::As(&outcome.accepted())).unwrap()
    }

    /// The test of a term against two passes.
    fn is_of_passes(test: &ErrorTermTest, with: &PassResult, without: &PassResult) {
        let gain = without.cost - with.cost;
        println!("{:?}: {} {gain}", test.term, test.gain);
        // Rounding of a pass leaves less than a tenth of what one state gains by chance.
        assert_relative_eq!(test.gain, gain, max_relative = 1e-3, epsilon = 0.1);
        for (group, factor) in Group::all().zip(test.sigma_factors) {
            let rms = |of: &PassResult| {
                let of_group = (0..PARAMETERS).filter(|&i| Group::of(i) == group);
                of_group
                    .map(|i| of.posterior.parameter_covariance[(i, i)])
                    .sum::<f64>()
                    .sqrt()
            };
            assert_relative_eq!(
                factor.unwrap(),
                rms(with) / rms(without),
                max_relative = 1e-4
            );
        }
    }

    #[test]
    fn a_term_that_is_taken_off_or_put_on_is_a_pass_without_or_with_it() {
        let order = ErrorTerm::Instrument(Term::AccelSecondOrder);
        let scenario = Scenario::load("real-table").unwrap().with_error_term(order);
        let run = scenario.simulate(23, 0).unwrap().run;
        let problem = Problem::new(&run, &Options::default());
        let outcome = estimate(&problem, UNWATCHED).unwrap();
        let (tests, _) = test_error_terms(&problem, &outcome).unwrap();
        let own = last_pass(&problem, &outcome);
        for (term, on) in [
            (order, true),
            (ErrorTerm::TableBase, true),
            (ErrorTerm::TableAxes(AxisError::Tilt), true),
            (ErrorTerm::Instrument(Term::GyroNonlinearity), false),
            (ErrorTerm::TableAxes(AxisError::Wobble), false),
        ] {
            let mut model = problem.model.clone();
            if on {
                model.switch_off(term)
            } else {
                model.switch_on(term)
            }
            let other = last_pass(&problem.with_model(model), &outcome);
            let test = tests.iter().find(|e| e.term == term).unwrap();
            assert_eq!(test.on, on);
            if on {
                is_of_passes(test, &own, &other)
            } else {
                is_of_passes(test, &other, &own)
            }
        }
    }
}
