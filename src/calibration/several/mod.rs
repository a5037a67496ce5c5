//! Several recordings of one instrument as one problem: what they have in common is estimated once, what is
//! each one's own differs by a stated σ, and parameters may follow temperature.
//!
//! Each recording is first calibrated alone, on a thread of its own. Through these estimates go the polynomials
//! from which the Gauss–Newton iterations of all data begin; with all orders that the temperatures support,
//! then with those that a likelihood ratio calls for.

pub mod day_to_day;
pub mod separate;
pub mod thermal;

mod between_recordings;
mod order;
mod repeat;
mod temperatures;

use std::sync::Arc;

use super::error::CalibrationError;
use super::gauss_newton::Progress;
use super::linearisation::{AttitudePrior, Linearisation};
use super::noise::NoisePolicy;
use super::options::Options;
use super::parameters::{PARAMETERS, from_vector, sensor_and_parameter, to_vector};
use super::pass::Gate;
use super::problem::{Problem, Stretch};
use super::solved::Solved;
use crate::calibration::{DayToDay, Difference, SeparateEstimate};
use crate::imu::{PerSensor, ThermalCoefficients, Triad};
use crate::run::{Aiding, Run};
pub use repeat::Repeatability;
pub use temperatures::TemperatureOptions;

/// What recordings of one instrument have in common, and what not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Together {
    /// By how much they differ. Without a table the body axes go with the accelerometers, however they are mounted.
    pub day_to_day: DayToDay,
    /// How parameters follow temperature; `None` if they do not.
    pub temperature: Option<TemperatureOptions>,
}

impl Default for Together {
    fn default() -> Self {
        Self {
            day_to_day: DayToDay::default(),
            temperature: Some(TemperatureOptions::default()),
        }
    }
}

impl<'a> Problem<'a> {
    /// The problem that recordings of one instrument pose together. The first one's instrument and table stand for
    /// all; one without a dwell is left out, and a finding says so.
    ///
    /// # Errors
    /// [`CalibrationError`] if there is none, or one has no temperature where parameters follow it.
    pub fn together(
        runs: &[&'a Run],
        options: &Options,
        together: &Together,
    ) -> Result<Self, CalibrationError> {
        let (first, others) = runs.split_first().ok_or(CalibrationError::NoDwells)?;
        let mut problem = Self::new(first, options);
        for run in others {
            problem = problem.and(run);
        }
        let problem = problem.of_dwells();
        let mut model = problem.model.clone();
        model.day_to_day = together.day_to_day;
        if model.aiding == Aiding::Velocity {
            model.day_to_day.mounting = 0.0;
        }
        if let Some(options) = together.temperature {
            model.thermal = temperatures::model(&problem, options)?.map(Arc::new);
        }
        Ok(problem.with_model(model))
    }

    /// Mean temperature in °C of each dwell, of all axes, and its rate in K/s; not a number where it is not known. None
    /// where nothing follows temperature.
    pub(in crate::calibration) fn warming(&self) -> Vec<(f64, f64)> {
        if self.model.thermal.is_none() {
            return Vec::new();
        }
        let of_stretch = |stretch: &Stretch| {
            let imu = &stretch.run.recording.imu;
            let mean =
                |all: PerSensor<[f64; 3]>| all.gyro.iter().chain(&all.accel).sum::<f64>() / 6.0;
            let dwells = stretch.dwells.iter();
            dwells
                .map(|dwell| {
                    let (from, to) = (imu.time(dwell.samples.start), imu.time(dwell.samples.end));
                    let middle = 0.5 * (from + to);
                    imu.temperature.as_ref().map_or((f64::NAN, f64::NAN), |t| {
                        (mean(t.at(middle)), mean(t.rate(middle)))
                    })
                })
                .collect::<Vec<_>>()
        };
        self.stretches().iter().flat_map(of_stretch).collect()
    }

    /// Whether anything in it differs between recordings or temperatures.
    pub(in crate::calibration) fn varies(&self) -> bool {
        self.model.thermal.is_some() || self.model.day_to_day.any()
    }
}

/// Solves a problem of several recordings, or one that varies, with stated noise. Recordings differ by what is stated
/// or, where the noise may be learnt, by what they show.
pub fn solve<'a>(
    problem: &Problem<'a>,
    progress: Progress,
) -> Result<Solved<'a>, CalibrationError> {
    let alone = separate::each(problem)?;
    let mut findings = Vec::new();
    let mut problem = problem.clone();
    if problem.options.noise != NoisePolicy::Stated
        && let Some((day_to_day, finding)) = between_recordings::learnt(&problem.model, &alone)
    {
        let mut model = problem.model.clone();
        model.day_to_day = day_to_day;
        problem = problem.with_model(model);
        findings.push(finding);
    }
    let priors: Vec<AttitudePrior> = alone.iter().flat_map(|a| a.priors.clone()).collect();
    let at = start(&problem, &alone);
    let mut solved = Solved::of(&problem, priors, at, Gate::Innovations, progress)?;
    if let Some(thermal) = solved.iterated.held.thermal(&problem.model) {
        let selected = order::select(&problem, &solved.iterated, &thermal);
        findings.extend(selected.finding);
        if selected.model != thermal.model {
            let mut model = problem.model.clone();
            model.thermal = Some(Arc::new(selected.model));
            solved.iterated.estimate = selected.at;
            solved = solved.again(problem.with_model(model), progress)?;
        }
    }
    Ok(Solved {
        alone,
        findings,
        ..solved
    })
}

/// Where the iterations begin: of each parameter the polynomial through what each recording alone says.
fn start(problem: &Problem, alone: &[SeparateEstimate]) -> Linearisation {
    let model = &problem.model;
    let initial = alone.iter().flat_map(|a| a.at.initial_attitudes.clone());
    let mut common = model.prior_mean;
    let mut thermal = PerSensor::<ThermalCoefficients>::default();
    for index in 0..PARAMETERS {
        let (sensor, of_triad) = sensor_and_parameter(index);
        let Some(axis) =
            Triad::axis(model.form, of_triad).filter(|_| model.prior_sigma[index] > 0.0)
        else {
            continue;
        };
        let fit = separate::through(model, alone, (sensor, of_triad, axis));
        common[index] += fit[0];
        let of_functions = fit.rows(1, fit.len() - 1).transpose();
        thermal
            .get_mut(sensor)
            .row_mut(of_triad)
            .copy_from(&of_functions);
    }
    let mut at = Linearisation::new(
        from_vector(model.form, &common),
        nalgebra::SVector::zeros(),
        initial.collect(),
    );
    at.thermal = thermal;
    if model.day_to_day.mounting > 0.0 {
        let mountings = alone.iter().map(|alone| Difference {
            mounting: Difference::mounting_between(&at.triads, &to_vector(&alone.at.triads)),
            ..Difference::default()
        });
        at.own = mountings.collect();
    }
    at
}
