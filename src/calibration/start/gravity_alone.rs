//! An instrument without gyros, or whose gyros turn between no two dwells: what gravity at rest says of it.
//!
//! The magnitude of gravity in the dwells gives the accelerometers, and the rates at rest give the gyro biases.

use super::coarse::{by_magnitude, calibrated, dwells};
use super::equations::Equations;
use super::gravity::{AtRest, add_magnitude, events};
use crate::calibration::checks::prior_distance::widened;
use crate::calibration::checks::residuals::Residuals;
use crate::calibration::linearisation::singular;
use crate::calibration::model::usual_variation;
use crate::calibration::{
    CalibrationError, Estimate, Model, NoisePolicy, ParameterMatrix, Problem, from_vector,
    to_vector,
};
use crate::imu::{Noise, PerSensor, Sensor, Triad};
use crate::recording::{LabelledMotion, Segment};
use crate::run::Aiding;

impl Problem<'_> {
    /// Whether gravity at rest is all that the runs show.
    pub fn shows_gravity_alone(&self) -> bool {
        let turns = |of: &Segment| matches!(of.motion, Some(LabelledMotion::Turns { .. }));
        let moved = self.stretches().iter().any(|of| of.dwells.len() != 1)
            || self.stretches().len() < 2
            || self
                .runs()
                .any(|run| run.recording.segments.iter().any(turns));
        self.model.aiding == Aiding::Velocity
            && self.model.thermal.is_none()
            && (self.lacks(Sensor::Gyro) || !moved)
    }

    /// Whether a run lacks a triad.
    pub fn lacks(&self, sensor: Sensor) -> bool {
        self.runs().any(|run| !run.recording.imu.has(sensor))
    }
}

/// The estimate, with residuals of its equations.
pub struct Standing {
    pub estimate: Estimate,
    pub residuals: Residuals,
    pub rests: Vec<Vec<AtRest>>,
}

/// Accelerometers and, where there are gyros, their biases from the dwells of a problem.
///
/// A prior that the dwells contradict is widened, so that it does not draw what they hardly show.
pub fn standing(problem: &Problem) -> Result<Standing, CalibrationError> {
    let rests = with_bias_variation(problem, dwells(problem)?);
    let first = solved(problem, &rests)?;
    let wide = widened(&problem.model, &first.0);
    let (estimate, residuals) = match wide {
        Some(model) => solved(&problem.with_model(model), &rests)?,
        None => first,
    };
    Ok(Standing {
        estimate: Estimate::with_curvature(estimate.triads, &estimate.covariance),
        residuals,
        rests,
    })
}

fn solved(
    problem: &Problem,
    rests: &[Vec<AtRest>],
) -> Result<(Estimate, Residuals), CalibrationError> {
    let (triads, equations) = if problem.lacks(Sensor::Gyro) {
        let triads = by_magnitude(problem, rests)?;
        (triads, of_accelerometers(problem, rests, &triads)?)
    } else {
        let turned = calibrated(problem, rests)?;
        (turned.at.triads, turned.equations)
    };
    let solution = equations.solved().ok_or_else(|| singular(&triads))?;
    let estimate = Estimate {
        triads: from_vector(problem.model.form, &(to_vector(&triads) + solution.step)),
        covariance: of_prior(&problem.model, &equations) + solution.covariance,
    };
    Ok((estimate, solution.residuals))
}

/// Equations of the accelerometers alone.
fn of_accelerometers(
    problem: &Problem,
    rests: &[Vec<AtRest>],
    triads: &PerSensor<Triad>,
) -> Result<Equations, CalibrationError> {
    let mut equations = Equations::of_triads(&problem.model, triads, &[Sensor::Accel]);
    add_magnitude(&mut equations, problem, rests, triads)?;
    equations.events = events(problem, rests);
    equations.correlated = true;
    Ok(equations)
}

/// Prior covariance of what the equations leave out.
fn of_prior(model: &Model, equations: &Equations) -> ParameterMatrix {
    let mut variances = model.prior_sigma.map(|sigma| sigma.powi(2));
    equations.unknown.iter().for_each(|&k| variances[k] = 0.0);
    ParameterMatrix::from_diagonal(&variances)
}

/// Adds the usual bias variation where none is stated: no dwell averages it out.
fn with_bias_variation(problem: &Problem, mut rests: Vec<Vec<AtRest>>) -> Vec<Vec<AtRest>> {
    if problem.options.noise == NoisePolicy::Stated {
        return rests;
    }
    for (stretch, rests) in problem.stretches().iter().zip(&mut rests) {
        for sensor in Sensor::ALL {
            let noise = stretch.run.instrument.noise.get(sensor);
            let varies = Noise {
                gauss_markov: Some(usual_variation(noise)),
                ..Noise::default()
            };
            for rest in rests.iter_mut().filter(|_| noise.gauss_markov.is_none()) {
                let variance = varies.covariance_of_means(rest.times, rest.times);
                rest.mean.get_mut(sensor).variance += variance;
            }
        }
    }
    rests
}
