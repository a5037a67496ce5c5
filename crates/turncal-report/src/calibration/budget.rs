//! Sources of the uncertainty: tables and stacked bars.

use super::super::terms::title;
use super::report::Report;
use crate::prelude::*;
use turncal::calibration::{Budget, BudgetPart, ErrorTermTest, Estimate, ParameterVector};
use turncal::earth::ROTATION_RATE;
use turncal::imu::Sensor;

/// Number of sources with separate colours; the others share one.
const SHOWN: usize = 5;
/// Usual resolution of a stated latitude, rad.
const LATITUDE: f64 = 1e-3 * DEGREE;
/// Maximum number of unobservable error terms that are named.
const NAMED_TERMS: usize = 3;
/// A source is named if it contributes at least this fraction of a variance.
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
    Table::new("Uncertainty budget", columns)
        .section(rows)
        .section([
            row("combined standard uncertainty", combined, ""),
            coverage,
        ])
        .note(
            "Standard uncertainty contributed by each source, RMS over the parameters of a group; squares add up to \
             the variance of the estimate (JCGM 100). Sources below a thousandth of every variance are not shown; \
             calibration.json lists all of them per parameter.",
        )
        .note(
            "ν: degrees of freedom of each source, infinite if stated. k: from Student's t with the effective \
             degrees of freedom, largest of the group.",
        )
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
        "Share of each source in the variance of every parameter. Improve the largest source first: noise with more \
         time at rest, table position with more positions, the prior with a path that excites the parameter.",
    )
}

/// Effects not included in σ: undetectable error terms that change a group by more than its σ.
pub fn unseen(report: &Report, estimate: &Estimate) -> Option<String> {
    let claimed = estimate.sigma();
    let worst = |test: &ErrorTermTest| {
        let left_off = test.left_off.filter(|_| !test.significant())?;
        let of_group = |group: Group| {
            let [may, sigma] = [&left_off.shown, &claimed].map(|v| group.rms(v, estimate));
            Some((group, may? / sigma?))
        };
        let groups = Group::all().filter_map(of_group);
        groups
            .filter(|&(_, times)| times > 1.0)
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(group, times)| (test.term, group, times))
    };
    let mut unseen: Vec<_> = report.effects.iter().filter_map(worst).collect();
    unseen.sort_by(|a, b| b.2.total_cmp(&a.2));
    let named = unseen.iter().take(NAMED_TERMS).map(|(term, group, times)| {
        let (name, group, times) = (term.name(), group.short(), three_digits(*times));
        format!("{name} (may change {group} by {times} σ)")
    });
    let mut named: Vec<String> = named.collect();
    let more = unseen.len() - named.len();
    named.extend((more > 0).then(|| format!("{more} more")));
    let named = named.join(", ");
    (!named.is_empty())
        .then(|| format!("{named}: not visible in this recording, so not included in σ"))
}

/// Effects not included in any sum: error terms that are not estimated.
pub fn left_off(report: &Report, estimate: &Estimate) -> Table {
    let row = |test: &ErrorTermTest| {
        let left_off = test.left_off?;
        let mut row = cells![title(test.term)];
        let changes = Group::all().map(|group| group.rms(&left_off.shown, estimate));
        row.extend(changes.map(|change| or_dash(change, sigma)));
        Some(row)
    };
    let gravity = if report.run.site.gravity_sigma > 0.0 {
        ""
    } else {
        " and gravity (1 mGal changes every accelerometer scale factor by 1.02 ppm)"
    };
    Table::new(
        "Possible effect of error terms that are not estimated",
        group_columns("term"),
    )
    .section(report.effects.iter().filter_map(row))
    .note(format!(
        "Taken as exact: the latitude of the site (0.001° changes gyro biases by up to {} °/h){gravity}.",
        three_digits(ROTATION_RATE * LATITUDE / DEG_PER_H),
    ))
    .note(
        "Not included in the sums above. RMS change of the parameters of a group if the term is as large as the data \
         allow. If it matters, estimate the term with --with.",
    )
}
