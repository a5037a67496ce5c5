//! What the figures are drawn with: a fine canvas, its colours, pens and letters.
//!
//! Plotters rounds every coordinate to a whole pixel, so a figure is drawn [`FINE`] times larger and
//! shown at its size. Sizes here are in shown pixels.

use std::io;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Drawn pixels in one shown pixel.
pub(super) const FINE: f64 = 8.0;
/// Size of the letters.
pub(super) const LETTER: f64 = 14.0;
/// What plotters divides a font's size by when it writes SVG.
const FONT_RATIO: f64 = 1.24;

/// Text and axes.
pub(super) const INK: RGBColor = RGBColor(34, 34, 34);
/// What must not distract.
pub(super) const QUIET: RGBColor = RGBColor(110, 110, 110);
/// Grid lines.
pub(super) const GRID: RGBColor = RGBColor(218, 218, 214);
/// The time of a dwell.
pub(super) const DWELL: RGBColor = RGBColor(243, 243, 238);
/// Bands of ±3σ.
pub(super) const BAND: RGBColor = RGBColor(196, 214, 228);

/// A drawing area of the SVG backend.
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// What can go wrong while drawing.
pub(super) type DrawError = DrawingAreaErrorKind<io::Error>;

/// Shown to drawn pixels.
pub(super) fn px(shown: f64) -> i32 {
    (shown * FINE).round() as i32
}

/// An SVG document of this size in shown pixels.
pub(super) fn svg(
    (width, height): (u32, u32),
    content: impl FnOnce(&Area) -> Result<(), DrawError>,
) -> Result<String, DrawError> {
    let (fine_width, fine_height) = (width * FINE as u32, height * FINE as u32);
    let mut text = String::new();
    {
        let area =
            SVGBackend::with_string(&mut text, (fine_width, fine_height)).into_drawing_area();
        area.fill(&WHITE)?;
        content(&area)?;
        area.present()?;
    }
    Ok(text.replacen(
        &format!(r#"width="{fine_width}" height="{fine_height}" viewBox"#),
        &format!(r#"width="{width}" height="{height}" viewBox"#),
        1,
    ))
}

/// How a line is drawn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pen {
    /// Colour.
    pub(super) color: RGBColor,
    /// Width in shown pixels.
    pub(super) width: f64,
    /// Lengths of dash and gap.
    pub(super) dash: Option<(f64, f64)>,
}

impl Pen {
    /// A solid line.
    pub(super) fn solid(color: RGBColor, width: f64) -> Self {
        Self {
            color,
            width,
            dash: None,
        }
    }

    /// A dashed line.
    pub(super) fn dashed(color: RGBColor, width: f64) -> Self {
        Self {
            dash: Some((6.0, 4.0)),
            ..Self::solid(color, width)
        }
    }

    /// The pen of the n-th of up to six lines in a panel: told apart by colour, lightness and label.
    pub(super) fn nth(n: usize, width: f64) -> Self {
        const COLORS: [RGBColor; 6] = [
            RGBColor(0, 84, 147),
            RGBColor(200, 80, 0),
            RGBColor(0, 128, 96),
            RGBColor(86, 160, 211),
            RGBColor(150, 60, 110),
            RGBColor(140, 120, 20),
        ];
        Self::solid(COLORS[n % COLORS.len()], width)
    }

    /// The pen of the n-th body axis: told apart by dashes, too.
    pub(super) fn axis(n: usize) -> Self {
        let pen = Self::nth(n, 1.5);
        Self {
            dash: [None, Some((6.0, 3.0)), Some((2.0, 2.0))][n % 3],
            ..pen
        }
    }

    /// The same for plotters.
    pub(super) fn style(self) -> ShapeStyle {
        self.color.stroke_width(px(self.width) as u32)
    }
}

/// Writes text at a place of an area, in shown pixels; `scale` 1 is the usual size.
pub(super) fn write(
    area: &Area,
    text: &str,
    (x, y): (f64, f64),
    (h, v): (HPos, VPos),
    color: &RGBColor,
    scale: f64,
) -> Result<(), DrawError> {
    area.draw(&Text::new(
        text.to_owned(),
        (px(x), px(y)),
        font(scale).color(color).pos(Pos::new(h, v)),
    ))
}

/// The usual font; `scale` 1 is the usual size.
pub(super) fn font(scale: f64) -> FontDesc<'static> {
    ("sans-serif", LETTER * FONT_RATIO * FINE * scale).into_font()
}

/// Thins a line to about `limit` points, keeping the lowest and the highest of each stretch.
pub(super) fn envelope(points: &[(f64, f64)], limit: usize) -> Vec<(f64, f64)> {
    if points.len() <= limit.max(2) {
        return points.to_vec();
    }
    let stretch = (2 * points.len()).div_ceil(limit.max(2));
    points
        .chunks(stretch)
        .flat_map(|chunk| {
            let by_height = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
            let mut ends: Vec<_> = chunk
                .iter()
                .min_by(by_height)
                .into_iter()
                .chain(chunk.iter().max_by(by_height))
                .copied()
                .collect();
            ends.sort_by(|a, b| a.0.total_cmp(&b.0));
            ends.dedup();
            ends
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_a_line_keeps_its_extremes() {
        let mut points: Vec<_> = (0..10_000).map(|i| (f64::from(i), 0.0)).collect();
        points[1234].1 = 7.0;
        points[7777].1 = -3.0;
        let thin = envelope(&points, 400);
        assert!(thin.len() <= 410);
        assert!(thin.contains(&(1234.0, 7.0)) && thin.contains(&(7777.0, -3.0)));
        assert!(thin.is_sorted_by(|a, b| a.0 <= b.0));
    }

    #[test]
    fn a_figure_is_shown_at_its_size_and_drawn_finer() {
        let text = svg((120, 50), |_| Ok(())).unwrap();
        assert!(text.starts_with(r#"<svg width="120" height="50" viewBox="0 0 960 400""#));
    }
}
