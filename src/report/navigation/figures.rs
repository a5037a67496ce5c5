//! Errors against time with the band that was predicted.

use super::super::axis::Axis;
use super::super::canvas::{Area, DrawError, Pen, QUIET, envelope};
use super::super::panel::{Margins, Panel};
use super::super::{Figure, ReportError};
use super::HOUR;
use super::quantity::Quantity;
use crate::study::navigation::Epoch;

/// Points of a line: more than the panel is wide in pixels would not show.
const POINTS: usize = 1000;
/// Size of a panel in shown pixels.
const PANEL: (u32, u32) = (1200, 210);
/// Of the height of a panel, free above and below its lines.
const FREE: f64 = 0.06;

/// A navigation that is drawn.
pub(in crate::report) struct Side<'a> {
    /// What its line is called.
    pub(in crate::report) name: &'a str,
    /// Its errors.
    pub(in crate::report) moments: &'a [Epoch],
}

/// Attitude, velocity and position, one figure each. Several navigations share the axes; one alone has
/// its predicted σ as a band.
pub(in crate::report) fn figures(sides: &[Side]) -> Result<Vec<Figure>, ReportError> {
    let band = match sides {
        [_] => "band",
        _ => "dashed",
    };
    let caption = format!(
        "Computed less true. Line: actual error by full navigation; {band}: ±1σ predicted from the \
         calibration's covariance by the linear model, within which the error of two calibrations in \
         three lies at any one time."
    );
    let horizontal =
        " Horizontal: length of both components, with the root of its predicted mean square.";
    let titles = [
        ("attitude.svg", "Attitude error", ""),
        ("velocity.svg", "Velocity error", horizontal),
        ("position.svg", "Position error", horizontal),
    ];
    titles
        .into_iter()
        .zip(Quantity::ALL.chunks(3))
        .map(|((file, title, more), quantities)| {
            let size = (PANEL.0, PANEL.1 * quantities.len() as u32);
            Figure::draw(file, title, caption.clone() + more, size, |area| {
                for (&quantity, area) in quantities
                    .iter()
                    .zip(area.split_evenly((quantities.len(), 1)))
                {
                    panel(&area, quantity, sides)?;
                }
                Ok(())
            })
        })
        .collect()
}

type Line = Vec<(f64, f64)>;

fn panel(area: &Area, quantity: Quantity, sides: &[Side]) -> Result<(), DrawError> {
    let errors = |side: &Side| -> Line {
        let all = side.moments.iter();
        all.map(|m| (m.time / HOUR, quantity.error(&m.error)))
            .collect()
    };
    let sigmas = |side: &Side| -> Line {
        let thinned = side.moments.len().div_ceil(POINTS).max(1);
        let all = side.moments.iter().step_by(thinned);
        all.filter_map(|m| Some((m.time / HOUR, quantity.sigma(m)?)))
            .collect()
    };
    let mut lines: Vec<(Line, Line)> = sides.iter().map(|s| (errors(s), sigmas(s))).collect();
    let points = || {
        lines
            .iter()
            .flat_map(|(error, sigma)| error.iter().chain(sigma))
    };
    let largest = points().map(|p| p.1.abs()).fold(0.0, f64::max);
    let hours = points().map(|p| p.0).fold(0.0, f64::max);
    let (unit, scale) = quantity.readable_unit(largest);
    for (error, sigma) in &mut lines {
        for point in error.iter_mut().chain(sigma) {
            point.1 *= scale;
        }
    }
    let longest = sides.iter().map(|side| side.name.chars().count()).max();
    let mut panel = Panel::new(
        area,
        &format!("{}, {unit}", quantity.name()),
        Margins {
            left: 60.0,
            right: 30.0 + 8.0 * longest.unwrap_or(0) as f64,
        },
        (time(hours), height(quantity, &lines)),
        "time, h",
        &[],
    )?;
    let lower = |sigma: &Line| -> Line {
        let sign = if quantity.is_component() { -1.0 } else { 0.0 };
        sigma.iter().map(|&(t, s)| (t, sign * s)).collect()
    };
    if let [(_, sigma)] = &lines[..] {
        panel.band(&lower(sigma), sigma)?;
        if let Some(&(_, last)) = sigma.last() {
            panel.label(last, "σ", QUIET);
        }
    }
    panel.line(&[(0.0, 0.0), (hours, 0.0)], Pen::solid(QUIET, 0.75))?;
    for (n, (side, (error, sigma))) in sides.iter().zip(&lines).enumerate() {
        let pen = Pen::nth(n, 1.5);
        if lines.len() > 1 {
            let thin = Pen::dashed(pen.color, 1.0);
            panel.line(sigma, thin)?;
            panel.line(&lower(sigma), thin)?;
        }
        panel.line(&envelope(error, POINTS), pen)?;
        if let Some(&(_, last)) = error.last() {
            panel.label(last, side.name, pen.color);
        }
    }
    panel.finish()
}

/// Ticks at whole hours, or parts of an hour in a short navigation.
pub(super) fn time(hours: f64) -> Axis {
    let steps = [0.1, 0.2, 0.5, 1.0, 2.0, 4.0, 8.0, 24.0, 48.0, 96.0];
    match steps.into_iter().find(|step| hours / step <= 12.0) {
        Some(step) if hours > 0.0 => Axis::stepped(0.0, hours, step),
        _ => Axis::linear(0.0, hours),
    }
}

/// From the lowest to the highest of all lines, zero included.
fn height(quantity: Quantity, lines: &[(Line, Line)]) -> Axis {
    let (mut low, mut high) = (0f64, 0f64);
    for (error, sigma) in lines {
        for &(_, error) in error {
            (low, high) = (low.min(error), high.max(error));
        }
        for &(_, sigma) in sigma {
            high = high.max(sigma);
            if quantity.is_component() {
                low = low.min(-sigma);
            }
        }
    }
    let free = FREE * (high - low);
    let below = if low < 0.0 { free } else { 0.0 };
    // Exactly zero everywhere has no range of its own.
    if high > low {
        Axis::linear(low - below, high + free)
    } else {
        Axis::linear(-1.0, 1.0)
    }
}
