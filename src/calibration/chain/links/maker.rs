//! Makes links from the events of a recording.

use nalgebra::{DMatrix, DVector};

use super::given::Given;
use super::link::Link;
use super::magnetic::magnetic;
use super::rows::Rows;
use super::transition::Transition;
use crate::attitude::skew;
use crate::calibration::budget::source::BudgetSource;
use crate::calibration::chain::dynamics::Dynamics;
use crate::calibration::chain::effects::{Dispersion, Effect, Slip};
use crate::calibration::chain::part::{PartFilter, filter_of, part_filters};
use crate::calibration::chain::short_rows::factor;
use crate::calibration::chain::states::{ATTITUDE, NAVIGATION, POSITION, States, VELOCITY};
use crate::calibration::record::{Event, Rest, between};
use crate::calibration::several::day_to_day::OwnState;
use crate::calibration::{CalibrationError, Constant, Group, Problem, Script, Source, Stretch};
use crate::imu::{GaussMarkov, MotionNoise, Noise, PerSensor, Sensor};
use crate::navigation::{Block, ErrorMatrix, ProcessNoise};

/// 1σ of the slips of all moves together, divided by that of a position.
const SLIP: f64 = 0.1;

/// Makes one link after the other.
pub struct Maker<'a, F> {
    problem: &'a Problem<'a>,
    filters: [Box<dyn PartFilter>; 2],
    dispersion: &'a Dispersion,
    dynamics: Dynamics<'a>,
    /// Transition since the last rows.
    pending: Transition,
    take: F,
    pub squares: f64,
    pub log_determinant: f64,
    pub observations: usize,
    /// Number of dwells begun.
    dwell: usize,
}

