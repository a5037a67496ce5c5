//! What a triad gave under known inputs, and how uncertain both are together.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use crate::imu::Noise;

/// The mean output of a triad under an input that is known from elsewhere: at a position, or over a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// Mean input along body axes, rad/s or m/s².
    pub input: Vector3<f64>,
    /// Mean normalised output, rad/s or m/s².
    pub output: Vector3<f64>,
    /// Variance of each output axis, (rad/s)² or (m/s²)².
    pub variance: Vector3<f64>,
    /// The same, by which it is weighted: the variance itself unless that would trust it too much.
    pub weighted: Vector3<f64>,
}

/// σ over the largest input of an output for which no noise is stated.
pub const NOISELESS: f64 = 1e-9;

/// Positions of a triad, and what is common to several of them.
#[derive(Debug, Clone)]
pub struct Observed {
    pub positions: Vec<Position>,
    /// Begin and end of each, s.
    pub times: Vec<[f64; 2]>,
    /// Covariance of the outputs of two positions on one axis, alike on all axes; zero on the diagonal.
    pub between: DMatrix<f64>,
    /// How the inputs change with each error of what they are known from, for one σ of it: three rows a
    /// position, along body axes.
    pub errors: DMatrix<f64>,
    /// How the inputs change with turns of the table's base about East, North and Up, in rad, whatever is stated of
    /// it; these are the first columns of `errors` then. Without columns where there is no table.
    pub base: DMatrix<f64>,
}

impl Observed {
    /// Positions that have nothing in common.
    pub fn independent(positions: &[Position]) -> Self {
        let count = positions.len();
        Self {
            positions: positions.to_vec(),
            times: vec![[0.0; 2]; count],
            between: DMatrix::zeros(count, count),
            errors: DMatrix::zeros(3 * count, 0),
            base: DMatrix::zeros(3 * count, 0),
        }
    }

    /// Positions over these spans of time, between which a triad's noise lasts.
    pub fn over(positions: Vec<Position>, times: Vec<[f64; 2]>, noise: &Noise) -> Self {
        let count = positions.len();
        Self {
            between: DMatrix::from_fn(count, count, |i, j| match i == j {
                true => 0.0,
                false => noise.covariance_of_means(times[i], times[j]),
            }),
            errors: DMatrix::zeros(3 * count, 0),
            base: DMatrix::zeros(3 * count, 0),
            positions,
            times,
        }
    }

    /// The same on a base whose level and north are known to this σ only, rad.
    pub fn on_base_within(&self, sigma: f64) -> Self {
        let mut wider = self.clone();
        let columns = self.base.ncols();
        wider
            .errors
            .columns_mut(0, columns)
            .copy_from(&(&self.base * sigma));
        wider
    }

    /// Largest input.
    pub fn size(&self) -> f64 {
        let sizes = self.positions.iter().map(|p| p.input.norm());
        sizes.fold(0.0, f64::max)
    }

    /// The same with this variance more on every axis of these positions, as of a bias that is new at each.
    pub fn widened(&self, variance: f64, places: &[usize]) -> Self {
        let mut wider = self.clone();
        for &place in places {
            let position = &mut wider.positions[place];
            position.variance = position.variance.add_scalar(variance);
            position.weighted = position.weighted.add_scalar(variance);
        }
        wider
    }

    /// How all outputs change with the errors of what the inputs are known from, by a triad of this
    /// sensitivity.
    pub fn output_errors(&self, sensitivity: &Matrix3<f64>) -> DMatrix<f64> {
        self.of_outputs(&self.errors, sensitivity)
    }

    /// The same of a turn of the table's base by 1 rad.
    pub fn output_errors_of_base(&self, sensitivity: &Matrix3<f64>) -> DMatrix<f64> {
        self.of_outputs(&self.base, sensitivity)
    }

    fn of_outputs(&self, of_inputs: &DMatrix<f64>, sensitivity: &Matrix3<f64>) -> DMatrix<f64> {
        let mut errors = of_inputs.clone();
        for k in 0..self.positions.len() {
            let of_input = sensitivity * of_inputs.fixed_rows::<3>(3 * k);
            errors.fixed_rows_mut::<3>(3 * k).copy_from(&of_input);
        }
        errors
    }

    /// Covariance of all outputs, three a position.
    pub fn covariance(&self, sensitivity: &Matrix3<f64>) -> DMatrix<f64> {
        self.with_variance(sensitivity, |position| position.variance)
    }

    /// What they are weighted by: the inverse of this. Weights that are chosen are used as they are.
    pub fn weights(&self, sensitivity: &Matrix3<f64>) -> DMatrix<f64> {
        let chosen = |position: &Position| position.weighted != position.variance;
        if self.positions.iter().any(chosen) {
            let diagonal = self
                .positions
                .iter()
                .flat_map(|p| <[f64; 3]>::from(p.weighted));
            let least = (NOISELESS * self.size()).powi(2);
            let diagonal = diagonal.map(|variance| variance.max(least));
            return DMatrix::from_diagonal(&DVector::from_iterator(
                3 * self.positions.len(),
                diagonal,
            ));
        }
        self.with_variance(sensitivity, |position| position.weighted)
    }

    fn with_variance(
        &self,
        sensitivity: &Matrix3<f64>,
        variance: impl Fn(&Position) -> Vector3<f64>,
    ) -> DMatrix<f64> {
        let errors = self.output_errors(sensitivity);
        let mut covariance = &errors * errors.transpose();
        let least = (NOISELESS * self.size()).powi(2);
        for (i, position) in self.positions.iter().enumerate() {
            let variance = variance(position);
            for axis in 0..3 {
                covariance[(3 * i + axis, 3 * i + axis)] += variance[axis].max(least);
                for j in 0..self.positions.len() {
                    covariance[(3 * i + axis, 3 * j + axis)] += self.between[(i, j)];
                }
            }
        }
        covariance
    }
}
