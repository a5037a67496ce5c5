//! Whitened innovations with their bounds.

use super::axis::Axis;
use super::canvas::{INK, Pen, QUIET, envelope};
use super::number;
use super::panel::{Margins, Mark, Panel};
use super::{Figure, Report, ReportError};
use crate::calibration::{Innovation, Nis, Observation, Outcome};

const DIRECTIONS: [&str; 3] = ["east", "north", "up"];
/// Beyond this an innovation is drawn at the edge.
const EDGE: f64 = 6.0;
/// Up to this many are drawn as dots, more as a line through the extremes.
const DOTS: usize = 150;

/// Velocity above, table attitude below, each in three directions.
pub(super) fn figure(report: &Report, outcome: &Outcome) -> Result<Option<Figure>, ReportError> {
    let kinds: Vec<(&str, Vec<&Innovation>)> = [
        ("velocity", Observation::Velocity),
        ("table attitude", Observation::Table),
    ]
    .into_iter()
    .map(|(name, kind)| {
        let of_kind = outcome.innovations.iter().filter(|i| i.observation == kind);
        (name, of_kind.collect::<Vec<_>>())
    })
    .filter(|(_, of_kind)| !of_kind.is_empty())
    .collect();
    if kinds.is_empty() {
        return Ok(None);
    }
    let nis: Vec<String> = [
        ("velocity", &outcome.consistency.velocity),
        ("table attitude", &outcome.consistency.table),
    ]
    .into_iter()
    .filter(|(_, nis)| nis.count > 0)
    .map(|(name, nis)| sentence(name, nis))
    .collect();
    let caption = format!(
        "Innovations of the last pass in units of their own σ; they should look like white noise of \
         unit variance. Solid lines: ±1σ; dashed: ±3σ. Where they are many the line runs through the \
         extremes of each stretch. Crosses: rejected by the gate; at the edge: ±{EDGE}σ or more. \
         {}",
        nis.join(" ")
    );
    let size = (1200, 40 + 250 * kinds.len() as u32);
    let figure = Figure::draw("innovations.svg", "Innovations", caption, size, |area| {
        let rows = area.split_evenly((kinds.len(), 1));
        for ((name, of_kind), row) in kinds.iter().zip(rows) {
            for (direction, area) in row.split_evenly((1, 3)).into_iter().enumerate() {
                let (start, end) = report.time_span();
                let mut panel = Panel::new(
                    &area,
                    &format!("{name}, {}, σ", DIRECTIONS[direction]),
                    Margins {
                        left: 40.0,
                        right: 50.0,
                    },
                    (Axis::linear(start, end), Axis::stepped(-EDGE, EDGE, 2.0)),
                    "time, s",
                    report.dwells,
                )?;
                let points = |accepted: bool| -> Vec<(f64, f64)> {
                    of_kind
                        .iter()
                        .filter(|i| i.accepted == accepted)
                        .map(|i| (i.time, i.whitened[direction].clamp(-EDGE, EDGE)))
                        .collect()
                };
                let blue = Pen::nth(0, 1.0);
                let accepted = points(true);
                if accepted.len() <= DOTS {
                    panel.marks(&accepted, Mark::Dot, blue)?;
                } else {
                    // A line across a turn would show what was not observed.
                    let dwell = |t: f64| report.dwells.partition_point(|dwell| dwell.end < t);
                    for stretch in accepted.chunk_by(|a, b| dwell(a.0) == dwell(b.0)) {
                        let share = 500 * stretch.len() / accepted.len();
                        panel.line(&envelope(stretch, share), blue)?;
                    }
                }
                for (bound, pen) in [(1.0, Pen::solid(QUIET, 1.0)), (3.0, Pen::dashed(INK, 1.25))] {
                    for y in [-bound, bound] {
                        panel.line(&[(start, y), (end, y)], pen)?;
                        let sign = if y < 0.0 { '−' } else { '+' };
                        panel.label(y, format!("{sign}{bound}σ"), INK);
                    }
                }
                let rejected = envelope(&points(false), 300);
                panel.marks(&rejected, Mark::Cross, Pen::nth(1, 1.75))?;
                panel.finish()?;
            }
        }
        Ok(())
    })?;
    Ok(Some(figure))
}

fn sentence(name: &str, nis: &Nis) -> String {
    format!(
        "NIS of {name} {} (95 % interval {}–{}, {} scalars).",
        number::value(nis.mean, 0.01),
        number::value(nis.interval.0, 0.01),
        number::value(nis.interval.1, 0.01),
        number::count(nis.count),
    )
}
