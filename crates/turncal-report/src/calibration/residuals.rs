//! Figure of the residuals before and after calibration.

use super::tables::{ANGLE, FORCE};
use crate::prelude::*;
use turncal::calibration::{DwellResidual, Quality};

/// Magnitude of the gravity residuals in each dwell and after each move, for the nominal and for the calibrated
/// instrument; rings mark dwells excluded from a fit.
pub fn figure(quality: &Quality) -> Plot {
    let panel = |name: &str, place: &str, units, of: fn(&DwellResidual) -> Option<f64>| {
        let points = |dwells: &[DwellResidual]| -> Vec<Point> {
            let residual = |dwell: &DwellResidual| Some((dwell.number as f64, of(dwell)?.abs()));
            dwells.iter().filter_map(residual).collect()
        };
        let before = points(&quality.nominal_dwells);
        let largest = before.iter().map(|point| point.1).fold(0.0, f64::max);
        let (unit, size) = readable(units, largest);
        let scaled = |points: Vec<Point>| points.into_iter().map(move |(x, y)| (x, y / size));
        let y = Axis::log("").room(0.1, 0.2);
        let x = Axis::linear(place).room(0.03, 0.03);
        let fitted = Series::marks(Mark::Dot, scaled(points(&quality.dwells)));
        let left_out = Series::marks(Mark::Ring, scaled(points(&quality.held_out_dwells)));
        Panel::new(format!("{name}, {unit}"), x, y)
            .with(
                Series::marks(Mark::Cross, scaled(before))
                    .nth(1)
                    .key("before"),
            )
            .with(fitted.key("after"))
            .with(left_out.nth(2).key("after, without the dwell"))
    };
    let panels = [
        panel("||f| − gravity|", "dwell", &FORCE, |dwell| {
            Some(dwell.gravity)
        }),
        panel(
            "direction of gravity",
            "dwell after the move",
            &ANGLE,
            |dwell| dwell.direction,
        ),
    ];
    Plot::new(
        "residuals.svg",
        "Before and after calibration",
        (2, 280),
        panels,
    )
    .caption(
        "|f| − gravity: deviation of the mean specific force of each dwell from gravity. Direction: after each move, \
         the angle between the vertical that the gyros carried over from the previous dwell and the vertical that the \
         accelerometers measured. Crosses: the instrument with nominal parameters, before calibration. Dots: the \
         calibrated instrument. Rings: the instrument calibrated without the data of this dwell.",
    )
}
