//! Each recording of a problem calibrated alone.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, SVector};
use rayon::prelude::*;

use super::day_to_day::{DayToDay, Difference};
use crate::calibration::noise::learn;
use crate::calibration::start::attempt::from_coarse_start;
use crate::calibration::{
    AttitudePrior, CalibrationError, Estimate, Gate, Iterated, Linearisation, Model, Problem,
    SeparateEstimate, Solved, UNWATCHED, coarse_start, from_vector, parameter, to_vector,
};
use crate::imu::{PerSensor, Sensor, THERMAL_FUNCTIONS, ThermalModel, ThermalRange, thermal_state};
use crate::run::Dwell;

/// Factor by which σ of a recording calibrated alone may exceed that of its noise: neglected effects may be
/// larger.
const BEYOND_NOISE: f64 = 10.0;

/// A recording that spans less than this part of the range counts as one temperature.
const PART_OF_RANGE: f64 = 0.1;

/// Calibrates each recording alone, in parallel, with the stated noise or, if the policy allows and the data demand it,
/// with the noise estimated from it.
pub fn each(problem: &Problem) -> Result<Vec<SeparateEstimate>, CalibrationError> {
    let runs = problem.runs().count();
    let plain = |number: usize| plain(&problem.recordings(|of| of == number), &problem.model);
    let all = (0..runs).into_par_iter();
    let all = all.map(|number| of(&plain(number), problem.model.thermal.as_ref()));
    let (mut all, contradicted): (Vec<SeparateEstimate>, Vec<bool>) =
        all.collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
    if contradicted.contains(&true)
        && let Some(model) = noise_of_all(problem, &all)
    {
        all.par_iter_mut().enumerate().for_each(|(number, alone)| {
            if let Some(estimate) = with_noise(alone, &plain(number).with_model(model.clone())) {
                alone.estimate = Some(estimate);
            }
        });
    }
    Ok(all)
}

/// The problem of a recording without differences between recordings and without temperature dependence.
fn plain<'a>(recording: &Problem<'a>, model: &Model) -> Problem<'a> {
    recording.with_model(model.clone()).with(|model| {
        model.thermal = None;
        model.day_to_day = DayToDay::default();
    })
}

/// Noise model estimated jointly from recordings that share no parameters. A short recording cannot show its own noise,
/// and differences between recordings must not be taken for noise.
fn noise_of_all(problem: &Problem, alone: &[SeparateEstimate]) -> Option<Model> {
    let known = |number: usize| alone[number].estimate.is_some();
    let problem = problem.recordings(known);
    let mut model = plain(&problem, &problem.model).model;
    model.day_to_day.parameters = model.prior_sigma;
    let problem = problem.with_model(model);
    let known: Vec<&SeparateEstimate> = alone
        .iter()
        .filter(|alone| alone.estimate.is_some())
        .collect();
    let priors: Vec<AttitudePrior> = known.iter().flat_map(|a| a.priors.clone()).collect();
    let attitudes = known.iter().flat_map(|a| a.at.initial_attitudes.clone());
    let mean = problem.model.prior_mean;
    let mut at = Linearisation::new(
        from_vector(problem.model.form, &mean),
        SVector::zeros(),
        attitudes.collect(),
    );
    let differences = known.iter().map(|alone| Difference {
        parameters: to_vector(&alone.at.triads) - mean,
        ..Difference::default()
    });
    at.own = differences.collect();
    let stated = Solved::of(&problem, priors, at, Gate::Innovations, UNWATCHED).ok()?;
    let learnt = learn(&problem, stated, UNWATCHED).ok()?;
    let of_all = || plain(&problem, &learnt.problem.model).model;
    learnt.noise.learnt.then(of_all)
}

