//! Uncertainty due to biases that may vary unobserved.

use rayon::prelude::*;
use serde_json::json;

use crate::calibration::checks::finding::widened_by;
use crate::calibration::model::usual_variation;
use crate::calibration::noise::LOG_SIGMA;
use crate::calibration::{
    CalibrationError, ErrorTerm, ErrorTermTest, Finding, FindingKind as Kind, Outcome,
    ParameterMatrix, Posterior, Problem, Role,
};
use crate::imu::{GaussMarkov, Noise, Sensor};
use crate::run::Aiding;

/// Smallest reported growth of σ.
const SAID: f64 = 1.05;
/// Values tried for σ of a varying bias, in 1σ of its logarithm around the usual value.
const SIGMAS: [f64; 5] = [-2.0, -1.0, 0.0, 1.0, 2.0];

/// Addition to the covariance of an estimate for biases that may vary although the record does not show it; `None` if
/// the stated noise is used, if the biases of both triads vary in the model already, or if a table is read, whose
/// attitudes show bias variation.
///
/// A short recording hardly shows a slowly varying bias, and the likelihood that selected the noise prefers the simpler
/// model. If the data contradict the stated noise, its statement of constant biases is not reliable either. Constant
/// and varying biases of a triad then have equal prior probabilities, with σ lognormal around the usual value, as for
/// any stated figure. The mean square error of the estimate averages these models by their posterior probabilities
/// (Hoeting, Madigan, Raftery, Volinsky 1999; see [`super::test_error_terms`]). Several values of σ are needed: with
/// only the usual one, σ of an accelerometer bias of a hand-turned recording is half as large.
///
/// # Errors
/// [`CalibrationError`] if the problem is not the one of the outcome.
pub fn bias_variation(
    problem: &Problem,
    outcome: &Outcome,
    tests: &[ErrorTermTest],
) -> Result<Option<ParameterMatrix>, CalibrationError> {
    let seen =
        |test: &ErrorTermTest| test.term == ErrorTerm::GaussMarkovBias && test.role != Role::None;
    let table = problem.model.aiding == Aiding::Table;
    if table || !outcome.noise.learnt || tests.iter().any(seen) {
        return Ok(None);
    }
    let stated = &problem.model.noise;
    let problem = &outcome.as_calibrated(problem);
    let constant = |&sensor: &Sensor| problem.model.noise.get(sensor).gauss_markov.is_none();
    let sensors: Vec<Sensor> = Sensor::ALL.into_iter().filter(constant).collect();
    if sensors.is_empty() {
        return Ok(None);
    }
    let own = outcome.posterior(problem, &outcome.reduction(problem)?);
    let of_sensors = sensors.par_iter().map(|&sensor| {
        let stated = stated.get(sensor);
        of_one(problem, outcome, &own, sensor, stated)
    });
    let of_sensors = of_sensors.collect::<Result<Vec<_>, _>>()?;
    Ok(Some(of_sensors.into_iter().sum()))
}

/// The finding, with the growth of the σ that grew most.
pub fn biases_may_vary(growth: f64) -> Option<Finding> {
    let text = format!(
        "You stated no bias instability, and this record is too short to measure it. turncal assumed a typical value, \
         which widens σ {}. Measure it with turncal allan on a longer static record and state it in [imu.noise].",
        widened_by(growth)
    );
    let figures = json!({ "growth": growth });
    (growth >= SAID).then(|| Finding::new(Kind::BiasesMayVary, text, figures))
}

/// The same for the biases of one triad.
fn of_one(
    problem: &Problem,
    outcome: &Outcome,
    own: &Posterior,
    sensor: Sensor,
    stated: &Noise,
) -> Result<ParameterMatrix, CalibrationError> {
    let usual = usual_variation(stated);
    let density = |z: &f64| (-0.5 * z * z).exp();
    let all: f64 = SIGMAS.iter().map(density).sum();
    let (mut weights, mut sum) = (1.0, ParameterMatrix::zeros());
    let varied = |variation: GaussMarkov| {
        problem.with(|model| model.noise.get_mut(sensor).gauss_markov = Some(variation))
    };
    let varying = varied(usual);
    let (script, accepted) = (outcome.script(&varying)?, outcome.accepted());
    for sigma in &SIGMAS {
        // What the filter cannot run with is not likely.
        let problem = varied(GaussMarkov {
            sigma: usual.sigma * (sigma * LOG_SIGMA).exp(),
            ..usual
        });
        let Ok(reduction) = script.reduce(&problem, &accepted) else {
            continue;
        };
        let with = outcome.posterior(&problem, &reduction);
        let ratio = (0.5 * (own.deviance - with.deviance)).exp();
        let weight = ratio * density(sigma) / all;
        if weight.is_finite() {
            weights += weight;
            sum += with.added_to(own) * weight;
        }
    }
    Ok(sum / weights)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::UNWATCHED;
    use crate::calibration::parameters::parameter;
    use crate::calibration::{BudgetSource, Method, NoisePolicy, Options};
    use crate::run::Run;
    use crate::simulation::Scenario;

    /// Fixed before the first run was made.
    const SEED: u64 = 13;

    fn solved(run: &Run, aiding: Aiding, noise: NoisePolicy) -> Outcome {
        let options = Options::default().aiding(aiding).noise(noise);
        let problem = Problem::new(run, &options);
        let mut solution = problem.solve(Method::Ekf, UNWATCHED).unwrap();
        solution.assess(&problem).unwrap();
        solution.outcome().unwrap().clone()
    }

    #[test]
    fn stated_noise_that_the_data_bear_out_or_a_table_says_that_biases_are_constant() {
        let run = Scenario::load("demo")
            .unwrap()
            .simulate(SEED, 0)
            .unwrap()
            .run;
        for (aiding, noise) in [
            (Aiding::Velocity, NoisePolicy::Stated),
            (Aiding::Table, NoisePolicy::Learnt),
        ] {
            let outcome = solved(&run, aiding, noise);
            assert_eq!(outcome.part(BudgetSource::UnseenVariation).amax(), 0.0);
        }
    }

    #[test]
    fn biases_are_less_sure_where_nobody_says_that_they_are_constant_and_nothing_is_surer() {
        let run = Scenario::load("demo")
            .unwrap()
            .simulate(SEED, 0)
            .unwrap()
            .run;
        let outcome = solved(&run, Aiding::Velocity, NoisePolicy::Learnt);
        let of = outcome.part(BudgetSource::UnseenVariation);
        let variance = outcome.estimate.covariance.diagonal();
        let without = variance - of.diagonal();
        for sensor in Sensor::ALL {
            if outcome.model.noise.get(sensor).gauss_markov.is_some() {
                continue;
            }
            for bias in (9..12).map(|of_triad| parameter(sensor, of_triad)) {
                let growth = (variance[bias] / without[bias]).sqrt();
                println!("σ of bias {bias} grows {growth:.2} times");
                assert!(growth > 1.0 && growth.is_finite());
            }
        }
        // Of a mean square error no direction is less than without.
        let over_sigma = ParameterMatrix::from_fn(|i, j| match without[i] * without[j] {
            0.0 => 0.0,
            product => of[(i, j)] / product.sqrt(),
        });
        let least = over_sigma.symmetric_eigenvalues().min();
        assert!(least > -1e-3, "{least}");
    }
}
