//! A correlation matrix: squares below the diagonal, numbers above it.

use plotters::style::RGBColor;

use super::super::plot::{Matrix, Point};
use super::canvas::{Canvas, HPos, INK, QUIET, VPos, width};

const SIDE: f64 = 880.0;
const DIAGONAL: RGBColor = RGBColor(225, 225, 222);
const FAINT: RGBColor = RGBColor(222, 222, 218);
const POSITIVE: RGBColor = RGBColor(0, 84, 147);
const NEGATIVE: RGBColor = RGBColor(176, 64, 0);
const LETTERS: f64 = 0.9;

/// Draws it and returns the height of the figure.
pub fn draw(on: &mut Canvas, matrix: &Matrix) -> u32 {
    let (names, count) = (&matrix.names, matrix.names.len());
    let widths = names.iter().map(|name| width(name, LETTERS));
    let margin = widths.fold(0.0, f64::max) + 16.0;
    let cell = SIDE / count.max(1) as f64;
    let at = |n: usize| margin + cell * n as f64;
    for (row, name) in names.iter().enumerate() {
        let middle = at(row) + 0.5 * cell;
        on.text(
            name,
            (margin - 8.0, middle),
            (HPos::Right, VPos::Center),
            INK,
            LETTERS,
        );
        on.upright(name, (middle, margin - 8.0), LETTERS);
        for (column, &r) in matrix.values[row].iter().enumerate() {
            let (left, top) = (at(column), at(row));
            let corners = [(left, top), (left + cell, top + cell)];
            if row == column {
                on.rectangle(corners, DIAGONAL);
                continue;
            }
            on.titled(
                &format!("{name}, {}: {}", names[column], hundredths(r)),
                |on| {
                    on.rectangle(corners, tint(r));
                    if row > column {
                        square(on, (left, top), cell, r);
                    } else if r.abs() >= matrix.written {
                        let text = format!("{:.0}", 100.0 * r).replace('-', "−");
                        let place = (left + 0.5 * cell, top + 0.5 * cell);
                        on.text(&text, place, (HPos::Center, VPos::Center), INK, LETTERS);
                    }
                },
            )
        }
    }
    for n in 0..=count {
        let between = n == 0 || n == count || matrix.groups.contains(&n);
        let (color, width) = if between { (QUIET, 1.25) } else { (FAINT, 0.5) };
        on.stroke(&[(at(0), at(n)), (at(count), at(n))], color, width);
        on.stroke(&[(at(n), at(0)), (at(n), at(count))], color, width);
    }
    scale(on, (at(count) + 50.0, margin + 30.0));
    (margin + SIDE + 20.0) as u32
}

fn hundredths(r: f64) -> String {
    format!("{r:+.2}").replace('-', "−").replace("+0.00", "0")
}

/// Blue for positive, orange for negative, white for none.
fn tint(r: f64) -> RGBColor {
    let full = if r < 0.0 {
        [238.0, 150.0, 80.0]
    } else {
        [110.0, 165.0, 215.0]
    };
    let mix = |to: f64| (255.0 + (to - 255.0) * r.abs().clamp(0.0, 1.0)).round() as u8;
    let [red, green, blue] = full.map(mix);
    RGBColor(red, green, blue)
}

/// Its side grows with the magnitude; filled if positive, open if negative.
fn square(on: &mut Canvas, corner: Point, cell: f64, r: f64) {
    let half = 0.5 * (cell - 4.0) * r.abs().clamp(0.0, 1.0);
    if half < 0.75 {
        return;
    }
    let (x, y) = (corner.0 + 0.5 * cell, corner.1 + 0.5 * cell);
    let (left, right, top, bottom) = (x - half, x + half, y - half, y + half);
    if r > 0.0 {
        return on.rectangle([(left, top), (right, bottom)], POSITIVE);
    }
    let corners = [(left, top), (right, top), (right, bottom), (left, bottom)];
    let around: Vec<Point> = corners.into_iter().cycle().take(6).collect();
    on.stroke(&around, NEGATIVE, 1.5)
}

fn scale(on: &mut Canvas, (x, y): Point) {
    let cell = 34.0;
    for n in 0..=8 {
        let r = 1.0 - 0.25 * f64::from(n);
        let corner = (x, y + cell * f64::from(n));
        on.rectangle([corner, (x + cell, corner.1 + cell)], tint(r));
        square(on, corner, cell, r);
        let place = (x + cell + 8.0, corner.1 + 0.5 * cell);
        on.text(
            &hundredths(r),
            place,
            (HPos::Left, VPos::Center),
            INK,
            LETTERS,
        );
    }
}
