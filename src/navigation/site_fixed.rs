//! Strapdown navigation in a frame fixed to the site.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::block::{Block, CorrectedResponse, Moments};
use super::increments::Increments;
use super::state::State;
use crate::attitude::{exp, orthonormalised};
use crate::earth::Site;
use crate::imu::{FurtherResponse, FurtherVector, PerSensor, Sensed, Sensor, Triad};
use crate::run::ImuRecord;

/// Navigates through a record with given triads and accumulates the error model as it goes.
#[derive(Debug, Clone)]
pub struct Navigator<'a> {
    imu: &'a ImuRecord,
    random_walk: PerSensor<f64>,
    gravity: Vector3<f64>,
    earth_rate: Vector3<f64>,
    earth_turn: Matrix3<f64>,
    instrument: PerSensor<Instrument>,
    further: FurtherTerms,
    /// Where navigation stands.
    pub state: State,
}

/// Further terms of the instrument that navigation knows of.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FurtherTerms {
    /// Parameters that are on, whatever their values.
    pub on: Vec<usize>,
    /// Values of all parameters; zero where off.
    pub values: FurtherVector,
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
    /// `random_walk` are the noise densities in rad/√s and (m/s)/√s.
    pub fn new(
        imu: &'a ImuRecord,
        site: &Site,
        random_walk: PerSensor<f64>,
        triads: &PerSensor<Triad>,
        state: State,
    ) -> Option<Self> {
        let earth_rate = site.earth_rate_n();
        Some(Self {
            imu,
            random_walk,
            gravity: site.gravity_n(),
            earth_rate,
            earth_turn: exp(-earth_rate * imu.period),
            instrument: instruments(triads, imu.period)?,
            further: FurtherTerms::default(),
            state,
        })
    }

    /// The same with further terms.
    pub fn with_further(mut self, further: FurtherTerms) -> Self {
        self.further = further;
        self
    }

    /// Goes on with other values of the further terms.
    pub fn set_further(&mut self, values: FurtherVector) {
        self.further.values = values;
    }

    /// Goes on with other triads; `None` if the sensitivity of one is singular.
    pub fn set_triads(&mut self, triads: &PerSensor<Triad>) -> Option<()> {
        self.instrument = instruments(triads, self.imu.period)?;
        Some(())
    }

    /// Increments along body axes of sample `k`, corrected by the triads (Eq. 11).
    #[inline]
    fn increments(&self, k: usize, attitude: &Matrix3<f64>) -> Increments {
        let increments = self.of_triads(k);
        if self.further.on.is_empty() {
            return increments;
        }
        let period = self.imu.period;
        let responses = self.responses(k, attitude);
        let added = |sensor| responses.get(sensor) * self.further.values * period;
        Increments {
            angle: increments.angle - added(Sensor::Gyro),
            velocity: increments.velocity - added(Sensor::Accel),
        }
    }

    #[inline]
    fn of_triads(&self, k: usize) -> Increments {
        let PerSensor { gyro, accel } = &self.instrument;
        Increments {
            angle: gyro.correction * self.imu.gyro[k] - gyro.bias,
            velocity: accel.correction * self.imu.accel[k] - accel.bias,
        }
    }

    /// What the further terms respond to in sample `k`, at about this attitude.
    fn responses(&self, k: usize, attitude: &Matrix3<f64>) -> PerSensor<FurtherResponse> {
        let period = self.imu.period;
        let Increments { angle, velocity } = self.of_triads(k);
        let before = k.checked_sub(1).map_or(angle, |k| self.of_triads(k).angle);
        let rate = angle / period;
        let sensed = Sensed {
            rate,
            rate_over_earth: rate - attitude.tr_mul(&self.earth_rate),
            angular_acceleration: (angle - before) / (period * period),
            force: velocity / period,
        };
        PerSensor::from_fn(|sensor| sensed.response(sensor))
    }

    /// Navigates through these samples of the record and gives their block. Where the record has a
    /// sample before the first of them, coning and sculling take it into account.
    pub fn advance(&mut self, samples: Range<usize>) -> Block {
        let period = self.imu.period;
        let mut moments = Moments::with_further(&self.further.on);
        let with_further = !self.further.on.is_empty();
        self.navigate(samples, |navigator, k, step| {
            let middle = (step.before + step.after) * 0.5;
            moments.add(&middle, &step.increments, &step.change, period);
            if with_further {
                let responses = navigator.responses(k, &middle);
                moments.add_further(&middle, &responses, &step.change, period);
            }
        });
        self.block(&moments)
    }

    /// The same where the table stands. What the instrument senses there is known, so the error
    /// model takes it from the attitude: taken from the samples, their noise would be in both the
    /// innovations and the sensitivity to scale factors, and the two together look like information.
    pub fn advance_standing(&mut self, samples: Range<usize>) -> Block {
        let duration = samples.len() as f64 * self.imu.period;
        self.navigate(samples, |_, _, _| {});
        let attitude = self.state.attitude;
        let force = -self.gravity;
        let mut moments = Moments::standing(&attitude, &self.earth_rate, &force, duration);
        if !self.further.on.is_empty() {
            let sensed = Sensed {
                rate: attitude.tr_mul(&self.earth_rate),
                rate_over_earth: Vector3::zeros(),
                angular_acceleration: Vector3::zeros(),
                force: attitude.tr_mul(&force),
            };
            let responses = PerSensor::from_fn(|sensor| sensed.response(sensor));
            moments.stand_further(&self.further.on, &attitude, &responses);
        }
        self.block(&moments)
    }

    /// Navigates through samples and tells `each` of every one.
    #[inline]
    fn navigate(&mut self, samples: Range<usize>, mut each: impl FnMut(&Self, usize, &Step)) {
        let period = self.imu.period;
        let mut state = self.state;
        let mut before = samples
            .start
            .checked_sub(1)
            .map_or_else(Increments::default, |k| self.increments(k, &state.attitude));
        let half_turn = self.earth_rate * (0.5 * period);
        for k in samples {
            let increments = self.increments(k, &state.attitude);
            let motion = increments.motion(&before);
            before = increments;

            let in_start_frame = state.attitude * motion.velocity;
            // The frame turns with the Earth while the sample lasts.
            let change = in_start_frame - half_turn.cross(&in_start_frame);
            let attitude = self.earth_turn * (state.attitude * exp(motion.rotation));
            let step = Step {
                before: state.attitude,
                after: attitude,
                increments,
                change,
            };
            each(self, k, &step);

            let coriolis = self.earth_rate.cross(&state.velocity) * 2.0;
            let velocity = state.velocity + change + (self.gravity - coriolis) * period;
            state.position += (state.velocity + velocity) * (0.5 * period);
            state.velocity = velocity;
            state.attitude = attitude;
        }
        state.attitude = orthonormalised(&state.attitude);
        self.state = state;
    }

    fn block(&self, moments: &Moments) -> Block {
        let responses = PerSensor::from_fn(|sensor| &self.instrument.get(sensor).response);
        moments.block(self.state, &self.earth_rate, responses, &self.random_walk)
    }
}

/// One sample of navigation.
struct Step {
    /// Attitude before and after it.
    before: Matrix3<f64>,
    after: Matrix3<f64>,
    increments: Increments,
    /// Velocity change by specific force.
    change: Vector3<f64>,
}

fn instruments(triads: &PerSensor<Triad>, period: f64) -> Option<PerSensor<Instrument>> {
    let one = |triad: &Triad| {
        let correction = triad.correction()?;
        Some(Instrument {
            correction,
            bias: correction * triad.bias * period,
            response: CorrectedResponse::new(triad, &correction),
        })
    };
    Some(PerSensor {
        gyro: one(&triads.gyro)?,
        accel: one(&triads.accel)?,
    })
}

#[cfg(test)]
mod tests;
