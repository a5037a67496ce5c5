//! Attitudes reached, and those missing, as a map of the sphere.

use std::f64::consts::TAU;

use super::report::Report;
use crate::prelude::*;
use turncal::imu::AXES;
use turncal::run::motion::{Rest, rests};

/// A position is missing if every dwell is farther from it, rad.
const FAR: f64 = 45.0 * DEGREE;
/// Dwells less than this below the rim of a hemisphere are shown in both maps: sine of 5°.
const RIM: f64 = 0.087;
/// Half the width of a map of a hemisphere, whose radius is 1.
const ROOM: f64 = 1.22;
/// Points of a circle.
const CIRCLE: usize = 121;

impl Report<'_> {
    /// The upward directions of all dwells along body axes, and those of the six positions that no dwell is near.
    pub fn attitudes(&self) -> Option<Plot> {
        let rests = rests(self.run);
        let missing: Vec<(usize, f64)> = (0..AXES.len())
            .flat_map(|axis| [1.0, -1.0].map(|sign| (axis, sign)))
            .filter(|position| !rests.iter().any(|rest| is_in(rest, *position)))
            .collect();
        let panels = [1.0, -1.0].map(|side| hemisphere(&rests, &missing, side));
        let named = missing.iter().map(|&(axis, sign)| position(axis, sign));
        let named: Vec<String> = named.collect();
        let missing = match named.as_slice() {
            [] => "All six positions were reached".to_owned(),
            [one] => format!("One of the six positions is missing: {one}"),
            some => format!(
                "Of the six positions these are missing: {}",
                some.join(", ")
            ),
        };
        let caption = format!(
            "Dots: upward direction along the body axes in each dwell, in an equal-area map of the two hemispheres. \
             Inner circle: {far:.0}° from the pole. Rings: positions with an axis up or down that are more than {far:.0}° \
             from every dwell. {missing}.",
            far = FAR / DEGREE
        );
        let plot = Plot::new("attitudes.svg", "Attitudes reached", (3, 420), panels);
        (!rests.is_empty()).then(|| plot.caption(caption))
    }
}

fn is_in(rest: &Rest, (axis, sign): (usize, f64)) -> bool {
    sign * rest.force[axis] > rest.force.norm() * FAR.cos()
}

/// Such as `x down`.
fn position(axis: usize, sign: f64) -> String {
    let way = if sign < 0.0 { "down" } else { "up" };
    format!("{} {way}", AXES[axis])
}

/// The hemisphere with z up (1) or down (−1), seen from outside.
fn hemisphere(rests: &[Rest], missing: &[(usize, f64)], side: f64) -> Panel {
    let map = |[x, y, z]: [f64; 3]| {
        // Lambert's azimuthal projection: areas are in proportion.
        let scale = (1.0 + side * z).max(0.0).sqrt().recip();
        (x * scale, side * y * scale)
    };
    let unit = |axis: usize, sign: f64| {
        let mut of = [0.0; 3];
        of[axis] = sign;
        of
    };
    let circle = |radius: f64| {
        let points = steps(0.0, TAU, CIRCLE).map(move |t| (radius * t.cos(), radius * t.sin()));
        Series::line(points).color(Color::Quiet).width(0.75)
    };
    let inner = map([FAR.sin(), 0.0, side * FAR.cos()]).0;
    let is_seen = |z: f64| z * side > -RIM;
    let dwells = rests.iter().map(|rest| rest.force.normalize());
    let dwells = dwells
        .filter(|up| is_seen(up.z))
        .map(|up| map([up.x, up.y, up.z]));
    let poles = (0..AXES.len()).flat_map(|axis| [1.0, -1.0].map(|sign| (axis, sign)));
    let poles = poles.filter(|&(axis, sign)| axis < 2 || sign == side);
    let names = poles.map(|(axis, sign)| {
        let (x, y) = map(unit(axis, sign));
        let at = (1.14 * x, 1.14 * y);
        let anchor = if axis == 2 {
            Anchor::Below
        } else {
            Anchor::Middle
        };
        Series::words(at, anchor, signed_axis(AXES[axis], sign))
    });
    let rings = missing
        .iter()
        .filter(|&&(axis, sign)| axis < 2 || sign == side);
    let rings = rings.map(|&(axis, sign)| map(unit(axis, sign)));
    let title = format!("{} side", signed_axis('z', side));
    let axis = || Axis::bare(-ROOM, ROOM);
    let mut panel = Panel::new(title, axis(), axis())
        .with_all([circle(1.0), circle(inner)])
        .with_all(names)
        .with(Series::marks(Mark::Dot, dwells).width(2.5).key("reached"))
        .with(
            Series::marks(Mark::Ring, rings)
                .nth(1)
                .width(2.5)
                .key("missing"),
        );
    panel.square = true;
    panel
}
