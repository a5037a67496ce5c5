//! What all passes over a run share.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::coarse::AttitudePrior;
use super::filter::Start;
use super::outcome::to_vector;
use super::schedule::Schedule;
use super::states::{ParameterVector, parameter};
use crate::imu::{FurtherVector, InstallationForm, PARAMETERS as PER_TRIAD, Sensor};
use crate::run::{Run, TableGeometry};

/// 1σ of the initial velocity: a table at rest, m/s.
const INITIAL_VELOCITY: f64 = 1e-3;
/// Chance that the gate rejects a sound observation.
const FALSE_REJECTION: f64 = 1e-6;

/// What all passes over a run share.
#[derive(Debug, Clone)]
pub(super) struct Problem<'a> {
    pub run: &'a Run,
    pub schedule: Schedule,
    pub form: InstallationForm,
    /// What is known of the initial attitude before the run.
    pub attitude: AttitudePrior,
    pub prior_mean: ParameterVector,
    pub prior_sigma: ParameterVector,
    /// 1σ of each further parameter before the run, whose mean is zero; zero where its term is off.
    pub further_sigma: FurtherVector,
    pub table_geometry: TableGeometry,
    pub start: Start,
    pub variance: Variance,
    /// White 1σ of the velocity at standstill, m/s, that is in `variance` already.
    pub velocity_sigma: f64,
    pub gate: f64,
}

/// Variance of each observation per axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Variance {
    pub velocity: f64,
    pub position: f64,
    /// Of one reading of the table.
    pub reading: f64,
    /// Of the computed attitude: a pulse's worth.
    pub attitude: f64,
    /// Of the table's position, drawn anew at each.
    pub table: f64,
}

impl<'a> Problem<'a> {
    /// The problem of a run that stands this still.
    pub fn new(
        run: &'a Run,
        schedule: Schedule,
        form: InstallationForm,
        attitude: AttitudePrior,
        velocity_sigma: f64,
    ) -> Self {
        let table_geometry = run.table.as_ref().map(|t| t.geometry).unwrap_or_default();
        let (position_sigma, reading_sigma) = run.table.as_ref().map_or((0.0, 0.0), |table| {
            (table.position_sigma, table.reading_sigma)
        });
        let quantisation = |pulse: f64| pulse.powi(2) / 12.0;
        let sigma_of_triads = run.prior_sigma(form);
        let mut prior_sigma = ParameterVector::zeros();
        for sensor in Sensor::ALL {
            prior_sigma
                .fixed_rows_mut::<PER_TRIAD>(parameter(sensor, 0))
                .copy_from(sigma_of_triads.get(sensor));
        }
        Self {
            run,
            schedule,
            form,
            attitude,
            prior_mean: to_vector(&run.prior_mean(form)),
            prior_sigma,
            further_sigma: run.further_sigma,
            table_geometry,
            start: Start {
                attitude: attitude.sigma,
                velocity: INITIAL_VELOCITY,
                position: run.standstill.position_sigma,
                table: position_sigma,
            },
            variance: Variance {
                velocity: velocity_sigma.powi(2) + quantisation(run.imu.pulse.accel),
                position: run.standstill.position_sigma.powi(2),
                reading: reading_sigma.powi(2),
                attitude: quantisation(run.imu.pulse.gyro),
                table: position_sigma.powi(2),
            },
            velocity_sigma,
            gate: gate(),
        }
    }
}

/// Squared whitened innovation of three components beyond which an observation is an outlier.
fn gate() -> f64 {
    // Three degrees of freedom are always valid.
    ChiSquared::new(3.0).map_or(f64::INFINITY, |chi2| {
        chi2.inverse_cdf(1.0 - FALSE_REJECTION)
    })
}
