//! Many vectors of one frame at once.

use nalgebra::{Matrix3, SVector, Vector3};

/// `N` vectors, component by component: what is done to all of them goes through rows without a stride.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Vectors<const N: usize>(pub [[f64; N]; 3]);

impl<const N: usize> Default for Vectors<N> {
    fn default() -> Self {
        Self([[0.0; N]; 3])
    }
}

impl<const N: usize> Vectors<N> {
    /// `self += weight others`
    #[inline]
    pub fn add(&mut self, weight: f64, others: &Self) {
        for (row, other) in self.0.iter_mut().zip(&others.0) {
            for (x, other) in row.iter_mut().zip(other) {
                *x += weight * other;
            }
        }
    }

    /// `self += by × others`
    #[inline]
    pub fn add_cross(&mut self, by: &Vector3<f64>, others: &Self) {
        for (row, (j, k)) in [(1, 2), (2, 0), (0, 1)].into_iter().enumerate() {
            for column in 0..N {
                self.0[row][column] += by[j] * others.0[k][column] - by[k] * others.0[j][column];
            }
        }
    }

    /// The vectors' sum with these weights.
    pub fn times(&self, weights: &SVector<f64, N>) -> Vector3<f64> {
        Vector3::from_fn(|row, _| {
            let terms = self.0[row].iter().zip(weights.iter());
            terms.map(|(x, weight)| x * weight).sum()
        })
    }
}

impl Vectors<12> {
    /// Adds the columns of a matrix, one after the other times each of four weights.
    #[inline]
    pub fn add_outer(&mut self, matrix: &Matrix3<f64>, weights: &[f64; 4]) {
        for (row, sums) in self.0.iter_mut().enumerate() {
            for (column, sums) in sums.chunks_exact_mut(4).enumerate() {
                let of_column = matrix[(row, column)];
                for (sum, weight) in sums.iter_mut().zip(weights) {
                    *sum += of_column * weight;
                }
            }
        }
    }
}
