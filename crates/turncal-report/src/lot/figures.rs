//! Figures of a comparison: every calibration with σ and limits.

use super::shown::{Together, in_unit, shown, together};
use crate::prelude::*;
use turncal::lot::{Lot, Quantity, Row, Sample};

/// Every calibration, with a panel for each group.
pub fn values(lot: &Lot) -> Plot {
    let panels = together(lot).into_iter().map(|of| panel(lot, &of));
    let what = match (&lot.specification, &lot.truth) {
        (Some(_), _) => "Calibrations in the given order. Long lines: limits common to all axes",
        (None, Some(_)) => "Differences of the calibrations from the truth",
        (None, None) => "Differences of the calibrations from their mean",
    };
    Plot::new("values.svg", "Every calibration", (2, 330), panels)
        .caption(format!("{what}; bars: 1σ. Crosses: outliers."))
}

/// Series for each quantity: bars and marks, with crosses for outliers.
fn panel(lot: &Lot, of: &Together) -> Panel {
    let count = of.quantities.len();
    let points = |quantity: Quantity| -> Vec<(usize, f64, f64)> {
        let all = lot.rows.iter().enumerate();
        let point = |(place, row)| {
            let (value, sigma) = plotted(lot, row, quantity)?;
            Some((place, value, sigma))
        };
        all.filter_map(point).collect()
    };
    let all: Vec<_> = of.quantities.iter().map(|q| points(*q)).collect();
    let reaches = lot.rows.iter().enumerate().map(|(place, _)| {
        let of_row = all.iter().flatten().filter(|point| point.0 == place);
        let reaches = of_row.map(|(_, value, sigma)| value.abs() + sigma);
        reaches.fold(0.0, f64::max)
    });
    let (y, kind) = match lot.specification {
        Some(_) => (Axis::linear("").room(0.05, 0.05), ""),
        None => Axis::about_zero(reaches),
    };
    let series = of.quantities.iter().zip(&of.names).zip(all).enumerate();
    let series = series.flat_map(|(n, ((quantity, name), points))| {
        let shift = beside(n, count, 0.7);
        let outliers = lot.statistics_of(*quantity).map(|of| &of.outliers[..]);
        let outliers = outliers.unwrap_or_default();
        let (crosses, dots): (Vec<_>, Vec<_>) = points
            .into_iter()
            .partition(|point| outliers.contains(&point.0));
        let place = |(place, value, sigma)| (place as f64 + shift, value, sigma);
        let dots = Series::measured(Mark::Dot, dots.into_iter().map(place)).key(name);
        let crosses = Series::measured(Mark::Cross, crosses.into_iter().map(place)).width(2.5);
        [dots, crosses].map(|marks| marks.nth(n))
    });
    let limits = limits(lot, &of.quantities);
    let units = Axis::places(lot.rows.iter().map(|row| row.unit.name.clone()));
    let heading = format!("{}{kind}", of.heading);
    Panel::new(heading, units, y.including(limits.iter().copied()))
        .with_all(series)
        .with_all(limits.into_iter().map(|y| Series::level(y).dashed()))
}

/// Value and σ in a figure: with limits the value itself; otherwise the difference from the truth or from the mean.
fn plotted(lot: &Lot, row: &Row, quantity: Quantity) -> Option<(f64, f64)> {
    let sample = row.sample(quantity)?;
    if lot.specification.is_some() {
        return Some(shown(quantity, sample));
    }
    let centre = match &lot.truth {
        Some(truth) => truth.sample(quantity)?.value,
        None => lot.statistics_of(quantity)?.scatter.mean,
    };
    let off = in_unit(quantity, sample.value - centre);
    Some((off, in_unit(quantity, sample.sigma)))
}

/// Limits common to all parameters of a group.
fn limits(lot: &Lot, quantities: &[Quantity]) -> Vec<f64> {
    let Some(specification) = &lot.specification else {
        return Vec::new();
    };
    let of = |quantity: &Quantity| {
        let mut limits = specification.limits.iter();
        let limit = limits.find(|of| Quantity::Parameter(of.parameter) == *quantity)?;
        let at = |sign: f64| {
            let value = limit.nominal + sign * limit.within;
            shown(*quantity, Sample { value, sigma: 0.0 }).0
        };
        Some([at(-1.0), at(1.0)])
    };
    let all: Option<Vec<[f64; 2]>> = quantities.iter().map(of).collect();
    match all.as_deref() {
        Some([first, rest @ ..]) if rest.iter().all(|other| other == first) => first.to_vec(),
        _ => Vec::new(),
    }
}
