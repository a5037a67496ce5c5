//! Navigation errors: their order, and their propagation over a short time at the site.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Attitude error φ, `C_computed = (I − [φ×]) C_true`, East-North-Up, rad.
pub const ATTITUDE: usize = 0;
/// Velocity error δV, computed − true, East-North-Up, m/s.
pub const VELOCITY: usize = 3;
/// Position error, computed − true: at the site East-North-Up in m; on the ellipsoid δL and δλ in rad, δh in m.
pub const POSITION: usize = 6;
/// Number of states.
pub const STATES: usize = 9;

/// A vector of the navigation states.
pub type ErrorVector = SVector<f64, STATES>;
/// A matrix of the navigation states.
pub type ErrorMatrix = SMatrix<f64, STATES, STATES>;

/// Attitude, velocity and position in one vector.
#[inline]
pub fn joined(kinds: [Vector3<f64>; 3]) -> ErrorVector {
    ErrorVector::from_fn(|row, _| kinds[row / 3][row % 3])
}

/// A matrix of these blocks, each at its first row and column, and zero elsewhere.
#[inline]
pub fn blocks<const N: usize>(blocks: &[(usize, usize, Matrix3<f64>)]) -> SMatrix<f64, STATES, N> {
    let mut whole = SMatrix::<f64, STATES, N>::zeros();
    for &(row, column, block) in blocks {
        whole.fixed_view_mut::<3, 3>(row, column).copy_from(&block);
    }
    whole
}

/// `R` rows of `N` columns, stored transposed, so that operations on all columns access memory contiguously.
pub type Rows<const R: usize, const N: usize> = SMatrix<f64, N, R>;

/// A short interval of time at the site.
pub struct Span {
    /// Rotation of the Earth, rad.
    pub earth_turn: Vector3<f64>,
    /// ∫f_n dt, m/s.
    pub force: Vector3<f64>,
    /// Length in s.
    pub duration: f64,
}

impl Span {
    /// Propagates errors of any origin. Earth rotation rotates the errors, specific force couples with tilt, and
    /// velocity errors change the position.
    #[inline]
    pub fn carry<const N: usize>(&self, errors: &mut Rows<STATES, N>) {
        for cause in 0..N {
            let of = |first: usize| Vector3::from_fn(|axis, _| errors[(cause, first + axis)]);
            let (tilt, drift) = (of(ATTITUDE), of(VELOCITY));
            let by_force = self.force.cross(&tilt);
            let changes = [
                -self.earth_turn.cross(&tilt),
                by_force - self.earth_turn.cross(&drift) * 2.0,
                (by_force * 0.5 + drift) * self.duration,
            ];
            for row in 0..STATES {
                errors[(cause, row)] += changes[row / 3][row % 3];
            }
        }
    }
}
