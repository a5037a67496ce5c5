//! Figures 2 to 9 of the paper: the curve of every sample, their mean and standard deviation.

use super::verdict::title;
use crate::imu::{InstallationForm, Sensor};
use crate::report::prelude::*;
use crate::study::Table1;
use crate::study::table1::{Column, Quantity};

/// A curve within this fraction of its axis is drawn as a straight line.
const FLAT: f64 = 1e-4;

const ATTITUDE: [Quantity; 3] = [Quantity::Pitch, Quantity::Roll, Quantity::Heading];
const MOTION: [Quantity; 2] = [Quantity::Velocity, Quantity::Position];

pub fn figures(table: &Table1) -> Vec<Plot> {
    let of_column = |column: &Column| {
        let [attitude, motion] = column.published.figures;
        let figures = [(attitude, &ATTITUDE[..]), (motion, &MOTION)];
        figures.map(|(number, of)| figure(table, column, number, of))
    };
    table.columns.iter().flat_map(of_column).collect()
}

fn figure(table: &Table1, column: &Column, number: u8, quantities: &[Quantity]) -> Plot {
    let sensor = match column.published.sensor {
        Sensor::Gyro => "gyros",
        Sensor::Accel => "accelerometers",
    };
    let form = match column.published.form {
        InstallationForm::ThreeAngle => "three-angle",
        _ => "six-angle",
    };
    let errors = match quantities.len() {
        3 => "attitude",
        _ => "velocity and position",
    };
    let heading = format!("Figure {number}: {sensor}, {form} form, {errors}");
    let panels = quantities.iter().map(|&of| panel(table, column, of));
    Plot::new(&format!("figure-{number}.svg"), &heading, (1, 230), panels)
        .caption(caption(table, column, quantities))
}

fn caption(table: &Table1, column: &Column, quantities: &[Quantity]) -> String {
    let drawn = column.courses.samples.len();
    let samples = match drawn < table.study.samples {
        true => format!("{drawn} of {} samples", count(table.study.samples)),
        false => format!("all {drawn} samples"),
    };
    let mut text = format!(
        "{}, as stated. Thin: errors of {samples}; thick: mean of all; dashed: mean ± one standard deviation. Both \
         forms of a triad have the same axes.",
        title(column.published)
    );
    if quantities.iter().all(|&q| flat(table, column, q)) {
        let largest = quantities.iter().map(|&q| {
            let largest = extent(column, q) / q.unit_value();
            format!("{} {largest:.0e} {}", q.name(), q.unit())
        });
        let largest = largest.collect::<Vec<_>>().join(", ");
        text += &format!(" Only rounding errors remain; largest: {largest}.");
    }
    text
}

fn flat(table: &Table1, column: &Column, quantity: Quantity) -> bool {
    extent(column, quantity) < FLAT * common_extent(table, column, quantity)
}

/// Largest drawn magnitude of a column.
fn extent(column: &Column, quantity: Quantity) -> f64 {
    let q = quantity as usize;
    let samples = column.courses.samples.iter().flatten().map(|e| e[q].abs());
    let moments = column.courses.moments.iter();
    let moments = moments.map(|m| m[q].mean.abs() + m[q].std);
    samples.chain(moments).fold(0.0, f64::max)
}

/// The same over both forms of the triad.
fn common_extent(table: &Table1, column: &Column, quantity: Quantity) -> f64 {
    let sensor = column.published.sensor;
    let columns = table.columns.iter();
    let columns = columns.filter(|column| column.published.sensor == sensor);
    let extents = columns.map(|column| extent(column, quantity));
    extents.fold(0.0, f64::max)
}

fn panel(table: &Table1, column: &Column, quantity: Quantity) -> Panel {
    let (unit, q) = (quantity.unit_value(), quantity as usize);
    let extent = 1.05 * common_extent(table, column, quantity) / unit;
    let signed = ATTITUDE.contains(&quantity);
    let courses = &column.courses;
    let hours: Vec<f64> = courses.times.iter().map(|t| t / HOUR).collect();
    let line = |values: &mut dyn Iterator<Item = f64>| {
        let lowest = if signed { f64::NEG_INFINITY } else { 0.0 };
        let values = values.map(|value| (value / unit).max(lowest));
        let points = hours.iter().copied().zip(values).collect();
        Series::line(straight(points, FLAT * extent))
    };
    let samples = courses.samples.iter().map(|sample| {
        let line = line(&mut sample.iter().map(|errors| errors[q]));
        line.nth(3).width(0.4)
    });
    let flat = flat(table, column, quantity);
    let means = [(1.0, "mean + σ"), (-1.0, "mean − σ"), (0.0, "mean")].map(|(sign, name)| {
        let values = courses.moments.iter().map(|moments| moments[q]);
        let series = line(&mut values.map(|m| m.mean + sign * m.std)).color(Color::Ink);
        let series = match sign == 0.0 {
            true => series.width(2.25),
            false => series.width(1.25).dashed(),
        };
        match (flat, sign == 0.0) {
            (false, _) => series.label(name),
            (true, true) => series.label("all samples"),
            (true, false) => series,
        }
    });
    let (kind, low) = match signed {
        true => ("error", -extent),
        false => ("error, horizontal", 0.0),
    };
    let title = format!("{} {kind}, {}", quantity.name(), quantity.unit());
    let x = Axis::hours(hours.last().copied().unwrap_or(1.0));
    Panel::new(title, x, Axis::linear("").between(low, extent))
        .with_all(samples)
        .with_all(means)
}

/// A line that stays within a height, as its ends.
fn straight(points: Vec<Point>, height: f64) -> Vec<Point> {
    match (points.first(), points.last()) {
        (Some(&first), Some(&last)) if points.iter().all(|p| (p.1 - first.1).abs() < height) => {
            vec![first, last]
        }
        _ => points,
    }
}
