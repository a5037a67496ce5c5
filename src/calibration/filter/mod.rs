//! The Kalman filter of the moving and reset states. The effect of constants is propagated as columns.

mod at_rest;
mod columns;
mod dwell;
mod dwell_filter;
mod gain_cache;
mod gate;
mod input_prior;
mod propagation;
pub mod rows;
mod update;

pub use dwell::{DwellFilters, Taken, dwell_filters};
pub use gate::{Gate, Judge};

use nalgebra::{DMatrix, DVector, Vector3};

use crate::attitude::skew;
use crate::calibration::linearisation::Start;
use crate::calibration::record::between;
use crate::calibration::several::day_to_day::Turned;
use crate::calibration::{
    ATTITUDE, Constant, Difference, DisturbanceKind, Layout, Model, NAVIGATION, POSITION, VELOCITY,
};
use crate::imu::PerSensor;
use crate::navigation::{ProcessNoise, State};
use columns::Columns;

/// Mean and covariance of the errors.
#[derive(Debug, Clone)]
pub struct Filter {
    pub layout: Layout,
    pub x: DVector<f64>,
    pub p: DMatrix<f64>,
    model: Model,
    noise: PerSensor<ProcessNoise>,
    /// 1σ and correlation time of each varying bias, by its state.
    varying: Vec<(usize, f64, f64)>,
    /// Effect of the mounting of the recording on the parameters, if any.
    turned: Option<Turned>,
    /// Effect of the constants.
    pub columns: Columns,
    /// Number of dwells started.
    dwells: usize,
}

/// Gap before a stretch.
#[derive(Debug)]
pub enum Since<'a> {
    /// Missing time in the same recording, s.
    Lost(f64),
    /// A new recording: its deviation at the linearisation point, and the effect of its mounting.
    Anew(&'a Difference, Option<&'a Turned>),
}

impl Filter {
    /// The filter before the first stretch, for recordings with one common gravity or several.
    pub fn new(model: &Model, one_gravity: bool) -> Self {
        let layout = Layout::new(model, one_gravity);
        let n = layout.sources.len();
        let varying = layout
            .varying_biases
            .iter()
            .filter_map(|&(state, sensor, _)| {
                let variation = model.noise.get(sensor).gauss_markov?;
                Some((state, variation.sigma, variation.correlation_time))
            });
        Self {
            varying: varying.collect(),
            columns: Columns::new(layout.constants.len(), n),
            layout,
            x: DVector::zeros(n),
            p: DMatrix::zeros(n, n),
            noise: model.process_noise(),
            model: model.clone(),
            turned: None,
            dwells: 0,
        }
    }

    /// Starts a stretch: navigation errors and the table position are reset. In another recording, so are the bias
    /// variations (first-order Gauss–Markov: Brown and Hwang, *Introduction to Random Signals*, 4th ed., §3.8) and the
    /// states of the recording; in the same recording, the biases vary during the gap. `gravity` is its 1σ at another
    /// site.
    pub fn begin(&mut self, start: &Start, since: Since, gravity: Option<f64>) {
        let initial = self.layout.initial_attitude;
        let (still, level) = (Vector3::zeros(), (&start.attitude, &start.attitude_sigma));
        self.redraw_three(ATTITUDE, level);
        self.redraw_three(VELOCITY, (&still, &Vector3::repeat(start.velocity_sigma)));
        self.redraw_three(POSITION, (&still, &Vector3::repeat(start.position_sigma)));
        self.redraw_three(initial, level);
        for axis in 0..3 {
            // φ starts as φ₀: fully correlated.
            let variance = self.p[(initial + axis, initial + axis)];
            self.p[(ATTITUDE + axis, initial + axis)] = variance;
            self.p[(initial + axis, ATTITUDE + axis)] = variance;
        }
        self.redraw_table();
        if let Some(first) = self.layout.earth_rate {
            self.redraw_three(first, (&start.earth_rate, &start.earth_rate_sigma));
        }
        if let Some((state, sigma)) = self.layout.gravity.zip(gravity) {
            self.redraw(state, 0.0, sigma);
        }
        match since {
            Since::Lost(duration) => self.vary(duration),
            Since::Anew(at, turned) => {
                self.turned = turned.cloned();
                for k in 0..self.varying.len() {
                    let (state, sigma, _) = self.varying[k];
                    self.redraw(state, 0.0, sigma);
                }
                for (state, own) in self.layout.own.clone() {
                    self.redraw(state, -at.get(own), self.model.day_to_day.of(own));
                }
            }
        }
    }

