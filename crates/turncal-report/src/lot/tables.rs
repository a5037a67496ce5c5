//! Tables of a comparison.

use super::shown::{difference, in_unit, shown, spread, symbol, title};
use crate::prelude::*;
use turncal::calibration::Nees;
use turncal::imu::Sensor;
use turncal::lot::{Check, FALSE_ALARM, Lot, Quantity, Row, Sample, Statistics, Verdict};

/// Largest number of calibrations with a column each.
const SIDE_BY_SIDE: usize = 5;
/// Differences beyond this many σ are flagged.
const FLAGGED: f64 = 3.0;

/// Columns of a table: heading, and the cell of each row.
struct Columns<'a, R>(Vec<(String, Cell<'a, R>)>);

type Cell<'a, R> = Box<dyn Fn(R) -> String + 'a>;

impl<'a, R: Copy> Columns<'a, R> {
    fn push(&mut self, heading: impl Into<String>, cell: impl Fn(R) -> String + 'a) {
        self.0.push((heading.into(), Box::new(cell)));
    }

    fn headings(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(|(heading, _)| heading.as_str())
    }

    fn row(&self, of: R) -> Vec<String> {
        self.0.iter().map(|(_, cell)| cell(of)).collect()
    }
}

/// One row per calibration.
pub fn units(lot: &Lot) -> Table {
    type Of<'a> = (usize, &'a Row);
    let mut columns = Columns::<Of>(Vec::new());
    columns.push("", |(_, row)| row.unit.name.clone());
    for key in ["serial", "date"] {
        if lot.rows.iter().any(|row| row.unit.meta.contains_key(key)) {
            columns.push(key, move |(_, row)| {
                row.unit.meta.get(key).cloned().unwrap_or(NONE.to_owned())
            });
        }
    }
    let optional = (1..columns.0.len()).collect();
    if lot.specification.is_some() {
        columns.push("verdict", |(_, row)| verdict(row));
    }
    if lot.truth.is_some() {
        let mut push = |heading: &str, cell: fn(Nees) -> String| {
            columns.push(heading, move |(_, row)| {
                row.nees.map_or(NONE.to_owned(), cell)
            });
        };
        push("NEES/n", |of| value(of.mean, 0.1));
        push("95 % interval", |of| interval(of.interval));
        push("n", |of| count(of.count));
    }
    columns.push("NIS", |(_, row)| nis(row));
    columns.push("calibration", |(_, row)| word_and_codes(row));
    if lot.rows.len() > 2 {
        columns.push("outlier in", move |(place, _)| outlier_in(lot, place));
    }
    let mut table = Table::new("Calibrations", columns.headings())
        .section(lot.rows.iter().enumerate().map(|of| columns.row(of)));
    table.optional = optional;
    if lot.truth.is_some() {
        table = table.note("NEES/n: mean squared error relative to its covariance, 1 if the covariance is correct.");
    }
    if lot.rows.len() > 2 {
        table = table.note(format!(
            "Outlier: farther from the mean of the other values than their scatter explains (false-alarm rate {} % \
             for all rows together); outliers are excluded from mean, scatter and spread.",
            100.0 * FALSE_ALARM
        ));
    }
    table.note("NIS: mean over all observations, 1 if the σ are correct.")
}

fn nis(row: &Row) -> String {
    let calibrated = row.unit.calibrated.as_ref().ok();
    let consistency = calibrated.and_then(|of| of.calibration.consistency.as_ref());
    or_dash(consistency.map(|of| of.all.nis), |nis| value(nis, 0.1))
}

/// The verdict and the findings of a calibration that can be used.
fn word_and_codes(row: &Row) -> String {
    let (Ok(_), Ok(of)) = (&row.canonical, &row.unit.calibrated) else {
        return "not calibrated".to_owned();
    };
    let word = of.calibration.word().map(|word| word.to_string());
    let codes = of.calibration.findings.iter().map(|of| of.code.clone());
    let mut all: Vec<String> = word.into_iter().chain(codes).collect();
    all.dedup();
    if all.is_empty() {
        return NONE.to_owned();
    }
    all.join(" ")
}

fn outlier_in(lot: &Lot, place: usize) -> String {
    let names: Vec<String> = lot
        .outliers_of(place)
        .map(|of| title(of.quantity))
        .collect();
    match names.len() {
        0 => NONE.to_owned(),
        1..=3 => names.join(", "),
        more => format!("{}, {} more", names[..2].join(", "), more - 2),
    }
}

