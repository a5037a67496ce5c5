//! Residuals in each dwell, as a figure.

use super::tables::{ANGLE, FORCE};
use crate::prelude::*;
use turncal::calibration::{DwellResidual, Quality};

/// Residuals of the magnitude and direction of gravity against time; dwells excluded from a fit as rings.
pub fn figure(quality: &Quality) -> Plot {
    let panel = |name: &str, units, of: fn(&DwellResidual) -> Option<f64>| {
        let points = |dwells: &[DwellResidual]| -> Vec<Point> {
            let residual = |dwell: &DwellResidual| Some((dwell.time, of(dwell)?));
            dwells.iter().filter_map(residual).collect()
        };
        let (fitted, left_out) = (points(&quality.dwells), points(&quality.held_out_dwells));
        let all = || fitted.iter().chain(&left_out).map(|point| point.1.abs());
        let largest = all().fold(0.0, f64::max);
        let (unit, size) = readable(units, largest);
        let scaled = |points: Vec<Point>| points.into_iter().map(move |(time, y)| (time, y / size));
        Panel::new(
            format!("{name}, {unit}"),
            Axis::linear("time, s").room(0.03, 0.03),
            Axis::linear("").including([0.0]).room(0.06, 0.06),
        )
        .with(Series::zero())
        .with(Series::marks(Mark::Dot, scaled(fitted)).key("in the fit"))
        .with(
            Series::marks(Mark::Ring, scaled(left_out))
                .nth(1)
                .key("left out"),
        )
    };
    let panels = [
        panel("|f| − gravity", &FORCE, |dwell| Some(dwell.gravity)),
        panel("direction of gravity after a move", &ANGLE, |dwell| {
            dwell.direction
        }),
    ];
    Plot::new("residuals.svg", "Residuals in each dwell", (2, 220), panels).caption(
        "Left: magnitude of the mean specific force minus gravity. Right: angle between the vertical carried over \
         from the previous dwell by the gyros and the vertical measured by the accelerometers. Rings: from a fit \
         without that dwell.",
    )
}
