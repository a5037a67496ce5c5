//! Strapdown navigation in a frame fixed to the site.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::block::{Block, CorrectedResponse};
use super::increments::{Increments, Motion};
use super::moments::Moments;
use super::passage::Passage;
use super::state::State;
use super::sums::Sums;
use crate::attitude::{exp, orthonormalised};
use crate::earth::Site;
use crate::imu::{
    PerSensor, Sensed, Sensor, TermResponse, TermVector, ThermalCoefficients, ThermalModel,
    ThermalState, Triad,
};
use crate::recording::{ImuSamples, Near};

/// Within this time, s, what happened first is taken to act on all that follows as a whole; the sensitivity of
/// navigation to errors is of second order in it.
const PART: f64 = 0.1;
/// Rounds in which the input is found that error terms add to. A time offset of one sample of 10 ms at 200 °/s turns
/// specific force by 0.03, and each round leaves that part of the one before: a part of 10⁻⁶ of the offset's own effect.
const ROUNDS: usize = 4;

/// The whole number of samples nearest to a time, at least one.
pub(crate) fn samples_of(time: f64, period: f64) -> usize {
    ((time / period).round() as usize).max(1)
}

/// Navigates through a record with given triads and accumulates the error model as it goes.
#[derive(Debug, Clone)]
pub struct Navigator<'a> {
    imu: &'a ImuSamples,
    near: Near<'a>,
    gravity: Vector3<f64>,
    earth_rate: Vector3<f64>,
    earth_turn: Matrix3<f64>,
    /// At the reference temperature.
    triads: PerSensor<Triad>,
    instrument: PerSensor<Instrument>,
    thermal: Option<Thermal>,
    terms: TermValues,
    /// Whether any of them has a value.
    shifted: bool,
    /// Where navigation stands.
    pub state: State,
}

/// Error terms of the instrument that navigation knows of.
#[derive(Debug, Clone, PartialEq)]
pub struct TermValues {
    /// Parameters that are on, whatever their values.
    pub on: Vec<usize>,
    /// Values of all parameters; zero where off.
    pub values: TermVector,
}

impl Default for TermValues {
    fn default() -> Self {
        Self {
            on: Vec::new(),
            values: TermVector::zeros(),
        }
    }
}

/// How the triads change with temperature.
#[derive(Debug, Clone)]
struct Thermal {
    model: Arc<ThermalModel>,
    coefficients: PerSensor<ThermalCoefficients>,
    /// Of the samples that navigation is at.
    state: ThermalState,
}

/// A triad, ready for use sample by sample.
#[derive(Debug, Clone)]
struct Instrument {
    correction: Matrix3<f64>,
    /// Corrected bias over one sample.
    bias: Vector3<f64>,
    response: CorrectedResponse,
}

impl<'a> Navigator<'a> {
    /// Starts at a state with these triads; `None` if the sensitivity of one is singular.
    pub fn new(
        imu: &'a ImuSamples,
        site: &Site,
        triads: &PerSensor<Triad>,
        state: State,
    ) -> Option<Self> {
        let earth_rate = site.earth_rate_n();
        Some(Self {
            imu,
            near: Near::new(imu),
            gravity: site.gravity_n(),
            earth_rate,
            earth_turn: exp(-earth_rate * imu.period),
            triads: *triads,
            instrument: instruments(triads, imu.period)?,
            thermal: None,
            terms: TermValues::default(),
            shifted: false,
            state,
        })
    }

    /// The same with triads that change with temperature; those it has are at the reference.
    pub fn with_thermal(
        mut self,
        model: Arc<ThermalModel>,
        coefficients: PerSensor<ThermalCoefficients>,
    ) -> Self {
        self.thermal = Some(Thermal {
            model,
            coefficients,
            state: ThermalState::default(),
        });
        self
    }

