//! Each recording of a problem calibrated alone.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::super::alone::Alone;
use super::super::attempt::from_coarse_start;
use super::super::coarse::coarse_start;
use super::super::day_to_day::DayToDay;
use super::super::error::CalibrationError;
use super::super::estimate::Estimate;
use super::super::model::Model;
use super::super::noise::learn;
use super::super::parameters::{from_vector, parameter, to_vector};
use super::super::problem::Problem;
use crate::imu::{PerSensor, Sensor, THERMAL_FUNCTIONS, ThermalRange};

/// A recording alone says less of a parameter than its noise does by this factor: what it leaves off may be
/// more.
const BEYOND_NOISE: f64 = 10.0;

/// A recording within this part of the range is at one temperature.
const PART_OF_RANGE: f64 = 0.1;

/// Each recording alone, on as many threads as there are.
pub(super) fn each(problem: &Problem) -> Result<Vec<Alone>, CalibrationError> {
    let runs = problem.runs().count();
    (0..runs)
        .into_par_iter()
        .map(|number| of(&problem.recording(number)))
        .collect()
}

fn of(problem: &Problem) -> Result<Alone, CalibrationError> {
    let run = problem.run();
    let mut model = problem.model.clone();
    let thermal = model.thermal.take();
    model.day_to_day = DayToDay::default();
    let plain = problem.with_model(model);
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
    let middle = temperature.map(|temperature| {
        let imu = &run.recording.imu;
        let times: Vec<f64> = plain
            .dwells()
            .map(|dwell| 0.5 * (imu.time(dwell.samples.start) + imu.time(dwell.samples.end)))
            .collect();
        PerSensor::from_fn(|sensor| {
            [0, 1, 2].map(|axis| {
                let values = times.iter().map(|&t| temperature.at(t).get(sensor)[axis]);
                values.sum::<f64>() / times.len().max(1) as f64
            })
        })
    });
    let state = thermal.as_ref().zip(middle.as_ref());
    let state = state.map(|(thermal, at)| thermal.state(at, &PerSensor::default()));
    let alone = |start, priors, initial_attitudes, estimate| Alone {
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
    let range = thermal.as_ref().map(|thermal| thermal.range);
    let whole = range.map_or(f64::INFINITY, |range| {
        let span = |range: &ThermalRange| range.highest - range.lowest;
        span(&range.gyro).max(span(&range.accel))
    });
    let stands = span < PART_OF_RANGE * whole;
    let solved = stands.then(|| from_coarse_start(&plain, &|_| {}));
    Ok(match solved {
        Some(Ok(solved)) => {
            let (priors, iterated) = (solved.priors, solved.iterated);
            // Noise that is more than stated is no difference between recordings.
            let learnt = learn(&plain, &priors, iterated.clone(), &mut Vec::new(), &|_| {});
            let iterated = learnt.map_or(iterated, |learnt| learnt.iterated);
            let held = iterated.held;
            alone(
                to_vector(&held.estimate.triads),
                priors,
                held.estimate.initial_attitudes,
                iterated.converged.then_some(Estimate {
                    triads: held.estimate.triads,
                    covariance: held.covariance,
                }),
            )
        }
        _ => {
            let start = coarse_start(&plain)?;
            alone(
                to_vector(&start.at.triads),
                start.attitudes,
                start.at.initial_attitudes,
                None,
            )
        }
    })
}

/// Of a parameter, the part common to all recordings beyond its prior mean, and the coefficient of each function of
/// temperature: least squares through what each recording alone says.
pub(super) fn through(
    model: &Model,
    alone: &[Alone],
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
