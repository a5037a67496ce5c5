//! What is reported of a navigation error, and in which unit.

use nalgebra::SVector;

use crate::navigation::NavigationError;
use crate::navigation::error_model::STATES;
use crate::report::prelude::*;
use crate::study::navigation::Epoch;
use crate::units::{ARCSEC, DEGREE, NAUTICAL_MILE};

const KILOMETRE: f64 = 1000.0;
const CENTIMETRE: f64 = 0.01;
/// Lines this many times apart share an axis that is logarithmic.
const APART: f64 = 20.0;

/// A component of the error, or the horizontal length of two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Quantity {
    kind: Kind,
    /// Place in [`NavigationError::to_vector`]; none for the horizontal length.
    component: Option<usize>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Attitude,
    Velocity,
    Position,
}

impl Kind {
    /// Place of the first component in [`NavigationError::to_vector`].
    fn first(self) -> usize {
        match self {
            Self::Attitude => 0,
            Self::Velocity => 3,
            Self::Position => 6,
        }
    }
}

impl Quantity {
    /// Attitude, velocity, position, three each.
    pub(super) const ALL: [Self; 9] = [
        Self::new(Kind::Attitude, Some(0)),
        Self::new(Kind::Attitude, Some(1)),
        Self::new(Kind::Attitude, Some(2)),
        Self::new(Kind::Velocity, Some(3)),
        Self::new(Kind::Velocity, Some(4)),
        Self::new(Kind::Velocity, None),
        Self::new(Kind::Position, Some(6)),
        Self::new(Kind::Position, Some(7)),
        Self::new(Kind::Position, None),
    ];

    /// Position east.
    pub(super) const EAST: Self = Self::ALL[6];
    /// Position north.
    pub(super) const NORTH: Self = Self::ALL[7];

    const fn new(kind: Kind, component: Option<usize>) -> Self {
        Self { kind, component }
    }

    /// Whether it has a sign, and a normal distribution where parameters have one.
    pub(super) fn is_component(self) -> bool {
        self.component.is_some()
    }

    /// Such as `pitch`.
    pub(super) fn name(self) -> &'static str {
        self.words().0
    }

    /// Its name in documents, with its unit.
    pub(super) fn key(self) -> &'static str {
        self.words().1
    }

    fn words(self) -> (&'static str, &'static str) {
        match (self.kind, self.component) {
            (Kind::Attitude, Some(0)) => ("pitch", "pitch_deg"),
            (Kind::Attitude, Some(1)) => ("roll", "roll_deg"),
            (Kind::Attitude, _) => ("heading", "heading_deg"),
            (Kind::Velocity, Some(3)) => ("velocity east", "velocity_east_m_s"),
            (Kind::Velocity, Some(_)) => ("velocity north", "velocity_north_m_s"),
            (Kind::Velocity, None) => ("velocity, horizontal", "velocity_m_s"),
            (Kind::Position, Some(6)) => ("position east", "position_east_nmile"),
            (Kind::Position, Some(_)) => ("position north", "position_north_nmile"),
            (Kind::Position, None) => ("position, horizontal", "position_nmile"),
        }
    }

    /// Symbol of its unit in documents and tables.
    pub(super) fn unit(self) -> &'static str {
        match self.kind {
            Kind::Attitude => "°",
            Kind::Velocity => "m/s",
            Kind::Position => "nmile",
        }
    }

    fn unit_value(self) -> f64 {
        match self.kind {
            Kind::Attitude => DEGREE,
            Kind::Velocity => 1.0,
            Kind::Position => NAUTICAL_MILE,
        }
    }

    /// A unit in which values up to this one, in the usual unit, have few zeros; and how many of it
    /// make the usual unit.
    pub(super) fn readable_unit(self, largest: f64) -> (&'static str, f64) {
        let units: &[(&str, f64)] = match self.kind {
            Kind::Attitude => &[("°", DEGREE), ("″", ARCSEC)],
            Kind::Velocity => &[
                ("m/s", 1.0),
                ("cm/s", CENTIMETRE),
                ("mm/s", 1.0 / KILOMETRE),
            ],
            Kind::Position => &[("nmile", NAUTICAL_MILE), ("m", 1.0)],
        };
        let size = largest * self.unit_value();
        let (unit, value) = units
            .iter()
            .find(|(_, value)| size >= 0.5 * value)
            .or(units.last())
            .copied()
            .unwrap_or((self.unit(), self.unit_value()));
        (unit, self.unit_value() / value)
    }

    /// The error in the usual unit.
    pub(super) fn error(self, error: &NavigationError) -> f64 {
        let si = match (self.component, self.kind) {
            (Some(component), _) => error.to_vector()[component],
            (None, Kind::Velocity) => error.horizontal_velocity(),
            (None, _) => error.horizontal_position(),
        };
        si / self.unit_value()
    }

    /// Predicted 1σ in the usual unit; of a horizontal length the root of its mean square.
    pub(super) fn sigma(self, moment: &Epoch) -> Option<f64> {
        Some(self.of_sigma(&moment.sigma()?))
    }

    /// The same from the σ of all errors, in the order of [`NavigationError::to_vector`].
    pub(super) fn of_sigma(self, sigma: &SVector<f64, STATES>) -> f64 {
        let si = match self.component {
            Some(component) => sigma[component],
            None => sigma[self.kind.first()].hypot(sigma[self.kind.first() + 1]),
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
            let label = line.label.iter_mut().map(|(at, _)| at);
            let points = match &mut line.shape {
                Shape::Line(points) => &mut points[..],
                _ => &mut [],
            };
            points
                .iter_mut()
                .chain(label)
                .for_each(|point| point.1 *= scale);
        }
        let sigma = |sign: f64| -> Vec<Point> {
            sigma.iter().map(|&(t, s)| (t, sign * s * scale)).collect()
        };
        let lowest = if self.is_component() { -1.0 } else { 0.0 };
        let names = [(1.0, "+σ"), (-1.0, "−σ")].into_iter();
        let names = names
            .filter(|(sign, _)| *sign >= lowest)
            .filter_map(|(sign, name)| Some(Series::name(sigma(sign).last()?.1, name)));
        let title = format!("{}, {unit}{kind}", self.name());
        Panel::new(title, time, y)
            .with(Series::band(sigma(lowest), sigma(1.0)))
            .with(Series::zero())
            .with_all(names)
            .with_all(lines)
    }
}
