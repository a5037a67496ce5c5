//! Legs of a path (a move and the dwell after it): each is made once, and joined to the bounds of many paths.

use nalgebra::{Cholesky, DMatrix};

use super::bound::at_truth;
use super::chain::{Effect, Forward, Link, Rows, Sizes, States, Transition};
use super::constants::{inverse, parameters};
use super::sizes::Effects;
use super::{
    AttitudePrior, CalibrationError, Constant, ErrorTerm, Estimate, Linearisation, ParameterVector,
    Prior, Problem, Script, of_parameters,
};
use crate::imu::{PerSensor, TermVector, Triad};
use crate::turntable::AxisError;

/// Number of rows that describe a new position.
const PLACE: usize = 3;

/// A move and the dwell after it, or the first dwell.
#[derive(Debug, Clone)]
pub struct Leg {
    parts: Vec<Part>,
}

/// A link without its drives.
#[derive(Debug, Clone)]
struct Part {
    link: Link,
    /// Covariance of the drives: noise of the move, a new position.
    driven: DMatrix<f64>,
    /// Number of the first rows that are not affected by the noise at rest: those that describe a new position.
    of_place: usize,
}

/// The error terms of an instrument, among those that may be absent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Terms {
    /// Every term, with its typical magnitude.
    All,
    /// No term.
    None,
}

/// Information on the parameters after some legs: the bound of their path with the stated noise, as [`super::bound`].
#[derive(Debug, Clone)]
pub struct Journey {
    filter: Forward,
    constants: Vec<Constant>,
    /// Whether each constant belongs to an error term that may be absent.
    may_be_absent: Vec<bool>,
    /// Information of the prior and of all rows.
    information: DMatrix<f64>,
}

impl Leg {
    /// The legs of a recording in order, linearised at its truth, with this prior of the attitude at the start of each
    /// stretch.
    ///
    /// # Errors
    /// Returns [`CalibrationError`] if the recording cannot be reduced.
    pub fn all(
        problem: &Problem,
        (truth, terms): (&PerSensor<Triad>, &TermVector),
        start: &[AttitudePrior],
    ) -> Result<Vec<Self>, CalibrationError> {
        let problem = at_usual_sizes(problem, truth);
        let means = start.iter().map(|prior| prior.mean).collect();
        let at = Linearisation::new(*truth, *terms, means);
        let script = Script::new(&problem, start, &at)?;
        let chain = Effects::new(&problem).chain(&problem, &script)?;
        let mut legs: Vec<Self> = Vec::new();
        for link in chain.links {
            let is_new = link.dwell == legs.len();
            let of_place = if is_new && !link.begins { PLACE } else { 0 };
            let part = Part::new(link, of_place);
            match legs.last_mut().filter(|_| !is_new) {
                Some(leg) => leg.parts.push(part),
                None => legs.push(Self { parts: vec![part] }),
            }
        }
        Ok(legs)
    }
}

impl Part {
    fn new(mut link: Link, of_place: usize) -> Self {
        let count = link.transition.offset.len();
        let mut driven = DMatrix::zeros(count, count);
        for drive in std::mem::take(&mut link.transition.drives) {
            // With stated noise, nothing slips.
            if !matches!(drive.effect, Effect::Slip(_)) {
                driven.gemm(1.0, &drive.by, &drive.by.transpose(), 1.0);
            }
        }
        Self {
            link,
            driven,
            of_place,
        }
    }

    /// The transition and rows if the variance of the noise at rest is multiplied by a factor.
    fn dispersed(&self, factor: f64) -> (Transition, Rows) {
        let (mut transition, mut rows) = (self.link.transition.clone(), self.link.rows.clone());
        transition.covariance *= factor;
        transition.covariance += &self.driven;
        let of_dwell = self.of_place..rows.values.len();
        let (first, count) = (of_dwell.start, of_dwell.len());
        let root = factor.sqrt();
        rows.states.rows_mut(first, count).unscale_mut(root);
        rows.constants.rows_mut(first, count).unscale_mut(root);
        (transition, rows)
    }
}

impl Journey {
    /// The prior of a problem in the form of a truth, before the first leg.
    pub fn new(problem: &Problem, (truth, terms): (&PerSensor<Triad>, &TermVector)) -> Self {
        let problem = at_usual_sizes(problem, truth);
        let model = &problem.model;
        let constants = Constant::all(model, problem.one_gravity());
        let at = Linearisation::new(*truth, *terms, Vec::new());
        let prior = Prior::new(&constants, model, &at);
        let may_be_absent = |of: &Constant| {
            let term = of.error_term();
            term.is_some_and(|term| model.may_have.contains(&term))
        };
        Self {
            may_be_absent: constants.iter().map(may_be_absent).collect(),
            filter: Forward::new(
                States::new(model, problem.one_gravity()).count,
                constants.len(),
            ),
            information: DMatrix::from_diagonal(&prior.sigma.map(|sigma| sigma.powi(-2))),
            constants,
        }
    }

