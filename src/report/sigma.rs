//! σ of every parameter against time.

use super::axis::Axis;
use super::canvas::{INK, Pen, envelope};
use super::group::{Group, axis_name};
use super::panel::{Margins, Panel, all_fixed};
use super::{Figure, Report, ReportError};
use crate::calibration::Outcome;

/// Points of a line: more than the panel is wide in pixels would not show.
const POINTS: usize = 300;

/// σ of each group on a logarithmic axis, with the largest true error where the truth is known.
pub(super) fn figure(report: &Report, outcome: &Outcome) -> Result<Option<Figure>, ReportError> {
    let (history, form) = (&outcome.history, outcome.estimate.form());
    if history.is_empty() {
        return Ok(None);
    }
    let truth = report.truth_vector();
    let mut caption = String::from(
        "1σ of every parameter in the last pass, one panel for each group, logarithmic. \
         Grey: standing; white: turning. A line that stays level was not observed.",
    );
    if truth.is_some() {
        caption.push_str(
            " Dashed: the largest true error in the group; it should end within a few σ of the lines.",
        );
    }
    let figure = Figure::draw(
        "sigma.svg",
        "Accuracy against time",
        caption,
        (1200, 660),
        |area| {
            for (group, area) in Group::all().zip(area.split_evenly((2, 3))) {
                let indices = group.estimated(&outcome.estimate);
                if indices.is_empty() {
                    all_fixed(&area, group)?;
                    continue;
                }
                let lines: Vec<Vec<(f64, f64)>> = indices
                    .iter()
                    .map(|&i| {
                        let line: Vec<_> = history
                            .iter()
                            .map(|m| (m.time, m.sigma[i] / group.unit_value()))
                            .collect();
                        envelope(&line, POINTS)
                    })
                    .collect();
                let error: Vec<(f64, f64)> = truth
                    .iter()
                    .flat_map(|truth| history.iter().map(move |m| (m.time, m.estimate - truth)))
                    .filter_map(|(time, error)| Some((time, group.spread(&error, &indices)?.0)))
                    .collect();
                let error = envelope(&error, POINTS);
                let (start, end) = report.time_span();
                let values = lines.iter().flatten().chain(&error).map(|point| point.1);
                let mut panel = Panel::new(
                    &area,
                    &format!("{}, {}", group.title(), group.unit()),
                    Margins {
                        left: 56.0,
                        right: 64.0,
                    },
                    (Axis::linear(start, end), Axis::log(values)),
                    "time, s",
                    report.dwells,
                )?;
                for (n, (line, &index)) in lines.iter().zip(&indices).enumerate() {
                    let pen = Pen::nth(n, 1.5);
                    panel.line(line, pen)?;
                    if let Some(last) = line.last() {
                        panel.label(last.1, format!("σ {}", axis_name(form, index)), pen.color);
                    }
                }
                panel.line(&error, Pen::dashed(INK, 1.5))?;
                if let Some(last) = error.last() {
                    panel.label(last.1, "error", INK);
                }
                panel.finish()?;
            }
            Ok(())
        },
    )?;
    Ok(Some(figure))
}
