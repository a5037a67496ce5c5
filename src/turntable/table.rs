//! The table: its axes, their limits, and what is wrong with them.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::{AxisError, PHASES, TableGeometry};

/// Which of [`super::phases`] is the sine of the angle.
const SINE: usize = 1;

/// A rotation axis of a table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// What its makers call it, such as `outer`.
    pub name: String,
    /// Unit vector in the frame of the next axis outwards; that of the outermost in East-North-Up.
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
    /// `C_mount`, body to the innermost axis' frame.
    pub mount: Matrix3<f64>,
    /// How large its errors are.
    pub errors: TableErrors,
}

/// 1σ of what a table's log is wrong by.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TableAccuracy {
    /// Per axis of the position error, constant while the table is at rest and new at every position,
    /// rad.
    pub position_sigma: f64,
    /// Per axis of the white error of each reading, rad.
    pub reading_sigma: f64,
    /// Of what it does not read.
    pub geometry: TableGeometry,
}

/// 1σ of a table's errors, all in rad.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct TableErrors {
    /// Position error per axis of the navigation frame: constant while the table stands, new at
    /// every position.
    pub position: f64,
    /// White error of each reading, per axis of the navigation frame.
    pub reading: f64,
    /// Tilt of the base about East and about North.
    pub level: f64,
    /// Error of the base in azimuth.
    pub north: f64,
    /// Tilt of every axis but the outermost, per direction across it.
    pub nonorthogonality: f64,
    /// Amplitude of the tilt that every axis makes once per turn.
    pub wobble: f64,
    /// Of what every axis tilts by with cosine and sine of its angle and of twice its angle, for each
    /// direction across it.
    pub wobble_harmonics: f64,
    /// Of what every encoder reads wrongly with cosine and sine of its angle and of twice its angle.
    pub encoder_harmonics: f64,
}

impl TableErrors {
    /// 1σ of each error of the axes of a kind.
    pub fn of_axes(&self, kind: AxisError) -> f64 {
        match kind {
            AxisError::Tilt => self.nonorthogonality,
            AxisError::Wobble => self.wobble_harmonics,
            AxisError::Encoder => self.encoder_harmonics,
        }
    }

    /// Sets that.
    pub fn set_of_axes(&mut self, kind: AxisError, sigma: f64) {
        match kind {
            AxisError::Tilt => self.nonorthogonality = sigma,
            AxisError::Wobble => self.wobble_harmonics = sigma,
            AxisError::Encoder => self.encoder_harmonics = sigma,
        }
    }
}

/// What one table really is beside its drawing: the errors that stay through a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Imperfection {
    /// Rotation vector of the base, East-North-Up, rad: `C_base = exp([base×])`.
    pub base: Vector3<f64>,
    /// For each axis, the rotation vector in rad that tilts it in the frame of the next one outwards.
    pub tilt: Vec<Vector3<f64>>,
    /// For each axis, the rotation vectors in rad that go with each of [`super::phases`] of its angle: across
    /// it a wobble, along it what its encoder does not read.
    pub harmonics: Vec<[Vector3<f64>; PHASES]>,
}

impl Imperfection {
    /// A perfect table.
    pub fn none(table: &Table) -> Self {
        Self {
            base: Vector3::zeros(),
            tilt: vec![Vector3::zeros(); table.axes.len()],
            harmonics: vec![[Vector3::zeros(); PHASES]; table.axes.len()],
        }
    }

    /// A table as its 1σ say, made from independent standard normal numbers.
    pub fn draw(table: &Table, mut normal: impl FnMut() -> f64) -> Self {
        let errors = &table.errors;
        let mut across = |direction: &Vector3<f64>, sigma: f64| {
            let any = Vector3::from_fn(|_, _| normal()) * sigma;
            any - direction * direction.dot(&any)
        };
        // The tilt of the outermost axis is the level of the base.
        let tilt = table
            .axes
            .iter()
            .enumerate()
            .map(|(i, axis)| {
                let sigma = if i == 0 { 0.0 } else { errors.nonorthogonality };
                across(&axis.direction, sigma)
            })
            .collect();
        let wobble: Vec<Vector3<f64>> = table
            .axes
            .iter()
            .map(|axis| {
                across(&axis.direction, 1.0)
                    .try_normalize(0.0)
                    .unwrap_or_default()
                    * errors.wobble
            })
            .collect();
        let base = Vector3::new(
            normal() * errors.level,
            normal() * errors.level,
            normal() * errors.north,
        );
        let drawn = table.axes.iter().zip(wobble).map(|(axis, once)| {
            let mut of_axis = [0; PHASES].map(|_| {
                let any = Vector3::from_fn(|_, _| normal());
                let along = axis.direction * axis.direction.dot(&any);
                (any - along) * errors.wobble_harmonics + along * errors.encoder_harmonics
            });
            of_axis[SINE] += once;
            of_axis
        });
        let harmonics = drawn.collect();
        Self {
            base,
            tilt,
            harmonics,
        }
    }

    /// Whether any axis is tilted, wobbles, or has an encoder that reads wrongly.
    pub fn moves_axes(&self) -> bool {
        let any = |vectors: &[Vector3<f64>]| vectors.iter().any(|v| *v != Vector3::zeros());
        any(&self.tilt) || self.harmonics.iter().any(|harmonics| any(harmonics))
    }
}
