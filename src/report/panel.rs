//! A panel: axes with a title, and what is drawn into them.

use std::ops::Range;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::axis::Axis;
use super::canvas::{
    Area, BAND, DWELL, DrawError, FINE, GRID, INK, LETTER, Pen, QUIET, font, px, write,
};
use super::group::Group;

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
    /// Lays out a panel and shades the dwells.
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
            .label_style(font(0.95).color(&INK))
            .axis_desc_style(font(0.95).color(&INK))
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

    /// Writes text beside a point, moved by some shown pixels to the right and down.
    pub(super) fn text(
        &self,
        point: (f64, f64),
        (right, down): (f64, f64),
        text: &str,
        anchor: (HPos, VPos),
    ) -> Result<(), DrawError> {
        let (at, base) = (self.chart.backend_coord(&point), self.area.get_base_pixel());
        let place = (
            f64::from(at.0 - base.0) / FINE + right,
            f64::from(at.1 - base.1) / FINE + down,
        );
        write(self.area, text, place, anchor, &INK, 0.95)
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
        let mut labels: Vec<(i32, &str, &RGBColor)> = self
            .labels
            .iter()
            .map(|(y, text, color)| {
                let at = self.chart.backend_coord(&(self.x.high(), *y)).1 - base.1;
                (at, text.as_str(), color)
            })
            .collect();
        labels.sort_by_key(|label| label.0);
        let heights: Vec<i32> = labels.iter().map(|label| label.0).collect();
        let apart = spread(&heights, top..bottom, px(LETTER));
        for ((at, text, color), shown_at) in labels.into_iter().zip(apart) {
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
                0.95,
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

/// In the place of a group of which nothing was estimated.
pub(super) fn all_fixed(area: &Area, group: Group) -> Result<(), DrawError> {
    let text = format!("{}: all fixed", group.title());
    write(area, &text, (56.0, 6.0), (HPos::Left, VPos::Top), &INK, 1.0)
}

/// Ascending heights moved until they are `spacing` apart, within the frame while there is room.
fn spread(heights: &[i32], frame: Range<i32>, spacing: i32) -> Vec<i32> {
    let mut heights = heights.to_vec();
    let mut free = frame.start;
    for height in &mut heights {
        *height = (*height).max(free);
        free = *height + spacing;
    }
    let mut free = frame.end;
    for height in heights.iter_mut().rev() {
        *height = (*height).min(free);
        free = *height - spacing;
    }
    heights
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_never_overlap_and_stay_where_there_is_room() {
        assert_eq!(spread(&[100, 300, 500], 0..600, 20), [100, 300, 500]);
        for heights in [[0, 0, 0, 0], [590, 595, 600, 600], [299, 300, 300, 301]] {
            let apart = spread(&heights, 0..600, 20);
            assert!(
                apart.windows(2).all(|pair| pair[1] - pair[0] >= 20),
                "{apart:?}"
            );
            assert!(
                apart.iter().all(|height| (0..=600).contains(height)),
                "{apart:?}"
            );
        }
    }
}
