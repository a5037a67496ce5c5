//! A Kalman filter as a textbook has it: constants among its states, all of them in every scalar, step by step.

use nalgebra::{DMatrix, DVector};

use super::{Filter, Measurement, ScalarInnovation};
use crate::calibration::checks::innovation::Observation;
use crate::calibration::constants::{Constant, Known};
use crate::calibration::layout::{ATTITUDE, NAVIGATION, POSITION, VELOCITY};
use crate::calibration::model::Model;
use crate::calibration::parameters::sensor_and_parameter;
use crate::calibration::problem::Stretch;
use crate::calibration::record::Rest;
use crate::calibration::record::dwell::Seen;
use crate::navigation::Block;

/// Mean and covariance of the states of a filter, then of its constants.
pub struct Textbook {
    x: DVector<f64>,
    p: DMatrix<f64>,
    states: usize,
}

impl Textbook {
    /// As a filter is.
    pub fn new(filter: &Filter, known: &Known) -> Self {
        let (x, p) = joined(filter, known);
        let states = filter.x.len();
        Self { x, p, states }
    }

    pub fn begin_to_hold(&mut self, filter: &Filter) {
        let turn = filter.layout.turn_at_rest;
        for state in turn.into_iter().flat_map(|turn| turn..turn + 3) {
            self.x[state] = 0.0;
            self.p.row_mut(state).fill(0.0);
            self.p.column_mut(state).fill(0.0);
        }
    }

    pub fn propagate(&mut self, filter: &Filter, block: &Block) {
        let layout = &filter.layout;
        let n = self.x.len();
        let mut phi = DMatrix::identity(n, n);
        let mut q = DMatrix::zeros(n, n);
        phi.view_mut((0, 0), (NAVIGATION, NAVIGATION))
            .copy_from(&block.navigation);
        q.view_mut((0, 0), (NAVIGATION, NAVIGATION))
            .copy_from(&block.noise.covariance(&filter.noise));
        for (k, constant) in layout.constants.iter().enumerate() {
            if let Constant::Parameter(index) = constant {
                let (sensor, of_triad) = sensor_and_parameter(*index);
                phi.view_mut((0, self.states + k), (NAVIGATION, 1))
                    .copy_from(&block.parameters.get(sensor).column(of_triad));
            }
        }
        for (state, sensor, of_triad) in layout.varying_biases.iter().copied() {
            let variation = filter.varying.iter().find(|of| of.0 == state).unwrap();
            phi.view_mut((0, state), (NAVIGATION, 1))
                .copy_from(&block.parameters.get(sensor).column(of_triad));
            let keep = (-block.duration / variation.2).exp();
            phi[(state, state)] = keep;
            q[(state, state)] = variation.1.powi(2) * (1.0 - keep * keep);
        }
        if let Some(turn) = layout.turn_at_rest {
            let change = phi.rows(ATTITUDE, 3).into_owned();
            let mut rows = phi.rows_mut(turn, 3);
            rows += change;
            (0..3).for_each(|axis| phi[(turn + axis, ATTITUDE + axis)] -= 1.0);
            let own = filter.model.turning_at_rest.powi(2) * block.duration;
            for axis in 0..3 {
                for other in 0..3 {
                    let of_attitude = q[(ATTITUDE + axis, ATTITUDE + other)];
                    q[(turn + axis, turn + other)] = of_attitude;
                    q[(turn + axis, ATTITUDE + other)] = of_attitude;
                    q[(ATTITUDE + other, turn + axis)] = of_attitude;
                    for first in [VELOCITY, POSITION] {
                        let across = q[(ATTITUDE + axis, first + other)];
                        q[(turn + axis, first + other)] = across;
                        q[(first + other, turn + axis)] = across;
                    }
                }
                q[(turn + axis, turn + axis)] += own;
            }
        }
        self.x = &phi * &self.x;
        self.p = &phi * &self.p * phi.transpose() + q;
    }

    /// One component after the other.
    pub fn update(&mut self, measurement: &Measurement) {
        for (row, z) in measurement.rows.iter().zip(&measurement.residual) {
            let mut h = DVector::zeros(self.x.len());
            row.iter().for_each(|&(state, weight)| h[state] = weight);
            self.scalar(&h, *z, measurement.variance);
        }
    }