/// Calibrates a recording alone with the stated or the estimated noise; also returns whether it contradicts the stated
/// noise.
fn of(
    plain: &Problem,
    thermal: Option<&Arc<ThermalModel>>,
) -> Result<(SeparateEstimate, bool), CalibrationError> {
    let run = plain.run();
    let temperature = run.recording.imu.temperature.as_ref();
    let span = temperature.map_or(0.0, |temperature| {
        let spans = Sensor::ALL.map(|sensor| temperature.range(sensor));
        spans
            .iter()
            .fold(0.0, |most: f64, [low, high]| most.max(high - low))
    });
    let middle = middle_temperature(plain);
    let state = thermal.zip(middle.as_ref());
    let state = state.map(|(thermal, at)| thermal_state(&thermal.range, at, &PerSensor::default()));
    // What changes within a recording has no calibration without its change.
    let whole = thermal.map_or(f64::INFINITY, |thermal| {
        let span = |range: &ThermalRange| range.highest - range.lowest;
        span(&thermal.range.gyro).max(span(&thermal.range.accel))
    });
    let stands = span < PART_OF_RANGE * whole;
    let solved = stands
        .then(|| from_coarse_start(plain, UNWATCHED).ok())
        .flatten();
    let solved = solved.map(|solved| learn(plain, solved.clone(), UNWATCHED).unwrap_or(solved));
    let contradicted = solved.as_ref().is_some_and(|solved| solved.noise.learnt);
    let estimate = solved
        .as_ref()
        .and_then(|solved| estimate(&solved.iterated));
    let (at, priors) = match solved {
        Some(solved) => (solved.iterated.estimate, solved.priors),
        None => {
            let start = coarse_start(&plain.with(|model| model.thermal = thermal.cloned()))?;
            (start.at, start.attitudes)
        }
    };
    let alone = SeparateEstimate {
        name: run.recording.name.clone(),
        temperature: middle,
        span,
        estimate,
        state,
        at,
        priors,
    };
    Ok((alone, contradicted))
}

/// Mean temperature of each axis in the middles of a recording's dwells, °C; `None` if unknown.
fn middle_temperature(recording: &Problem) -> Option<PerSensor<[f64; 3]>> {
    let imu = &recording.run().recording.imu;
    let temperature = imu.temperature.as_ref()?;
    let middle =
        |dwell: &Dwell| 0.5 * (imu.time(dwell.samples.start) + imu.time(dwell.samples.end));
    let times: Vec<f64> = recording.dwells().map(middle).collect();
    Some(PerSensor::from_fn(|sensor| {
        [0, 1, 2].map(|axis| {
            let values = times.iter().map(|&t| temperature.at(t).get(sensor)[axis]);
            values.sum::<f64>() / times.len().max(1) as f64
        })
    }))
}

/// The estimate of a recording alone with other noise.
fn with_noise(alone: &SeparateEstimate, recording: &Problem) -> Option<Estimate> {
    alone.estimate.as_ref()?;
    let (priors, at) = (alone.priors.clone(), alone.at.clone());
    let solved = Solved::of(recording, priors, at, Gate::Innovations, UNWATCHED).ok()?;
    estimate(&solved.iterated)
}

fn estimate(iterated: &Iterated) -> Option<Estimate> {
    iterated.converged.then(|| iterated.both_triads())
}

/// For a parameter: the common deviation from its prior mean, and the coefficient of each function of temperature, by
/// least squares through the recordings calibrated alone.
pub fn through(
    model: &Model,
    alone: &[SeparateEstimate],
    (sensor, of_triad, axis): (Sensor, usize, usize),
) -> DVector<f64> {
    let index = parameter(sensor, of_triad);
    let prior = model.prior_sigma[index];
    let n = 1 + THERMAL_FUNCTIONS;
    let mut sigma = DVector::zeros(n);
    sigma[0] = prior;
    if let Some(thermal) = &model.thermal {
        let coefficients = thermal.sigma.get(sensor).row(of_triad).transpose();
        sigma
            .rows_mut(1, THERMAL_FUNCTIONS)
            .copy_from(&coefficients);
    }
    let prior_mean = from_vector(model.form, &model.prior_mean);
    let own = model.day_to_day.covariance(&prior_mean)[(index, index)];
    let (mut normal, mut right) = (DMatrix::identity(n, n), DVector::zeros(n));
    for alone in alone {
        let known = alone.estimate.as_ref();
        let variance = known.map_or(0.0, |estimate| estimate.covariance[(index, index)]);
        // Without a σ the coarse start is as good as a tenth of what was known before.
        let variance = if variance > 0.0 {
            variance * BEYOND_NOISE.powi(2) + own
        } else {
            (0.1 * prior).powi(2) + own
        };
        let mut row = sigma.clone();
        for function in 0..THERMAL_FUNCTIONS {
            let state = alone.state.as_ref();
            row[1 + function] *= state.map_or(0.0, |s| s.get(sensor)[axis][function]);
        }
        let off = to_vector(&alone.at.triads)[index] - model.prior_mean[index];
        normal.ger(1.0 / variance, &row, &row, 1.0);
        right.axpy(off / variance, &row, 1.0);
    }
    // Positive definite by the prior.
    let solution = normal.cholesky().map(|factor| factor.solve(&right));
    solution.map_or_else(
        || DVector::zeros(n),
        |solution| solution.component_mul(&sigma),
    )
}
