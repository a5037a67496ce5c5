//! Correlations between the estimated parameters.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::canvas::{Area, DrawError, INK, QUIET, font, px, write};
use super::group::{Group, short_name};
use super::{Figure, ReportError};
use crate::calibration::Estimate;

const LEFT: f64 = 124.0;
const TOP: f64 = 92.0;
/// Weaker than this a number would only hide the strong ones.
const WRITTEN: f64 = 0.2;

/// Squares below the diagonal, numbers above it; `None` if nothing was estimated.
pub(super) fn figure(estimate: &Estimate) -> Result<Option<Figure>, ReportError> {
    let indices: Vec<usize> = estimate.estimated().collect();
    if indices.is_empty() {
        return Ok(None);
    }
    let sigma = estimate.sigma();
    let correlation = |i: usize, j: usize| estimate.covariance[(i, j)] / (sigma[i] * sigma[j]);
    let cell = 880.0 / indices.len() as f64;
    let side = cell * indices.len() as f64;
    let at = |n: usize, origin: f64| origin + cell * n as f64;
    let caption = format!(
        "Correlation of the estimated parameters. Below the diagonal the side of a square grows with \
         the magnitude; filled squares are positive, open ones negative. Above it stands the \
         coefficient in hundredths where its magnitude is at least {WRITTEN}. Strongly correlated \
         parameters were seen by this path as a sum or difference rather than each alone."
    );
    let size = (1200, (TOP + side + 20.0) as u32);
    let figure = Figure::draw("correlation.svg", "Correlations", caption, size, |area| {
        for (row, &i) in indices.iter().enumerate() {
            let name = short_name(estimate.form(), i);
            let middle = at(row, 0.5 * cell);
            write(
                area,
                &name,
                (LEFT - 8.0, TOP + middle),
                (HPos::Right, VPos::Center),
                &INK,
                0.9,
            )?;
            write_upright(area, &name, (LEFT + middle, TOP - 8.0))?;
            for (column, &j) in indices.iter().enumerate() {
                let corner = (at(column, LEFT), at(row, TOP));
                let r = correlation(i, j);
                let frame = [to_px(corner), to_px((corner.0 + cell, corner.1 + cell))];
                area.draw(&Rectangle::new(frame, tint(r).filled()))?;
                if row > column {
                    square(area, corner, cell, r)?;
                } else if row == column {
                    area.draw(&Rectangle::new(frame, RGBColor(225, 225, 222).filled()))?;
                } else if r.abs() >= WRITTEN {
                    let text = format!("{:.0}", 100.0 * r).replace('-', "−");
                    let place = (corner.0 + 0.5 * cell, corner.1 + 0.5 * cell);
                    write(area, &text, place, (HPos::Center, VPos::Center), &INK, 0.9)?;
                }
            }
        }
        for n in 0..=indices.len() {
            // A strong line between groups, a faint one between parameters.
            let between =
                n == 0 || n == indices.len() || Group::of(indices[n - 1]) != Group::of(indices[n]);
            let style = if between {
                QUIET.stroke_width(px(1.25) as u32)
            } else {
                RGBColor(222, 222, 218).stroke_width(px(0.5) as u32)
            };
            let (x, y) = (at(n, LEFT), at(n, TOP));
            for ends in [[(LEFT, y), (LEFT + side, y)], [(x, TOP), (x, TOP + side)]] {
                area.draw(&PathElement::new(ends.map(to_px).to_vec(), style))?;
            }
        }
        scale_bar(area, (LEFT + side + 50.0, TOP + 30.0))
    })?;
    Ok(Some(figure))
}

fn to_px((x, y): (f64, f64)) -> (i32, i32) {
    (px(x), px(y))
}

/// Blue for positive, orange for negative, white for none.
fn tint(r: f64) -> RGBColor {
    let full = if r < 0.0 {
        (238.0, 150.0, 80.0)
    } else {
        (110.0, 165.0, 215.0)
    };
    let weight = r.abs().clamp(0.0, 1.0);
    let mix = |to: f64| (255.0 + (to - 255.0) * weight).round() as u8;
    RGBColor(mix(full.0), mix(full.1), mix(full.2))
}

fn square(area: &Area, corner: (f64, f64), cell: f64, r: f64) -> Result<(), DrawError> {
    let half = 0.5 * (cell - 4.0) * r.abs().clamp(0.0, 1.0);
    if half < 0.75 {
        return Ok(());
    }
    let (x, y) = (corner.0 + 0.5 * cell, corner.1 + 0.5 * cell);
    let ends = [to_px((x - half, y - half)), to_px((x + half, y + half))];
    if r > 0.0 {
        area.draw(&Rectangle::new(ends, RGBColor(0, 84, 147).filled()))
    } else {
        let outline = vec![
            ends[0],
            (ends[1].0, ends[0].1),
            ends[1],
            (ends[0].0, ends[1].1),
            ends[0],
            (ends[1].0, ends[0].1),
        ];
        let style = RGBColor(176, 64, 0).stroke_width(px(1.5) as u32);
        area.draw(&PathElement::new(outline, style))
    }
}

fn write_upright(area: &Area, text: &str, (x, y): (f64, f64)) -> Result<(), DrawError> {
    let style = font(0.9)
        .transform(FontTransform::Rotate270)
        .color(&INK)
        .pos(Pos::new(HPos::Left, VPos::Center));
    area.draw(&Text::new(text.to_owned(), to_px((x, y)), style))
}

fn scale_bar(area: &Area, (x, y): (f64, f64)) -> Result<(), DrawError> {
    let cell = 34.0;
    for (n, r) in [1.0, 0.75, 0.5, 0.25, 0.0, -0.25, -0.5, -0.75, -1.0]
        .into_iter()
        .enumerate()
    {
        let corner = (x, y + cell * n as f64);
        let frame = [to_px(corner), to_px((corner.0 + cell, corner.1 + cell))];
        area.draw(&Rectangle::new(frame, tint(r).filled()))?;
        square(area, corner, cell, r)?;
        let text = format!("{r:+.2}").replace('-', "−").replace("+0.00", "0");
        let place = (x + cell + 8.0, corner.1 + 0.5 * cell);
        write(area, &text, place, (HPos::Left, VPos::Center), &INK, 0.9)?;
    }
    Ok(())
}