/// The verdict with the limit that decides it.
fn verdict(row: &Row) -> String {
    let word = row.verdict.map_or(NONE, Verdict::name);
    let decides = |check: &&Check| Some(check.verdict) == row.verdict;
    match row.checks.iter().find(decides) {
        Some(check) if row.canonical.is_ok() && check.verdict != Verdict::Pass => {
            format!("{word}: {}", title(check.quantity()))
        }
        _ => word.to_owned(),
    }
}

/// Table of every quantity. Up to a few calibrations are shown side by side, with the truth or the difference; for
/// three or more, the table shows a mean and a scatter.
pub fn quantities(lot: &Lot) -> Table {
    let mut columns = Columns::<Quantity>(Vec::new());
    columns.push("", title);
    columns.push("unit", |quantity| symbol(lot, quantity));
    let few = || lot.rows.iter().filter(|_| lot.rows.len() <= SIDE_BY_SIDE);
    for row in lot
        .truth
        .iter()
        .chain(few().filter(|_| lot.truth.is_none()))
    {
        columns.push(row.unit.name.as_str(), move |of| one(lot, row, of));
    }
    let differing = few().skip(usize::from(lot.truth.is_none()));
    for row in differing.filter(|_| lot.reference().is_some()) {
        let minus = move |of: Quantity| Some(difference(of, lot.difference(row, of)?));
        let heading = match lot.truth {
            Some(_) => row.unit.name.as_str(),
            None => "difference",
        };
        columns.push(heading, move |of| minus(of).unwrap_or(NONE.to_owned()));
        columns.push("in σ", move |of| {
            let difference = lot.difference(row, of);
            flagged(difference.and_then(Sample::in_sigma))
        });
    }
    if lot.rows.len() > 2 {
        push_statistics(&mut columns, lot);
    }
    let rows = |sensor: Sensor| {
        let is = move |of: &Quantity| matches!(of, Quantity::Parameter(k) if Group::of(*k).sensor() == sensor);
        lot.quantities()
            .filter(is)
            .map(|of| columns.row(of))
            .collect::<Vec<_>>()
    };
    let others = |is: fn(&Quantity) -> bool| lot.quantities().filter(is).map(|of| columns.row(of));
    let table = Table::new("Parameters", columns.headings())
        .sections(Sensor::ALL.map(rows))
        .section(others(|of| matches!(of, Quantity::Auxiliary(_))))
        .section(others(|of| matches!(of, Quantity::Magnetic(_))))
        .section(others(|of| matches!(of, Quantity::Noise(..))));
    notes(lot, table)
}

fn push_statistics<'a>(columns: &mut Columns<'a, Quantity>, lot: &'a Lot) {
    let mut push = |heading: &str, cell: fn(&Statistics) -> String| {
        columns.push(heading, move |quantity| {
            let of = lot.statistics_of(quantity);
            of.map_or(NONE.to_owned(), cell)
        });
    };
    push("mean", |of| {
        let (value, own) = shown(of.quantity, of.mean());
        plus_minus(value, own)
    });
    push("scatter", |of| {
        sigma(in_unit(of.quantity, of.scatter.deviation))
    });
    push("χ²/n", |of| {
        or_dash(
            of.scatter.chi_square.map(|of| of.value / of.freedom as f64),
            ratio,
        )
    });
    push("p", |of| {
        let flag = if of.real { "! " } else { "" };
        or_dash(of.scatter.chi_square.map(|of| of.p), |p| {
            format!("{flag}{}", chance(p))
        })
    });
    push("spread", |of| spread(of.quantity, &of.scatter.spread));
    if lot.statistics.iter().any(|of| !of.outliers.is_empty()) {
        push("outliers", |of| match of.outliers.len() {
            0 => NONE.to_owned(),
            some => format!("{} of {}", count(some), count(of.count)),
        });
    }
}

/// χ²/n, rounded if far beyond chance.
fn ratio(of: f64) -> String {
    const FAR: f64 = 1000.0;
    if of > FAR {
        format!("> {FAR}")
    } else {
        three_digits(of)
    }
}

