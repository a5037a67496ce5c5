//! Closed form against filter against truth, parameter by parameter.

use super::axis::Axis;
use super::canvas::{Area, DrawError, INK, Pen, QUIET};
use super::group::{Group, axis_name, short_name};
use super::panel::{Margins, Mark, Panel, all_fixed};
use super::{Figure, Report, ReportError};
use crate::calibration::Estimate;
use crate::calibration::{ParameterVector, sensor_and_parameter};

/// Errors of each method against the truth, or the difference between the methods where the truth is
/// not known; `None` if there is neither a truth nor a second method.
pub(super) fn figure(report: &Report) -> Result<Option<Figure>, ReportError> {
    match (report.truth_vector(), report.methods().as_slice()) {
        (_, []) => Ok(None),
        (Some(truth), methods) => errors(methods, &truth).map(Some),
        (None, &[(_, closed), (_, filter)]) => differences(closed, filter).map(Some),
        (None, _) => Ok(None),
    }
}

fn errors(methods: &[(&str, &Estimate)], truth: &ParameterVector) -> Result<Figure, ReportError> {
    let mut caption = String::from(
        "Magnitude of each parameter's true error, logarithmic. The whisker reaches up to the 1σ that \
         the method claims: about two marks in three should lie below the top of their whisker.",
    );
    if methods.len() == 2 {
        caption.push_str(" Open rings: closed form; filled dots: EKF.");
    }
    Figure::draw(
        "comparison.svg",
        "Errors against the truth",
        caption,
        (1200, 600),
        |area| {
            for (group, area) in Group::all().zip(area.split_evenly((2, 3))) {
                error_panel(&area, group, methods, truth)?;
            }
            Ok(())
        },
    )
}

fn error_panel(
    area: &Area,
    group: Group,
    methods: &[(&str, &Estimate)],
    truth: &ParameterVector,
) -> Result<(), DrawError> {
    let Some(&(_, first)) = methods.first() else {
        return Ok(());
    };
    let form = first.form();
    let mut indices = group.parameters(form);
    indices.retain(|&i| methods.iter().any(|(_, m)| m.covariance[(i, i)] > 0.0));
    if indices.is_empty() {
        return all_fixed(area, group);
    }
    let unit = group.unit_value();
    let shown: Vec<(&str, Vec<(f64, f64)>)> = methods
        .iter()
        .map(|(name, estimate)| {
            let (error, sigma) = (estimate.vector() - truth, estimate.sigma());
            let points = indices
                .iter()
                .map(|&i| (error[i].abs() / unit, sigma[i] / unit));
            (*name, points.collect())
        })
        .collect();
    let y = Axis::log(
        shown
            .iter()
            .flat_map(|(_, points)| points)
            .flat_map(|&(e, s)| [e, s]),
    );
    let floor = y.low();
    let mut panel = Panel::new(
        area,
        &format!("{}, {}", group.title(), group.unit()),
        Margins {
            left: 56.0,
            right: 96.0,
        },
        (Axis::places(indices.iter().map(|&i| axis_name(form, i))), y),
        "",
        &[],
    )?;
    for (n, (name, points)) in shown.iter().enumerate() {
        let offset = 0.26 * (n as f64 - 0.5 * (shown.len() as f64 - 1.0));
        let (mark, pen) = if *name == "EKF" {
            (Mark::Dot, Pen::nth(0, 2.5))
        } else {
            (Mark::Ring, Pen::nth(1, 1.75))
        };
        for (place, &(error, sigma)) in points.iter().enumerate() {
            let x = place as f64 + offset;
            if sigma > 0.0 {
                let whisker = Pen::solid(pen.color, 1.0);
                panel.line(&[(x, floor), (x, sigma)], whisker)?;
                panel.line(&[(x - 0.07, sigma), (x + 0.07, sigma)], whisker)?;
            }
            panel.marks(&[(x, error.max(floor))], mark, pen)?;
        }
        if let Some(last) = points.last() {
            panel.label(last.0.max(floor), *name, pen.color);
        }
    }
    panel.finish()
}

fn differences(closed: &Estimate, filter: &Estimate) -> Result<Figure, ReportError> {
    let form = filter.form();
    let difference = closed.vector() - filter.vector();
    let variance = closed.covariance.diagonal() + filter.covariance.diagonal();
    let points: Vec<(usize, f64)> = filter
        .estimated()
        .filter(|&i| variance[i] > 0.0)
        .map(|i| (i, difference[i] / variance[i].sqrt()))
        .collect();
    let sensor = |index: usize| sensor_and_parameter(index).0;
    let extent = points.iter().map(|point| point.1.abs()).fold(4.0, f64::max);
    let caption = String::from(
        "Closed form less EKF in units of the σ of their difference, as if they had no data in common. \
         Dashed: ±3.",
    );
    let y = if extent > 20.0 {
        Axis::symlog(1.0, 1.2 * extent)
    } else {
        Axis::linear(-1.2 * extent, 1.2 * extent)
    };
    Figure::draw(
        "comparison.svg",
        "Closed form against EKF",
        caption,
        (1200, 420),
        |area| {
            let rows = area.split_evenly((2, 1));
            let triads = points.chunk_by(|a, b| sensor(a.0) == sensor(b.0));
            for (triad, area) in triads.zip(rows) {
                let mut panel = Panel::new(
                    &area,
                    "closed form less EKF, σ",
                    Margins {
                        left: 56.0,
                        right: 52.0,
                    },
                    (
                        Axis::places(triad.iter().map(|&(i, _)| short_name(form, i))),
                        y.clone(),
                    ),
                    "",
                    &[],
                )?;
                let ends = (-0.5, triad.len() as f64 - 0.5);
                panel.line(&[(ends.0, 0.0), (ends.1, 0.0)], Pen::solid(QUIET, 0.75))?;
                for y in [-3.0, 3.0] {
                    panel.line(&[(ends.0, y), (ends.1, y)], Pen::dashed(INK, 1.0))?;
                    panel.label(y, if y < 0.0 { "−3σ" } else { "+3σ" }, INK);
                }
                for (place, &(_, y)) in triad.iter().enumerate() {
                    panel.line(&[(place as f64, 0.0), (place as f64, y)], Pen::nth(0, 1.0))?;
                    panel.marks(&[(place as f64, y)], Mark::Dot, Pen::nth(0, 2.5))?;
                }
                panel.finish()?;
            }
            Ok(())
        },
    )
}
