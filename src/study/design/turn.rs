//! A turn, and an attitude between turns.

use nalgebra::{Matrix3, Vector3};

use crate::units::DEGREE;

/// A turn of each table axis, outermost first, or about each body axis, in whole degrees, at a rate in °/s.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Turn {
    pub degrees: Vec<i32>,
    pub rate: i32,
}

/// An attitude between turns.
#[derive(Debug, Clone, PartialEq)]
pub enum Place {
    /// Angles of the table axes, in degrees.
    Table(Vec<i32>),
    /// `C_b_n`.
    Hand(Matrix3<f64>),
}

impl Place {
    /// Integers that are equal for equal attitudes.
    pub fn key(&self) -> Vec<i32> {
        match self {
            Self::Table(angles) => angles.iter().map(|angle| angle.rem_euclid(360)).collect(),
            Self::Hand(attitude) => attitude.iter().map(|c| (1e4 * c).round() as i32).collect(),
        }
    }
}

impl Turn {
    /// Rotation vector about body axes, rad.
    pub fn vector(&self) -> Vector3<f64> {
        let angles = radians(&self.degrees);
        Vector3::from_fn(|axis, _| angles.get(axis).copied().unwrap_or(0.0))
    }
}

/// Angles in rad.
pub fn radians(degrees: &[i32]) -> Vec<f64> {
    degrees
        .iter()
        .map(|&angle| f64::from(angle) * DEGREE)
        .collect()
}
