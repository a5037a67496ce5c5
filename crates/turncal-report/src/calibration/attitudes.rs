//! Map of the sphere with the attitudes that were reached and those that are missing.

use std::f64::consts::TAU;

use super::report::Report;
use crate::prelude::*;
use turncal::imu::AXES;
use turncal::run::motion::{Rest, rests};

/// A position is missing if every dwell is farther from it, rad: half the angle between two neighbouring positions.
const FAR: f64 = 45.0 * DEGREE;
/// Dwells less than this below the rim of a hemisphere are shown in both maps: sine of 5°.
const RIM: f64 = 0.087;
/// Half the width of a map of a hemisphere, whose radius is 1.
const ROOM: f64 = 1.22;
/// Number of points of a circle.
const CIRCLE: usize = 121;

/// An axis, and 1 if it points up or −1 if it points down.
type Position = (usize, f64);
const POSITIONS: [Position; 6] = [
    (0, 1.0),
    (0, -1.0),
    (1, 1.0),
    (1, -1.0),
    (2, 1.0),
    (2, -1.0),
];

impl Report<'_> {
    /// The upward directions of all dwells along body axes, and those of the six positions that have no dwell nearby.
    pub fn attitudes(&self) -> Option<Plot> {
        let rests = rests(self.run);
        let near = |rest: &Rest, (axis, sign): Position| {
            sign * rest.force[axis] > rest.force.norm() * FAR.cos()
        };
        let is_missing = |of: &Position| !rests.iter().any(|rest| near(rest, *of));
        let missing: Vec<Position> = POSITIONS.into_iter().filter(is_missing).collect();
        let panels = [1.0, -1.0].map(|side| hemisphere(&rests, &missing, side));
        let way = |sign: f64| if sign < 0.0 { "down" } else { "up" };
        let named = missing
            .iter()
            .map(|&(axis, sign)| format!("{} {}", AXES[axis], way(sign)));
        let named = named.reduce(|one, other| format!("{one}, {other}"));
        let missing = named.unwrap_or_else(|| "none".to_owned());
        let far = FAR / DEGREE;
        let caption = format!(
            "Dots: upward direction along the body axes in each dwell, on an equal-area map of the two hemispheres. \
             Inner circle: {far:.0}° from the pole. Rings: positions with one axis up or down that are more than \
             {far:.0}° from the upward direction of every dwell. Missing positions (of six): {missing}."
        );
        let plot = Plot::new("attitudes.svg", "Attitudes reached", (3, 420), panels);
        (!rests.is_empty()).then(|| plot.caption(caption))
    }
}

/// The hemisphere with z up (1) or down (−1), seen from outside.
fn hemisphere(rests: &[Rest], missing: &[Position], side: f64) -> Panel {
    let map = |[x, y, z]: [f64; 3]| {
        // Lambert's azimuthal equal-area projection.
        let scale = (1.0 + side * z).max(0.0).sqrt().recip();
        (x * scale, side * y * scale)
    };
    let place = |&(axis, sign): &Position| {
        let mut unit = [0.0; 3];
        unit[axis] = sign;
        map(unit)
    };
    let is_here = |of: &&Position| of.0 < 2 || of.1 == side;
    let circle = |radius: f64| {
        let points = steps(0.0, TAU, CIRCLE).map(move |t| (radius * t.cos(), radius * t.sin()));
        Series::line(points).color(Color::Quiet).width(0.75)
    };
    let inner = map([FAR.sin(), 0.0, side * FAR.cos()]).0;
    let dwells = rests.iter().map(|rest| rest.force.normalize());
    let dwells = dwells.filter(|up| up.z * side > -RIM);
    let dwells = dwells.map(|up| map([up.x, up.y, up.z]));
    let names = POSITIONS.iter().filter(is_here).map(|of| {
        let (x, y) = place(of);
        let anchor = [Anchor::Middle, Anchor::Below][usize::from(of.0 == 2)];
        Series::words((1.14 * x, 1.14 * y), anchor, signed_axis(AXES[of.0], of.1))
    });
    let rings = missing.iter().filter(is_here).map(place);
    let rings = Series::marks(Mark::Ring, rings).nth(1).width(2.5);
    let title = format!("{} side", signed_axis('z', side));
    let axis = || Axis::bare(-ROOM, ROOM);
    let mut panel = Panel::new(title, axis(), axis())
        .with_all([circle(1.0), circle(inner)])
        .with_all(names)
        .with(Series::marks(Mark::Dot, dwells).width(2.5).key("reached"))
        .with(rings.key("missing"));
    panel.square = true;
    panel
}
