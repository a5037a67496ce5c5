//! Strapdown navigation in a frame fixed to the site.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::block::{Block, State};
use super::increments::{Increments, Motion, Sums};
use super::instrument::Instrument;
use super::passage::Passage;
use crate::attitude::{exp, orthonormalised};
use crate::earth::Site;
use crate::imu::{
    PerSensor, Sensed, Sensor, TermVector, ThermalCoefficients, ThermalModel, ThermalState, Triad,
    thermal_state,
};
use crate::recording::{ImuSamples, Near};

/// Length of a part, s. Within a part, the effect of earlier errors is treated as a whole; the sensitivity of
/// navigation is accurate to second order in this length.
const PART: f64 = 0.1;
/// Number of iterations for the input with error terms. A time offset of one sample of 10 ms at 200 °/s rotates
/// specific force by 0.03, and each iteration leaves this fraction of the previous error: 10⁻⁶ of the effect of the
/// offset.
const ROUNDS: usize = 4;

/// The whole number of samples nearest to a time, at least one.
pub fn samples_of(time: f64, period: f64) -> usize {
    ((time / period).round() as usize).max(1)
}

/// Navigates through a record with given triads and accumulates the error model.
#[derive(Debug, Clone)]
pub struct Navigator<'a> {
    imu: &'a ImuSamples,
    near: Near<'a>,
    gravity: Vector3<f64>,
    earth_rate: Vector3<f64>,
    earth_turn: Matrix3<f64>,
    /// Triads at the reference temperature.
    triads: PerSensor<Triad>,
    instrument: PerSensor<Instrument>,
    thermal: Option<Thermal>,
    /// Enabled parameters of error terms.
    on: Vec<usize>,
    /// Values of all parameters of error terms; zero where off.
    terms: TermVector,
    /// Whether any of these values is nonzero.
    shifted: bool,
    /// The current state.
    pub state: State,
}

/// Temperature dependence of the triads.
#[derive(Debug, Clone)]
struct Thermal {
    model: Arc<ThermalModel>,
    coefficients: PerSensor<ThermalCoefficients>,
    /// Temperature functions of the current samples.
    state: ThermalState,
}

