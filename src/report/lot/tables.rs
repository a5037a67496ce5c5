//! Tables of a lot.

use super::shown::{shown, shown_spread, spread, spread_symbol, symbol, title, together};
use crate::imu::Sensor;
use crate::lot::{Calibrated, Check, FALSE_ALARM, Lot, Quantity, Row, Sample, Statistics, Verdict};
use crate::report::prelude::*;

/// One row per unit.
pub fn units(lot: &Lot) -> Table {
    let mut columns = cells!["unit", "serial", "date"];
    if lot.specification.is_some() {
        columns.push("verdict".to_owned());
    }
    columns.extend(cells!["NIS", "warnings", "outlier in"]);
    let row = |(place, row): (usize, &Row)| {
        let meta = |key: &str| row.unit.meta.get(key).cloned().unwrap_or(NONE.to_owned());
        let mut cells = cells![row.unit.name.as_str(), meta("serial"), meta("date")];
        if lot.specification.is_some() {
            let open = row.canonical.is_ok().then_some(row.checks.as_slice());
            let mut open = open.unwrap_or_default().iter();
            let reason = open.find(|check| Some(check.verdict) == row.verdict);
            cells.push(verdict(row.verdict, reason));
        }
        match (&row.canonical, &row.unit.calibrated) {
            (Ok(_), Ok(calibrated)) => {
                let apart: Vec<String> = lot
                    .outliers_of(place)
                    .map(|of| title(of.quantity))
                    .collect();
                cells.push(nis(calibrated));
                cells.push(count(calibrated.calibration.warnings.len()));
                cells.push(match apart.len() {
                    0 => NONE.to_owned(),
                    1..=3 => apart.join(", "),
                    more => format!("{}, {} more", apart[..2].join(", "), more - 2),
                });
            }
            _ => cells.extend(cells![NONE, NONE, "not calibrated"]),
        }
        cells
    };
    let mut table = Table::new("Units", columns)
        .section(lot.rows.iter().enumerate().map(row))
        .note(
            "NIS: of all observations, 1 if the σ are correct. Warnings: number in the report of the unit.",
        )
        .note(format!(
            "Outlier: by a test with a false-alarm rate of {} % per lot.",
            100.0 * FALSE_ALARM
        ));
    let place = |column: &str| table.columns.iter().position(|name| name == column);
    table.optional = ["warnings", "date", "serial"]
        .into_iter()
        .filter_map(place)
        .collect();
    table
}

fn nis(calibrated: &Calibrated) -> String {
    let consistency = calibrated.calibration.consistency.as_ref();
    or_dash(consistency.map(|c| c.all.nis), |nis| value(nis, 0.1))
}

/// The verdict with the limit that decides it.
fn verdict(of: Option<Verdict>, check: Option<&Check>) -> String {
    let word = of.map_or(NONE, Verdict::name);
    match (of, check) {
        (Some(Verdict::Fail | Verdict::NotDecided), Some(check)) => {
            format!("{word}: {}", title(check.quantity()))
        }
        _ => word.to_owned(),
    }
}

/// Mean and spread of every parameter.
pub fn parameters(lot: &Lot) -> Table {
    let sections = Sensor::ALL.map(|sensor| {
        let of_sensor = move |of: &&Statistics| match of.quantity {
            Quantity::Parameter(index) => Group::of(index).sensor() == sensor,
            Quantity::Noise(..) => false,
        };
        lot.statistics.iter().filter(of_sensor).map(row)
    });
    statistics("Parameters of the lot")
        .sections(sections)
        .note("Mean: weighted by spread and σ, ± its 1σ. Scatter: sample standard deviation.")
        .note("χ²/n: scatter compared with the σ of the units; p: probability of a larger value if these σ alone \
            explain it.")
        .note(format!(
            "Spread: 1σ between units after subtracting the σ of the units, ± its 1σ, or its 95 % limit if not \
             significant; real: not explained by these σ (false-alarm rate {} % for all rows together).",
            100.0 * FALSE_ALARM
        ))
        .note("Outliers are excluded.")
}

/// Noise at rest.
pub fn noise(lot: &Lot) -> Table {
    let of_noise = |of: &&Statistics| matches!(of.quantity, Quantity::Noise(..));
    let rows = lot.statistics.iter().filter(of_noise).map(row);
    statistics("Noise at rest")
        .section(rows)
        .note("White-noise density from the Allan variance of the dwells at a quarter of their length; scatter and \
            spread refer to its logarithm.")
}

