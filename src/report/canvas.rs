//! What the figures are drawn with: a fine canvas, panels with axes, lines, bands, marks and labels.
//!
//! Plotters rounds every coordinate to a whole pixel, so a figure is drawn [`FINE`] times larger and
//! shown at its size. Sizes here are in shown pixels.

use std::io;
use std::ops::Range;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::axis::Axis;

/// Drawn pixels in one shown pixel.
const FINE: f64 = 8.0;
/// Size of the letters.
const LETTER: f64 = 13.0;
/// What plotters divides a font's size by when it writes SVG.
const FONT_RATIO: f64 = 1.24;

/// Text and axes.
pub(super) const INK: RGBColor = RGBColor(34, 34, 34);
/// What must not distract.
pub(super) const QUIET: RGBColor = RGBColor(110, 110, 110);
/// Grid lines.
const GRID: RGBColor = RGBColor(218, 218, 214);
/// The time during which the table stands.
const DWELL: RGBColor = RGBColor(243, 243, 238);
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
    color: RGBColor,
    width: f64,
    /// Lengths of dash and gap.
    dash: Option<(f64, f64)>,
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

    /// Its colour.
    pub(super) fn color(self) -> RGBColor {
        self.color
    }

    fn style(self) -> ShapeStyle {
        self.color.stroke_width(px(self.width) as u32)
    }
}

/// A mark at a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mark {
    /// A filled circle.
    Dot,
    /// An open circle.
    Ring,
    /// A cross.
    Cross,
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

fn font(scale: f64) -> FontDesc<'static> {
    ("sans-serif", LETTER * FONT_RATIO * FINE * scale).into_font()
}

/// Space around a panel's axes, in shown pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Margins {
    /// For the tick labels of the vertical axis.
    pub(super) left: f64,
    /// For labels of lines.
    pub(super) right: f64,
}

/// Axes with a title, into which lines and marks are drawn.
pub(super) struct Panel<'a, 'b> {
    area: &'a Area<'b>,
    chart: ChartContext<'a, SVGBackend<'b>, Cartesian2d<Axis, Axis>>,
    x: Axis,
    labels: Vec<(f64, String, RGBColor)>,
}

impl<'a, 'b> Panel<'a, 'b> {
    /// Lays out a panel and shades the time during which the table stands.
    pub(super) fn new(
        area: &'a Area<'b>,
        title: &str,
        margins: Margins,
        (x, y): (Axis, Axis),
        x_title: &str,
        dwells: &[Range<f64>],
    ) -> Result<Self, DrawError> {
        write(
            area,
            title,
            (margins.left, 6.0),
            (HPos::Left, VPos::Top),
            &INK,
            1.0,
        )?;
        let mut chart = ChartBuilder::on(area)
            .margin_top(px(26.0))
            .margin_right(px(margins.right))
            .margin_bottom(px(4.0))
            .x_label_area_size(px(if x_title.is_empty() { 22.0 } else { 38.0 }))
            .y_label_area_size(px(margins.left))
            .build_cartesian_2d(x.clone(), y.clone())?;
        chart.draw_series(dwells.iter().filter_map(|dwell| {
            let (start, end) = (dwell.start.max(x.low()), dwell.end.min(x.high()));
            (end > start)
                .then(|| Rectangle::new([(start, y.low()), (end, y.high())], DWELL.filled()))
        }))?;
        chart
            .configure_mesh()
            .bold_line_style(GRID.stroke_width(px(0.75) as u32))
            .axis_style(QUIET.stroke_width(px(0.75) as u32))
            .set_all_tick_mark_size(px(3.0))
            .label_style(font(0.9).color(&INK))
            .axis_desc_style(font(0.9).color(&INK))
            .x_desc(x_title)
            .draw()?;
        Ok(Self {
            area,
            chart,
            x,
            labels: Vec::new(),
        })
    }

