//! Legs of a path (a move and the dwell after it): each is made once, and joined to the bounds of many paths.

use nalgebra::DMatrix;

use super::bound::at_truth;
use super::chain::{Effect, Forward, Link, Sizes, Slip, States};
use super::constants::{inverse, parameters};
use super::sizes::Effects;
use super::{
    AttitudePrior, CalibrationError, Constant, ErrorTerm, Estimate, Linearisation, ParameterVector,
    Prior, Problem, Script, of_parameters,
};
use crate::imu::{PerSensor, TermVector, Triad};
use crate::turntable::AxisError;

/// A move and the dwell after it, or the first dwell.
#[derive(Debug, Clone)]
pub struct Leg {
    links: Vec<Link>,
    /// Number of rows of the links that are not affected by the noise at rest: the position of each new dwell.
    of_position: usize,
}

/// Information on the parameters after some legs: the bound of their path with the stated noise, as [`super::bound`]; with
/// automatic terms, that of an instrument that has every term with its usual size.
#[derive(Debug, Clone)]
pub struct Journey {
    filter: Forward,
    constants: Vec<Constant>,
    /// Information of the prior and of all rows.
    information: DMatrix<f64>,
}

impl Leg {
    /// The legs of a recording in order, linearised at its truth, with this prior of the attitude at the start of each
    /// stretch.
    ///
    /// # Errors
    /// [`CalibrationError`] if the recording cannot be reduced.
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
            match legs.get_mut(link.dwell) {
                Some(leg) => leg.links.push(link),
                None => legs.push(Self {
                    of_position: if legs.is_empty() { 0 } else { 3 },
                    links: vec![link],
                }),
            }
        }
        Ok(legs)
    }

    /// The leg with a dwell of another length, as a factor of the variance of its noise at rest.
    fn dispersed(&self, factor: f64) -> Vec<Link> {
        let mut links = self.links.clone();
        for (number, link) in links.iter_mut().enumerate() {
            let first = if number == 0 { self.of_position } else { 0 };
            let of_dwell = link.rows.values.len() - first;
            let root = factor.sqrt();
            link.rows.states.rows_mut(first, of_dwell).unscale_mut(root);
            let mut constants = link.rows.constants.rows_mut(first, of_dwell);
            constants.unscale_mut(root);
            link.transition.covariance *= factor;
        }
        links
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
        Self {
            filter: Forward::new(
                States::new(model, problem.one_gravity()).count,
                constants.len(),
            ),
            information: DMatrix::from_diagonal(&prior.sigma.map(|sigma| sigma.powi(-2))),
            constants,
        }
    }

    /// The journey with another leg, whose noise at rest has its variance multiplied by a factor.
    ///
    /// # Errors
    /// [`CalibrationError::Diverged`] if a covariance is not positive definite.
    pub fn go(&mut self, leg: &Leg, factor: f64) -> Result<(), CalibrationError> {
        // With stated noise, nothing slips.
        let sizes = [Slip::Mount, Slip::Base].into_iter();
        let sizes = sizes.fold(Sizes::default(), |sizes, slip| {
            sizes.with(Effect::Slip(slip), 0.0)
        });
        for link in leg.dispersed(factor) {
            let seen = self.filter.pass(&link, &sizes)?.of_constants;
            self.information.gemm_tr(1.0, &seen, &seen, 1.0);
        }
        Ok(())
    }

    /// 1σ of the parameters of both triads; `None` if a constant is undetermined.
    pub fn sigma(&self) -> Option<ParameterVector> {
        let (covariance, _) = inverse(&self.information)?;
        let mut sigma = ParameterVector::zeros();
        for (k, index) in parameters(&self.constants) {
            sigma[index] = covariance[(k, k)].sqrt();
        }
        Some(sigma)
    }

    /// The truth, with its covariance; `None` if a constant is undetermined.
    pub fn estimate(&self, truth: &PerSensor<Triad>) -> Option<Estimate> {
        let (covariance, _) = inverse(&self.information)?;
        Some(Estimate {
            triads: *truth,
            covariance: of_parameters(&self.constants, &covariance),
        })
    }
}

/// The problem at a truth. Terms that may be absent have their usual sizes, except wobble and encoder errors: of these,
/// there are many, and they average out over the angles of a path.
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
                journey.sigma().unwrap()
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