    fn scalar(&mut self, h: &DVector<f64>, z: f64, noise: f64) -> ScalarInnovation {
        let ph = &self.p * h;
        let variance = h.dot(&ph) + noise;
        let innovation = z - h.dot(&self.x);
        let gain = &ph / variance;
        self.x += &gain * innovation;
        // Joseph's form.
        let rest = DMatrix::identity(h.len(), h.len()) - &gain * h.transpose();
        self.p = &rest * &self.p * rest.transpose() + &gain * gain.transpose() * noise;
        ScalarInnovation {
            innovation,
            variance,
        }
    }

    /// Through a part of a dwell.
    pub fn through(
        &mut self,
        filter: &Filter,
        segment: &Rest,
        (model, stretch): (&Model, &Stretch),
    ) -> Vec<ScalarInnovation> {
        let mut scalars = Vec::new();
        let turn = filter.layout.turn_at_rest;
        for step in &segment.steps {
            let firsts = [ATTITUDE, VELOCITY, POSITION].into_iter();
            let referred = firsts.zip(step.referred);
            for (first, by) in referred.chain(turn.map(|turn| (turn, step.referred[0]))) {
                let mut error = self.x.fixed_rows_mut::<3>(first);
                error += by;
            }
            self.propagate(filter, &segment.models[step.model]);
            for seen in &segment.seen[step.seen.clone()] {
                let variance = stretch.observation_variance(model, seen.kind, seen.readings);
                for axis in 0..3 {
                    let h = self.row(filter, seen, axis);
                    scalars.push(self.scalar(&h, seen.residual[axis], variance));
                }
            }
        }
        scalars
    }

    fn row(&self, filter: &Filter, seen: &Seen, axis: usize) -> DVector<f64> {
        let layout = &filter.layout;
        let mut h = DVector::zeros(self.x.len());
        let first = match seen.kind {
            Observation::Velocity => VELOCITY,
            Observation::Table => ATTITUDE,
            Observation::Attitude => layout.turn_at_rest.unwrap(),
        };
        h[first + axis] = 1.0;
        if seen.kind == Observation::Table {
            if let Some(position) = layout.table_position {
                h[position + axis] = -1.0;
            }
            for (k, constant) in layout.constants.iter().enumerate() {
                if *constant == Constant::Base(axis) {
                    h[self.states + k] = -1.0;
                }
            }
        }
        h
    }

    /// Whether a filter is the same to this part of each σ.
    pub fn is_near(&self, filter: &Filter, known: &Known, tolerance: f64) {
        let (x, p) = joined(filter, known);
        let sigma = self.p.map_diagonal(|v| v.max(0.0).sqrt());
        for i in 0..x.len() {
            if sigma[i] == 0.0 {
                continue;
            }
            let apart = (x[i] - self.x[i]) / sigma[i];
            assert!(apart.abs() < tolerance, "state {i}: {apart} σ");
            for j in (0..x.len()).filter(|&j| sigma[j] > 0.0) {
                let apart = (p[(i, j)] - self.p[(i, j)]) / (sigma[i] * sigma[j]);
                assert!(apart.abs() < tolerance, "states {i} and {j}: {apart}");
            }
        }
    }
}

/// Mean and covariance of states and constants together.
fn joined(filter: &Filter, known: &Known) -> (DVector<f64>, DMatrix<f64>) {
    let posterior = known.posterior();
    let (c, covariance) = (&posterior.mean, &posterior.covariance);
    let by = filter.columns.of_states.transpose();
    let (n, m) = (filter.x.len(), c.len());
    let across = &by * covariance;
    let mut x = DVector::zeros(n + m);
    x.rows_mut(0, n).copy_from(&(&filter.x + &by * c));
    x.rows_mut(n, m).copy_from(c);
    let mut p = DMatrix::zeros(n + m, n + m);
    p.view_mut((0, 0), (n, n))
        .copy_from(&(&filter.p + &across * by.transpose()));
    p.view_mut((0, n), (n, m)).copy_from(&across);
    p.view_mut((n, 0), (m, n)).copy_from(&across.transpose());
    p.view_mut((n, n), (m, m)).copy_from(covariance);
    (x, p)
}
