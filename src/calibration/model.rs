//! Estimated quantities of a run with their prior; cheap to copy and modify.

use std::sync::Arc;

use nalgebra::Vector3;

use crate::calibration::budget::source::BudgetSource;
use crate::calibration::parameters::stacked;
use crate::calibration::record::standstill::FLOOR;
use crate::calibration::{DayToDay, Disturbance, ErrorTerm, Options, ParameterVector, to_vector};
use crate::imu::{
    GaussMarkov, InstallationForm, MotionNoise, Noise, PerSensor, Sensor, Term, TermVector,
    ThermalModel,
};
use crate::navigation::ProcessNoise;
use crate::run::{Aiding, Run};
use crate::turntable::{AxisError, TableGeometry};
use crate::units::ARCSEC;

/// Default 1σ of the level of a table, rad.
pub const USUAL_LEVEL: f64 = 10.0 * ARCSEC;
/// Default 1σ of its north, rad.
pub const USUAL_NORTH: f64 = 60.0 * ARCSEC;
/// Default 1σ of each tilt of its axes, rad.
const USUAL_TILT: f64 = 10.0 * ARCSEC;
/// Default correlation time of a varying bias, s.
const USUAL_CORRELATION: f64 = 100.0;
/// Default 1σ of a varying bias, in multiples of the white noise averaged over a correlation time.
const USUAL_VARIATION: f64 = 3.0;

/// The estimated quantities with their prior uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Form of the installation matrix.
    pub form: InstallationForm,
    /// Observations at rest.
    pub aiding: Aiding,
    /// Mean of the parameters of both triads.
    pub prior_mean: ParameterVector,
    /// 1σ of each; zero for those that the form does not have or the body frame fixes.
    pub prior_sigma: ParameterVector,
    /// Noise of each triad.
    pub noise: PerSensor<Noise>,
    /// Noise added during moves.
    pub motion_noise: PerSensor<MotionNoise>,
    /// White 1σ, at standstill, of the integral of each triad's output: attitude in rad, velocity in m/s; `None`: in
    /// each stretch, the value stated in or estimated from its run.
    pub standstill_sigma: PerSensor<Option<f64>>,
    /// Unwanted rotation of the body in dwells without a table: 1σ density of a random walk,
    /// rad/√s. Gyros sense it, so it is not part of their noise.
    pub turning_at_rest: f64,
    /// Whether velocity is reset after each move: without a table log, a move adds more noise than information to
    /// velocity, except about terms visible in no other observation.
    pub velocity_anew: bool,
    /// 1σ of each parameter of the instrument's error terms, around zero; zero if a term is off.
    pub term_sigma: TermVector,
    /// Temperature dependence of the instrument, if any.
    pub thermal: Option<Arc<ThermalModel>>,
    /// σ of the differences between recordings.
    pub day_to_day: DayToDay,
    /// 1σ of gravity at the site, m/s²; common to all dwells of a recording.
    pub gravity_sigma: f64,
    /// 1σ per axis of the table position error, rad; zero without a table.
    pub position_sigma: f64,
    /// 1σ per axis of a reading of the table, rad; zero without a table.
    pub reading_sigma: f64,
    /// 1σ of table errors not included in its readings; zero if off.
    pub geometry: TableGeometry,
    /// Single events that are estimated.
    pub(in crate::calibration) disturbances: Vec<Disturbance>,
    /// Number of table axes with angle readings; zero if there are none.
    table_axes: usize,
    /// The source with scaled variance, and the factor; used to compute its share of the budget.
    pub(in crate::calibration) varied: Option<(BudgetSource, f64)>,
}

impl Model {
    /// The model of a run: the run's statements, completed by the options.
    pub fn new(run: &Run, options: &Options) -> Self {
        let aiding = options.aiding.unwrap_or_else(|| run.aiding());
        let table = run.observed_table(aiding);
        let accuracy = table.map(|_| run.table).unwrap_or_default();
        let axes = table.and_then(|table| table.axes.first());
        let mut model = Self {
            form: options.form,
            aiding,
            prior_mean: ParameterVector::zeros(),
            prior_sigma: ParameterVector::zeros(),
            noise: run.instrument.noise,
            motion_noise: run.instrument.motion_noise,
            standstill_sigma: PerSensor::default(),
            turning_at_rest: run.standstill.turning,
            velocity_anew: false,
            term_sigma: run.instrument.term_sigma,
            thermal: None,
            day_to_day: DayToDay::default(),
            gravity_sigma: run.site.gravity_sigma,
            position_sigma: accuracy.position_sigma,
            reading_sigma: accuracy.reading_sigma,
            geometry: accuracy.geometry,
            disturbances: Vec::new(),
            table_axes: axes.map_or(0, |axes| axes.iter().flatten().count()),
            varied: None,
        };
        model.set_form(run, options.form);
        for &term in &options.terms {
            model.switch_on(term);
        }
        let shows_in_velocity = [Term::SizeEffect, Term::TimeOffset].map(ErrorTerm::Instrument);
        let needed = shows_in_velocity.into_iter().any(|term| model.has(term));
        model.velocity_anew = aiding == Aiding::Velocity && !needed;
        model
    }

