//! How navigation errors go on by themselves.

use nalgebra::{SVector, Vector3};

use super::block::{BlockMatrix, NAVIGATION};
use super::vectors::Vectors;

/// Attitude, velocity and position errors, a column of each cause.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Errors<const N: usize> {
    pub attitude: Vectors<N>,
    pub velocity: Vectors<N>,
    pub position: Vectors<N>,
}

/// What a few samples make of the navigation errors that are there when they begin.
pub(super) struct Transition {
    /// Of the Earth, rad.
    pub earth_turn: Vector3<f64>,
    /// ∫f_n dt, m/s.
    pub force: Vector3<f64>,
    /// s
    pub duration: f64,
}

impl Transition {
    /// Takes errors over the samples: the Earth turns them, force acts on tilt, velocity moves position.
    pub fn carry<const N: usize>(&self, errors: &mut Errors<N>) {
        let Errors {
            attitude: Vectors(attitude),
            velocity: Vectors(velocity),
            position: Vectors(position),
        } = errors;
        for column in 0..N {
            let of = |[x, y, z]: &[[f64; N]; 3]| Vector3::new(x[column], y[column], z[column]);
            let [turned, more, moved] = self.changes(&of(attitude), &of(velocity));
            for row in 0..3 {
                attitude[row][column] += turned[row];
                velocity[row][column] += more[row];
                position[row][column] += moved[row];
            }
        }
    }

    /// Takes the causes of errors, each itself an error, over the samples: of a covariance its other side.
    pub fn carry_causes(&self, errors: &mut Errors<NAVIGATION>) {
        let kinds = [
            &mut errors.attitude,
            &mut errors.velocity,
            &mut errors.position,
        ];
        for row in kinds.into_iter().flat_map(|kind| &mut kind.0) {
            let of = |first: usize| Vector3::new(row[first], row[first + 1], row[first + 2]);
            let changes = self.changes(&of(0), &of(3));
            for (cause, change) in row.iter_mut().zip(changes.iter().flatten()) {
                *cause += change;
            }
        }
    }

    /// What an error of attitude and one of velocity add to those of attitude, velocity and position.
    #[inline]
    fn changes(&self, tilt: &Vector3<f64>, drift: &Vector3<f64>) -> [Vector3<f64>; 3] {
        let by_force = self.force.cross(tilt);
        [
            -self.earth_turn.cross(tilt),
            by_force - self.earth_turn.cross(drift) * 2.0,
            (by_force * 0.5 + drift) * self.duration,
        ]
    }
}

impl<const N: usize> Errors<N> {
    /// Of navigation error `row`, by its cause.
    pub fn component(&self, row: usize, column: usize) -> f64 {
        let Self {
            attitude,
            velocity,
            position,
        } = self;
        [attitude, velocity, position][row / 3].0[row % 3][column]
    }

    /// The errors' sum with these weights.
    pub fn times(&self, weights: &SVector<f64, N>) -> SVector<f64, NAVIGATION> {
        let mut sum = SVector::<f64, NAVIGATION>::zeros();
        let kinds = [&self.attitude, &self.velocity, &self.position];
        for (k, of_kind) in kinds.into_iter().enumerate() {
            sum.fixed_rows_mut::<3>(3 * k)
                .copy_from(&of_kind.times(weights));
        }
        sum
    }
}

impl Errors<NAVIGATION> {
    /// `self += matrix`
    pub fn add(&mut self, matrix: &BlockMatrix) {
        let kinds = [&mut self.attitude, &mut self.velocity, &mut self.position];
        for (kind, of_kind) in kinds.into_iter().enumerate() {
            for (axis, row) in of_kind.0.iter_mut().enumerate() {
                for (column, sum) in row.iter_mut().enumerate() {
                    *sum += matrix[(3 * kind + axis, column)];
                }
            }
        }
    }
}