fn statistics(heading: &str) -> Table {
    let mut table = Table::new(
        heading,
        [
            "", "unit", "mean", "scatter", "χ²/n", "p", "spread", "unit", "real", "n", "outliers",
        ],
    );
    table.optional = vec![3, 9];
    table
}

fn row(of: &Statistics) -> Vec<String> {
    let quantity = of.quantity;
    let mean = Sample {
        value: of.scatter.mean,
        sigma: of.scatter.mean_sigma,
    };
    let (mean, own) = shown(quantity, mean);
    let scatter = shown_spread(quantity, of.scatter.deviation);
    let chi2 = of.scatter.chi_square;
    cells![
        title(quantity),
        symbol(quantity),
        plus_minus(mean, own),
        sigma(scatter),
        or_dash(chi2.map(|c| c.value / c.freedom as f64), ratio),
        or_dash(chi2.map(|c| c.p), chance),
        spread(quantity, &of.scatter.spread),
        spread_symbol(quantity),
        if of.real { "yes" } else { "no" },
        count(of.count),
        match of.outliers.len() {
            0 => NONE.to_owned(),
            outliers => count(outliers),
        },
    ]
}

/// χ²/n, whose exact size is not meaningful far beyond chance.
fn ratio(of: f64) -> String {
    const FAR: f64 = 1000.0;
    match of > FAR {
        true => format!("> {FAR}"),
        false => three_digits(of),
    }
}

/// Every parameter of every unit, one table per group, and one of noise per triad.
pub fn values(lot: &Lot) -> Vec<Table> {
    let tables = together(lot).into_iter();
    let tables = tables.filter(|(.., quantities)| !quantities.is_empty());
    let table = |(heading, axes, quantities): (String, Vec<String>, Vec<Quantity>)| {
        let row = |(place, row): (usize, &Row)| {
            let mut cells = vec![row.unit.name.clone()];
            cells.extend(quantities.iter().map(|&quantity| {
                let Some(sample) = row.sample(quantity) else {
                    return NONE.to_owned();
                };
                let apart = lot.outliers_of(place).any(|of| of.quantity == quantity);
                let check = row.check_of(quantity);
                let fails = check.is_some_and(|check| check.verdict == Verdict::Fail);
                let mark = if apart || fails { "! " } else { "" };
                let (value, own) = shown(quantity, sample);
                format!("{mark}{}", plus_minus(value, own))
            }));
            cells
        };
        Table::new(heading, std::iter::once("unit".to_owned()).chain(axes))
            .section(lot.rows.iter().enumerate().map(row))
            .note("± 1σ; ! outlier or outside its limit.")
    };
    tables.map(table).collect()
}

/// Every limit of a single unit, those that are not kept first; of a lot those that are not kept, or not certainly.
pub fn limits(lot: &Lot) -> Table {
    let row = |row: &Row, check: &Check| {
        let quantity = check.quantity();
        let in_unit = |x: f64| shown_spread(quantity, x);
        let off = check
            .off
            .map(|(off, own)| plus_minus(in_unit(off), in_unit(own)));
        cells![
            row.unit.name.as_str(),
            title(quantity),
            symbol(quantity),
            off.unwrap_or_else(|| NONE.to_owned()),
            format!("±{}", stated(in_unit(check.limit.within))),
            or_dash(check.probability, |p| value(p, 0.01)),
            check.verdict.name(),
        ]
    };
    let is_single = lot.rows.len() == 1;
    let rows = lot.rows.iter().flat_map(|of| {
        let (passed, mut shown): (Vec<_>, Vec<_>) =
            of.checks.iter().partition(|c| c.verdict == Verdict::Pass);
        shown.extend(passed.into_iter().filter(|_| is_single));
        shown.into_iter().map(move |check| row(of, check))
    });
    Table::new(
        match is_single {
            true => "Limits",
            false => "Limits that are not kept, or not certainly",
        },
        columns("unit | | unit | from nominal | limit | P(within) | verdict"),
    )
    .section(rows)
    .note("A unit passes a limit if the probability of being within it is at least the stated confidence, and fails \
        if the probability of being outside is.")
}
