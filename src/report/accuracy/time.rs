//! RMS error of both methods against table time.

use super::super::axis::Axis;
use super::super::canvas::{Area, DrawError, INK, Pen};
use super::super::panel::{Margins, Mark, Panel};
use super::super::{Figure, ReportError};
use crate::study::{Accuracy, GroupAccuracy};

const MINUTE: f64 = 60.0;

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
    let mut panel = Panel::new(
        area,
        &format!("{}, {}", of.group.title(), of.group.unit()),
        Margins {
            left: 56.0,
            right: 88.0,
        },
        (
            Axis::log(all().map(|point| point.0)),
            Axis::log(all().map(|point| point.1)),
        ),
        "table time, min",
        &[],
    )?;
    panel.line(&filter, Pen::nth(0, 1.75))?;
    panel.line(&bound, Pen::dashed(INK, 1.25))?;
    panel.line(&closed, Pen::nth(1, 1.0))?;
    panel.marks(&closed, Mark::Ring, Pen::nth(1, 1.25))?;
    for (points, name, color) in [
        (&filter, "EKF", Pen::nth(0, 1.0).color),
        (&bound, "bound", INK),
        (&closed, "closed form", Pen::nth(1, 1.0).color),
    ] {
        if let Some(last) = points.last() {
            panel.label(last.1, name, color);
        }
    }
    panel.finish()
}
