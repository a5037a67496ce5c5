//! The quantities to estimate from a run, with their prior; a model is cheap to copy and modify.

use std::sync::Arc;

use nalgebra::Vector3;

use crate::calibration::budget::source::BudgetSource;
use crate::calibration::parameters::{Before, stacked};
use crate::calibration::record::standstill::FLOOR;
use crate::calibration::{DayToDay, ErrorTerm, MagneticPrior, Options, ParameterVector, to_vector};
use crate::imu::{
    GaussMarkov, InstallationForm, MotionNoise, Noise, PerSensor, Sensor, TermVector, ThermalModel,
};
use crate::navigation::ProcessNoise;
use crate::run::{Aiding, Run};
use crate::turntable::{AxisError, TableGeometry};
use crate::units::ARCSEC;

/// Default 1σ of the level of a table, rad.
pub const USUAL_LEVEL: f64 = 10.0 * ARCSEC;
/// Default 1σ of the north of a table, rad.
pub const USUAL_NORTH: f64 = 60.0 * ARCSEC;
/// Default 1σ of each tilt of its axes, rad.
const USUAL_TILT: f64 = 10.0 * ARCSEC;
/// Typical time in which a table settles after a stop, s.
pub const SETTLING_TIME: f64 = 1.0;
/// Default correlation time of a varying bias, s.
const USUAL_CORRELATION: f64 = 100.0;
/// Default 1σ of a varying bias, in multiples of the white noise averaged over a correlation time.
const USUAL_VARIATION: f64 = 3.0;

/// The estimated quantities with their prior uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Form of the misalignment matrix.
    pub form: InstallationForm,
    /// Observations at rest.
    pub aiding: Aiding,
    /// Mean of the parameters of both triads.
    pub prior_mean: ParameterVector,
    /// 1σ of each parameter; zero for parameters that the form does not have or the body frame fixes.
    pub prior_sigma: ParameterVector,
    /// Noise of each triad.
    pub noise: PerSensor<Noise>,
    /// Noise added during moves.
    pub motion_noise: PerSensor<MotionNoise>,
    /// 1σ, at standstill (white), of the integral of each triad's output: attitude in rad, velocity in m/s. With
    /// `None`, each stretch uses the value that is stated in its run or estimated from it.
    pub standstill_sigma: PerSensor<Option<f64>>,
    /// Unwanted rotation of the body in dwells without a table: 1σ density of a random walk, rad/√s. The gyros sense
    /// this rotation, so it is not part of their noise.
    pub turning_at_rest: f64,
    /// 1σ of each parameter of an error term, whose prior mean is zero; 0 if the term is off.
    pub term_sigma: TermVector,
    /// Error terms that may be absent; the estimate averages over their sizes.
    pub may_have: Vec<ErrorTerm>,
    /// Whether the latitude may differ from the stated latitude, which only a table can show.
    pub may_be_elsewhere: bool,
    /// Temperature dependence of the instrument, if any.
    pub thermal: Option<Arc<ThermalModel>>,
    /// σ of the differences between recordings.
    pub day_to_day: DayToDay,
    /// Prior of the magnetometer and the field at its site, if any.
    pub magnetic: MagneticPrior,
    /// 1σ of gravity at the site, m/s²; common to all dwells of a recording.
    pub gravity_sigma: f64,
    /// 1σ per axis of the table position error, rad; zero without a table.
    pub position_sigma: f64,
    /// 1σ per axis of a reading of the table, rad; zero without a table.
    pub reading_sigma: f64,
    /// 1σ per axis of the settling, an additional error of a reading just after a stop, rad.
    pub settling_sigma: f64,
    /// Time in which the settling fades, s.
    pub settling_time: f64,
    /// 1σ of the table errors that the readings do not contain; zero if off.
    pub geometry: TableGeometry,
    /// Number of table axes with angle readings; zero if there are none.
    pub(in crate::calibration) table_axes: usize,
    /// The source with scaled variance, and the factor; used to compute its share of the budget.
    pub(in crate::calibration) varied: Option<(BudgetSource, f64)>,
}

impl Model {
    /// The model of a run, from the statements of the run and the options.
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
            term_sigma: run.instrument.term_sigma,
            may_have: Vec::new(),
            may_be_elsewhere: aiding == Aiding::Table
                && (options.auto_terms || !options.terms.is_empty()),
            thermal: None,
            day_to_day: DayToDay::default(),
            magnetic: MagneticPrior::new(run),
            gravity_sigma: run.site.gravity_sigma,
            position_sigma: accuracy.position_sigma,
            reading_sigma: accuracy.reading_sigma,
            settling_sigma: accuracy.settling_sigma,
            settling_time: SETTLING_TIME,
            geometry: accuracy.geometry,
            table_axes: axes.map_or(0, |axes| axes.iter().flatten().count()),
            varied: None,
        };
        model.set_form(run, options.form);
        for &term in &options.terms {
            model.switch_on(term);
        }
        if options.auto_terms {
            let absent = &run.instrument.absent_terms;
            let is_absent =
                |term| matches!(term, ErrorTerm::Instrument(of) if absent.contains(&of));
            let may_have = ErrorTerm::constant().filter(|&term| !is_absent(term));
            model.may_have = may_have
                .filter(|&term| !model.has(term) && model.can_have(term))
                .collect();
        }
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

    /// Fraction of the settling of a table that remains after a time.
    pub(in crate::calibration) fn settling(&self, duration: f64) -> f64 {
        (-duration / self.settling_time).exp()
    }

    /// Variance of the settling of a table at a stop per axis, rad².
    pub(in crate::calibration) fn settling_variance(&self) -> f64 {
        self.settling_sigma.powi(2) * self.weight(BudgetSource::Settling)
    }

    /// Values and σ of the parameters before a recording.
    pub(in crate::calibration) fn before(&self) -> Before<'_> {
        Before {
            mean: &self.prior_mean,
            sigma: &self.prior_sigma,
        }
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

    /// Switches an error term on; its σ is the typical one, unless the run states another σ. This has no effect if the
    /// run does not support the term.
    pub fn switch_on(&mut self, term: ErrorTerm) {
        self.may_have.retain(|&of| of != term);
        if !self.has(term) && self.can_have(term) {
            self.set(term, true);
        }
    }

    /// Switches an error term off.
    pub fn switch_off(&mut self, term: ErrorTerm) {
        self.may_have.retain(|&of| of != term);
        self.set(term, false);
    }

    /// Sets an error term to its typical σ or to zero.
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

/// Default variation of a bias, derived from the white noise.
pub fn usual_variation(noise: &Noise) -> GaussMarkov {
    GaussMarkov {
        sigma: USUAL_VARIATION * noise.random_walk / USUAL_CORRELATION.sqrt(),
        correlation_time: USUAL_CORRELATION,
    }
}
