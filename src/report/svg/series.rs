//! One series in its frame.

use plotters::style::text_anchor::{HPos, VPos};

use super::super::plot::{Anchor, Mark, Pen, Point, Series, Shape};
use super::canvas::{BAND, Canvas, Frame, SMALL, rgb};

/// Half the width of a cap, in pixels.
const CAP: f64 = 4.0;
/// Points of a line for each pixel of its panel; more would not show.
const POINTS: f64 = 1.5;

pub fn draw(on: &Canvas, frame: &Frame, series: &Series) {
    let (pen, color) = (series.pen, rgb(series.pen.color));
    let ((left, right), (top, bottom)) = (frame.across, frame.down);
    match &series.shape {
        Shape::Line(points) => line(on, frame, points, pen),
        Shape::Band(lower, upper) => band(on, frame, lower, upper),
        Shape::Marks(mark, points) => {
            let points = placed(frame, &visible(frame, points));
            points.into_iter().for_each(|at| marked(on, at, *mark, pen))
        }
        Shape::Intervals(of) => of
            .iter()
            .filter(|(_, low, high)| low.is_finite() && high.is_finite())
            .for_each(|&of| interval(on, frame, of, pen)),
        Shape::Bars {
            tops,
            half,
            base,
            filled,
        } => tops
            .iter()
            .filter(|top| top.1.is_finite())
            .for_each(|&(x, top)| {
                let foot = base.unwrap_or(frame.y.low);
                let corners = corners(frame, x, *half, (foot, top));
                if *filled {
                    on.area(&corners, BAND);
                }
                on.stroke(&corners, color, pen.width)
            }),
        Shape::Blocks(half, of) => of
            .iter()
            .filter(|(_, low, high)| low.is_finite() && high > low)
            .for_each(|&(x, low, high)| on.area(&corners(frame, x, *half, (low, high)), color)),
        Shape::Level(y) => {
            let y = frame.at_y(*y);
            on.line(&[(left, y), (right, y)], pen)
        }
        Shape::Upright(x) => {
            let (x, _) = frame.at((*x, frame.y.low));
            on.line(&[(x, top), (x, bottom)], pen)
        }
        Shape::Words {
            at,
            shift,
            anchor,
            text,
        } => {
            let (x, y) = frame.at(*at);
            let anchor = match anchor {
                Anchor::Above => (HPos::Center, VPos::Bottom),
                Anchor::Below => (HPos::Center, VPos::Top),
                Anchor::AboveLeft => (HPos::Right, VPos::Bottom),
            };
            on.text(text, (x + shift.0, y + shift.1), anchor, color, SMALL)
        }
    }
}

fn band(on: &Canvas, frame: &Frame, lower: &[Point], upper: &[Point]) {
    let limit = (POINTS * (frame.across.1 - frame.across.0)) as usize;
    let lower = thinned(&visible(frame, lower), limit);
    let mut outline = thinned(&visible(frame, upper), limit);
    outline.extend(lower.into_iter().rev());
    match outline.len() {
        0..=2 => {}
        _ => on.area(&placed(frame, &outline), BAND),
    }
}

/// An upright line from low to high with a cap at each end.
fn interval(on: &Canvas, frame: &Frame, (x, low, high): (f64, f64, f64), pen: Pen) {
    let color = rgb(pen.color);
    let ends = [frame.at((x, low)), frame.at((x, high))];
    on.stroke(&ends, color, pen.width);
    ends.into_iter()
        .for_each(|(x, y)| on.stroke(&[(x - CAP, y), (x + CAP, y)], color, pen.width))
}

/// Corners of a bar about `x`: up on its left, across, and down on its right.
fn corners(frame: &Frame, x: f64, half: f64, (foot, top): (f64, f64)) -> [Point; 4] {
    let corners = [
        (x - half, foot),
        (x - half, top),
        (x + half, top),
        (x + half, foot),
    ];
    corners.map(|corner| frame.at(corner))
}

/// Points joined between those that are no numbers; a point alone is a dot.
fn line(on: &Canvas, frame: &Frame, points: &[Point], pen: Pen) {
    let limit = POINTS * (frame.across.1 - frame.across.0);
    let is_point = |p: &Point| p.0.is_finite() && p.1.is_finite();
    for piece in points.split(|p| !is_point(p)) {
        let piece = visible(frame, piece);
        let share = limit * piece.len() as f64 / points.len() as f64;
        let piece = placed(frame, &thinned(&piece, share as usize));
        match piece[..] {
            [] => {}
            [alone] => marked(on, alone, Mark::Dot, Pen { width: 0.5, ..pen }),
            _ => on.line(&piece, pen),
        }
    }
}

/// What lies on the horizontal axis and is a number.
fn visible(frame: &Frame, points: &[Point]) -> Vec<Point> {
    let (low, high) = (frame.x.low, frame.x.high);
    let points = points.iter().copied();
    points
        .filter(|(x, y)| *x >= low && *x <= high && y.is_finite())
        .collect()
}

fn placed(frame: &Frame, points: &[Point]) -> Vec<Point> {
    points.iter().map(|&point| frame.at(point)).collect()
}

fn marked(on: &Canvas, at: Point, mark: Mark, pen: Pen) {
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

/// About `limit` points of a line, the lowest and the highest of each stretch.
pub fn thinned(points: &[Point], limit: usize) -> Vec<Point> {
    if points.len() <= limit.max(2) {
        return points.to_vec();
    }
    let stretch = (2 * points.len()).div_ceil(limit.max(2));
    let ends = |chunk: &[Point]| {
        let by_height = |a: &&Point, b: &&Point| a.1.total_cmp(&b.1);
        let ends = [
            chunk.iter().min_by(by_height),
            chunk.iter().max_by(by_height),
        ];
        let mut ends: Vec<Point> = ends.into_iter().flatten().copied().collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        ends.dedup();
        ends
    };
    let mut thin: Vec<Point> = points.chunks(stretch).flat_map(ends).collect();
    // The end is what the line's name points to.
    thin.extend(points.last().filter(|last| thin.last() != Some(last)));
    thin
}
