//! Sources of the uncertainty: tables and stacked bars.

use crate::prelude::*;
use turncal::calibration::{Budget, BudgetPart, BudgetSource, Estimate, ParameterVector};
use turncal::earth::ROTATION_RATE;
use turncal::imu::Sensor;

/// Number of sources with separate colours; the others share one.
const SHOWN: usize = 5;
/// Usual resolution of a stated latitude, rad.
const LATITUDE: f64 = 1e-3 * DEGREE;
/// A source is shown if it contributes at least this fraction of a variance.
const NAMED: f64 = 1e-3;

/// RMS of the standard uncertainties of a group, by source and combined.
pub fn table(budget: &Budget, estimate: &Estimate) -> Table {
    let row = |name: &str, u: ParameterVector, freedom: &str| {
        let mut row = vec![name.to_owned()];
        row.extend(Group::all().map(|group| or_dash(group.rms(&u, estimate), three_digits)));
        row.push(freedom.to_owned());
        row
    };
    let root = |part: &BudgetPart| part.covariance.diagonal().map(|v| v.max(0.0).sqrt());
    let parts = shown(budget, estimate);
    let rows = parts.iter().map(|part| {
        let freedom = match part.degrees_of_freedom {
            freedom if freedom.is_finite() => sigma(freedom),
            _ => "∞".to_owned(),
        };
        row(&part.source.name(), root(part), &freedom)
    });
    let combined = budget.covariance().diagonal().map(f64::sqrt);
    let factors = Group::all().map(|group| {
        let of = group.estimated(estimate).into_iter();
        of.map(|i| budget.coverage_factor(i)).reduce(f64::max)
    });
    let mut coverage = vec!["coverage factor k, 95.45 %".to_owned()];
    coverage.extend(factors.map(|k| or_dash(k, |k| value(k, 0.1))));
    coverage.push(String::new());
    let columns = [group_columns("source"), vec!["ν".to_owned()]].concat();
    let mut table = Table::new("Uncertainty budget", columns)
        .section(rows)
        .section([
            row("combined standard uncertainty", combined, ""),
            coverage,
        ])
        .note(
            "Standard uncertainty contributed by each source, RMS over the parameters of a group; the sum of the \
             squares is the variance of the estimate (JCGM 100). Sources that contribute less than a thousandth of \
             every variance are not shown; calibration.json lists all sources for each parameter.",
        )
        .note(
            "ν: degrees of freedom of each source, infinite if its variance is stated. k: coverage factor from \
             Student's t with the effective degrees of freedom, largest value in the group.",
        );
    table.notes.extend(taken_as_exact(budget));
    table
}

/// Inputs that are not in the budget, with their effect on the parameters.
fn taken_as_exact(budget: &Budget) -> Option<String> {
    let latitude = format!(
        "the latitude of the site (0.001° changes gyro biases by up to {} °/h)",
        three_digits(ROTATION_RATE * LATITUDE / DEG_PER_H)
    );
    let gravity = "gravity (1 mGal changes every accelerometer scale factor by 1.02 ppm)";
    let inputs = [
        (BudgetSource::EarthRate, latitude),
        (BudgetSource::Gravity, gravity.to_owned()),
    ];
    let is_source = |source: BudgetSource| budget.parts.iter().any(|part| part.source == source);
    let exact = inputs.into_iter().filter(|(source, _)| !is_source(*source));
    let exact: Vec<String> = exact.map(|(_, input)| input).collect();
    (!exact.is_empty()).then(|| format!("Taken as exact: {}.", exact.join(" and ")))
}

/// The relevant sources, the largest first.
fn shown<'a>(budget: &'a Budget, estimate: &Estimate) -> Vec<&'a BudgetPart> {
    let shares = |part| estimate.estimated().map(move |i| share(part, estimate, i));
    let parts = budget.parts.iter();
    let mut parts: Vec<&BudgetPart> = parts
        .filter(|part| shares(part).any(|share| share >= NAMED))
        .collect();
    let total = |part| shares(part).sum::<f64>();
    parts.sort_by(|a, b| total(b).total_cmp(&total(a)));
    parts
}

fn share(part: &BudgetPart, estimate: &Estimate, index: usize) -> f64 {
    part.covariance[(index, index)] / estimate.covariance[(index, index)]
}

/// The largest source of the variance of a group, with its share.
pub fn largest(budget: &Budget, group: &[usize]) -> Option<String> {
    let sum = |part: &BudgetPart| group.iter().map(|&i| part.covariance[(i, i)]).sum::<f64>();
    let all: f64 = budget.parts.iter().map(sum).sum();
    let part = budget
        .parts
        .iter()
        .max_by(|a, b| sum(a).total_cmp(&sum(b)))?;
    let percent = 100.0 * sum(part) / all;
    (all > 0.0).then(|| format!("{} {percent:.0} %", part.source.name()))
}

/// Shares of every variance, one bar per parameter.
pub fn figure(budget: &Budget, estimate: &Estimate) -> Plot {
    let parts = shown(budget, estimate);
    let own = &parts[..parts.len().min(SHOWN)];
    let form = estimate.form();
    let panel = |sensor: Sensor| {
        let groups = Group::all().filter(|group| group.sensor() == sensor);
        let indices: Vec<usize> = groups.flat_map(|group| group.estimated(estimate)).collect();
        let name = |&i: &usize| {
            let letter = Group::of(i).short();
            let letter = letter.rsplit(' ').next().unwrap_or_default();
            format!("{letter} {}", axis_name(form, i))
        };
        let mut floor = vec![0.0; indices.len()];
        let mut panel = Panel::new(
            format!("{}, %", sensor.name()),
            Axis::places(indices.iter().map(name)).room(0.5, 0.5),
            Axis::linear("").between(0.0, 100.0),
        );
        let mut stack = |heights: &dyn Fn(usize) -> f64, color: Color, key: &str| {
            let blocks = indices.iter().zip(&mut floor).enumerate();
            let blocks = blocks.map(|(n, (&i, floor))| {
                let low = *floor;
                *floor += 100.0 * heights(i);
                (n as f64, low, *floor)
            });
            let bars = Series::bars(0.35, blocks);
            bars.color(color).key(key)
        };
        for (n, part) in own.iter().enumerate() {
            let of = |i: usize| share(part, estimate, i);
            let color = Color::Nth(n);
            panel = panel.with(stack(&of, color, &part.source.name()));
        }
        let others = |i: usize| {
            let of_own: f64 = own.iter().map(|part| share(part, estimate, i)).sum();
            (1.0 - of_own).max(0.0)
        };
        panel.with(stack(&others, Color::Quiet, "others"))
    };
    Plot::new(
        "budget.svg",
        "Where the uncertainty comes from",
        (1, 240),
        Sensor::ALL.map(panel),
    )
    .caption(
        "Share of each source in the variance of every parameter. Improve the largest source first: reduce noise with \
         more time at rest, table position errors with more positions, and the prior with a path that excites the \
         parameter.",
    )
}
