//! RMS error of both methods against table time.

use plotters::style::text_anchor::{HPos, VPos};

use super::super::axis::Axis;
use super::super::canvas::{Area, DrawError, INK, Pen};
use super::super::panel::{Margins, Mark, Panel};
use super::super::{Figure, ReportError};
use crate::study::{Accuracy, GroupAccuracy};

const MINUTE: f64 = 60.0;
/// Below the lowest point this part of it is on the axis, too.
const ROOM: f64 = 0.4;
/// Lines that end nearer than this factor have one name.
const TOGETHER: f64 = 2.0;

pub(super) fn figure(accuracy: &Accuracy) -> Result<Figure, ReportError> {
    let caption = String::from(
        "RMS error over all runs at that time of the last pass, one panel for each group, both axes \
         logarithmic. Solid: EKF; dashed: its Cramér–Rao bound; rings: closed form with shorter dwells \
         at all of its positions.",
    );
    Figure::draw(
        "time.svg",
        "Accuracy against table time",
        caption,
        (1200, 680),
        |area| {
            for (of, area) in accuracy.groups.iter().zip(area.split_evenly((2, 3))) {
                panel(&area, of)?;
            }
            Ok(())
        },
    )
}

fn panel(area: &Area, of: &GroupAccuracy) -> Result<(), DrawError> {
    let unit = of.group.unit_value();
    let line = |points: &mut dyn Iterator<Item = (f64, f64)>| -> Vec<(f64, f64)> {
        points
            .map(|(time, rms)| (time / MINUTE, rms / unit))
            .filter(|(_, rms)| rms.is_finite())
            .collect()
    };
    let filter = line(&mut of.filter_against_time.iter().map(|p| (p.0, p.1)));
    let bound = line(&mut of.filter_against_time.iter().map(|p| (p.0, p.2)));
    let closed = line(&mut of.closed_form_against_time.iter().copied());
    let all = || filter.iter().chain(&bound).chain(&closed);
    let (first, last) = all().fold((f64::INFINITY, 0.0), |(first, last): (f64, f64), p| {
        (first.min(p.0), last.max(p.0))
    });
    // Names stand below the ends of the lines.
    let lowest = all().map(|p| p.1).fold(f64::INFINITY, f64::min);
    let heights = all().map(|p| p.1).chain([ROOM * lowest]);
    let mut panel = Panel::new(
        area,
        &format!("{}, {}", of.group.title(), of.group.unit()),
        Margins {
            left: 56.0,
            right: 24.0,
        },
        (
            Axis::log_between(0.9 * first, 1.1 * last),
            Axis::log(heights),
        ),
        "table time, min",
        &[],
    )?;
    panel.line(&filter, Pen::nth(0, 1.75))?;
    panel.line(&bound, Pen::dashed(INK, 1.25))?;
    panel.line(&closed, Pen::nth(1, 1.0))?;
    panel.marks(&closed, Mark::Ring, Pen::nth(1, 1.25))?;
    let below = ((4.0, 7.0), (HPos::Right, VPos::Top));
    let above = ((4.0, -6.0), (HPos::Right, VPos::Bottom));
    let beyond = ((4.0, -4.0), (HPos::Left, VPos::Bottom));
    let under_filter = |p: &(f64, f64)| filter.last().is_some_and(|end| p.1 < end.1);
    let together = filter.last().zip(bound.last());
    let together = together.is_some_and(|(a, b)| (a.1 / b.1).ln().abs() < TOGETHER.ln());
    let mut names = vec![(&closed, "closed form", below)];
    if together {
        // Where the closed form runs below, there is room above it.
        let free = closed.iter().all(under_filter);
        let free = free && !closed.is_empty();
        names.push((&filter, "EKF and bound", if free { beyond } else { below }));
    } else {
        names.extend([(&filter, "EKF", above), (&bound, "bound", below)]);
    }
    for (points, name, (moved, anchor)) in names {
        if let Some(&end) = points.last() {
            panel.text(end, moved, name, anchor)?;
        }
    }
    panel.finish()
}
