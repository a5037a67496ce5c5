//! Each recording of a problem calibrated alone.

use nalgebra::{DMatrix, DVector, SVector};
use rayon::prelude::*;

use super::day_to_day::{DayToDay, Difference};
use super::separate_estimate::SeparateEstimate;
use crate::calibration::error::CalibrationError;
use crate::calibration::estimate::Estimate;
use crate::calibration::gauss_newton::{Iterated, UNWATCHED, iterate};
use crate::calibration::linearisation::{AttitudePrior, Linearisation};
use crate::calibration::model::Model;
use crate::calibration::noise::learn;
use crate::calibration::parameters::{from_vector, parameter, to_vector};
use crate::calibration::pass::Gate;
use crate::calibration::problem::Problem;
use crate::calibration::solved::Solved;
use crate::calibration::start::attempt::from_coarse_start;
use crate::calibration::start::coarse::coarse_start;
use crate::imu::{PerSensor, Sensor, THERMAL_FUNCTIONS, ThermalModel, ThermalRange};
use crate::run::Dwell;

/// A recording alone says less of a parameter than its noise does by this factor: what it leaves off may be
/// more.
const BEYOND_NOISE: f64 = 10.0;

/// A recording within this part of the range is at one temperature.
const PART_OF_RANGE: f64 = 0.1;

/// Each recording alone, on as many threads as there are, with the noise that is stated or, where it may be learnt
/// and has to be, with that of what each shows.
pub fn each(problem: &Problem) -> Result<Vec<SeparateEstimate>, CalibrationError> {
    let runs = problem.runs().count();
    let plain = |number: usize| plain(&problem.recordings(|of| of == number), &problem.model);
    let all = (0..runs).into_par_iter();
    let all = all.map(|number| of(&plain(number), problem.model.thermal.as_deref()));
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

/// The problem of a recording without what differs between recordings and temperatures.
fn plain<'a>(recording: &Problem<'a>, model: &Model) -> Problem<'a> {
    let mut model = model.clone();
    model.thermal = None;
    model.day_to_day = DayToDay::default();
    recording.with_model(model)
}

/// A model with the noise that recordings show which have no parameter in common: a short one does not show its own,
/// and what they differ by is no noise.
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
    let attitudes = known.iter().flat_map(|a| a.initial_attitudes.clone());
    let model = &problem.model;
    let mut at = Linearisation::new(
        from_vector(model.form, &model.prior_mean),
        SVector::zeros(),
        attitudes.collect(),
    );
    at.own = known
        .iter()
        .map(|alone| Difference {
            parameters: alone.start - model.prior_mean,
            ..Difference::default()
        })
        .collect();
    let passes = &mut Vec::new();
    let gate = Gate::Innovations;
    let iterated = iterate(&problem, &priors, at, gate, passes, UNWATCHED).ok()?;
    let stated = Solved::new(&problem, priors, iterated, Vec::new());
    let learnt = learn(&problem, stated, UNWATCHED).ok()?;
    let of_all = || plain(&problem, &learnt.problem.model).model;
    learnt.noise.learnt.then(of_all)
}

/// A recording alone with the noise that is stated or that it shows, and whether it shows other than is stated.
fn of(
    plain: &Problem,
    thermal: Option<&ThermalModel>,
) -> Result<(SeparateEstimate, bool), CalibrationError> {
    let run = plain.run();
    let temperature = run.recording.imu.temperature.as_ref();
    let span = temperature.map_or(0.0, |temperature| {
        Sensor::ALL
            .map(|sensor| {
                let [low, high] = temperature.range(sensor);
                high - low
            })
            .into_iter()
            .fold(0.0, f64::max)
    });
    let middle = middle_temperature(plain);
    let state = thermal.zip(middle.as_ref());
    let state = state.map(|(thermal, at)| thermal.range.state(at, &PerSensor::default()));
    let alone = |start, priors, initial_attitudes, estimate| SeparateEstimate {
        name: run.recording.name.clone(),
        temperature: middle,
        span,
        estimate,
        state,
        start,
        priors,
        initial_attitudes,
    };
    // What changes within a recording has no calibration without its change.
    let range = thermal.map(|thermal| thermal.range);
    let whole = range.map_or(f64::INFINITY, |range| {
        let span = |range: &ThermalRange| range.highest - range.lowest;
        span(&range.gyro).max(span(&range.accel))
    });
    let stands = span < PART_OF_RANGE * whole;
    let solved = stands.then(|| from_coarse_start(plain, UNWATCHED));
    Ok(match solved {
        Some(Ok(solved)) => {
            let solved = learn(plain, solved.clone(), UNWATCHED).unwrap_or(solved);
            let (contradicted, iterated) = (solved.noise.learnt, solved.iterated);
            let at = &iterated.estimate;
            let alone = alone(
                to_vector(&at.triads),
                solved.priors,
                at.initial_attitudes.clone(),
                estimate(iterated),
            );
            (alone, contradicted)
        }
        _ => {
            let start = coarse_start(plain)?;
            let alone = alone(
                to_vector(&start.at.triads),
                start.attitudes,
                start.at.initial_attitudes,
                None,
            );
            (alone, false)
        }
    })
}

