//! Errors of a table that its readings do not show.

use serde::{Deserialize, Serialize};
use std::ops::Range;

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::attitude::exp;

/// Number of axes with modelled errors, including the outermost.
const AXES: usize = 3;
/// Number of directions across an axis.
const ACROSS: usize = 2;
/// Cosine and sine of the angle of an axis, then of twice this angle.
pub const PHASES: usize = 4;
/// Number of errors of the axes, of all kinds.
pub const AXIS_ERRORS: usize = ACROSS * (AXES - 1) + AXES * PHASES * ACROSS + AXES * PHASES;
/// Errors of the base and of the axes.
pub const TABLE_GEOMETRY: usize = 3 + AXIS_ERRORS;
/// Rotation of the attitude in the navigation frame for a unit error of the axes.
pub type AxisResponse = SMatrix<f64, 3, AXIS_ERRORS>;
/// Axes of a table, outermost first: direction when all angles are zero, and angle in rad.
pub type AxisAngles = [Option<(Vector3<f64>, f64)>; AXES];

/// A kind of error of the axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum AxisError {
    /// Non-orthogonality of an inner axis, given by constant tilts in two directions across the axis.
    Tilt,
    /// Tilt of an axis that depends on its angle, once and twice per turn: for each axis, cosine and sine of the angle
    /// and of twice the angle, in two directions across it.
    Wobble,
    /// Encoder error that depends on its angle, once and twice per turn: for each axis, cosine and sine of the angle
    /// and of twice the angle.
    Encoder,
}

impl AxisError {
    /// All kinds, in the order of their errors.
    pub const ALL: [Self; 3] = [Self::Tilt, Self::Wobble, Self::Encoder];

    /// Indices of the errors of one axis (outermost is zero) among those of all axes.
    fn of_axis(self, axis: usize) -> Range<usize> {
        const WOBBLE: usize = ACROSS * (AXES - 1);
        const ENCODER: usize = WOBBLE + AXES * PHASES * ACROSS;
        let from = |start, each| start + axis * each..start + (axis + 1) * each;
        match self {
            // The outermost axis has none.
            Self::Tilt => ACROSS * axis.saturating_sub(1)..ACROSS * axis,
            Self::Wobble => from(WOBBLE, PHASES * ACROSS),
            Self::Encoder => from(ENCODER, PHASES),
        }
    }

    /// The kind at an index among the errors of the axes; `None` beyond the last.
    pub fn of(index: usize) -> Option<Self> {
        let mut all = Self::ALL.into_iter();
        all.find(|kind| kind.range().contains(&index))
    }

    /// Indices of the errors of this kind among all errors of the axes.
    pub fn range(self) -> Range<usize> {
        self.of_axis(0).start..self.of_axis(AXES - 1).end
    }

    /// Assigns this 1σ to each error of this kind, for a table with this many axes.
    pub fn of_table(self, axes: usize, sigma: f64) -> SVector<f64, AXIS_ERRORS> {
        let mut all = SVector::<f64, AXIS_ERRORS>::zeros();
        for axis in 0..axes.min(AXES) {
            all.rows_range_mut(self.of_axis(axis)).fill(sigma);
        }
        all
    }
}

/// 1σ of errors that change a table's true attitude but not its reading; zero if they are not
/// estimated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TableGeometry {
    /// 1σ of the base about East, North (level) and Up (north), rad.
    pub base: Vector3<f64>,
    /// 1σ of each error of the axes, see [`AxisError::range`], rad; zero for axes that the table does not
    /// have.
    pub axes: SVector<f64, AXIS_ERRORS>,
}

impl Default for TableGeometry {
    fn default() -> Self {
        Self {
            base: Vector3::zeros(),
            axes: SVector::zeros(),
        }
    }
}

impl TableGeometry {
    /// Whether there are errors of this kind.
    pub fn has(&self, kind: AxisError) -> bool {
        self.axes.rows_range(kind.range()).amax() > 0.0
    }