    /// Takes the triads as they are at the temperature in the middle of these samples.
    pub fn warm(&mut self, samples: &Range<usize>) {
        let (Some(thermal), Some(temperature)) = (&mut self.thermal, &self.imu.temperature) else {
            return;
        };
        let middle = 0.5 * (self.imu.time(samples.start) + self.imu.time(samples.end));
        let (t, rate) = (temperature.at(middle), temperature.rate(middle));
        thermal.state = thermal.model.state(&t, &rate);
        // Where a sensitivity is singular nothing is finite, and a pass diverges.
        let singular = Matrix3::repeat(f64::NAN);
        self.instrument = PerSensor::from_fn(|sensor| {
            let triad = self.triads().get(sensor).to_owned();
            let correction = triad.correction().unwrap_or(singular);
            Instrument::new(&triad, correction, self.imu.period)
        });
    }

    /// The triads in use.
    pub fn triads(&self) -> PerSensor<Triad> {
        let Some(thermal) = &self.thermal else {
            return self.triads;
        };
        PerSensor::from_fn(|sensor| {
            let coefficients = thermal.coefficients.get(sensor);
            let triad = self.triads.get(sensor);
            triad.warmed(coefficients, thermal.state.get(sensor))
        })
    }

    /// The same with error terms.
    pub fn with_terms(mut self, terms: TermValues) -> Self {
        self.set_terms(terms.values);
        self.terms.on = terms.on;
        self
    }

    /// Goes on with other values of the error terms.
    pub fn set_terms(&mut self, values: TermVector) {
        self.shifted = values != TermVector::zeros();
        self.terms.values = values;
    }

    /// Goes on with other triads; `None` if the sensitivity of one is singular.
    pub fn set_triads(&mut self, triads: &PerSensor<Triad>) -> Option<()> {
        self.instrument = instruments(triads, self.imu.period)?;
        self.triads = *triads;
        Some(())
    }

    /// Increments along body axes of sample `k`, corrected by the triads (Eq. 11) and, at about this
    /// attitude, by error terms; and where these are on, what the body then senses.
    #[inline]
    fn increments(&self, k: usize, attitude: &Matrix3<f64>) -> (Increments, Option<Sensed>) {
        let of_triads = self.of_triads(k);
        if self.terms.on.is_empty() {
            return (of_triads, None);
        }
        let sensed = self.sensed(k, &of_triads, attitude);
        let (increments, sensed) = self.without_terms(of_triads, sensed, self.imu.period);
        (increments, Some(sensed))
    }

    /// Increments over a time without what error terms add to them, and what is then sensed.
    fn without_terms(
        &self,
        of_triads: Increments,
        mut sensed: Sensed,
        period: f64,
    ) -> (Increments, Sensed) {
        let mut increments = of_triads;
        if !self.shifted {
            return (increments, sensed);
        }
        // Triads see u + t(u), and u is what is looked for.
        for _ in 0..ROUNDS {
            let added = |sensor| sensed.added(sensor, &self.terms.values) * period;
            increments = Increments {
                angle: of_triads.angle - added(Sensor::Gyro),
                velocity: of_triads.velocity - added(Sensor::Accel),
            };
            sensed.force = increments.velocity / period;
        }
        (increments, sensed)
    }

    #[inline]
    fn of_triads(&self, k: usize) -> Increments {
        let PerSensor { gyro, accel } = &self.instrument;
        let raw = self.near.at(k);
        Increments {
            angle: gyro.correction * raw.gyro - gyro.bias,
            velocity: accel.correction * raw.accel - accel.bias,
        }
    }

    /// What the body senses in sample `k`, of these increments, at about this attitude.
    fn sensed(&self, k: usize, increments: &Increments, attitude: &Matrix3<f64>) -> Sensed {
        let period = self.imu.period;
        let rate = increments.angle / period;
        // Angular acceleration at the middle of the sample, from those beside it.
        let (before, after) = (k.saturating_sub(1), (k + 1).min(self.imu.len() - 1));
        let change = self.of_triads(after).angle - self.of_triads(before).angle;
        let apart = (after - before).max(1) as f64 * period;
        Sensed {
            rate,
            rate_over_earth: rate - attitude.tr_mul(&self.earth_rate),
            angular_acceleration: change / (period * apart),
            force: increments.velocity / period,
        }
    }

    fn responses(&self, sensed: &Sensed) -> PerSensor<TermResponse> {
        PerSensor::from_fn(|sensor| sensed.response(sensor, &self.terms.values))
    }

