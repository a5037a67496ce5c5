//! What is reported of a navigation error, and in which unit.

use nalgebra::SVector;

use crate::navigation::NavigationError;
use crate::navigation::error_model::STATES;
use crate::report::prelude::*;
use crate::study::navigation::Epoch;

/// Lines this many times apart share an axis that is logarithmic.
const APART: f64 = 20.0;

/// Units of one kind with their size in SI, the usual one first.
type Units = &'static [(&'static str, f64)];
const ANGLES: Units = &[("°", DEGREE), ("″", ARCSEC)];
const SPEEDS: Units = &[("m/s", 1.0), ("cm/s", 0.01), ("mm/s", 0.001)];
const LENGTHS: Units = &[("nmile", NAUTICAL_MILE), ("m", 1.0)];

/// A component of the error, or the horizontal length of two.
#[derive(Debug, Clone, Copy)]
pub struct Quantity {
    /// Such as `pitch`.
    pub(super) name: &'static str,
    /// Its name in documents, with its unit.
    pub(super) key: &'static str,
    /// Place in [`NavigationError::to_vector`]; of a horizontal length that of its first component.
    place: usize,
    /// Whether it has a sign, and a normal distribution where parameters have one.
    pub(super) is_component: bool,
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
    /// Attitude, velocity, position, three each.
    pub(super) const ALL: [Self; 9] = [
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

    /// Symbol of its unit in documents and tables.
    pub(super) fn unit(self) -> &'static str {
        self.units[0].0
    }

    fn unit_value(self) -> f64 {
        self.units[0].1
    }

    /// A unit in which values up to this one, in the usual unit, have few zeros; and how many of it
    /// make the usual unit.
    pub(super) fn readable_unit(self, largest: f64) -> (&'static str, f64) {
        let size = largest * self.unit_value();
        let fits = self.units.iter().find(|(_, value)| size >= 0.5 * value);
        let (unit, value) = fits.copied().unwrap_or(self.units[self.units.len() - 1]);
        (unit, self.unit_value() / value)
    }

    /// The error in the usual unit.
    pub(super) fn error(self, error: &NavigationError) -> f64 {
        self.of(&error.to_vector())
    }

    /// Predicted 1σ in the usual unit; of a horizontal length the root of its mean square.
    pub(super) fn sigma(self, moment: &Epoch) -> Option<f64> {
        Some(self.of(&moment.sigma()?))
    }

    /// The same of all errors or their σ, in the order of [`NavigationError::to_vector`].
    pub(super) fn of(self, all: &SVector<f64, STATES>) -> f64 {
        let si = match self.is_component {
            true => all[self.place],
            false => all[self.place].hypot(all[self.place + 1]),
        };
        si / self.unit_value()
    }

    /// Lines against time over a band of ±σ, all given in the usual unit and drawn in a readable one.
    pub(super) fn panel(self, time: Axis, sigma: &[Point], mut lines: Vec<Series>) -> Panel {
        let size = |points: &[Point]| points.iter().map(|p| p.1.abs()).fold(0.0, f64::max);
        let of_line = |series: &Series| match &series.shape {
            Shape::Line(points) => size(points),
            _ => 0.0,
        };
        let sizes = lines.iter().map(of_line).chain([size(sigma)]);
        let (smallest, largest) = sizes
            .filter(|size| *size > 0.0)
            .fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), size| {
                (low.min(size), high.max(size))
            });
        let (unit, scale) = self.readable_unit(largest);
        let (y, kind) = match largest > APART * smallest {
            true => (
                Axis::symlog(0.3 * smallest * scale),
                ", logarithmic to both sides",
            ),
            false if largest > 0.0 => (Axis::linear("").including([0.0]).room(0.06, 0.06), ""),
            // Exactly zero everywhere has no range of its own.
            false => (Axis::linear("").between(-1.0, 1.0), ""),
        };
        for line in &mut lines {
            if let Shape::Line(points) = &mut line.shape {
                points.iter_mut().for_each(|point| point.1 *= scale);
            }
        }
        let sigma = |sign: f64| -> Vec<Point> {
            sigma.iter().map(|&(t, s)| (t, sign * s * scale)).collect()
        };
        let lowest = if self.is_component { -1.0 } else { 0.0 };
        let names = [(1.0, "+σ"), (-1.0, "−σ")].into_iter();
        let names = names
            .filter(|(sign, _)| *sign >= lowest)
            .filter_map(|(sign, name)| Some(Series::name(sigma(sign).last()?.1, name)));
        let title = format!("{}, {unit}{kind}", self.name);
        Panel::new(title, time, y)
            .with(Series::band(sigma(lowest), sigma(1.0)))
            .with(Series::zero())
            .with_all(names)
            .with_all(lines)
    }
}