/// A difference in units of its σ, flagged if it is large.
fn flagged(in_sigma: Option<f64>) -> String {
    or_dash(in_sigma, |z| {
        let flag = if z.abs() > FLAGGED { "! " } else { "" };
        format!("{flag}{}", value(z, 1.0))
    })
}

/// The value of one calibration; if it states no σ, with as many digits as the most accurate one.
fn one(lot: &Lot, row: &Row, quantity: Quantity) -> String {
    let Some(sample) = row.sample(quantity) else {
        return NONE.to_owned();
    };
    let (size, own) = shown(quantity, sample);
    if own > 0.0 {
        return plus_minus(size, own);
    }
    let all = lot.rows.iter().filter_map(|row| row.sample(quantity));
    let finest = all.map(|of| shown(quantity, of).1).filter(|own| *own > 0.0);
    finest
        .reduce(f64::min)
        .map_or_else(|| three_digits(size), |finest| value(size, finest))
}

fn notes(lot: &Lot, mut table: Table) -> Table {
    if !lot.nominal_is_stated
        && let Some(first) = lot.truth.iter().chain(&lot.rows).next()
    {
        let name = &first.unit.name;
        table = table.note(format!(
            "No calibration states nominal scale factors, so K is the deviation from K of {name}."
        ));
    }
    table = match &lot.truth {
        Some(truth) => table.note(format!(
            "Each column: difference from {} ± 1σ; ! marks differences of more than {FLAGGED} σ.",
            truth.unit.name
        )),
        None if lot.rows.len() == 2 => table.note(format!(
            "± 1σ. The σ of the difference is valid only if the calibrations are from different data; ! marks \
             differences of more than {FLAGGED} σ."
        )),
        None => table,
    };
    if lot.rows.len() > 2 {
        table = table
            .note("Mean: weighted by spread and σ, ± 1σ of the mean. Scatter: sample standard deviation.")
            .note(format!(
                "χ²/n: scatter compared with the stated σ; p: probability of at least this scatter if the stated σ \
                 alone cause it; ! marks scatter that the σ do not explain (false-alarm rate {} % for all rows \
                 together).",
                100.0 * FALSE_ALARM
            ))
            .note("Spread: 1σ between units after subtraction of their σ, or the 95 % limit of the spread if it is \
            not significant.");
    }
    table = shared_errors(lot, table);
    match lot.joint {
        Some(joint) => table.note(format!(
            "All parameters of gyros and accelerometers with their correlations: χ²/n {}, n = {}, p = {}. If p is near \
             0, the calibrations differ by more than their σ; if p is near 1, the σ are too large.",
            ratio(joint.value / joint.freedom as f64),
            count(joint.freedom),
            chance(joint.p)
        )),
        None => table,
    }
}

/// Notes on the errors that all calibrations have in common.
fn shared_errors(lot: &Lot, mut table: Table) -> Table {
    let (gravity, field) = (lot.shared.gravity, lot.shared.field);
    for (error, of, quantity) in [
        ("gravity error", gravity, "accelerometer K"),
        (
            "error of the magnetic field",
            field,
            "the magnetometer matrix",
        ),
    ] {
        if let Some(of) = of.filter(|_| lot.rows.len() > 1) {
            table = table.note(format!(
                "The {error}, which is the same for all calibrations (1σ {} ppm), is part of every σ of {quantity} and \
                 of the σ of their mean, but not of the scatter or of differences between calibrations.",
                three_digits(of / PPM)
            ));
        }
    }
    table
}

/// For a single unit, all limits (exceeded limits first); for several units, only limits that are exceeded or
/// undecided.
pub fn limits(lot: &Lot) -> Table {
    let row = |row: &Row, check: &Check| {
        let quantity = check.quantity();
        let off = check
            .off
            .map(|(value, sigma)| difference(quantity, Sample { value, sigma }));
        cells![
            row.unit.name.as_str(),
            title(quantity),
            symbol(lot, quantity),
            off.unwrap_or_else(|| NONE.to_owned()),
            format!("±{}", stated(in_unit(quantity, check.limit.within))),
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
    let heading = if is_single {
        "Limits"
    } else {
        "Limits that are exceeded or undecided"
    };
    Table::new(heading, columns("unit | | unit | from nominal | limit | P(within) | verdict"))
        .section(rows)
        .note(
            "A unit passes a limit if the probability of being within the limit is at least the stated confidence, and \
             fails if the probability of being outside is at least the stated confidence.",
        )
}