    /// The journey extended by a leg, with the variance of the noise at rest multiplied by a factor.
    ///
    /// # Errors
    /// Returns [`CalibrationError::Diverged`] if a covariance is not positive definite.
    pub fn go(&mut self, leg: &Leg, factor: f64) -> Result<(), CalibrationError> {
        for part in &leg.parts {
            let (transition, rows) = part.dispersed(factor);
            let time = part.link.time;
            let seen = self.filter.step(&transition, &rows, &Sizes::default());
            let (seen, _) = seen.ok_or(CalibrationError::Diverged { time })?;
            let rows = &seen.of_constants;
            // A product with a transposed copy is several times faster than `gemm_tr`.
            self.information.gemm(1.0, &rows.transpose(), rows, 1.0);
        }
        Ok(())
    }

    /// Whether the instrument may have error terms that may also be absent.
    pub fn may_have_terms(&self) -> bool {
        self.may_be_absent.contains(&true)
    }

    /// Indices of the constants that an instrument has.
    fn present(&self, terms: Terms) -> Vec<usize> {
        let all = 0..self.constants.len();
        all.filter(|&k| terms == Terms::All || !self.may_be_absent[k])
            .collect()
    }

    /// 1σ of the parameters of both triads; `None` if a constant is undetermined.
    pub fn sigma(&self, terms: Terms) -> Option<ParameterVector> {
        let of_triads: Vec<(usize, usize)> = parameters(&self.constants).collect();
        // The parameters last: the last block of the root is that of their covariance.
        let is_other = |k: &usize| of_triads.iter().all(|(of, _)| of != k);
        let others = self.present(terms).into_iter().filter(is_other);
        let order: Vec<usize> = others.chain(of_triads.iter().map(|&(k, _)| k)).collect();
        let count = of_triads.len();
        let first = order.len() - count;
        let information = self.information.select_rows(&order).select_columns(&order);
        // Scaled so that the diagonal is one.
        let scale = information.diagonal().map(|value| value.sqrt().recip());
        let scaled = DMatrix::from_fn(order.len(), order.len(), |i, j| {
            information[(i, j)] * scale[i] * scale[j]
        });
        let root = Cholesky::new(scaled)?.unpack();
        let mut inverse = DMatrix::identity(count, count);
        let last = root.view((first, first), (count, count));
        let solved = last.solve_lower_triangular_mut(&mut inverse);
        let mut sigma = ParameterVector::zeros();
        for (k, &(_, index)) in of_triads.iter().enumerate() {
            sigma[index] = inverse.column(k).norm() * scale[first + k];
        }
        solved.then_some(sigma)
    }

    /// The truth, with its covariance; `None` if a constant is undetermined.
    pub fn estimate(&self, truth: &PerSensor<Triad>, terms: Terms) -> Option<Estimate> {
        let present = self.present(terms);
        let information = self.information.select_rows(&present);
        let (covariance, _) = inverse(&information.select_columns(&present))?;
        let constants: Vec<Constant> = present.iter().map(|&k| self.constants[k]).collect();
        Some(Estimate {
            triads: *truth,
            covariance: of_parameters(&constants, &covariance),
        })
    }
}

/// The problem at a truth. Terms that may be absent have their typical magnitudes, except wobble and encoder errors: of
/// these, there are many, and they average out over the angles of a path.
fn at_usual_sizes<'a>(problem: &Problem<'a>, truth: &PerSensor<Triad>) -> Problem<'a> {
    let averages_out = |term: &ErrorTerm| {
        use AxisError::{Encoder, Wobble};
        matches!(term, ErrorTerm::TableAxes(Wobble | Encoder))
    };
    at_truth(problem, truth).with(|model| {
        model.may_have.retain(|term| !averages_out(term));
        model.may_be_elsewhere = false;
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::{Options, bound, coarse_start};
    use crate::simulation::Scenario;

    #[test]
    fn the_legs_of_a_recording_joined_have_its_bound() {
        for name in ["demo", "mems"] {
            let simulated = Scenario::load(name).unwrap().simulate(1, 0).unwrap();
            let at = (&simulated.truth, &simulated.terms);
            let sigma = |options: &Options| {
                let problem = Problem::new(&simulated.run, options);
                let start = coarse_start(&problem).unwrap().attitudes;
                let mut journey = Journey::new(&problem, at);
                for leg in Leg::all(&problem, at, &start).unwrap() {
                    journey.go(&leg, 1.0).unwrap();
                }
                journey.sigma(Terms::All).unwrap()
            };
            let certain = Options::default().no_auto_terms();
            let (joined, with_terms) = (sigma(&certain), sigma(&Options::default()));
            let problem = Problem::new(&simulated.run, &certain);
            let whole = bound(&problem, at.0, at.1).unwrap().estimate.sigma();
            for (k, whole) in whole.iter().enumerate() {
                assert!((joined[k] / whole - 1.0).abs() < 1e-6, "{name} {k}");
                assert!(with_terms[k] > whole * (1.0 - 1e-6), "{name} {k}");
            }
            // Turns at two rates hardly separate a nonlinearity from a scale factor.
            assert!(with_terms[0] > 3.0 * whole[0], "{name}");
        }
    }
}
