//! The report of a lot: every parameter of every unit, mean and spread, limits, outliers, trends.

mod data;
mod figures;
mod shown;
mod tables;
#[cfg(test)]
mod tests;
mod verdict;

use std::collections::BTreeMap;

use shown::{change, title};

use crate::imu::AXES;
use crate::lot::{FALSE_ALARM, FALSE_TREND, Lot, Row, Verdict};
use crate::report::prelude::*;

/// Everything that is said of a lot.
pub fn document(lot: &Lot) -> Document {
    let units = lot.rows.len();
    let mut document = Document::new(match &lot.rows[..] {
        [row] => row.unit.name.clone(),
        _ => format!("Lot of {} units", count(units)),
    });
    document.verdict = verdict::of(lot);
    document.lead = vec![format!(
        "General form, body frame: {}. Scale factors are departures from the lot's nominal ones. Every σ is 1σ.",
        lot.body_frame.words()
    )];
    say_failures(lot, &mut document);
    say_verdicts(lot, &mut document);
    say_outliers(lot, &mut document);
    say_nominal(lot, &mut document);
    say_findings(lot, &mut document);
    say_trends(lot, &mut document);
    document.both(tables::undecided(lot));
    document.both(facts(lot));
    document.both(tables::units(lot));
    document.page(figures::parameters(lot));
    document.both(tables::parameters(lot));
    document.page(figures::noise(lot));
    document.both(tables::noise(lot));
    document.pages(tables::values(lot));
    document.data = data::data(lot);
    document.files = vec![("lot.csv".to_owned(), data::csv(lot))];
    document
}

fn facts(lot: &Lot) -> Facts {
    let failed = lot.failures().count();
    let mut facts = Facts::new("Lot", [("units", count(lot.rows.len()))]);
    facts.push("calibrated", count(lot.rows.len() - failed));
    if let Some(specification) = &lot.specification {
        let of = |verdict| {
            let with = lot.rows.iter().filter(|row| row.verdict == Some(verdict));
            format!("{} {}", verdict.name(), count(with.count()))
        };
        let all = [Verdict::Pass, Verdict::NotDecided, Verdict::Fail].map(of);
        facts.push(
            "specification",
            format!(
                "{}; each limit at a confidence of {} %",
                all.join(", "),
                100.0 * specification.confidence
            ),
        );
    }
    if let Some(gravity) = lot.shared_gravity {
        facts.push(
            "gravity",
            format!(
                "the same for all, 1σ {:.1} ppm: in every σ of accelerometer K and in their mean, not in their scatter",
                gravity / PPM
            ),
        );
    }
    facts
}

fn say_failures(lot: &Lot, document: &mut Document) {
    for (unit, reason) in lot.failures() {
        document.say(false, format!("{}: {reason}", unit.name));
    }
}

fn say_verdicts(lot: &Lot, document: &mut Document) {
    let Some(specification) = &lot.specification else {
        return;
    };
    let names = |verdict: Verdict| {
        let of = lot.rows.iter().filter(|row| row.verdict == Some(verdict));
        of.map(|row| row.unit.name.as_str()).collect::<Vec<_>>()
    };
    let percent = 100.0 * specification.confidence;
    let failing = names(Verdict::Fail);
    if !failing.is_empty() {
        let words = format!(
            "Outside a limit with {percent} % confidence: {}.",
            failing.join(", ")
        );
        document.say(false, words);
    }
    let failed: Vec<&str> = lot.failures().map(|(unit, _)| unit.name.as_str()).collect();
    let mut undecided = names(Verdict::NotDecided);
    undecided.retain(|name| !failed.contains(name));
    if !undecided.is_empty() {
        let words = format!(
            "Not decided with {percent} % confidence: {}. A smaller σ decides.",
            undecided.join(", ")
        );
        document.say(false, words);
    }
    if failing.len() + undecided.len() == 0 {
        let words =
            format!("All calibrated units are within all limits with {percent} % confidence.");
        document.say(true, words);
    }
}

fn say_outliers(lot: &Lot, document: &mut Document) {
    let mut any = false;
    for (place, row) in lot.rows.iter().enumerate() {
        let apart: Vec<String> = lot
            .outliers_of(place)
            .map(|of| title(of.quantity))
            .collect();
        if !apart.is_empty() {
            any = true;
            let words = format!(
                "{} is apart from the lot in {}; means and spreads there are without it.",
                row.unit.name,
                apart.join(", ")
            );
            document.say(false, words);
        }
    }
    if !any && lot.rows.len() > 1 {
        let percent = 100.0 * FALSE_ALARM;
        let words = format!(
            "No unit is apart from the others; a sound lot has one named in {percent} % of all cases."
        );
        document.say(true, words);
    }
}

/// Units of one type have one nominal scale: who states another is named, where most state the same.
fn say_nominal(lot: &Lot, document: &mut Document) {
    let same = |row: &Row| row.nominal_off(&lot.nominal).is_none();
    let stated = lot.rows.iter().filter(|row| row.unit.calibrated.is_ok());
    let others: Vec<&Row> = stated.clone().filter(|row| !same(row)).collect();
    if 2 * others.len() > stated.count() {
        return;
    }
    for row in others {
        if let Some((sensor, axis, off)) = row.nominal_off(&lot.nominal) {
            document.say(
                false,
                format!(
                    "{} states another nominal scale than the lot: {} {}, {} ppm off; its scale factors are given \
                     against the lot's.",
                    row.unit.name,
                    sensor.name(),
                    AXES[axis],
                    three_digits(off / PPM)
                ),
            );
        }
    }
}

/// What the units' own calibrations warn of, by kind.
fn say_findings(lot: &Lot, document: &mut Document) {
    let mut kinds: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for row in &lot.rows {
        let calibration = row.unit.calibrated.as_ref().ok().map(|of| &of.calibration);
        let findings = calibration.into_iter().flat_map(|c| &c.findings);
        for finding in findings {
            let units = kinds.entry(finding.kind.as_str()).or_default();
            if units.last() != Some(&row.unit.name.as_str()) {
                units.push(&row.unit.name);
            }
        }
    }
    let calibrated = lot
        .rows
        .iter()
        .filter(|row| row.unit.calibrated.is_ok())
        .count();
    for (kind, units) in kinds {
        let who = match units.len() == calibrated {
            true => "all units".to_owned(),
            false => units.join(", "),
        };
        let words = format!("Their own reports warn of `{kind}`: {who}.");
        document.say(false, words);
    }
}

fn say_trends(lot: &Lot, document: &mut Document) {
    let told: usize = lot.statistics.iter().map(|of| of.trends.len()).sum();
    for statistics in &lot.statistics {
        for trend in &statistics.trends {
            document.say(false, change(statistics.quantity, trend));
        }
    }
    if told == 0 {
        let percent = 100.0 * FALSE_TREND;
        let words = format!(
            "No trend with serial or date, as far as runs state them; a lot without one has one told in \
             {percent} % of all cases."
        );
        document.say(true, words);
    }
}
