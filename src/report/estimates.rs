//! Estimates with their ±3σ bands against time.

use super::axis::Axis;
use super::canvas::{INK, Margins, Panel, Pen, QUIET, envelope};
use super::group::{Group, axis_name};
use super::{Figure, Report, ReportError};
use crate::calibration::outcome::Outcome;

const POINTS: usize = 200;
const COLUMNS: usize = 3;
/// Where the axis ends, in final σ: with the prior on it the end could not be read.
const EXTENT: f64 = 300.0;

/// One small panel a parameter: estimate less truth (or less the final estimate) within ±3σ.
pub(super) fn figure(report: &Report, outcome: &Outcome) -> Result<Option<Figure>, ReportError> {
    let (history, form) = (&outcome.history, outcome.estimate.form());
    if history.is_empty() {
        return Ok(None);
    }
    let reference = report
        .truth_vector()
        .unwrap_or_else(|| outcome.estimate.vector());
    let less = if report.truth.is_some() {
        "truth"
    } else {
        "final value"
    };
    let caption = format!(
        "Line: estimate less {less}; band: ±3σ. The vertical axis is linear within the final σ of \
         the group and logarithmic beyond, and ends at {EXTENT} times that σ; what lies beyond is drawn \
         at its edge. The line should stay in its band."
    );
    let groups: Vec<(Group, Vec<usize>)> = Group::all()
        .map(|group| (group, group.parameters(form)))
        .collect();
    let rows: usize = groups
        .iter()
        .map(|(_, of)| of.len().div_ceil(COLUMNS))
        .sum();
    let last_row = groups
        .last()
        .and_then(|(_, of)| of.rchunks(COLUMNS).next()?.first().copied());
    let size = (1200, 165 * rows as u32);
    let figure = Figure::draw(
        "estimates.svg",
        "Estimates and their ±3σ bands",
        caption,
        size,
        |area| {
            let mut places = area.split_evenly((rows, COLUMNS)).into_iter();
            for (group, indices) in groups {
                let unit = group.unit_value();
                let final_sigma = group
                    .spread(&outcome.estimate.sigma(), &indices)
                    .map_or(0.0, |(_, rms)| rms);
                let axis = Axis::symlog(final_sigma, EXTENT * final_sigma);
                for (index, area) in indices.into_iter().zip(&mut places) {
                    let line: Vec<_> = history
                        .iter()
                        .map(|m| (m.time, (m.estimate[index] - reference[index]) / unit))
                        .collect();
                    let bound = |sign: f64| {
                        let line: Vec<_> = history
                            .iter()
                            .map(|m| (m.time, sign * 3.0 * m.sigma[index] / unit))
                            .collect();
                        envelope(&line, POINTS)
                    };
                    let (start, end) = report.time_span();
                    let mut panel = Panel::new(
                        &area,
                        &format!(
                            "{} {}, {}",
                            group.title(),
                            axis_name(form, index),
                            group.unit()
                        ),
                        Margins {
                            left: 62.0,
                            right: 14.0,
                        },
                        (Axis::linear(start, end), axis.clone()),
                        if last_row.is_some_and(|first| index >= first) {
                            "time, s"
                        } else {
                            ""
                        },
                        report.dwells,
                    )?;
                    let (lower, upper) = (bound(-1.0), bound(1.0));
                    panel.band(&lower, &upper)?;
                    panel.line(&[(start, 0.0), (end, 0.0)], Pen::solid(QUIET, 0.75))?;
                    panel.line(&envelope(&line, POINTS), Pen::solid(INK, 1.25))?;
                    panel.finish()?;
                }
            }
            Ok(())
        },
    )?;
    Ok(Some(figure))
}