    /// Resets three states, with these means and 1σ of their errors.
    fn redraw_three(&mut self, first: usize, (mean, sigma): (&Vector3<f64>, &Vector3<f64>)) {
        (0..3).for_each(|axis| self.redraw(first + axis, mean[axis], sigma[axis]));
    }

    /// Resets a state: its new error is independent of all others.
    fn redraw(&mut self, state: usize, mean: f64, sigma: f64) {
        self.x[state] = mean;
        self.columns.of_states.column_mut(state).fill(0.0);
        self.p.row_mut(state).fill(0.0);
        self.p.column_mut(state).fill(0.0);
        self.p[(state, state)] = sigma.powi(2) * self.weight_of(state);
    }

    /// Variance factor of the source of a reset state.
    fn weight_of(&self, state: usize) -> f64 {
        self.model.weight(self.layout.sources[state])
    }

    /// Resets the position error of the table after it has left its position.
    pub fn redraw_table(&mut self) {
        if let Some(table) = self.layout.table_position {
            let sigma = self.model.position_sigma;
            (table..table + 3).for_each(|state| self.redraw(state, 0.0, sigma));
        }
    }

    /// Resets the velocity after a hand move, which gives no information about it.
    pub fn redraw_velocity(&mut self, sigma: f64) {
        (VELOCITY..VELOCITY + 3).for_each(|state| self.redraw(state, 0.0, sigma));
    }

    /// Starts a dwell.
    pub fn begin_dwell(&mut self) {
        for (k, constant) in self.layout.constants.iter().enumerate() {
            if let Constant::Disturbance(of, component) = constant
                && (of.kind, of.dwell) == (DisturbanceKind::Slip, self.dwells)
            {
                self.columns.of_states[(k, ATTITUDE + component)] += 1.0;
            }
        }
        self.dwells += 1;
    }

    /// Whether a dwell is the current one.
    pub fn is_in(&self, dwell: usize) -> bool {
        self.dwells == dwell + 1
    }

    /// Marks the body as not rotating: any change of the computed attitude is an error.
    pub fn begin_to_hold(&mut self) {
        if let Some(turn) = self.layout.turn_at_rest {
            (turn..turn + 3).for_each(|state| self.redraw(state, 0.0, 0.0));
        }
    }

    /// Converts the errors of velocity and position to those in the computed frame, `δV + φ × V`, when the body
    /// comes to rest.
    ///
    /// A wrong heading rotates computed velocity and position with it, and `computed − true` would treat this as an
    /// observation of the heading; in the computed frame, the heading is not observed (Barrau and Bonnabel 2017,
    /// "The invariant extended Kalman filter as a stable observer", IEEE Trans. Automatic Control 62(4)). Without
    /// this step, the σ of an unobserved heading would shrink with every turn.
    pub fn come_to_rest(&mut self, computed: &State) {
        for (first, computed) in [(VELOCITY, computed.velocity), (POSITION, computed.position)] {
            let turn = skew(-computed);
            let x = turn * self.x.fixed_rows::<3>(ATTITUDE);
            let mut error = self.x.fixed_rows_mut::<3>(first);
            error += x;
            let by_attitude = self.columns.of_states.fixed_columns::<3>(ATTITUDE);
            let columns = by_attitude * turn.transpose();
            let mut of_error = self.columns.of_states.fixed_columns_mut::<3>(first);
            of_error += columns;
            let rows = turn * self.p.fixed_rows::<3>(ATTITUDE);
            let mut of_error = self.p.fixed_rows_mut::<3>(first);
            of_error += rows;
            let columns = self.p.fixed_columns::<3>(ATTITUDE) * turn.transpose();
            let mut of_error = self.p.fixed_columns_mut::<3>(first);
            of_error += columns;
        }
    }

    /// Refers the navigation errors to another computed state of the same moment.
    pub fn refer(&mut self, from: &State, to: &State) {
        let by = between(from, to);
        let turn = self.layout.turn_at_rest;
        let firsts = [ATTITUDE, VELOCITY, POSITION].into_iter().zip(by);
        for (first, by) in firsts.chain(turn.map(|turn| (turn, by[0]))) {
            let mut error = self.x.fixed_rows_mut::<3>(first);
            error += by;
        }
    }
}

const _: () = assert!(NAVIGATION == crate::navigation::error_model::STATES);

#[cfg(test)]
mod tests;
