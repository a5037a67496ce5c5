//! Estimates with their ±3σ bands against time.

use super::axis::Axis;
use super::canvas::{Area, DrawError, INK, Pen, QUIET, envelope};
use super::group::{Group, axis_name};
use super::panel::{Margins, Panel};
use super::{Figure, Report, ReportError};
use crate::calibration::{Epoch, Outcome};
use crate::calibration::ParameterVector;

const POINTS: usize = 200;
const COLUMNS: usize = 3;
/// Where the axis ends, in final σ: with the prior on it the end could not be read.
const EXTENT: f64 = 300.0;
const MARGINS: Margins = Margins {
    left: 62.0,
    right: 14.0,
};

/// One small panel a parameter: estimate less truth (or less the final estimate) within ±3σ.
pub(super) fn figure(report: &Report, outcome: &Outcome) -> Result<Option<Figure>, ReportError> {
    let rows: Vec<Vec<usize>> = Group::all()
        .map(|group| group.estimated(&outcome.estimate))
        .flat_map(|indices| {
            indices
                .chunks(COLUMNS)
                .map(<[_]>::to_vec)
                .collect::<Vec<_>>()
        })
        .collect();
    if outcome.history.is_empty() || rows.is_empty() {
        return Ok(None);
    }
    let (reference, less) = match report.truth_vector() {
        Some(truth) => (truth, "truth"),
        None => (outcome.estimate.vector(), "final value"),
    };
    let live = if outcome.feedback_history.is_empty() {
        ""
    } else {
        "; thin line: the live pass, from the coarse start on"
    };
    let caption = format!(
        "Thick line: estimate of the last pass less {less}; band: its ±3σ{live}. The vertical axis is linear within the final σ of the group and \
         logarithmic beyond, and ends at {EXTENT} times that σ; what lies beyond is drawn at its \
         edge. The thick line should stay in its band."
    );
    let (file, title) = ("estimates.svg", "Estimates and their ±3σ bands");
    let size = (1200, 165 * rows.len() as u32);
    let figure = Figure::draw(file, title, caption, size, |area| {
        let areas = area.split_evenly((rows.len(), 1));
        for (n, (row, area)) in rows.iter().zip(areas).enumerate() {
            let x_title = if n + 1 == rows.len() { "time, s" } else { "" };
            for (&index, area) in row.iter().zip(area.split_evenly((1, COLUMNS))) {
                draw_panel(report, outcome, &reference, index, &area, x_title)?;
            }
        }
        Ok(())
    })?;
    Ok(Some(figure))
}

fn draw_panel(
    report: &Report,
    outcome: &Outcome,
    reference: &ParameterVector,
    index: usize,
    area: &Area,
    x_title: &str,
) -> Result<(), DrawError> {
    let (group, estimate) = (Group::of(index), &outcome.estimate);
    let line = |history: &[Epoch], shown: &dyn Fn(&Epoch) -> f64| {
        let shown = |m: &Epoch| (m.time, shown(m) / group.unit_value());
        envelope(&history.iter().map(shown).collect::<Vec<_>>(), POINTS)
    };
    let error = |m: &Epoch| m.estimate[index] - reference[index];
    let final_sigma = group
        .spread(&estimate.sigma(), &group.estimated(estimate))
        .map_or(0.0, |(_, rms)| rms);
    let (start, end) = report.time_span();
    let mut panel = Panel::new(
        area,
        &format!(
            "{} {}, {}",
            group.title(),
            axis_name(estimate.form(), index),
            group.unit()
        ),
        MARGINS,
        (
            Axis::linear(start, end),
            Axis::symlog(final_sigma, EXTENT * final_sigma),
        ),
        x_title,
        report.dwells,
    )?;
    panel.band(
        &line(&outcome.history, &|m| -3.0 * m.sigma[index]),
        &line(&outcome.history, &|m| 3.0 * m.sigma[index]),
    )?;
    panel.line(&[(start, 0.0), (end, 0.0)], Pen::solid(QUIET, 0.75))?;
    panel.line(&line(&outcome.feedback_history, &error), Pen::nth(1, 0.9))?;
    panel.line(&line(&outcome.history, &error), Pen::solid(INK, 1.75))?;
    panel.finish()
}