/// Mean temperature of each axis in the middles of a recording's dwells, °C; none where it is not known.
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

/// What a recording alone says with other noise.
fn with_noise(alone: &SeparateEstimate, recording: &Problem) -> Option<Estimate> {
    let at = Linearisation::new(
        alone.estimate.as_ref()?.triads,
        SVector::zeros(),
        alone.initial_attitudes.clone(),
    );
    let (gate, passes) = (Gate::Innovations, &mut Vec::new());
    let iterated = iterate(recording, &alone.priors, at, gate, passes, UNWATCHED).ok()?;
    estimate(iterated)
}

fn estimate(iterated: Iterated) -> Option<Estimate> {
    iterated.converged.then_some(Estimate {
        triads: iterated.estimate.triads,
        covariance: iterated.held.posterior.parameter_covariance,
    })
}

/// Of a parameter, the part common to all recordings beyond its prior mean, and the coefficient of each function of
/// temperature: least squares through what each recording alone says.
pub fn through(
    model: &Model,
    alone: &[SeparateEstimate],
    (sensor, of_triad, axis): (Sensor, usize, usize),
) -> DVector<f64> {
    let index = parameter(sensor, of_triad);
    let prior = model.prior_sigma[index];
    let n = 1 + THERMAL_FUNCTIONS;
    let sigma = |k: usize| match k.checked_sub(1) {
        None => prior,
        Some(function) => model.thermal.as_ref().map_or(0.0, |thermal| {
            thermal.sigma.get(sensor)[(of_triad, function)]
        }),
    };
    let prior_mean = from_vector(model.form, &model.prior_mean);
    let own = model.day_to_day;
    let own = own.covariance(&prior_mean);
    let own = own.diagonal();
    let mut normal = DMatrix::from_fn(n, n, |i, j| f64::from(u8::from(i == j)));
    let mut right = DVector::zeros(n);
    for alone in alone {
        let known = alone.estimate.as_ref();
        let variance = known.map_or(0.0, |estimate| estimate.covariance[(index, index)]);
        let own = own[index];
        // Without a σ the coarse start is as good as a tenth of what was known before.
        let variance = match variance > 0.0 {
            true => variance * BEYOND_NOISE.powi(2) + own,
            false => (0.1 * prior).powi(2) + own,
        };
        let functions = alone.state.as_ref();
        let row = DVector::from_fn(n, |k, _| {
            let by = match k.checked_sub(1) {
                None => 1.0,
                Some(function) => functions.map_or(0.0, |s| s.get(sensor)[axis][function]),
            };
            by * sigma(k)
        });
        let off = alone.start[index] - model.prior_mean[index];
        normal.ger(1.0 / variance, &row, &row, 1.0);
        right.axpy(off / variance, &row, 1.0);
    }
    let mut solution = solved(normal, &right);
    for k in 0..n {
        solution[k] *= sigma(k);
    }
    solution
}

/// A solution of normal equations that are positive definite by their prior; zero if not.
fn solved(normal: DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    let n = right.len();
    normal
        .cholesky()
        .map_or_else(|| DVector::zeros(n), |factor| factor.solve(right))
}
