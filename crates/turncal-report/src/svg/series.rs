//! One series in its frame.

use plotters::style::RGBColor;

use super::super::plot::{Anchor, Axis, Mark, Pen, Point, Series, Shape, Upright, thinned};
use super::canvas::{BAND, Canvas, Frame, HPos, SMALL, VPos, rgb, width};
use turncal::number::three_digits;

/// Half the width of a cap, in pixels.
const CAP: f64 = 4.0;
/// Maximum number of marks with hover texts.
const HOVERED: usize = 500;

pub fn draw(on: &mut Canvas, frame: &Frame, series: &Series) {
    let (pen, color) = (series.pen, rgb(series.pen.color));
    let (left, right) = frame.across;
    match &series.shape {
        Shape::Line(points) => {
            // Two points per pixel look the same as all points.
            let most = 2.0 * (right - left).max(1.0);
            line(
                on,
                frame,
                &thinned(points.iter().copied(), most as usize),
                pen,
            )
        }
        Shape::Band(lower, upper) => {
            let [lower, upper] = [lower, upper].map(|edge| visible(frame, edge));
            let outline = upper.into_iter().chain(lower.into_iter().rev());
            let outline = placed(frame, outline);
            if outline.len() > 2 {
                on.area(&outline, BAND);
            }
        }
        Shape::Marks(mark, points) => marks(on, frame, series, *mark, points),
        Shape::Bars(half, of) => bars(on, frame, series, *half, of),
        Shape::Level(y) => {
            let y = frame.at_y(*y);
            on.line(&[(left, y), (right, y)], pen)
        }
        Shape::Words(at, anchor, text) => {
            let (x, y) = frame.at(*at);
            let (at, lie) = match anchor {
                Anchor::Above => ((x, y - 5.0), (HPos::Center, VPos::Bottom)),
                Anchor::Below => ((x, y + 5.0), (HPos::Center, VPos::Top)),
                Anchor::Middle => ((x, y), (HPos::Center, VPos::Center)),
            };
            // In a small matrix cell, words would cover those of its neighbours.
            if *anchor != Anchor::Middle || frame.x.step(right - left) > width(text, SMALL) {
                on.text(text, at, lie, color, SMALL)
            }
        }
    }
}

fn marks(
    on: &mut Canvas,
    frame: &Frame,
    series: &Series,
    mark: Mark,
    points: &[(Point, (f64, f64))],
) {
    let is_hovered = points.len() <= HOVERED && !frame.panel.x.is_bare;
    for &(at, ends) in points {
        if visible(frame, &[at]).is_empty() {
            continue;
        }
        let drawn = |on: &mut Canvas| {
            if ends.0 < ends.1 {
                whisker(on, frame, (at.0, ends), rgb(series.pen.color));
            }
            marked(on, frame.at(at), mark, series.pen)
        };
        if is_hovered {
            on.titled(&hover(frame, series, at, ends), drawn)
        } else {
            drawn(on)
        }
    }
}

fn bars(on: &mut Canvas, frame: &Frame, series: &Series, half: f64, bars: &[Upright]) {
    let drawn = |of: &&Upright| of.2.is_finite() && of.1 != of.2;
    for &(x, low, high) in bars.iter().filter(drawn) {
        let corners = [frame.at((x - half, low)), frame.at((x + half, high))];
        // Bars are stacked, so the height is that of each bar alone.
        let height = high - low;
        let text = hover(frame, series, (x, height), (height, height));
        on.titled(&text, |on| on.rectangle(corners, rgb(series.pen.color)))
    }
}

/// Name, abscissa, ordinate and interval of a point.
fn hover(frame: &Frame, series: &Series, (x, y): Point, (low, high): (f64, f64)) -> String {
    let panel = frame.panel;
    let of = |axis: &Axis, title: &str, value: f64| match axis.places.get(value.round() as usize) {
        Some(place) => place.clone(),
        None if title.is_empty() => three_digits(value),
        None => format!("{title}: {}", three_digits(value)),
    };
    let name = series.key.iter().chain(&series.label).cloned();
    let mut lines: Vec<String> = name.collect();
    lines.push(of(&panel.x, &panel.x.title, x));
    let mut height = of(&panel.y, &panel.title, y);
    if low.is_finite() && low < high {
        height += &format!(" ({} … {})", three_digits(low), three_digits(high));
    }
    lines.push(height);
    lines.join("\n")
}

/// A vertical line with a cap at each end.
fn whisker(on: &mut Canvas, frame: &Frame, (x, (low, high)): (f64, (f64, f64)), color: RGBColor) {
    let ends = [frame.at((x, low)), frame.at((x, high))];
    on.stroke(&ends, color, 1.0);
    for (x, y) in ends {
        on.stroke(&[(x - CAP, y), (x + CAP, y)], color, 1.0);
    }
}

/// Points joined except across missing values; a single point is a dot.
fn line(on: &mut Canvas, frame: &Frame, points: &[Point], pen: Pen) {
    let is_point = |p: &Point| p.0.is_finite() && p.1.is_finite();
    for piece in points.split(|p| !is_point(p)) {
        match placed(frame, visible(frame, piece))[..] {
            [] => {}
            [alone] => marked(on, alone, Mark::Dot, Pen { width: 0.5, ..pen }),
            ref piece => on.line(piece, pen),
        }
    }
}

/// Points with a numeric abscissa.
fn visible(frame: &Frame, points: &[Point]) -> Vec<Point> {
    let across = frame.x.low..=frame.x.high;
    let points = points.iter().copied();
    points
        .filter(|(x, y)| across.contains(x) && y.is_finite())
        .collect()
}

fn placed(frame: &Frame, points: impl IntoIterator<Item = Point>) -> Vec<Point> {
    points.into_iter().map(|point| frame.at(point)).collect()
}

fn marked(on: &mut Canvas, at: Point, mark: Mark, pen: Pen) {
    let color = rgb(pen.color);
    let (x, y) = at;
    match mark {
        Mark::Dot => on.circle(at, pen.width + 1.0, color, None),
        Mark::Ring => on.circle(at, 4.5, color, Some(pen.width)),
        Mark::Cross => {
            on.stroke(&[(x - 4.0, y - 4.0), (x + 4.0, y + 4.0)], color, pen.width);
            on.stroke(&[(x - 4.0, y + 4.0), (x + 4.0, y - 4.0)], color, pen.width)
        }
    }
}
