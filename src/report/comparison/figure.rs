//! Differences with their σ, a panel for each group.

use crate::calibration::Comparison;
use crate::imu::InstallationForm;
use crate::report::prelude::*;

/// Calibrations that reach this many times further than others make an axis logarithmic.
const APART: f64 = 20.0;

pub(super) fn figure(comparison: &Comparison) -> Plot {
    let panels = Group::all().map(|group| panel(comparison, group));
    Plot::new("differences.svg", "Differences to the reference", (3, 320), panels).caption(format!(
        "Each calibration minus the reference, {}; bars: the 1σ that it claims. About two bars in three should \
         reach a true value. Where one calibration is far coarser than another, the axis is logarithmic away \
         from zero.",
        comparison.reference.name
    ))
}

fn panel(comparison: &Comparison, group: Group) -> Panel {
    let (indices, unit) = (group.among(&comparison.parameters), group.unit_value());
    let sides: Vec<(&str, Vec<(f64, f64)>)> = comparison
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
    let (y, kind) = axis(sides.iter().map(|(_, points)| reach(points)).collect());
    let spacing = 0.6 / sides.len().max(1) as f64;
    let series = sides.iter().enumerate().flat_map(|(n, (name, points))| {
        let x =
            |place: usize| place as f64 + spacing * (n as f64 - 0.5 * (sides.len() as f64 - 1.0));
        let bars = points
            .iter()
            .enumerate()
            .filter(|(_, (_, sigma))| *sigma > 0.0);
        let bars = bars
            .map(|(k, (d, sigma))| (x(k), d - sigma, d + sigma))
            .collect();
        let marks = points.iter().enumerate().map(|(k, point)| (x(k), point.0));
        let mark = [Mark::Dot, Mark::Ring, Mark::Cross][n % 3];
        [
            Series::new(Shape::Intervals(bars)).nth(n).width(1.25),
            Series::marks(mark, marks).nth(n).width(1.75).label(*name),
        ]
    });
    let names = indices
        .iter()
        .map(|&i| axis_name(InstallationForm::General, i));
    Panel::new(
        format!("{}, {}{kind}", group.title(), group.unit()),
        Axis::places(names),
        y,
    )
    .with(Series::zero())
    .with_all(series)
}

/// How far points reach from zero with their σ.
fn reach(points: &[(f64, f64)]) -> f64 {
    let reaches = points
        .iter()
        .map(|(difference, sigma)| difference.abs() + sigma);
    reaches.fold(0.0, f64::max)
}

/// The axis of calibrations that reach as far as this, and what its title says of it.
fn axis(reaches: Vec<f64>) -> (Axis, &'static str) {
    let most = reaches.iter().copied().fold(0.0, f64::max);
    let least = reaches
        .into_iter()
        .filter(|r| *r > 0.0)
        .fold(most, f64::min);
    match most > APART * least {
        true => (
            Axis::symlog(0.3 * least).between(-1.5 * most, 1.5 * most),
            ", logarithmic",
        ),
        false => (Axis::linear("").between(-1.15 * most, 1.15 * most), ""),
    }
}
