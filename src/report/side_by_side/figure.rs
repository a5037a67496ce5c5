//! Differences with their σ, a panel for each group.

use super::super::axis::Axis;
use super::super::canvas::{Area, DrawError, Pen, QUIET};
use super::super::group::{Group, axis_name};
use super::super::panel::{Margins, Mark, Panel};
use super::super::{Figure, ReportError};
use super::of_group;
use crate::calibration::Comparison;
use crate::imu::InstallationForm;

/// Letters of a name that the margin has room for.
const NAME: usize = 16;

pub(super) fn figure(comparison: &Comparison) -> Result<Figure, ReportError> {
    let caption = format!(
        "Each calibration less the reference, {}; bars: the 1σ that it claims. About two bars in three \
         should reach a true value. Where one calibration is far coarser than another, the axis is \
         logarithmic away from zero.",
        comparison.reference.name
    );
    Figure::draw(
        "differences.svg",
        "Differences to the reference",
        caption,
        (1200, 640),
        |area| {
            for (group, area) in Group::all().zip(area.split_evenly((2, 3))) {
                panel(&area, group, comparison)?;
            }
            Ok(())
        },
    )
}

fn panel(area: &Area, group: Group, comparison: &Comparison) -> Result<(), DrawError> {
    let indices = of_group(comparison, group);
    let unit = group.unit_value();
    let shown: Vec<(&str, Vec<(f64, f64)>)> = comparison
        .sides
        .iter()
        .map(|side| {
            let sigma = side.calibration.sigma().unwrap_or_default();
            let points = indices
                .iter()
                .map(|&i| (side.difference[i] / unit, sigma[i] / unit));
            (side.calibration.name.as_str(), points.collect())
        })
        .collect();
    let (y, kind) = height(&shown);
    let longest = shown.iter().map(|(name, _)| name.chars().count()).max();
    let mut panel = Panel::new(
        area,
        &format!("{}, {}{kind}", group.title(), group.unit()),
        Margins {
            left: 60.0,
            right: 24.0 + 7.5 * longest.unwrap_or(0).min(NAME) as f64,
        },
        (
            Axis::places(
                indices
                    .iter()
                    .map(|&i| axis_name(InstallationForm::General, i)),
            ),
            y,
        ),
        "",
        &[],
    )?;
    let ends = [(-0.5, 0.0), (indices.len() as f64 - 0.5, 0.0)];
    panel.line(&ends, Pen::solid(QUIET, 0.75))?;
    let spacing = 0.6 / shown.len().max(1) as f64;
    for (n, (name, points)) in shown.iter().enumerate() {
        let offset = spacing * (n as f64 - 0.5 * (shown.len() as f64 - 1.0));
        let mark = [Mark::Dot, Mark::Ring, Mark::Cross][n % 3];
        let pen = Pen::nth(n, 1.75);
        for (place, &(difference, sigma)) in points.iter().enumerate() {
            let x = place as f64 + offset;
            if sigma > 0.0 {
                let bar = [(x, difference - sigma), (x, difference + sigma)];
                panel.line(&bar, Pen::solid(pen.color, 1.25))?;
            }
            panel.marks(&[(x, difference)], mark, pen)?;
        }
        if let Some(last) = points.last() {
            panel.label(last.0, shortened(name), pen.color);
        }
    }
    panel.finish()
}

/// Linear, unless the smallest σ or differences would vanish on it; with a word that says so.
fn height(shown: &[(&str, Vec<(f64, f64)>)]) -> (Axis, &'static str) {
    let reach = |points: &Vec<(f64, f64)>| {
        let reaches = points.iter().map(|(d, s)| d.abs() + s);
        reaches.fold(0.0, f64::max)
    };
    let reaches = || shown.iter().map(|(_, points)| reach(points));
    let most = reaches().fold(0.0, f64::max);
    let least = reaches().filter(|r| *r > 0.0).fold(most, f64::min);
    if most > 20.0 * least {
        (Axis::symlog(0.3 * least, 1.5 * most), ", logarithmic")
    } else {
        (Axis::linear(-1.15 * most, 1.15 * most), "")
    }
}

fn shortened(name: &str) -> String {
    if name.chars().count() <= NAME {
        return name.to_owned();
    }
    let start: String = name.chars().take(NAME - 1).collect();
    format!("{start}…")
}
