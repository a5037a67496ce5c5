//! Report on a lot: every parameter of every unit, mean and spread, limits, outliers, trends.

mod data;
mod figures;
mod shown;
mod tables;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use shown::{change, title, verdict};

use crate::imu::AXES;
use crate::lot::{FALSE_ALARM, FALSE_TREND, Lot, Row, Verdict};
use crate::report::prelude::*;

/// The complete report on a lot.
pub fn document(lot: &Lot) -> Document {
    let mut document = Document::new(match &lot.rows[..] {
        [row] => row.unit.name.clone(),
        rows => format!("Lot of {} units", count(rows.len())),
    });
    document.verdict = verdict(lot);
    document.lead = vec![format!(
        "General form, body frame: {}. Scale factors are deviations from the nominal values of the lot. Every σ is 1σ.",
        lot.body_frame.words()
    )];
    let failures = lot.failures();
    let failures = failures.map(|(unit, reason)| (false, format!("{}: {reason}", unit.name)));
    let sentences = [
        failures.collect(),
        kept(lot),
        outliers(lot),
        nominal(lot),
        findings(lot),
        trends(lot),
    ];
    for (good, text) in sentences.into_iter().flatten() {
        document.say(good, text);
    }
    document.both(tables::limits(lot));
    // A single unit has no lot to be compared with.
    if lot.rows.len() != 1 {
        document.both(facts(lot));
        document.both(tables::units(lot));
        document.page(figures::parameters(lot));
        document.both(tables::parameters(lot));
        document.page(figures::noise(lot));
        document.both(tables::noise(lot));
        document.pages(tables::values(lot));
    }
    document.data = data::data(lot);
    document.files = vec![("lot.csv".to_owned(), data::csv(&document.data))];
    document
}

/// A conclusion or a warning.
type Sentence = (bool, String);

fn facts(lot: &Lot) -> Facts {
    let failed = lot.failures().count();
    let mut facts = Facts::new("Lot", [("units", count(lot.rows.len()))]);
    facts.push("calibrated", count(lot.rows.len() - failed));
    if let Some(gravity) = lot.shared_gravity {
        facts.push(
            "gravity",
            format!(
                "the same for all units, 1σ {:.1} ppm: included in every σ of accelerometer K and in their mean, but \
                 not in their scatter",
                gravity / PPM
            ),
        );
    }
    facts
}

fn kept(lot: &Lot) -> Vec<Sentence> {
    let Some(specification) = &lot.specification else {
        return Vec::new();
    };
    let names = |verdict: Verdict| {
        let of = lot.rows.iter().filter(|row| row.verdict == Some(verdict));
        of.map(|row| row.unit.name.as_str()).collect::<Vec<_>>()
    };
    let percent = 100.0 * specification.confidence;
    let failing = names(Verdict::Fail);
    let failed: Vec<&str> = lot.failures().map(|(unit, _)| unit.name.as_str()).collect();
    let mut undecided = names(Verdict::NotDecided);
    undecided.retain(|name| !failed.contains(name));
    let mut sentences = Vec::new();
    if !failing.is_empty() {
        let names = failing.join(", ");
        sentences.push((
            false,
            format!("Outside a limit with {percent} % confidence: {names}."),
        ));
    }
    if !undecided.is_empty() {
        let words = format!(
            "Not decided with {percent} % confidence: {}. A decision needs a smaller σ.",
            undecided.join(", ")
        );
        sentences.push((false, words));
    }
    if sentences.is_empty() {
        let words =
            format!("All calibrated units are within all limits with {percent} % confidence.");
        sentences.push((true, words));
    }
    sentences
}

fn outliers(lot: &Lot) -> Vec<Sentence> {
    let of_unit = |(place, row): (usize, &Row)| {
        let apart = lot.outliers_of(place).map(|of| title(of.quantity));
        let apart = apart.collect::<Vec<_>>().join(", ");
        let words = format!(
            "{} is an outlier in {apart}; the means and spreads of these parameters exclude it.",
            row.unit.name
        );
        (!apart.is_empty()).then_some((false, words))
    };
    let sentences: Vec<Sentence> = lot.rows.iter().enumerate().filter_map(of_unit).collect();
    match sentences.is_empty() && lot.rows.len() > 1 {
        true => vec![(
            true,
            format!(
                "No unit is an outlier (false-alarm rate {} % per lot).",
                100.0 * FALSE_ALARM
            ),
        )],
        false => sentences,
    }
}

/// Units of one type have one nominal scale; units with a different one are named if most state the same.
fn nominal(lot: &Lot) -> Vec<Sentence> {
    let stated = lot.rows.iter().filter(|row| row.unit.calibrated.is_ok());
    let other = |row: &Row| {
        let (sensor, axis, off) = row.nominal_off(&lot.nominal)?;
        let words = format!(
            "{} states a different nominal scale from the lot ({} {}, {} ppm off); its scale factors are relative to \
             the nominal scale of the lot.",
            row.unit.name,
            sensor.name(),
            AXES[axis],
            three_digits(off / PPM)
        );
        Some((false, words))
    };
    let others: Vec<Sentence> = stated.clone().filter_map(other).collect();
    match 2 * others.len() > stated.count() {
        true => Vec::new(),
        false => others,
    }
}

/// Findings of the unit calibrations, by kind.
fn findings(lot: &Lot) -> Vec<Sentence> {
    let mut kinds: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    let calibrated = lot.rows.iter().filter_map(|row| {
        let of = row.unit.calibrated.as_ref().ok()?;
        Some((row.unit.name.as_str(), &of.calibration.findings))
    });
    for (name, findings) in calibrated.clone() {
        for finding in findings {
            let kind = format!("{} {}", finding.code, finding.kind.replace('-', " "));
            let units = kinds.entry(kind).or_default();
            if units.last() != Some(&name) {
                units.push(name);
            }
        }
    }
    let all = calibrated.count();
    let sentence = |(kind, units): (String, Vec<&str>)| {
        let who = match units.len() == all {
            true => "all units".to_owned(),
            false => units.join(", "),
        };
        (false, format!("Reports with finding `{kind}`: {who}."))
    };
    kinds.into_iter().map(sentence).collect()
}

fn trends(lot: &Lot) -> Vec<Sentence> {
    let trends = lot.statistics.iter().flat_map(|of| {
        let words = |trend| (false, change(of.quantity, trend));
        of.trends.iter().map(words)
    });
    let sentences: Vec<Sentence> = trends.collect();
    match sentences.is_empty() && lot.rows.len() > 1 {
        true => vec![(
            true,
            format!(
                "No trend with serial number or date, where stated (false-alarm rate {} % per lot).",
                100.0 * FALSE_TREND
            ),
        )],
        false => sentences,
    }
}