impl<'a, F: FnMut(Link) -> Result<(), CalibrationError>> Maker<'a, F> {
    /// A maker before the first stretch; `take` gets each link.
    pub fn new(
        (problem, dispersion): (&'a Problem<'a>, &'a Dispersion),
        states: &'a States,
        constants: &'a [Constant],
        take: F,
    ) -> Self {
        Self {
            problem,
            filters: part_filters(states.moving),
            dispersion,
            dynamics: Dynamics {
                states,
                constants,
                turned: None,
                magnetic: None,
            },
            pending: Transition::identity(states.count, constants.len()),
            take,
            squares: 0.0,
            log_determinant: 0.0,
            observations: 0,
            dwell: 0,
        }
    }

    /// The links of a stretch.
    pub fn stretch(&mut self, script: &Script, number: usize) -> Result<(), CalibrationError> {
        self.begin(script, number);
        let stretch = &self.problem.stretches()[number];
        let mut begins = true;
        for event in &script.events[number] {
            match event {
                Event::Move(block) => self.advance(block),
                Event::Rest(rest) => {
                    self.stand(rest, stretch, begins)?;
                    begins = false;
                }
            }
        }
        Ok(())
    }

    /// Begins a stretch: resets navigation errors, table position and Earth rate; in another recording, also the states
    /// of the recording.
    fn begin(&mut self, script: &Script, number: usize) {
        let (problem, states) = (self.problem, self.dynamics.states);
        let stretch = &problem.stretches()[number];
        let (prior, at) = (&script.priors[number], &script.at.initial_attitudes[number]);
        let start = stretch.start(prior, at);
        self.dynamics.magnetic = script.at.magnetic;
        let before = number.checked_sub(1).map(|k| &problem.stretches()[k]);
        let same = before.filter(|before| before.recording == stretch.recording);
        if let Some(before) = same {
            self.vary(before.time_until(stretch), self.dwell);
        }
        let (stated, still) = (Effect::Stated, [0.0; 3]);
        let level = (start.attitude.as_slice(), start.attitude_sigma.as_slice());
        self.renew(ATTITUDE, level, stated(BudgetSource::InitialAttitude));
        let place = stated(BudgetSource::Place);
        self.renew(VELOCITY, (&still, &[start.velocity_sigma; 3]), place);
        self.renew(POSITION, (&still, &[start.position_sigma; 3]), place);
        if let Some(turn) = states.turn() {
            self.renew(turn, (&still, &still), stated(BudgetSource::RotationAtRest));
        }
        if let Some(table) = states.table {
            let sigma = [problem.model.position_sigma; 3];
            let position = Effect::Noise(Source::TablePosition);
            self.renew(table, (&still, &sigma), position);
        }
        if let Some(first) = states.earth_rate {
            let sigma = start.earth_rate_sigma.as_slice();
            let rate = (start.earth_rate.as_slice(), sigma);
            self.renew(first, rate, stated(BudgetSource::Headings));
        }
        let moved = before.is_none_or(|before| before.run.site != stretch.run.site);
        if let Some(state) = states.gravity.filter(|_| moved) {
            let sigma = [stretch.run.site.gravity_sigma];
            self.renew(state, (&[0.0], &sigma), stated(BudgetSource::Gravity));
        }
        if same.is_none() {
            self.begin_recording(script, stretch.recording);
        }
    }

    /// Begins a recording: resets slips of the table, deviations of the biases, and differences between recordings.
    fn begin_recording(&mut self, script: &Script, recording: usize) {
        let (model, states) = (&self.problem.model, self.dynamics.states);
        let (stated, still) = (Effect::Stated, [0.0; 3]);
        for first in states.slips.into_iter().flatten() {
            self.renew(first, (&still, &still), stated(BudgetSource::Slips));
        }
        for sensor in Sensor::ALL {
            let sigma = [variation(model.noise.get(sensor)).sigma; 3];
            let first = *states.biases.get(sensor);
            self.renew(first, (&still, &sigma), wander(sensor));
        }
        let own = script.at.own(recording);
        for &(state, of) in &states.own {
            let sigma = [model.day_to_day.of(of)];
            let effect = match of {
                OwnState::Parameter(index) => Effect::Difference(Group::of(index)),
                OwnState::Mounting(_) => stated(BudgetSource::Recording),
            };
            self.renew(state, (&[-own.get(of)], &sigma), effect);
        }
        let mounted = model.day_to_day.mounting > 0.0;
        self.dynamics.turned = mounted.then(|| own.response(&script.at.triads));
    }

    /// Resets some states, with these means and 1σ.
    fn renew(&mut self, first: usize, of: (&[f64], &[f64]), effect: Effect) {
        self.renew_at(self.dwell, first, of, effect);
    }

    /// Does the same for an event of this number.
    fn renew_at(
        &mut self,
        event: usize,
        first: usize,
        (mean, sigma): (&[f64], &[f64]),
        effect: Effect,
    ) {
        self.pending.reset(first..first + mean.len(), mean);
        let root = DMatrix::from_diagonal(&DVector::from_column_slice(sigma));
        self.pending.drive(effect, event, first, &root);
    }

    /// Adds a move.
    fn advance(&mut self, block: &Block) {
        let n = self.dynamics.states.count;
        let mut by = DMatrix::identity(n, n);
        by.rows_mut(0, NAVIGATION)
            .copy_from(&self.dynamics.by_states(block));
        self.pending.then(&by);
        let constants = self.dynamics.by_constants(block);
        self.pending.add_constants(0, &constants);
        let model = &self.problem.model;
        for (effect, noise) in noises(model.noise, model.motion_noise) {
            let covariance = block.noise.covariance(&noise);
            self.pending
                .drive(effect, self.dwell, 0, &root(&covariance));
        }
        if block.noise.parts.iter().any(|part| part.bridged.is_some()) {
            let covariance = block.noise.covariance(&PerSensor::default());
            let effect = Effect::Stated(BudgetSource::Interpolated);
            self.pending
                .drive(effect, self.dwell, 0, &root(&covariance));
        }
        self.vary(block.duration, self.dwell);
    }

    /// Lets the biases vary: first-order Gauss–Markov (Brown and Hwang, *Introduction to Random Signals*, 4th ed.,
    /// §3.8). `event` is the number of the dwell that the variation concerns or precedes.
    fn vary(&mut self, duration: f64, event: usize) {
        let n = self.dynamics.states.count;
        for sensor in Sensor::ALL {
            let first = *self.dynamics.states.biases.get(sensor);
            let variation = variation(self.problem.model.noise.get(sensor));
            let keep = (-duration / variation.correlation_time).exp();
            let mut by = DMatrix::identity(n, n);
            (first..first + 3).for_each(|state| by[(state, state)] = keep);
            self.pending.then(&by);
            let sigma = variation.sigma * (1.0 - keep * keep).sqrt();
            let root = DMatrix::from_diagonal_element(3, 3, sigma);
            self.pending.drive(wander(sensor), event, first, &root);
        }
    }

    /// Adds a part of a dwell, with its rows.
    fn stand(
        &mut self,
        rest: &Rest,
        stretch: &Stretch,
        begins: bool,
    ) -> Result<(), CalibrationError> {
        let diverged = || CalibrationError::Diverged { time: rest.end() };
        let Some(first) = rest.models.first() else {
            return Ok(());
        };
        let place = self.begin_part(rest, stretch);
        let model = &self.problem.model;
        let filter = &mut self.filters[filter_of(rest)];
        let part = filter.reduce((rest, stretch), model, &mut |_| {});
        let size = filter.given();
        let factor = self.dispersion.of(self.dwell - 1);
        let part = part.ok_or_else(diverged)?.dispersed(factor);
        self.observations += part.count;
        self.squares += part.squares;
        self.log_determinant += part.log_determinant;
        let given = Given::new(&self.dynamics, rest, first, size);
        let n = self.dynamics.states.count;
        let pending = std::mem::replace(
            &mut self.pending,
            Transition::identity(n, self.dynamics.constants.len()),
        );
        let rows = given.rows(&part).and(place);
        let weight = model.weight(BudgetSource::MagneticNoise);
        let rows = match magnetic(&self.dynamics, rest, weight) {
            Some((magnetic, log_determinant)) => {
                self.log_determinant += log_determinant;
                magnetic.and(rows)
            }
            None => rows,
        };
        if !rows.values.iter().all(|value| value.is_finite()) {
            return Err(diverged());
        }
        given.end(&part, self.dynamics.states.moving, &mut self.pending);
        let link = Link {
            begins,
            recording: stretch.recording,
            dwell: self.dwell - 1,
            attitude: rest.first.then_some(rest.begin.attitude),
            time: rest.end(),
            transition: pending,
            rows,
            given,
        };
        (self.take)(link)?;
        let duration = rest
            .steps
            .iter()
            .map(|step| rest.models[step.model].duration);
        self.vary(duration.sum(), self.dwell - 1);
        Ok(())
    }

    /// Renews the disturbance of the magnetic field for the dwell that begins.
    fn disturb_field(&mut self) {
        if let Some(first) = self.dynamics.states.magnetic {
            let model = &self.problem.model.magnetic;
            let sigma = [model.disturbance / model.magnitude[0]; 3];
            let effect = Effect::Noise(Source::MagneticDisturbance);
            self.renew_at(self.dwell - 1, first, (&[0.0; 3], &sigma), effect);
        }
    }

    /// Refers the states to the beginning of a part. If the body came to rest at a new position, the table position is
    /// reset and the position is observed.
    fn begin_part(&mut self, rest: &Rest, stretch: &Stretch) -> Rows {
        let states = self.dynamics.states;
        let (n, model) = (states.count, &self.problem.model);
        if rest.first {
            let mut by = DMatrix::identity(n, n);
            for (first, computed) in [
                (VELOCITY, rest.from.velocity),
                (POSITION, rest.from.position),
            ] {
                by.fixed_view_mut::<3, 3>(first, ATTITUDE)
                    .copy_from(&skew(-computed));
            }
            self.pending.then(&by);
        }
        let by = between(&rest.from, &rest.begin);
        let errors = [ATTITUDE, VELOCITY, POSITION].into_iter().zip(by);
        for (first, by) in errors.chain(states.turn().map(|turn| (turn, by[0]))) {
            let mut offset = self.pending.offset.fixed_rows_mut::<3>(first);
            offset += by;
        }
        let mut rows = Rows::none(n, self.dynamics.constants.len());
        if !rest.first {
            return rows;
        }
        self.dwell += 1;
        let still = [0.0; 3];
        if let Some(turn) = states.turn() {
            self.pending.reset(turn..turn + 3, &still);
            // The rotation is counted from an attitude without the remainder of its pulses.
            let remainder = stretch.run.recording.imu.pulse.gyro / 12f64.sqrt();
            let root = DMatrix::from_diagonal_element(3, 3, remainder);
            let effect = Effect::Stated(BudgetSource::Pulses);
            self.pending.drive(effect, self.dwell - 1, turn, &root);
        }
        self.disturb_field();
        if rest.new_position {
            if let Some(table) = states.table {
                self.pending.reset(table..table + 3, &still);
                let root = DMatrix::from_diagonal_element(3, 3, model.position_sigma);
                let effect = Effect::Noise(Source::TablePosition);
                self.pending.drive(effect, self.dwell - 1, table, &root);
            }
            let kinds = [Slip::Mount, Slip::Base].map(Effect::Slip);
            for (slips, effect) in states.slips.into_iter().flatten().zip(kinds) {
                let slip = self.problem.slip() * model.position_sigma;
                let root = DMatrix::from_diagonal_element(3, 3, slip);
                self.pending.drive(effect, self.dwell - 1, slips, &root);
            }
            let sigma = stretch.position_variance(model).sqrt();
            rows = Rows::none(n, self.dynamics.constants.len()).of(3);
            for axis in 0..3 {
                rows.states[(axis, POSITION + axis)] = 1.0 / sigma;
                rows.values[axis] = rest.begin.position[axis] / sigma;
            }
            self.log_determinant += 6.0 * sigma.ln();
        }
        rows
    }
}

impl Problem<'_> {
    /// 1σ of the slip in one move, divided by the 1σ of a table position.
    pub fn slip(&self) -> f64 {
        SLIP / (self.dwells().count().max(1) as f64).sqrt()
    }
}

