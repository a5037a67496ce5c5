//! Reported components of a navigation error, with units.

use nalgebra::SVector;

use crate::navigation::error_model::STATES;
use crate::report::prelude::*;
use crate::study::navigation::Outlook;

/// Lines that differ by more than this factor share a logarithmic axis.
const APART: f64 = 20.0;

/// Units of one kind with their SI value, the usual one first.
type Units = &'static [(&'static str, f64)];
const ANGLES: Units = &[("°", DEGREE), ("″", ARCSEC)];
const SPEEDS: Units = &[("m/s", 1.0), ("cm/s", 0.01), ("mm/s", 0.001)];
const LENGTHS: Units = &[("nmile", NAUTICAL_MILE), ("m", 1.0)];

/// A component of the error, or the horizontal length of two.
#[derive(Debug, Clone, Copy)]
pub struct Quantity {
    /// Such as `pitch`.
    pub name: &'static str,
    /// Its name in documents, with its unit.
    pub key: &'static str,
    /// Index in [`Outlook::sigma`]; for a horizontal length, that of its first component.
    place: usize,
    /// Whether it is signed, with a normal distribution if parameters have one.
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
    /// Attitude, velocity, position, three each.
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

    /// Symbol of its unit in documents and tables.
    pub fn unit(self) -> &'static str {
        self.units[0].0
    }

    fn unit_value(self) -> f64 {
        self.units[0].1
    }

    /// A convenient unit for values up to this one (in the usual unit), and its ratio to the usual unit.
    pub fn readable_unit(self, largest: f64) -> (&'static str, f64) {
        let size = largest * self.unit_value();
        let fits = self.units.iter().find(|(_, value)| size >= 0.5 * value);
        let (unit, value) = fits.copied().unwrap_or(self.units[self.units.len() - 1]);
        (unit, self.unit_value() / value)
    }

    /// The error in the usual unit.
    pub fn error(self, moment: &Outlook) -> Option<f64> {
        Some(self.of(&moment.error.as_ref()?.to_vector()))
    }

    /// Predicted 1σ in the usual unit (RMS for a horizontal length).
    pub fn sigma(self, moment: &Outlook) -> Option<f64> {
        Some(self.of(moment.sigma.as_ref()?))
    }

    /// The same of all errors or their σ, in the order of [`Outlook::sigma`].
    fn of(self, all: &SVector<f64, STATES>) -> f64 {
        let si = match self.is_component {
            true => all[self.place],
            false => all[self.place].hypot(all[self.place + 1]),
        };
        si / self.unit_value()
    }

    /// Errors by name against time, over the ±σ band of the last, in a readable unit; only σ bounds if no error is
    /// known. `second` is the length of a second on the axis of time.
    pub fn panel(self, time: Axis, second: f64, navigated: &[(&str, &[Outlook])]) -> Panel {
        let curve = |moments: &[Outlook], of: &dyn Fn(&Outlook) -> Option<f64>| -> Vec<Point> {
            let points = moments.iter();
            let points = points.filter_map(|m| Some((m.time * second, of(m)?)));
            points.collect()
        };
        let mut lines = Vec::new();
        for &(name, moments) in navigated {
            let errors = curve(moments, &|m| self.error(m));
            if !errors.is_empty() {
                lines.push((name, Some(name.to_owned()), errors));
                continue;
            }
            let upper = curve(moments, &|m| self.sigma(m));
            lines.push((name, Some(format!("σ of {name}")), upper));
            lines.push((name, None, curve(moments, &|m| Some(-self.sigma(m)?))));
        }
        let last = navigated.last().map_or(&[][..], |last| last.1);
        let sigma = |sign: f64| curve(last, &|m| Some(sign * self.sigma(m)?));
        let size = |points: &[Point]| points.iter().map(|p| p.1.abs()).fold(0.0, f64::max);
        let sizes = lines.iter().map(|(.., points)| size(points));
        let (smallest, largest) = positive_range(sizes.chain([size(&sigma(1.0))]));
        let (unit, scale) = self.readable_unit(largest);
        let scaled = |points: Vec<Point>| -> Vec<Point> {
            points.into_iter().map(|(t, y)| (t, y * scale)).collect()
        };
        let (y, kind) = match largest > APART * smallest {
            true => (
                Axis::symlog(0.3 * smallest * scale),
                ", logarithmic to both sides",
            ),
            false if largest > 0.0 => (Axis::linear("").including([0.0]).room(0.06, 0.06), ""),
            // Exactly zero everywhere has no range of its own.
            false => (Axis::linear("").between(-1.0, 1.0), ""),
        };
        let lines = lines.into_iter().map(|(name, label, points)| {
            let mut line = Series::line(scaled(points));
            line.label = label;
            match name {
                "closed form" => line.nth(1).dashed(),
                _ => line,
            }
        });
        let lowest = if self.is_component { -1.0 } else { 0.0 };
        let [low, high] = [lowest, 1.0].map(|sign| scaled(sigma(sign)));
        let mut names = vec![(&high, "+σ")];
        names.extend(self.is_component.then_some((&low, "−σ")));
        let names = names.into_iter();
        let names = names.filter_map(|(edge, name)| Some(Series::name(edge.last()?.1, name)));
        let names: Vec<Series> = names.collect();
        Panel::new(format!("{}, {unit}{kind}", self.name), time, y)
            .with(Series::band(low, high))
            .with(Series::zero())
            .with_all(names)
            .with_all(lines)
    }
}