    /// Draws a line, leaving out what is not a number or lies before or after the axis.
    pub(super) fn line(&mut self, points: &[(f64, f64)], pen: Pen) -> Result<(), DrawError> {
        let points: Vec<_> = self.visible(points).collect();
        if points.len() < 2 {
            self.marks(&points, Mark::Dot, pen)
        } else if let Some((dash, gap)) = pen.dash {
            let series = DashedLineSeries::new(points, px(dash), px(gap), pen.style());
            self.chart.draw_series(series).map(drop)
        } else {
            let path = PathElement::new(points, pen.style());
            self.chart.draw_series([path]).map(drop)
        }
    }

    /// Fills between two lines given at the same times.
    pub(super) fn band(
        &mut self,
        lower: &[(f64, f64)],
        upper: &[(f64, f64)],
    ) -> Result<(), DrawError> {
        let mut outline: Vec<_> = self.visible(lower).collect();
        outline.extend(self.visible(upper).collect::<Vec<_>>().into_iter().rev());
        if outline.len() > 2 {
            self.chart
                .draw_series([Polygon::new(outline, BAND.filled())])?;
        }
        Ok(())
    }

    /// Draws marks.
    pub(super) fn marks(
        &mut self,
        points: &[(f64, f64)],
        mark: Mark,
        pen: Pen,
    ) -> Result<(), DrawError> {
        let points: Vec<_> = self.visible(points).collect();
        let (thin, small, large) = (pen.style(), px(2.0), px(4.5));
        for point in points {
            let one = std::iter::once(point);
            match mark {
                Mark::Dot => self.chart.draw_series(
                    one.map(|p| Circle::new(p, px(pen.width + 1.0), pen.color.filled())),
                )?,
                Mark::Ring => self
                    .chart
                    .draw_series(one.map(|p| Circle::new(p, large, thin)))?,
                Mark::Cross => self.chart.draw_series(one.map(|p| {
                    EmptyElement::at(p)
                        + PathElement::new(
                            vec![(-2 * small, -2 * small), (2 * small, 2 * small)],
                            thin,
                        )
                        + PathElement::new(
                            vec![(-2 * small, 2 * small), (2 * small, -2 * small)],
                            thin,
                        )
                }))?,
            };
        }
        Ok(())
    }

    /// Notes a label for the right margin at a height.
    pub(super) fn label(&mut self, y: f64, text: impl Into<String>, color: RGBColor) {
        if y.is_finite() {
            self.labels.push((y, text.into(), color));
        }
    }

    /// Writes the labels, pushed apart where they would overlap, each with a leader to its line.
    pub(super) fn finish(self) -> Result<(), DrawError> {
        let base = self.area.get_base_pixel();
        let frame = self.chart.plotting_area().get_pixel_range();
        let (right, top, bottom) = (
            frame.0.end - base.0,
            frame.1.start - base.1,
            frame.1.end - base.1,
        );
        let spacing = px(LETTER);
        let mut labels: Vec<(i32, i32, &str, &RGBColor)> = self
            .labels
            .iter()
            .map(|(y, text, color)| {
                let at = self.chart.backend_coord(&(self.x.high(), *y)).1 - base.1;
                (at, at, text.as_str(), color)
            })
            .collect();
        labels.sort_by_key(|label| label.0);
        let mut free = top;
        for label in &mut labels {
            label.1 = label.1.max(free);
            free = label.1 + spacing;
        }
        let mut free = bottom;
        for label in labels.iter_mut().rev() {
            label.1 = label.1.min(free);
            free = label.1 - spacing;
        }
        for (at, shown_at, text, color) in labels {
            let leader = vec![(right + px(1.0), at), (right + px(9.0), shown_at)];
            self.area.draw(&PathElement::new(
                leader,
                color.stroke_width(px(0.75) as u32),
            ))?;
            let place = (f64::from(right) / FINE + 11.0, f64::from(shown_at) / FINE);
            write(
                self.area,
                text,
                place,
                (HPos::Left, VPos::Center),
                color,
                0.9,
            )?;
        }
        Ok(())
    }

    fn visible<'p>(&self, points: &'p [(f64, f64)]) -> impl Iterator<Item = (f64, f64)> + use<'p> {
        let (low, high) = (self.x.low(), self.x.high());
        points
            .iter()
            .copied()
            .filter(move |(x, y)| *x >= low && *x <= high && y.is_finite())
    }
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