/// The noise sources of a move, with their densities.
fn noises(
    noise: PerSensor<Noise>,
    motion: PerSensor<MotionNoise>,
) -> [(Effect, PerSensor<ProcessNoise>); 6] {
    let one = |sensor: Sensor, source: Source, of: ProcessNoise| {
        let mut noise = PerSensor::default();
        *noise.get_mut(sensor) = of;
        (Effect::Noise(source), noise)
    };
    let none = ProcessNoise::default();
    let white = |sensor: Sensor| ProcessNoise {
        random_walk: noise.get(sensor).random_walk,
        ..none
    };
    let by_motion = |sensor: Sensor| ProcessNoise {
        by_motion: motion.get(sensor).by_motion,
        ..none
    };
    let by_duration = |sensor: Sensor| ProcessNoise {
        by_duration: motion.get(sensor).by_duration,
        ..none
    };
    let (gyro, accel) = (Sensor::Gyro, Sensor::Accel);
    [
        one(gyro, Source::AngleRandomWalk, white(gyro)),
        one(accel, Source::VelocityRandomWalk, white(accel)),
        one(gyro, Source::GyroMotion, by_motion(gyro)),
        one(accel, Source::AccelMotion, by_motion(accel)),
        one(gyro, Source::GyroMoving, by_duration(gyro)),
        one(accel, Source::AccelMoving, by_duration(accel)),
    ]
}

/// The variation of biases, zero if there is none.
fn variation(noise: &Noise) -> GaussMarkov {
    noise.gauss_markov.unwrap_or(GaussMarkov {
        sigma: 0.0,
        correlation_time: f64::INFINITY,
    })
}

fn wander(sensor: Sensor) -> Effect {
    Effect::Noise(match sensor {
        Sensor::Gyro => Source::GyroGaussMarkov,
        Sensor::Accel => Source::AccelGaussMarkov,
    })
}

/// A square root of a covariance of the navigation errors, without columns that are only rounding errors.
fn root(covariance: &ErrorMatrix) -> DMatrix<f64> {
    let rows = covariance
        .row_iter()
        .map(|row| std::array::from_fn(|k| row[k]));
    let mut matrix = [[0.0; NAVIGATION]; NAVIGATION];
    for (row, to) in rows.zip(&mut matrix) {
        *to = row;
    }
    let columns = factor(matrix, [0.0; NAVIGATION]);
    let columns: Vec<[f64; NAVIGATION]> = columns.map(|(_, column, _)| column).collect();
    DMatrix::from_fn(NAVIGATION, columns.len(), |row, k| columns[k][row])
}