impl<'a> Navigator<'a> {
    /// Starts in this state with these triads; returns `None` if a sensitivity is singular.
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
            on: Vec::new(),
            terms: TermVector::zeros(),
            shifted: false,
            state,
        })
    }

    /// A copy with temperature-dependent triads; the current triads are those at the reference temperature.
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

    /// Uses the triads at the temperature in the middle of these samples.
    pub fn warm(&mut self, samples: &Range<usize>) {
        let (Some(thermal), Some(temperature)) = (&mut self.thermal, &self.imu.temperature) else {
            return;
        };
        let middle = 0.5 * (self.imu.time(samples.start) + self.imu.time(samples.end));
        let (t, rate) = (temperature.at(middle), temperature.rate(middle));
        thermal.state = thermal_state(&thermal.model.range, &t, &rate);
        // If a sensitivity is singular, the results are not finite and the pass diverges.
        let singular = Matrix3::repeat(f64::NAN);
        self.instrument = PerSensor::from_fn(|sensor| {
            let triad = self.triads().get(sensor).to_owned();
            let correction = triad.correction().unwrap_or(singular);
            Instrument::new(&triad, correction, self.imu.period)
        });
    }

    /// The triads that are in use.
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

    /// A copy with these enabled error-term parameters, and values of all parameters (zero if off).
    pub fn with_terms(mut self, on: Vec<usize>, values: TermVector) -> Self {
        self.on = on;
        self.shifted = values != TermVector::zeros();
        self.terms = values;
        self
    }

    /// Increments of sample `k` along body axes, corrected by the triads (Eq. 11) and, near this attitude, by error
    /// terms; and, with error terms, the sensed motion.
    #[inline]
    fn increments(&self, k: usize, attitude: &Matrix3<f64>) -> (Increments, Option<Sensed>) {
        let of_triads = self.of_triads(k);
        if self.on.is_empty() {
            return (of_triads, None);
        }
        let (period, last) = (self.imu.period, self.imu.len() - 1);
        let mut sensed = self.sensed(&of_triads, attitude, period);
        // Angular acceleration at the middle of the sample, from the samples before and after it.
        let (before, after) = (k.saturating_sub(1), (k + 1).min(last));
        let change = self.of_triads(after).angle - self.of_triads(before).angle;
        let apart = (after - before).max(1) as f64 * period;
        sensed.angular_acceleration = change / (period * apart);
        let increments = self.without_terms(of_triads, &mut sensed, period);
        (increments, Some(sensed))
    }

    /// Removes the contribution of error terms from increments over a time; the sensed motion is updated.
    fn without_terms(&self, of_triads: Increments, sensed: &mut Sensed, period: f64) -> Increments {
        let mut increments = of_triads;
        // Triads sense u + t(u), and u is sought.
        for _ in 0..if self.shifted { ROUNDS } else { 0 } {
            let added = |sensor| sensed.added(sensor, &self.terms) * period;
            increments.angle = of_triads.angle - added(Sensor::Gyro);
            increments.velocity = of_triads.velocity - added(Sensor::Accel);
            sensed.force = increments.velocity / period;
        }
        increments
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

    /// Sensed motion of a steadily rotating body, from increments over a time, near this attitude.
    fn sensed(&self, increments: &Increments, attitude: &Matrix3<f64>, period: f64) -> Sensed {
        let rate = increments.angle / period;
        Sensed {
            rate,
            rate_over_earth: rate - attitude.tr_mul(&self.earth_rate),
            angular_acceleration: Vector3::zeros(),
            force: increments.velocity / period,
        }
    }

    /// Navigates through these samples and returns their block. Coning and sculling use the previous sample, if there
    /// is one.
    pub fn advance(&mut self, samples: Range<usize>) -> Block {
        let few = samples_of(PART, self.imu.period);
        let parts = samples.len().div_ceil(few);
        let mut passage = Passage::new(&self.earth_rate, &self.on, parts);
        for begin in samples.clone().step_by(few) {
            let part = begin..(begin + few).min(samples.end);
            self.warm(&part);
            self.move_through(part.clone(), &mut passage);
            passage.end_part(self.bridged(&part));
        }
        // Sensitivities that change by only a few thousandths are evaluated in the middle.
        self.warm(&samples);
        self.block(passage)
    }

    /// Navigates through a few samples of a move.
    fn move_through(&mut self, samples: Range<usize>, passage: &mut Passage) {
        let period = self.imu.period;
        // Coning needs the previous sample, angular acceleration the samples on both sides.
        self.near
            .reach(&(samples.start.saturating_sub(2)..samples.end + 1));
        let mut state = self.state;
        let mut last = match samples.start.checked_sub(1) {
            Some(before) => self.increments(before, &state.attitude).0,
            None => Increments::default(),
        };
        for k in samples {
            let begin = state.attitude;
            let (increments, sensed) = self.increments(k, &begin);
            let motion = increments.motion(&last);
            last = increments;
            let change = self.follow(&mut state, &motion, &self.earth_turn, period);
            let middle = (begin + state.attitude) * 0.5;
            passage.add(&middle, &increments, &change, period);
            let turned = increments.angle - middle.tr_mul(&self.earth_rate) * period;
            passage.add_motion(&turned, &(change + self.gravity * period), period);
            if let Some(sensed) = &sensed {
                passage.add_terms(&middle, sensed, &self.terms, &change, period);
            }
        }
        self.arrive(state);
    }

    /// Navigates through samples of a body at rest, given their sums, without an error model.
    pub fn stand(&mut self, sums: &Sums) {
        let period = sums.samples as f64 * self.imu.period;
        let mut increments = sums.increments(&self.instrument);
        let mut state = self.state;
        if !self.on.is_empty() {
            let mut sensed = self.sensed(&increments, &state.attitude, period);
            increments = self.without_terms(increments, &mut sensed, period);
        }
        let motion = sums.motion(&increments, &self.instrument);
        let earth_turn = exp(-self.earth_rate * period);
        self.follow(&mut state, &motion, &earth_turn, period);
        self.arrive(state);
    }

    /// The block of these samples for a table at rest in this attitude, with the current state. The sensed input is
    /// known, so the error model follows from the attitude, as for one long sample. If the error model used the
    /// samples, the noise of the samples would enter both the innovations and the sensitivity to scale factors, and the
    /// product of the two would look like information.
    pub fn standing(&self, attitude: &Matrix3<f64>, samples: Range<usize>) -> Block {
        let duration = samples.len() as f64 * self.imu.period;
        let change = -self.gravity * duration;
        let increments = Increments {
            angle: attitude.tr_mul(&self.earth_rate) * duration,
            velocity: attitude.tr_mul(&change),
        };
        let mut passage = Passage::new(&self.earth_rate, &self.on, 1);
        passage.add(attitude, &increments, &change, duration);
        if !self.on.is_empty() {
            let sensed = self.sensed(&increments, attitude, duration);
            passage.add_terms(attitude, &sensed, &self.terms, &change, duration);
        }
        passage.end_part(self.bridged(&samples));
        self.block(passage)
    }

    /// Does the same as [`Self::standing`] for samples some of which are interpolated, given the block of the same
    /// number of samples in the same attitude.
    pub fn standing_like(&self, block: &Block, samples: &Range<usize>) -> Block {
        let mut like = block.clone();
        for part in &mut like.noise.parts {
            part.bridged = self.bridged(samples);
        }
        like
    }

    /// Sets the state reached after the samples.
    fn arrive(&mut self, mut state: State) {
        state.attitude = orthonormalised(&state.attitude);
        self.state = state;
    }

    /// Advances a state by this motion over a time with this Earth rotation, and returns the velocity change by
    /// specific force.
    #[inline(always)]
    fn follow(
        &self,
        state: &mut State,
        motion: &Motion,
        earth_turn: &Matrix3<f64>,
        period: f64,
    ) -> Vector3<f64> {
        let in_start_frame = state.attitude * motion.velocity;
        // Meanwhile, the frame rotates with the Earth.
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

    /// Covariance in `n` that interpolation adds to the integrals of both triads' input, if any does.
    fn bridged(&self, samples: &Range<usize>) -> Option<Box<PerSensor<Matrix3<f64>>>> {
        let mut covariance = None;
        for (bridge, part) in self.imu.bridged(samples) {
            let covariance = covariance.get_or_insert_with(Box::<PerSensor<Matrix3<f64>>>::default);
            for (sensor, axis, variance) in bridge.each() {
                let correction = &self.instrument.get(sensor).correction;
                let error = self.state.attitude * correction.column(axis);
                *covariance.get_mut(sensor) += error * error.transpose() * (variance * part);
            }
        }
        covariance
    }
}

fn instruments(triads: &PerSensor<Triad>, period: f64) -> Option<PerSensor<Instrument>> {
    let of = |triad: &Triad| Some(Instrument::new(triad, triad.correction()?, period));
    Some(PerSensor {
        gyro: of(&triads.gyro)?,
        accel: of(&triads.accel)?,
    })
}

#[cfg(test)]
mod tests;
