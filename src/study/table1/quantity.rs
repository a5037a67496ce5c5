//! What the paper's table has a line for.

use crate::units::{DEGREE, NAUTICAL_MILE};

/// A navigation error; inside in rad, m/s and m.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Pitch.
    Pitch,
    /// Roll.
    Roll,
    /// Heading.
    Heading,
    /// Horizontal velocity, the norm of east and north.
    Velocity,
    /// Horizontal position, the norm of east and north.
    Position,
}

/// A value for each quantity, in the order of [`Quantity::ALL`].
pub type ByQuantity<T> = [T; 5];

impl Quantity {
    /// All, in the order of the paper's table.
    pub const ALL: ByQuantity<Self> = [
        Self::Pitch,
        Self::Roll,
        Self::Heading,
        Self::Velocity,
        Self::Position,
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pitch => "pitch",
            Self::Roll => "roll",
            Self::Heading => "heading",
            Self::Velocity => "velocity",
            Self::Position => "position",
        }
    }

    /// The unit that the paper gives it in.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Pitch | Self::Roll | Self::Heading => "°",
            Self::Velocity => "m/s",
            Self::Position => "nmile",
        }
    }

    /// One of that unit in rad, m/s or m.
    pub fn unit_value(self) -> f64 {
        match self {
            Self::Pitch | Self::Roll | Self::Heading => DEGREE,
            Self::Velocity => 1.0,
            Self::Position => NAUTICAL_MILE,
        }
    }

    /// Its key in JSON, with the unit.
    pub fn key(self) -> &'static str {
        match self {
            Self::Pitch => "pitch_deg",
            Self::Roll => "roll_deg",
            Self::Heading => "heading_deg",
            Self::Velocity => "velocity_m_s",
            Self::Position => "position_nmile",
        }
    }
}
