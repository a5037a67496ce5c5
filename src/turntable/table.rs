//! The table: its axes, their limits and their errors.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::{AxisError, PHASES, TableGeometry};

/// Index of the sine of the angle in [`super::phases`].
const SINE: usize = 1;

/// A rotation axis of a table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// Name, such as `outer`.
    pub name: String,
    /// Unit vector in the frame of the next axis outwards; for the outermost axis, in East-North-Up.
    pub direction: Vector3<f64>,
    /// Highest rate, rad/s.
    pub max_rate: f64,
    /// Highest acceleration, rad/s².
    pub max_acceleration: f64,
}

/// A turntable of any number of axes, `C_b_n = C_base R(axis₁, a₁) R(axis₂, a₂) … C_mount`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// The axes from the outermost to the innermost.
    pub axes: Vec<Axis>,
    /// `C_mount`, from the body to the frame of the innermost axis.
    pub mount: Matrix3<f64>,
    /// 1σ of its errors.
    pub errors: TableErrors,
}

/// 1σ of the errors of a table log.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TableAccuracy {
    /// 1σ per axis of the position error, rad; the error is constant in a dwell and independent between positions.
    pub position_sigma: f64,
    /// 1σ per axis of the white error of each reading, rad.
    pub reading_sigma: f64,
    /// 1σ per axis of the additional error of a reading just after a stop, rad; the error fades within a second.
    pub settling_sigma: f64,
    /// 1σ of errors that the reading does not show.
    pub geometry: TableGeometry,
}

/// 1σ of a table's errors, all in rad.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct TableErrors {
    /// Position error per axis of the navigation frame, which is constant in a dwell and independent between positions.
    pub position: f64,
    /// White error of each reading, per axis of the navigation frame.
    pub reading: f64,
    /// Tilt of the base about East and about North.
    pub level: f64,
    /// Error of the base in azimuth.
    pub north: f64,
    /// Tilt of every axis except the outermost, per direction across it.
    pub nonorthogonality: f64,
    /// Amplitude of the tilt of every axis once per turn.
    pub wobble: f64,
    /// Amplitudes of the tilt of every axis with cosine and sine of its angle and of twice its angle, for each
    /// direction across it.
    pub wobble_harmonics: f64,
    /// Amplitudes of the error of every encoder with cosine and sine of its angle and of twice its angle.
    pub encoder_harmonics: f64,
}

impl TableErrors {
    /// 1σ of each axis error of a kind.
    pub fn of_axes(mut self, kind: AxisError) -> f64 {
        *self.of_axes_mut(kind)
    }

    /// A mutable reference to this 1σ.
    pub fn of_axes_mut(&mut self, kind: AxisError) -> &mut f64 {
        match kind {
            AxisError::Tilt => &mut self.nonorthogonality,
            AxisError::Wobble => &mut self.wobble_harmonics,
            AxisError::Encoder => &mut self.encoder_harmonics,
        }
    }
}

/// Deviations of one table from its design: the errors that are constant in a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Imperfection {
    /// Rotation vector of the base, East-North-Up, rad: `C_base = exp([base×])`.
    pub base: Vector3<f64>,
    /// Errors of each axis.
    pub axes: Vec<AxisImperfection>,
}

/// The errors of one axis, as rotation vectors in rad in the frame of the next one outwards.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AxisImperfection {
    /// A constant tilt.
    pub tilt: Vector3<f64>,
    /// Coefficients of the errors, one for each of the [`super::phases`] of the axis angle: wobble across the axis,
    /// encoder error along the axis.
    pub harmonics: [Vector3<f64>; PHASES],
}

impl Imperfection {
    /// A perfect table.
    pub fn none(table: &Table) -> Self {
        Self {
            base: Vector3::zeros(),
            axes: vec![AxisImperfection::default(); table.axes.len()],
        }
    }

    /// Draws a table according to its 1σ, from independent standard normal numbers.
    pub fn draw(table: &Table, mut normal: impl FnMut() -> f64) -> Self {
        let errors = &table.errors;
        let mut any = || Vector3::from_fn(|_, _| normal());
        let across =
            |any: Vector3<f64>, axis: &Axis| any - axis.direction * axis.direction.dot(&any);
        let mut imperfection = Self::none(table);
        let axes = || table.axes.iter();
        for (number, (axis, own)) in axes().zip(&mut imperfection.axes).enumerate() {
            // The tilt of the outermost axis is the level of the base.
            let sigma = if number == 0 {
                0.0
            } else {
                errors.nonorthogonality
            };
            own.tilt = across(any() * sigma, axis);
        }
        for (axis, own) in axes().zip(&mut imperfection.axes) {
            let direction = across(any(), axis).try_normalize(0.0).unwrap_or_default();
            own.harmonics[SINE] = direction * errors.wobble;
        }
        let of_base = Vector3::new(errors.level, errors.level, errors.north);
        imperfection.base = any().component_mul(&of_base);
        for (axis, own) in axes().zip(&mut imperfection.axes) {
            for harmonic in &mut own.harmonics {
                let any = any();
                let along = axis.direction * axis.direction.dot(&any);
                *harmonic +=
                    (any - along) * errors.wobble_harmonics + along * errors.encoder_harmonics;
            }
        }
        imperfection
    }

    /// Whether any axis has tilt, wobble or encoder error.
    pub fn moves_axes(&self) -> bool {
        self.axes
            .iter()
            .any(|of| *of != AxisImperfection::default())
    }
}
