//! Navigation errors: their order, many of them at once, and how they pass a short time at the site.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::attitude::skew;

/// Attitude error φ, `C_computed = (I − [φ×]) C_true`, East-North-Up, rad.
pub const ATTITUDE: usize = 0;
/// Velocity error δV, computed − true, East-North-Up, m/s.
pub const VELOCITY: usize = 3;
/// Position error, computed − true: at the site East-North-Up in m; on the ellipsoid δL and δλ in rad, δh in m.
pub const POSITION: usize = 6;
/// Number of states.
pub const STATES: usize = 9;

/// A vector of the states.
pub type ErrorVector = SVector<f64, STATES>;
/// A matrix of the states.
pub type ErrorMatrix = SMatrix<f64, STATES, STATES>;

/// Attitude, velocity and position in one vector.
#[inline]
pub fn joined(kinds: [Vector3<f64>; 3]) -> ErrorVector {
    ErrorVector::from_fn(|row, _| kinds[row / 3][row % 3])
}

/// A matrix of these blocks, each at its first row and column, and zero elsewhere.
#[inline]
pub fn blocks<const N: usize>(blocks: &[(usize, usize, Matrix3<f64>)]) -> SMatrix<f64, STATES, N> {
    let mut matrix = SMatrix::<f64, STATES, N>::zeros();
    for &(row, column, block) in blocks {
        let mut place = matrix.fixed_view_mut::<3, 3>(row, column);
        place.copy_from(&block);
    }
    matrix
}

/// `R` rows of `N` columns, kept transposed: what is done to all columns goes through memory without a stride.
pub type Rows<const R: usize, const N: usize> = SMatrix<f64, N, R>;

/// `sum += sparse · rows`, in as many steps as the sparse matrix has entries other than zero.
#[inline]
pub fn add_product<const R: usize, const M: usize, const N: usize>(
    sum: &mut Rows<R, N>,
    sparse: &SMatrix<f64, R, M>,
    rows: &Rows<M, N>,
) {
    for i in 0..R {
        for j in 0..M {
            let weight = sparse[(i, j)];
            if weight != 0.0 {
                sum.column_mut(i).axpy(weight, &rows.column(j), 1.0);
            }
        }
    }
}

/// `Φ − I` of a time in s over which the Earth turns by so much, rad, and specific force sums to so much in `n`,
/// m/s: the Earth turns errors, force acts on tilt, velocity moves position.
pub fn change(earth_turn: &Vector3<f64>, force: &Vector3<f64>, duration: f64) -> ErrorMatrix {
    let (turn, force) = (skew(*earth_turn), skew(*force));
    blocks(&[
        (ATTITUDE, ATTITUDE, -turn),
        (VELOCITY, ATTITUDE, force),
        (VELOCITY, VELOCITY, turn * -2.0),
        (POSITION, ATTITUDE, force * (0.5 * duration)),
        (POSITION, VELOCITY, Matrix3::identity() * duration),
    ])
}

/// Takes errors of any causes over a time with this `Φ − I`.
#[inline]
pub fn carry<const N: usize>(errors: &mut Rows<STATES, N>, change: &ErrorMatrix) {
    let before = *errors;
    add_product(errors, change, &before);
}