    /// Navigates through these samples of the record and gives their block. Where the record has a
    /// sample before the first of them, coning and sculling take it into account.
    pub fn advance(&mut self, samples: Range<usize>) -> Block {
        let few = samples_of(PART, self.imu.period);
        let mut passage = Passage::new(&self.earth_rate, &self.terms.on);
        for begin in samples.clone().step_by(few) {
            let part = begin..(begin + few).min(samples.end);
            self.warm(&part);
            let moments = self.move_through(part.clone());
            passage.add(&moments, self.bridged(&part));
        }
        // Sensitivities to what changes by parts in a thousand are those in the middle.
        self.warm(&samples);
        self.block(passage)
    }

    /// Navigates through a few samples of a move.
    fn move_through(&mut self, samples: Range<usize>) -> Moments {
        let period = self.imu.period;
        let mut moments = Moments::with_terms(&self.terms.on);
        let mut underway = self.before(&samples);
        for k in samples {
            let step = self.through(k, &mut underway);
            let middle = &step.middle;
            moments.add(middle, &step.increments, &step.change, period);
            let turned = step.increments.angle - middle.tr_mul(&self.earth_rate) * period;
            let change = step.change + self.gravity * period;
            moments.add_motion(&turned, &change, period);
            if let Some(sensed) = &step.sensed {
                let responses = self.responses(sensed);
                moments.add_terms(middle, &responses, &step.change, period);
            }
        }
        self.arrive(underway.state);
        moments
    }

    /// The same where the table stands.
    pub fn advance_standing(&mut self, samples: Range<usize>) -> Block {
        let mut underway = self.before(&samples);
        for k in samples.clone() {
            self.through(k, &mut underway);
        }
        self.arrive(underway.state);
        self.standing(&self.state.attitude, samples)
    }

    /// Navigates through samples of a body at rest, given their sums, without an error model.
    pub fn stand(&mut self, sums: &Sums) {
        let n = sums.samples as f64;
        let period = n * self.imu.period;
        let correction = PerSensor::from_fn(|sensor| self.instrument.get(sensor).correction);
        let bias = PerSensor::from_fn(|sensor| self.instrument.get(sensor).bias * n);
        let mut increments = sums.increments(&correction, &bias);
        if !self.terms.on.is_empty() {
            let rate = increments.angle / period;
            let sensed = Sensed {
                rate,
                rate_over_earth: rate - self.state.attitude.tr_mul(&self.earth_rate),
                angular_acceleration: Vector3::zeros(),
                force: increments.velocity / period,
            };
            (increments, _) = self.without_terms(increments, sensed, period);
        }
        let motion = sums.motion(&increments, &correction);
        let earth_turn = exp(-self.earth_rate * period);
        let mut state = self.state;
        self.go_on(&mut state, &motion, &earth_turn, period);
        self.arrive(state);
    }

    /// The block of these samples where the table stands in this attitude; its state is where navigation
    /// is now. What the instrument senses there is known, so the error model takes it from the attitude:
    /// taken from the samples, their noise would be in both the innovations and the sensitivity to scale
    /// factors, and the two together look like information.
    pub fn standing(&self, attitude: &Matrix3<f64>, samples: Range<usize>) -> Block {
        let duration = samples.len() as f64 * self.imu.period;
        let force = -self.gravity;
        let mut moments = Moments::standing(attitude, &self.earth_rate, &force, duration);
        if !self.terms.on.is_empty() {
            let sensed = Sensed {
                rate: attitude.tr_mul(&self.earth_rate),
                rate_over_earth: Vector3::zeros(),
                angular_acceleration: Vector3::zeros(),
                force: attitude.tr_mul(&force),
            };
            let responses = self.responses(&sensed);
            moments.stand_terms(&self.terms.on, attitude, &responses);
        }
        let mut passage = Passage::new(&self.earth_rate, &self.terms.on);
        passage.add(&moments, self.bridged(&samples));
        self.block(passage)
    }

