//! What a table is wrong by and does not read.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::attitude::exp;

/// Tilts of the axes within the outermost, two for each of two at most.
pub const AXIS_TILTS: usize = 4;
/// Errors of the base and tilts of the axes.
pub const TABLE_GEOMETRY: usize = 3 + AXIS_TILTS;
/// How the attitude turns in the navigation frame with each tilt.
pub type Tilts = SMatrix<f64, 3, AXIS_TILTS>;

/// 1σ of errors that move a table's true attitude and not its reading; zero where they are not to be
/// estimated.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TableGeometry {
    /// Of the base about East, North (level) and Up (north), rad.
    pub base: Vector3<f64>,
    /// Of each tilt of an axis but the outermost, in its two directions across it, rad; zero for axes
    /// that the table does not have.
    pub axes: SVector<f64, AXIS_TILTS>,
}

impl TableGeometry {
    /// Whether there are any.
    pub fn any(&self) -> bool {
        *self != Self::default()
    }

    /// The same 1σ for the tilts of a table with this many axes.
    pub fn tilts_of(axes: usize, sigma: f64) -> SVector<f64, AXIS_TILTS> {
        SVector::from_fn(|k, _| if k / 2 + 1 < axes { sigma } else { 0.0 })
    }

    /// Of the base about East, North and Up, then of each tilt.
    pub fn vector(&self) -> SVector<f64, TABLE_GEOMETRY> {
        let mut all = self.base.iter().chain(&self.axes).copied();
        SVector::from_fn(|_, _| all.next().unwrap_or(0.0))
    }
}

/// The name of an error of a table in files; `None` beyond the last. Tilts are about the directions
/// of [`across`], in the frame of the next axis outwards.
pub fn table_geometry_name(k: usize) -> Option<String> {
    const NAMES: [&str; TABLE_GEOMETRY] = [
        "table.base.east",
        "table.base.north",
        "table.base.up",
        "table.second_axis.tilt_1",
        "table.second_axis.tilt_2",
        "table.third_axis.tilt_1",
        "table.third_axis.tilt_2",
    ];
    NAMES.get(k).map(|&name| name.to_owned())
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
            let [one, other] = across(&direction);
            tilts.set_column(first, &(carried * one));
            tilts.set_column(first + 1, &(carried * other));
        }
        carried *= exp(direction * angle);
    }
    tilts
}

/// Two directions across another and each other.
pub fn across(direction: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let one = Vector3::ith(direction.iamin(), 1.0)
        .cross(direction)
        .normalize();
    [one, direction.cross(&one)]
}
