//! What a table is wrong by and does not read.

use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::attitude::exp;

/// Tilts of the axes within the outermost, two for each of two at most.
pub const AXIS_TILTS: usize = 4;
/// Errors of the base and tilts of the axes.
pub const TABLE_ERRORS: usize = 3 + AXIS_TILTS;
/// How the attitude turns in the navigation frame with each tilt.
pub type Tilts = SMatrix<f64, 3, AXIS_TILTS>;

/// 1σ of errors that move a table's true attitude and not its reading; zero where they are not to be
/// estimated.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TableErrors {
    /// Of the base about East, North (level) and Up (north), rad.
    pub base: Vector3<f64>,
    /// Of each tilt of an axis but the outermost, per direction across it, rad.
    pub axes: f64,
}

impl TableErrors {
    /// Whether there are any.
    pub fn any(&self) -> bool {
        *self != Self::default()
    }
}

/// Tilts of a table whose axes, outermost first, stand at these angles in rad: an axis that is tilted
/// in the frame of the next one outwards turns all that it carries.
///
/// `C_b_n = C_base R(a₁, θ₁) [I + t₂×] R(a₂, θ₂) [I + t₃×] R(a₃, θ₃) …` turns in the navigation frame by
/// `R(a₁, θ₁) t₂` and `R(a₁, θ₁) R(a₂, θ₂) t₃`.
pub fn tilts(axes: impl IntoIterator<Item = (Vector3<f64>, f64)>) -> Tilts {
    let mut tilts = Tilts::zeros();
    let mut carried = Matrix3::identity();
    for (number, (direction, angle)) in axes.into_iter().enumerate() {
        if let Some(first) = number.checked_sub(1).map(|inner| 2 * inner)
            && first < AXIS_TILTS
        {
            let (one, other) = across(&direction);
            tilts.set_column(first, &(carried * one));
            tilts.set_column(first + 1, &(carried * other));
        }
        carried *= exp(direction * angle);
    }
    tilts
}

/// Two directions across another and each other.
fn across(direction: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let one = Vector3::ith(direction.iamin(), 1.0)
        .cross(direction)
        .normalize();
    (one, direction.cross(&one))
}