    /// 1σ of the base errors about East, North and Up, followed by the 1σ of each error of the axes.
    pub fn vector(&self) -> SVector<f64, TABLE_GEOMETRY> {
        SVector::from_iterator(self.base.iter().chain(&self.axes).copied())
    }
}

/// The name of an error of a table in files; `None` beyond the last. Directions across an axis are
/// those of [`across`], in the frame of the next axis outwards.
pub fn table_geometry_name(k: usize) -> Option<String> {
    const BASE: [&str; 3] = ["east", "north", "up"];
    const AXIS: [&str; AXES] = ["first_axis", "second_axis", "third_axis"];
    const PHASE: [&str; PHASES] = ["cos", "sin", "cos2", "sin2"];
    let Some(k) = k.checked_sub(BASE.len()) else {
        return Some(format!("table.base.{}", BASE[k]));
    };
    let (kind, axis) = AxisError::ALL
        .into_iter()
        .flat_map(|kind| (0..AXES).map(move |axis| (kind, axis)))
        .find(|(kind, axis)| kind.of_axis(*axis).contains(&k))?;
    let (name, k) = (AXIS[axis], k - kind.of_axis(axis).start);
    let (phase, side) = (PHASE[k / ACROSS], 1 + k % ACROSS);
    Some(match kind {
        AxisError::Tilt => format!("table.{name}.tilt_{side}"),
        AxisError::Wobble => format!("table.{name}.wobble_{phase}_{side}"),
        AxisError::Encoder => format!("table.{name}.encoder_{}", PHASE[k]),
    })
}

/// Rotation of the attitude of a table with axes at these angles, for a unit value of each error of the axes.
///
/// `C_b_n = C_base R(a₁, θ₁) [I + t₂×] R(a₂, θ₂) [I + t₃×] R(a₃, θ₃) …`: a tilt of an axis in the frame of the next one
/// outwards rotates everything that the axis carries; in the navigation frame, this rotation is `R(a₁, θ₁) t₂` and
/// `R(a₁, θ₁) R(a₂, θ₂) t₃`. Wobble is a t across the axis that depends on the axis angle; an encoder error is a t
/// along the axis.
pub fn axis_response(axes: &AxisAngles) -> AxisResponse {
    let mut response = AxisResponse::zeros();
    let mut carried = Matrix3::identity();
    for (number, &(direction, angle)) in axes.iter().flatten().enumerate() {
        let across = across(&direction).map(|across| carried * across);
        let (along, phases) = ([carried * direction], phases(angle));
        for (kind, values, directions) in [
            (AxisError::Tilt, &[1.0][..], &across[..]),
            (AxisError::Wobble, &phases, &across),
            (AxisError::Encoder, &phases, &along),
        ] {
            let turns = values
                .iter()
                .flat_map(|value| directions.iter().map(move |turn| turn * *value));
            for (k, turn) in kind.of_axis(number).zip(turns) {
                response.set_column(k, &turn);
            }
        }
        carried *= exp(direction * angle);
    }
    response
}

/// Cosine and sine of the angle of an axis and of twice this angle.
pub fn phases(angle: f64) -> [f64; PHASES] {
    let ((s, c), (s2, c2)) = (angle.sin_cos(), (2.0 * angle).sin_cos());
    [c, s, c2, s2]
}

/// The axes of a table at these angles, limited to the axes whose errors are modelled.
pub fn axis_angles(axes: impl IntoIterator<Item = (Vector3<f64>, f64)>) -> AxisAngles {
    let mut axes = axes.into_iter();
    std::array::from_fn(|_| axes.next())
}

/// Two directions perpendicular to another direction and to each other.
pub fn across(direction: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let one = Vector3::ith(direction.iamin(), 1.0)
        .cross(direction)
        .normalize();
    [one, direction.cross(&one)]
}
