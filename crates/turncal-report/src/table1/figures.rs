//! Figures 2 to 9 of the paper: the curve of every sample, with the mean and standard deviation of all curves.

use super::verdict::title;
use crate::prelude::*;
use turncal::study::Table1;
use turncal::study::table1::{Column, QUANTITIES};

/// Positions of attitude, and of velocity and position, in [`QUANTITIES`].
const ATTITUDE: [usize; 3] = [0, 1, 2];
const MOTION: [usize; 2] = [3, 4];

pub fn figures(table: &Table1) -> Vec<Plot> {
    let of_column = |column: &Column| {
        let [attitude, motion] = column.published.figures;
        let figures = [(attitude, &ATTITUDE[..]), (motion, &MOTION)];
        figures.map(|(number, of)| figure(table, column, number, of))
    };
    table.columns.iter().flat_map(of_column).collect()
}

fn figure(table: &Table1, column: &Column, number: u8, quantities: &[usize]) -> Plot {
    let (triad, form) = (
        triad_name(column.published.sensor),
        column.published.form.name(),
    );
    let errors = match quantities.len() {
        3 => "attitude",
        _ => "velocity and position",
    };
    let heading = format!("Figure {number}: {triad}, {form} form, {errors}");
    let panels = quantities.iter().map(|&of| panel(table, column, of));
    Plot::new(&format!("figure-{number}.svg"), &heading, (1, 230), panels)
        .caption(caption(table, column))
}

fn caption(table: &Table1, column: &Column) -> String {
    let drawn = column.courses.samples.len();
    let samples = if drawn < table.study.samples {
        format!("{drawn} of {} samples", count(table.study.samples))
    } else {
        format!("all {drawn} samples")
    };
    format!(
        "{}, as stated. Thin: errors of {samples}; thick: mean of all; dashed: mean ± one standard deviation. Both \
         forms of a triad are drawn with the same axes.",
        title(column.published)
    )
}

/// Largest drawn magnitude, the same for both forms of the triad.
fn extent(table: &Table1, column: &Column, q: usize) -> f64 {
    let sensor = column.published.sensor;
    let columns = table.columns.iter();
    let courses = columns
        .filter(|column| column.published.sensor == sensor)
        .map(|column| &column.courses);
    let extents = courses.flat_map(|of| {
        let samples = of.samples.iter().flatten().map(|e| e[q].abs());
        let moments = of.moments.iter().map(|m| m[q].mean.abs() + m[q].std);
        samples.chain(moments)
    });
    extents.fold(0.0, f64::max)
}

fn panel(table: &Table1, column: &Column, q: usize) -> Panel {
    let quantity = QUANTITIES[q];
    let extent = 1.05 * extent(table, column, q);
    let signed = quantity.is_component;
    let courses = &column.courses;
    let hours: Vec<f64> = courses.times.iter().map(|t| t / HOUR).collect();
    let line = |values: &mut dyn Iterator<Item = f64>| {
        let lowest = if signed { f64::NEG_INFINITY } else { 0.0 };
        Series::line(
            hours
                .iter()
                .copied()
                .zip(values.map(|value| value.max(lowest))),
        )
    };
    let samples = courses.samples.iter().map(|sample| {
        let line = line(&mut sample.iter().map(|errors| errors[q]));
        line.nth(3).width(0.4)
    });
    let means = [(1.0, "mean + σ"), (-1.0, "mean − σ"), (0.0, "mean")].map(|(sign, name)| {
        let values = courses.moments.iter().map(|moments| moments[q]);
        let series = line(&mut values.map(|m| m.mean + sign * m.std)).color(Color::Ink);
        let series = if sign == 0.0 {
            series.width(2.25)
        } else {
            series.width(1.25).dashed()
        };
        series.label(name)
    });
    let (kind, low) = if signed {
        ("error", -extent)
    } else {
        ("error, horizontal", 0.0)
    };
    let title = format!("{} {kind}, {}", quantity.short(), quantity.unit());
    let end = hours.last().copied().unwrap_or(1.0);
    let x = Axis::linear("time, h").between(0.0, end);
    Panel::new(title, x, Axis::linear("").between(low, extent))
        .with_all(samples)
        .with_all(means)
}
