//! Both methods side by side, parameter by parameter.

use crate::calibration::{Estimate, ParameterVector, sensor_and_parameter};
use crate::report::prelude::*;

/// Magnitude of each parameter's error by each method, with the σ that it claims.
pub(super) fn errors(methods: &[(&str, &Estimate)], truth: &ParameterVector) -> Plot {
    let form = methods[0].1.form();
    let panel = |group: Group| {
        let mut indices = group.parameters(form);
        indices.retain(|&i| methods.iter().any(|(_, m)| m.covariance[(i, i)] > 0.0));
        if indices.is_empty() {
            return Panel::blank(format!("{}: all fixed", group.title()));
        }
        let series = methods
            .iter()
            .enumerate()
            .flat_map(|(n, (name, estimate))| {
                let (error, sigma) = (estimate.vector() - truth, estimate.sigma());
                let offset = 0.26 * (n as f64 - 0.5 * (methods.len() as f64 - 1.0));
                let places = || {
                    indices
                        .iter()
                        .enumerate()
                        .map(|(k, &i)| (k as f64 + offset, i))
                };
                let unit = group.unit_value();
                let (mark, color) = method_mark(name);
                let whiskers = places().filter(|&(_, i)| sigma[i] > 0.0);
                let whiskers = whiskers.map(|(x, i)| (x, 0.0, sigma[i] / unit)).collect();
                let marks = places().map(|(x, i)| (x, error[i].abs() / unit));
                [
                    Series::new(Shape::Intervals(whiskers))
                        .color(color)
                        .width(1.0),
                    Series::marks(mark, marks)
                        .color(color)
                        .width(2.0)
                        .key(*name),
                ]
            });
        let x = Axis::places(indices.iter().map(|&i| axis_name(form, i)));
        Panel::new(group.titled(), x, Axis::log("")).with_all(series)
    };
    let mut caption = "Magnitude of each parameter's true error, logarithmic. The whisker reaches up to the 1σ \
                       that the method claims: about two marks in three should lie below the top of their \
                       whisker."
        .to_owned();
    if methods.len() == 2 {
        caption += " Open rings: closed form; filled dots: EKF.";
    }
    let heading = "Errors against the truth";
    Plot::new("comparison.svg", heading, (3, 300), Group::all().map(panel)).caption(caption)
}

/// Mark and colour of a method, the same in every figure.
fn method_mark(name: &str) -> (Mark, Color) {
    match name {
        "EKF" => (Mark::Dot, Color::Nth(0)),
        _ => (Mark::Ring, Color::Nth(1)),
    }
}

/// The difference between both methods in its σ.
pub(super) fn differences(closed: &Estimate, filter: &Estimate) -> Plot {
    let form = filter.form();
    let difference = closed.vector() - filter.vector();
    let variance = closed.covariance.diagonal() + filter.covariance.diagonal();
    let points: Vec<(usize, f64)> = filter
        .estimated()
        .filter(|&i| variance[i] > 0.0)
        .map(|i| (i, difference[i] / variance[i].sqrt()))
        .collect();
    let extent = 1.2 * points.iter().map(|point| point.1.abs()).fold(4.0, f64::max);
    let y = match extent > 24.0 {
        true => Axis::symlog(1.0),
        false => Axis::linear(""),
    };
    let sensor = |index: usize| sensor_and_parameter(index).0;
    let panels = points
        .chunk_by(|a, b| sensor(a.0) == sensor(b.0))
        .map(|triad| {
            let x = Axis::places(triad.iter().map(|&(i, _)| short_name(form, i)));
            let stems = triad
                .iter()
                .enumerate()
                .map(|(k, &(_, y))| (k as f64, 0.0, y))
                .collect();
            let marks = triad.iter().enumerate().map(|(k, &(_, y))| (k as f64, y));
            Panel::new(
                "closed form minus EKF, σ",
                x,
                y.clone().between(-extent, extent),
            )
            .with(Series::zero())
            .with_all([-3.0, 3.0].map(|y| {
                Series::level(y)
                    .dashed()
                    .label(if y < 0.0 { "−3σ" } else { "+3σ" })
            }))
            .with(Series::new(Shape::Intervals(stems)).width(1.0))
            .with(Series::marks(Mark::Dot, marks).width(2.5))
        });
    Plot::new("comparison.svg", "Closed form against EKF", (1, 220), panels).caption(
        "Closed form minus EKF in units of the σ of their difference, as if they had no data in common. Dashed: \
         ±3.",
    )
}
