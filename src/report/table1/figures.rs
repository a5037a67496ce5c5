//! The paper's Figures 2 to 9: every sample's course, their mean and standard deviation.

use super::super::axis::Axis;
use super::super::canvas::{Area, DrawError, INK, Pen};
use super::super::number::count;
use super::super::panel::{Margins, Panel};
use super::super::{Figure, ReportError};
use super::tables::title;
use crate::study::Table1;
use crate::study::table1::paper::Published;
use crate::study::table1::{Column, Quantity};

const HOUR: f64 = 3600.0;
/// Height of a panel.
const HEIGHT: u32 = 230;
/// A course that stays within this part of its axis is a straight line.
const FLAT: f64 = 1e-4;

const ATTITUDE: [Quantity; 3] = [Quantity::Pitch, Quantity::Roll, Quantity::Heading];
const MOTION: [Quantity; 2] = [Quantity::Velocity, Quantity::Position];

pub(super) fn figures(table: &Table1) -> Result<Vec<Figure>, ReportError> {
    let mut figures = Vec::new();
    for column in &table.columns {
        for (number, quantities) in column
            .published
            .figures
            .into_iter()
            .zip([&ATTITUDE[..], &MOTION])
        {
            figures.push(figure(table, column, number, quantities)?);
        }
    }
    Ok(figures)
}

/// File and heading of a figure of the paper's.
fn names(number: u8) -> (&'static str, &'static str) {
    match number {
        2 => ("figure-2.svg", "Figure 2: gyros, six-angle form, attitude"),
        3 => (
            "figure-3.svg",
            "Figure 3: gyros, six-angle form, velocity and position",
        ),
        4 => (
            "figure-4.svg",
            "Figure 4: gyros, three-angle form, attitude",
        ),
        5 => (
            "figure-5.svg",
            "Figure 5: gyros, three-angle form, velocity and position",
        ),
        6 => (
            "figure-6.svg",
            "Figure 6: accelerometers, six-angle form, attitude",
        ),
        7 => (
            "figure-7.svg",
            "Figure 7: accelerometers, six-angle form, velocity and position",
        ),
        8 => (
            "figure-8.svg",
            "Figure 8: accelerometers, three-angle form, attitude",
        ),
        _ => (
            "figure-9.svg",
            "Figure 9: accelerometers, three-angle form, velocity and position",
        ),
    }
}

fn figure(
    table: &Table1,
    column: &Column,
    number: u8,
    quantities: &[Quantity],
) -> Result<Figure, ReportError> {
    let (file, heading) = names(number);
    let size = (1200, HEIGHT * quantities.len() as u32);
    Figure::draw(
        file,
        heading,
        caption(table, column, quantities),
        size,
        |area| {
            for (&quantity, area) in quantities
                .iter()
                .zip(area.split_evenly((quantities.len(), 1)))
            {
                panel(&area, table, column, quantity)?;
            }
            Ok(())
        },
    )
}

fn caption(table: &Table1, column: &Column, quantities: &[Quantity]) -> String {
    let drawn = column.courses.samples.len();
    let mut text = format!("{}, as stated: errors of ", title(column.published));
    text.push_str(&if drawn < table.study.samples {
        format!("{drawn} of {} samples", count(table.study.samples))
    } else {
        format!("all {drawn} samples")
    });
    text.push_str(
        " thin, mean of all thick, mean ± one standard deviation dashed. The axes are the same for both \
         forms of a triad.",
    );
    if flat(table, column, quantities) {
        let largest: Vec<String> = quantities
            .iter()
            .map(|&q| {
                let largest = extent(column, q) / q.unit_value();
                format!("{} {largest:.0e} {}", q.name(), q.unit())
            })
            .collect();
        text.push_str(&format!(
            " Nothing is left but rounding; largest: {}.",
            largest.join(", ")
        ));
    }
    text
}

fn flat(table: &Table1, column: &Column, quantities: &[Quantity]) -> bool {
    quantities
        .iter()
        .all(|&q| extent(column, q) < FLAT * common_extent(table, column.published, q))
}

/// Largest size of what is drawn of a column.
fn extent(column: &Column, quantity: Quantity) -> f64 {
    let q = quantity as usize;
    let samples = column.courses.samples.iter().flatten().map(|e| e[q].abs());
    let moments = column.courses.moments.iter();
    samples
        .chain(moments.map(|m| m[q].mean.abs() + m[q].std))
        .fold(0.0, f64::max)
}

/// The same over both forms of the triad.
fn common_extent(table: &Table1, published: &Published, quantity: Quantity) -> f64 {
    let columns = table.columns.iter();
    columns
        .filter(|column| column.published.sensor == published.sensor)
        .map(|column| extent(column, quantity))
        .fold(0.0, f64::max)
}

fn panel(
    area: &Area,
    table: &Table1,
    column: &Column,
    quantity: Quantity,
) -> Result<(), DrawError> {
    let unit = quantity.unit_value();
    let q = quantity as usize;
    let extent = 1.05 * common_extent(table, column.published, quantity) / unit;
    let signed = ATTITUDE.contains(&quantity);
    let courses = &column.courses;
    let hours: Vec<f64> = courses.times.iter().map(|t| t / HOUR).collect();
    let line = |values: &mut dyn Iterator<Item = f64>| -> Vec<(f64, f64)> {
        let lowest = if signed { f64::NEG_INFINITY } else { 0.0 };
        let values = values.map(|value| (value / unit).max(lowest));
        straight(hours.iter().copied().zip(values).collect(), FLAT * extent)
    };
    let last = hours.last().copied().unwrap_or(1.0);
    let low = if signed { -extent } else { 0.0 };
    let step = [1.0, 2.0, 4.0, 8.0, 24.0, 48.0]
        .into_iter()
        .find(|step| last / step <= 12.0);
    let x = match step {
        Some(step) if last >= 4.0 => Axis::stepped(0.0, last, step),
        _ => Axis::linear(0.0, last),
    };
    let kind = if signed { "error" } else { "error, horizontal" };
    let mut panel = Panel::new(
        area,
        &format!("{} {kind}, {}", quantity.name(), quantity.unit()),
        Margins {
            left: 64.0,
            right: 96.0,
        },
        (x, Axis::linear(low, extent)),
        "time, h",
        &[],
    )?;
    for sample in &courses.samples {
        let course = line(&mut sample.iter().map(|errors| errors[q]));
        panel.line(&course, Pen::nth(3, 0.4))?;
    }
    let moments = || courses.moments.iter().map(|moments| moments[q]);
    let mut labels = Vec::new();
    for (sign, name) in [(1.0, "mean + σ"), (-1.0, "mean − σ"), (0.0, "mean")] {
        let course = line(&mut moments().map(|m| m.mean + sign * m.std));
        let pen = if sign == 0.0 {
            Pen::solid(INK, 2.25)
        } else {
            Pen::dashed(INK, 1.25)
        };
        panel.line(&course, pen)?;
        labels.extend(course.last().map(|end| (end.1, name, pen.color)));
    }
    if flat(table, column, &[quantity]) {
        panel.label(0.0, "all samples", INK);
    } else {
        for (y, name, color) in labels {
            panel.label(y, name, color);
        }
    }
    panel.finish()
}

/// A line that stays within a height, as its ends.
fn straight(points: Vec<(f64, f64)>, height: f64) -> Vec<(f64, f64)> {
    match (points.first(), points.last()) {
        (Some(&first), Some(&last)) if points.iter().all(|p| (p.1 - first.1).abs() < height) => {
            vec![first, last]
        }
        _ => points,
    }
}
