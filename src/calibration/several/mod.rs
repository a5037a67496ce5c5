//! Joint calibration of several recordings of one instrument: common parameters are estimated once, differences between
//! recordings have a σ, and parameters may depend on temperature.
//!
//! Each recording is first calibrated alone, on its own thread. The iterations on all data start from polynomials
//! through these estimates, with all orders that the temperatures support; the result is averaged over the presence and
//! absence of each order.

pub mod at_rest;
pub mod day_to_day;
pub mod separate;
pub mod thermal;

mod repeat;
mod temperatures;

use std::sync::Arc;

use crate::calibration::{
    AttitudePrior, CalibrationError, CoarseStart, DayToDay, Difference, Linearisation, Options,
    PARAMETERS, Problem, coarse_start, from_vector, sensor_and_parameter, to_vector,
};
use crate::imu::{PerSensor, ThermalCoefficients, Triad};
use crate::run::{Aiding, Run};
pub use repeat::Repeatability;
pub use separate::SeparateEstimate;
pub use temperatures::TemperatureOptions;

/// Common and individual properties of recordings of one instrument.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Together {
    /// σ of their differences. Without a table, the accelerometers define the body axes, regardless of the mounting.
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
    /// The joint problem of several recordings of one instrument. The instrument and table of the first recording apply
    /// to all; a recording without a dwell is excluded with a finding.
    ///
    /// # Errors
    /// Returns [`CalibrationError`] if there is no recording, or if a recording has no temperature although parameters
    /// depend on temperature.
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

/// Starting point of the iterations of a problem.
pub struct Start {
    pub at: Linearisation,
    /// Prior of the initial attitude of each stretch.
    pub priors: Vec<AttitudePrior>,
    /// Each recording calibrated alone, if there are several recordings or their temperatures differ.
    pub alone: Vec<SeparateEstimate>,
}

/// The start of a problem: the coarse start of a single recording, or the separate estimates of several recordings.
///
/// # Errors
/// Returns [`CalibrationError`] if a recording has no start.
pub fn start(problem: &Problem) -> Result<Start, CalibrationError> {
    if !problem.varies() && problem.runs().nth(1).is_none() {
        let CoarseStart { at, attitudes, .. } = coarse_start(problem)?;
        return Ok(Start {
            at,
            priors: attitudes,
            alone: Vec::new(),
        });
    }
    let alone = separate::each(problem)?;
    Ok(Start {
        at: through(problem, &alone),
        priors: alone.iter().flat_map(|a| a.priors.clone()).collect(),
        alone,
    })
}

/// For each parameter, the polynomial through the recordings calibrated alone.
fn through(problem: &Problem, alone: &[SeparateEstimate]) -> Linearisation {
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
