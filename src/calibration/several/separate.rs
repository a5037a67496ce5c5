//! Separate calibration of each recording of a problem.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::day_to_day::DayToDay;
use crate::calibration::iterations::{Solved, solve};
use crate::calibration::{
    AttitudePrior, CalibrationError, Estimate, Linearisation, MagneticPrior, Model, Problem,
    UNWATCHED, coarse_start, from_vector, parameter, to_vector,
};
use crate::imu::{
    PerSensor, Sensor, THERMAL_FUNCTIONS, ThermalModel, ThermalRange, ThermalState, thermal_state,
};
use crate::run::Dwell;

/// Factor by which σ of a recording calibrated alone may exceed that of its noise: neglected effects may be
/// larger.
const BEYOND_NOISE: f64 = 10.0;

/// A recording that spans less than this fraction of the range counts as one temperature.
const PART_OF_RANGE: f64 = 0.1;

/// A recording calibrated alone.
#[derive(Debug, Clone)]
pub struct SeparateEstimate {
    /// Name.
    pub name: String,
    /// Mean temperature of each axis, °C, and its rate, K/s, over its dwells; `None` if unknown.
    pub temperature: Option<PerSensor<[f64; 3]>>,
    /// The temperature range within the recording, K.
    pub span: f64,
    /// Calibration at the mean temperature; `None` if the calibration failed.
    pub estimate: Option<Estimate>,
    /// Functions of temperature, if its temperature is constant.
    pub(in crate::calibration) state: Option<ThermalState>,
    /// The estimate with the initial attitudes, or the coarse start.
    pub(in crate::calibration) at: Linearisation,
    pub(in crate::calibration) priors: Vec<AttitudePrior>,
}

impl SeparateEstimate {
    /// Mean temperature of all axes over its dwells, °C.
    pub fn mean_temperature(&self) -> Option<f64> {
        let PerSensor { gyro, accel } = self.temperature?;
        Some(gyro.iter().chain(&accel).sum::<f64>() / 6.0)
    }
}

/// Calibrates each recording alone, in parallel.
pub fn each(problem: &Problem) -> Result<Vec<SeparateEstimate>, CalibrationError> {
    let all = (0..problem.runs().count()).into_par_iter();
    let all = all.map(|number| {
        let plain = problem.recordings(|of| of == number).with(|model| {
            model.thermal = None;
            model.day_to_day = DayToDay::default();
            // All recordings together have one magnetometer.
            model.magnetic = MagneticPrior::default();
        });
        alone(&plain, problem.model.thermal.as_ref())
    });
    all.collect()
}

/// Calibrates a recording alone.
fn alone(
    plain: &Problem,
    thermal: Option<&Arc<ThermalModel>>,
) -> Result<SeparateEstimate, CalibrationError> {
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
    // A recording with changing temperature cannot be calibrated without the temperature dependence.
    let whole = thermal.map_or(f64::INFINITY, |thermal| {
        let span = |range: &ThermalRange| range.highest - range.lowest;
        span(&thermal.range.gyro).max(span(&thermal.range.accel))
    });
    let solved = if span < PART_OF_RANGE * whole {
        let start = coarse_start(plain).ok();
        start.and_then(|start| solve(plain, (&start.at, &start.attitudes), UNWATCHED).ok())
    } else {
        None
    };
    let estimate = solved.as_ref().filter(|solved| solved.converged);
    let estimate = estimate.map(Solved::both_triads);
    let (at, priors) = match solved {
        Some(solved) => (solved.estimate, solved.script.priors.clone()),
        None => {
            let start = coarse_start(&plain.with(|model| model.thermal = thermal.cloned()))?;
            (start.at, start.attitudes)
        }
    };
    Ok(SeparateEstimate {
        name: run.recording.name.clone(),
        temperature: middle,
        span,
        estimate,
        state,
        at,
        priors,
    })
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

/// For each parameter, the common deviation from its prior mean and the coefficient of each function of temperature,
/// from a least-squares fit to the recordings calibrated alone.
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
        // Without a σ, the coarse start is assumed to be accurate to a tenth of the prior σ.
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
    // The matrix is positive definite because of the prior.
    let solution = normal.cholesky().map(|factor| factor.solve(&right));
    solution.map_or_else(
        || DVector::zeros(n),
        |solution| solution.component_mul(&sigma),
    )
}
