//! Figures of a lot: values of every unit with σ, mean and limits.

use super::shown::{shown, together};
use crate::lot::{Lot, Quantity, Sample};
use crate::report::prelude::*;

pub fn parameters(lot: &Lot) -> Plot {
    let panels = together(lot).into_iter().take(Group::all().count());
    let panels = panels.map(|(title, names, quantities)| {
        let limits = limits(lot, &quantities);
        let mut panel = panel(lot, &title, &quantities, &names);
        panel.y = panel.y.including(limits.iter().copied());
        panel.with_all(limits.into_iter().map(|y| Series::level(y).dashed()))
    });
    Plot::new("lot.svg", "Every unit", (2, 330), panels).caption(
        "Units in the given order, with their 1σ; long lines: limits common to all axes. Crosses: outliers.",
    )
}

pub fn noise(lot: &Lot) -> Plot {
    let panels = together(lot).into_iter().skip(Group::all().count());
    let panels = panels.map(|(title, names, quantities)| Panel {
        y: Axis::log("").room(0.1, 0.1),
        ..panel(lot, &title, &quantities, &names)
    });
    Plot::new("noise.svg", "Noise at rest", (2, 330), panels).caption(
        "White-noise density of each axis in the dwells, with its 1σ; logarithmic. Crosses: outliers.",
    )
}

/// Series for each quantity: bars and marks, with crosses for outliers.
fn panel(lot: &Lot, title: &str, quantities: &[Quantity], names: &[String]) -> Panel {
    let of_quantity = |(n, (&quantity, name)): (usize, (&Quantity, &String))| {
        let shift = beside(n, quantities.len(), 0.7);
        let points = |apart: bool| {
            lot.rows.iter().enumerate().filter_map(move |(place, row)| {
                let is_apart = lot.outliers_of(place).any(|of| of.quantity == quantity);
                let (value, sigma) = shown(quantity, row.sample(quantity)?);
                (is_apart == apart).then_some((place as f64 + shift, value, sigma))
            })
        };
        let dots = Series::measured(Mark::Dot, points(false)).key(name);
        let crosses = Series::measured(Mark::Cross, points(true)).width(2.5);
        [dots, crosses].map(|marks| marks.nth(n))
    };
    let series = quantities.iter().zip(names).enumerate();
    let series = series.flat_map(of_quantity);
    let units = Axis::places(lot.rows.iter().map(|row| row.unit.name.clone()));
    Panel::new(title, units, Axis::linear("").room(0.05, 0.05)).with_all(series)
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