    /// The same of samples of which some are interpolated, given the block of as many where the table stands
    /// in the same attitude.
    pub fn standing_like(&self, block: &Block, samples: &Range<usize>) -> Block {
        block.bridging(self.bridged(samples))
    }

    /// Before these samples.
    fn before(&mut self, samples: &Range<usize>) -> Underway {
        // Coning asks for the sample before, angular acceleration for those beside.
        self.near
            .reach(&(samples.start.saturating_sub(2)..samples.end + 1));
        let last = samples.start.checked_sub(1);
        Underway {
            state: self.state,
            last: last.map_or_else(Increments::default, |k| {
                self.increments(k, &self.state.attitude).0
            }),
        }
    }

    /// Navigates through a sample.
    #[inline(always)]
    fn through(&self, k: usize, underway: &mut Underway) -> Step {
        let Underway { state, last } = underway;
        let (increments, sensed) = self.increments(k, &state.attitude);
        let motion = increments.motion(last);
        *last = increments;
        let attitude = state.attitude;
        let change = self.go_on(state, &motion, &self.earth_turn, self.imu.period);
        Step {
            middle: (attitude + state.attitude) * 0.5,
            increments,
            change,
            sensed,
        }
    }

    /// Is where the samples led to.
    fn arrive(&mut self, mut state: State) {
        state.attitude = orthonormalised(&state.attitude);
        self.state = state;
    }

    /// The state goes on by this motion over a time in which the Earth turns so; the velocity change by
    /// specific force.
    #[inline(always)]
    fn go_on(
        &self,
        state: &mut State,
        motion: &Motion,
        earth_turn: &Matrix3<f64>,
        period: f64,
    ) -> Vector3<f64> {
        let in_start_frame = state.attitude * motion.velocity;
        // The frame turns with the Earth meanwhile.
        let half_turn = self.earth_rate * (0.5 * period);
        let change = in_start_frame - half_turn.cross(&in_start_frame);
        let coriolis = self.earth_rate.cross(&state.velocity) * 2.0;
        let velocity = state.velocity + change + (self.gravity - coriolis) * period;
        state.attitude = earth_turn * (state.attitude * exp(motion.rotation));
        state.position += (state.velocity + velocity) * (0.5 * period);
        state.velocity = velocity;
        change
    }

    fn block(&self, passage: Passage) -> Block {
        let responses = PerSensor::from_fn(|sensor| &self.instrument.get(sensor).response);
        let thermal = self.thermal.as_ref().map(|thermal| thermal.state);
        passage.block(self.state, responses, thermal)
    }

    /// Covariance in `n` that interpolation adds to the integrals of both triads' input.
    fn bridged(&self, samples: &Range<usize>) -> PerSensor<Matrix3<f64>> {
        let mut covariance = PerSensor::<Matrix3<f64>>::default();
        for (bridge, part) in self.imu.bridged(samples) {
            for (sensor, axis, variance) in bridge.each() {
                let correction = &self.instrument.get(sensor).correction;
                let error = self.state.attitude * correction.column(axis);
                *covariance.get_mut(sensor) += error * error.transpose() * (variance * part);
            }
        }
        covariance
    }
}

/// Navigation within samples that follow one another.
struct Underway {
    state: State,
    /// Of the sample before.
    last: Increments,
}

/// One sample of navigation.
struct Step {
    /// Attitude at its middle.
    middle: Matrix3<f64>,
    increments: Increments,
    /// Velocity change by specific force.
    change: Vector3<f64>,
    /// What the body senses, where error terms are on.
    sensed: Option<Sensed>,
}

impl Instrument {
    fn new(triad: &Triad, correction: Matrix3<f64>, period: f64) -> Self {
        Self {
            correction,
            bias: correction * triad.bias * period,
            response: CorrectedResponse::new(triad, &correction),
        }
    }
}

fn instruments(triads: &PerSensor<Triad>, period: f64) -> Option<PerSensor<Instrument>> {
    let one = |triad: &Triad| {
        let correction = triad.correction()?;
        Some(Instrument::new(triad, correction, period))
    };
    Some(PerSensor {
        gyro: one(&triads.gyro)?,
        accel: one(&triads.accel)?,
    })
}

#[cfg(test)]
mod tests;