    /// Process noise of the navigation errors.
    pub(in crate::calibration) fn process_noise(&self) -> PerSensor<ProcessNoise> {
        PerSensor::from_fn(|sensor| {
            let MotionNoise {
                by_motion,
                by_duration,
            } = *self.motion_noise.get(sensor);
            let of_moves = self.weight(BudgetSource::Moves(sensor)).sqrt();
            let white = self.weight(BudgetSource::White(sensor)).sqrt();
            ProcessNoise {
                random_walk: white * self.noise.get(sensor).random_walk,
                by_motion: of_moves * by_motion,
                by_duration: of_moves * by_duration,
            }
        })
    }

    /// Factor of the variance of a source.
    pub(in crate::calibration) fn weight(&self, source: BudgetSource) -> f64 {
        let varied = self.varied.filter(|&(varied, _)| varied == source);
        varied.map_or(1.0, |(_, factor)| factor)
    }

    /// Sets the variance at standstill in excess of the floor, rad² or m²/s².
    pub(in crate::calibration) fn set_standstill_variance(
        &mut self,
        sensor: Sensor,
        variance: f64,
    ) {
        let sigma = (variance + FLOOR.get(sensor).powi(2)).sqrt();
        *self.standstill_sigma.get_mut(sensor) = Some(sigma);
    }

    /// The same model with the noise of another.
    pub(in crate::calibration) fn with_noise_of(&self, other: &Self) -> Self {
        Self {
            noise: other.noise,
            motion_noise: other.motion_noise,
            standstill_sigma: other.standstill_sigma,
            turning_at_rest: other.turning_at_rest,
            position_sigma: other.position_sigma,
            reading_sigma: other.reading_sigma,
            ..self.clone()
        }
    }

    /// The model with its parameters in another form.
    pub(in crate::calibration) fn in_form(&self, run: &Run, form: InstallationForm) -> Self {
        let mut model = self.clone();
        model.set_form(run, form);
        model
    }

    fn set_form(&mut self, run: &Run, form: InstallationForm) {
        self.form = form;
        self.prior_mean = to_vector(&run.instrument.prior_mean(form));
        self.prior_sigma = stacked(&run.instrument.prior_sigma(form, self.aiding.body_frame()));
    }

    /// Whether an error term is on.
    pub fn has(&self, term: ErrorTerm) -> bool {
        match term {
            ErrorTerm::GaussMarkovBias => {
                let varies = |sensor| self.noise.get(sensor).gauss_markov.is_some();
                Sensor::ALL.into_iter().any(varies)
            }
            ErrorTerm::TableBase => self.geometry.base != Vector3::zeros(),
            ErrorTerm::TableAxes(kind) => self.geometry.has(kind),
            ErrorTerm::Instrument(term) => term.parameters().any(|k| self.term_sigma[k] > 0.0),
        }
    }

    /// Whether the run supports an error term: terms of the table need its log, and terms of its axes need axis
    /// angles.
    pub fn can_have(&self, term: ErrorTerm) -> bool {
        match term {
            ErrorTerm::TableBase => self.aiding == Aiding::Table,
            ErrorTerm::TableAxes(kind) => kind.of_table(self.table_axes, 1.0).amax() > 0.0,
            ErrorTerm::GaussMarkovBias | ErrorTerm::Instrument(_) => true,
        }
    }

    /// Switches an error term on, with its usual σ unless the run states one. No effect if the
    /// run does not support it.
    pub fn switch_on(&mut self, term: ErrorTerm) {
        if !self.has(term) && self.can_have(term) {
            self.set(term, true);
        }
    }

    /// Switches an error term off.
    pub fn switch_off(&mut self, term: ErrorTerm) {
        self.set(term, false);
    }

    /// Sets an error term to its usual σ or to zero.
    fn set(&mut self, term: ErrorTerm, on: bool) {
        let times = f64::from(u8::from(on));
        match term {
            ErrorTerm::GaussMarkovBias => {
                for noise in [&mut self.noise.gyro, &mut self.noise.accel] {
                    noise.gauss_markov = on.then(|| usual_variation(noise));
                }
            }
            ErrorTerm::TableBase => {
                self.geometry.base = times * Vector3::new(USUAL_LEVEL, USUAL_LEVEL, USUAL_NORTH);
            }
            ErrorTerm::TableAxes(kind) => {
                let sigma = times * usual_axis_error(kind, self.position_sigma);
                self.geometry.axes.rows_range_mut(kind.range()).fill(0.0);
                self.geometry.axes += kind.of_table(self.table_axes, sigma);
            }
            ErrorTerm::Instrument(term) => {
                for parameter in term.parameters() {
                    self.term_sigma[parameter] = times * term.usual_sigma();
                }
            }
        }
    }
}

/// Default 1σ of each error of a table's axes, rad, for this position error: the repeatable part of a table error may
/// be as large as the non-repeatable part.
pub fn usual_axis_error(kind: AxisError, position_sigma: f64) -> f64 {
    match kind {
        AxisError::Tilt => USUAL_TILT,
        AxisError::Wobble | AxisError::Encoder => position_sigma.max(ARCSEC),
    }
}

/// Default variation of a bias, from its white noise.
pub fn usual_variation(noise: &Noise) -> GaussMarkov {
    GaussMarkov {
        sigma: USUAL_VARIATION * noise.random_walk / USUAL_CORRELATION.sqrt(),
        correlation_time: USUAL_CORRELATION,
    }
}
