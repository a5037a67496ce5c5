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

    /// Name, unit that the paper gives it in, one of that unit in rad, m/s or m, key in JSON.
    fn entry(self) -> (&'static str, &'static str, f64, &'static str) {
        match self {
            Self::Pitch => ("pitch", "°", DEGREE, "pitch_deg"),
            Self::Roll => ("roll", "°", DEGREE, "roll_deg"),
            Self::Heading => ("heading", "°", DEGREE, "heading_deg"),
            Self::Velocity => ("velocity", "m/s", 1.0, "velocity_m_s"),
            Self::Position => ("position", "nmile", NAUTICAL_MILE, "position_nmile"),
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        self.entry().0
    }

    /// The unit that the paper gives it in.
    pub fn unit(self) -> &'static str {
        self.entry().1
    }

    /// One of that unit in rad, m/s or m.
    pub fn unit_value(self) -> f64 {
        self.entry().2
    }

    /// Its key in JSON, with the unit.
    pub fn key(self) -> &'static str {
        self.entry().3
    }
}
