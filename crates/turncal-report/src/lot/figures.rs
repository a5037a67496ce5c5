//! Figures of a comparison, which show every calibration with its σ and the limits.

use super::shown::{Together, in_unit, shown, together};
use crate::prelude::*;
use turncal::lot::{Lot, Quantity, Row, Sample};

/// Figure of all calibrations, with a panel for each group.
pub fn values(lot: &Lot) -> Plot {
    let panels = together(lot).into_iter().map(|of| panel(lot, &of));
    let what = match (&lot.specification, &lot.truth) {
        (Some(_), _) => {
            "The calibrations are in the given order. Dashed: limits (black if a limit is common to all axes)"
        }
        (None, Some(_)) => "Differences of the calibrations from the truth",
        (None, None) => "Differences of the calibrations from their mean",
    };
    Plot::new("values.svg", "Every calibration", (2, 330), panels)
        .caption(format!("{what}; bars: 1σ. Crosses: outliers."))
}

/// Series for each quantity: bars and marks, with crosses for outliers.
fn panel(lot: &Lot, of: &Together) -> Panel {
    let count = of.quantities.len();
    let points = |quantity: Quantity| {
        let rows = lot.rows.iter().enumerate();
        rows.filter_map(move |(place, row)| {
            let (value, sigma) = plotted(lot, row, quantity)?;
            Some((place, value, sigma))
        })
    };
    let series = of.quantities.iter().zip(&of.names).enumerate();
    let series = series.flat_map(|(n, (quantity, name))| {
        let shift = beside(n, count, 0.7);
        let outliers = lot.statistics_of(*quantity).map(|of| &of.outliers[..]);
        let outliers = outliers.unwrap_or_default();
        let (crosses, dots): (Vec<_>, Vec<_>) =
            points(*quantity).partition(|point| outliers.contains(&point.0));
        let place = |(place, value, sigma)| (place as f64 + shift, value, sigma);
        let dots = Series::measured(Mark::Dot, dots.into_iter().map(place)).key(name);
        let crosses = Series::measured(Mark::Cross, crosses.into_iter().map(place)).width(2.5);
        [dots, crosses].map(|marks| marks.nth(n))
    });
    let limits = of.quantities.iter().map(|&quantity| limits(lot, quantity));
    let limits: Vec<Vec<f64>> = limits.collect();
    let common = limits.windows(2).all(|pair| pair[0] == pair[1]);
    let lines = limits.iter().enumerate().flat_map(|(n, limits)| {
        let color = if common { Color::Ink } else { Color::Nth(n) };
        let line = move |&y: &f64| Series::level(y).color(color).dashed();
        limits.iter().map(line)
    });
    let units = Axis::places(lot.rows.iter().map(|row| row.unit.name.clone()));
    let zero = lot.specification.is_none().then_some(0.0);
    let y = Axis::linear("").room(0.05, 0.05);
    let y = y.including(limits.iter().flatten().copied().chain(zero));
    Panel::new(&of.heading, units, y)
        .with_all(zero.map(|_| Series::zero()))
        .with_all(series)
        .with_all(lines)
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

/// Lower and upper limit of a parameter, if the specification has them.
fn limits(lot: &Lot, quantity: Quantity) -> Vec<f64> {
    let limits = lot.specification.iter().flat_map(|of| &of.limits);
    let own = limits.filter(|of| Quantity::Parameter(of.parameter) == quantity);
    let ends = own.flat_map(|of| [of.nominal - of.within, of.nominal + of.within]);
    ends.map(|value| shown(quantity, Sample { value, sigma: 0.0 }).0)
        .collect()
}
