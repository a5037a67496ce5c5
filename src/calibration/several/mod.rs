//! Several recordings of one instrument as one problem: common parameters are estimated once, differences between
//! recordings have a stated σ, and parameters may depend on temperature.
//!
//! Each recording is first calibrated alone, on its own thread. Polynomials through these estimates are the start of
//! the Gauss–Newton iterations on all data: first with all orders that the temperatures support, then with those
//! that a likelihood-ratio test selects.

pub mod at_rest;
pub mod day_to_day;
pub mod separate;
pub mod thermal;

mod between_recordings;
mod order;
mod repeat;
mod temperatures;

use std::sync::Arc;

use crate::calibration::{
    AttitudePrior, CalibrationError, DayToDay, Difference, Gate, Linearisation, NoisePolicy,
    Options, PARAMETERS, Problem, Progress, SeparateEstimate, Solved, from_vector,
    sensor_and_parameter, to_vector,
};
use crate::imu::{PerSensor, ThermalCoefficients, Triad};
use crate::run::{Aiding, Run};
pub use repeat::Repeatability;
pub use temperatures::TemperatureOptions;

/// Common and individual properties of recordings of one instrument.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Together {
    /// σ of their differences. Without a table, the body axes are those of the accelerometers for any mounting.
    pub day_to_day: DayToDay,
    /// Temperature dependence of the parameters; `None` if there is none.
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
    /// The joint problem of several recordings of one instrument. The instrument and table of the first apply to all;
    /// a recording without a dwell is dropped with a finding.
    ///
    /// # Errors
    /// [`CalibrationError`] if there is no recording, or if one has no temperature although parameters depend on it.
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

    /// Whether any quantity differs between recordings or temperatures.
    pub(in crate::calibration) fn varies(&self) -> bool {
        self.model.thermal.is_some() || self.model.day_to_day.any()
    }
}

/// Solves a problem of several recordings, or one with temperature dependence, with the stated noise. Differences
/// between recordings are as stated or, if noise may be estimated, as estimated.
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
        problem = problem.with(|model| model.day_to_day = day_to_day);
        findings.push(finding);
    }
    let priors: Vec<AttitudePrior> = alone.iter().flat_map(|a| a.priors.clone()).collect();
    let at = start(&problem, &alone);
    let mut solved = Solved::of(&problem, priors, at, Gate::Innovations, progress)?;
    let held = &solved.iterated.held;
    if let Some(thermal) = held.posterior.thermal(&held.at, &problem.model) {
        let reduction = held.reduction.clone().folded();
        let selected = order::select(&reduction, (&held.at, &problem.model), &thermal);
        findings.extend(selected.finding);
        if selected.model != thermal.model {
            let problem = problem.with(|model| model.thermal = Some(Arc::new(selected.model)));
            solved.iterated.estimate = selected.at;
            solved = solved.again(problem, progress)?;
        }
    }
    Ok(Solved {
        alone,
        findings,
        ..solved
    })
}

/// Start of the iterations: for each parameter, the polynomial through the recordings calibrated alone.
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
