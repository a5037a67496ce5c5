//! Reported quantities of a navigation error, and their units.

use super::Outlook;
use crate::navigation::ErrorVector;
use crate::number::readable;
use crate::units::{ARCSEC, DEGREE, NAUTICAL_MILE};

/// Units of one kind with their value in SI, the usual unit first.
type Units = &'static [(&'static str, f64)];
const ANGLES: Units = &[("°", DEGREE), ("″", ARCSEC)];
const SPEEDS: Units = &[("m/s", 1.0), ("cm/s", 0.01), ("mm/s", 0.001)];
const LENGTHS: Units = &[("nmile", NAUTICAL_MILE), ("m", 1.0)];

/// A component of the navigation error, or the horizontal length of two components.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantity {
    /// Name, such as `pitch`.
    pub name: &'static str,
    /// Name in documents, with the unit.
    pub key: &'static str,
    /// Index in [`Outlook::sigma`]; for a horizontal length, that of its first component.
    place: usize,
    /// Whether the quantity has a sign, and a normal distribution if the parameters have one.
    pub is_component: bool,
    units: Units,
}

const fn component(place: usize, name: &'static str, key: &'static str, units: Units) -> Quantity {
    Quantity {
        name,
        key,
        place,
        is_component: true,
        units,
    }
}

const fn horizontal(place: usize, name: &'static str, key: &'static str, units: Units) -> Quantity {
    Quantity {
        is_component: false,
        ..component(place, name, key, units)
    }
}

impl Quantity {
    /// The components of attitude, velocity and position, three of each.
    pub const ALL: [Self; 9] = [
        component(0, "pitch", "pitch_deg", ANGLES),
        component(1, "roll", "roll_deg", ANGLES),
        component(2, "heading", "heading_deg", ANGLES),
        component(3, "velocity east", "velocity_east_m_s", SPEEDS),
        component(4, "velocity north", "velocity_north_m_s", SPEEDS),
        horizontal(3, "velocity, horizontal", "velocity_m_s", SPEEDS),
        component(6, "position east", "position_east_nmile", LENGTHS),
        component(7, "position north", "position_north_nmile", LENGTHS),
        horizontal(6, "position, horizontal", "position_nmile", LENGTHS),
    ];

    /// The part of the name before the comma, without the kind of length.
    pub fn short(self) -> &'static str {
        self.name.split(',').next().unwrap_or(self.name)
    }

    /// Symbol of the unit in documents and tables.
    pub fn unit(self) -> &'static str {
        self.units[0].0
    }

    fn unit_value(self) -> f64 {
        self.units[0].1
    }

    /// A unit in which values up to `largest` (in the usual unit) have few zeros, and the factor that converts the
    /// usual unit to this unit.
    pub fn readable_unit(self, largest: f64) -> (&'static str, f64) {
        let (unit, value) = readable(self.units, largest * self.unit_value());
        (unit, self.unit_value() / value)
    }

    /// The error in the usual unit.
    pub fn error(self, moment: &Outlook) -> Option<f64> {
        Some(self.of(&moment.error.as_ref()?.to_vector()))
    }

    /// Predicted 1σ in the usual unit; for a horizontal length, its root mean square.
    pub fn sigma(self, moment: &Outlook) -> Option<f64> {
        Some(self.of(moment.sigma.as_ref()?))
    }

    /// The quantity from all errors or their σ, in the order of [`Outlook::sigma`].
    pub fn of(self, all: &ErrorVector) -> f64 {
        let si = if self.is_component {
            all[self.place]
        } else {
            all.fixed_rows::<2>(self.place).norm()
        };
        si / self.unit_value()
    }
}
