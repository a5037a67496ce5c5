//! The report of a lot: every parameter of every unit, mean and spread, limits, outliers, trends.

mod data;
mod figures;
mod rows;
mod shown;
mod tables;
#[cfg(test)]
mod tests;

use super::document::{Document, Facts};
use super::number::count;
use crate::lot::{FALSE_ALARM, FALSE_TREND, Lot, Statistics, Verdict};
use shown::{change, title};

/// Everything that is said of a lot.
pub fn document(lot: &Lot) -> Document {
    let units = lot.rows.len();
    let mut document = Document::new(format!("Lot of {} units", count(units)));
    document.lead = vec![format!(
        "General form, body frame: {}. Scale factors are departures from the lot's nominal ones. Every σ is 1σ.",
        lot.body_frame.words()
    )];
    say_failures(lot, &mut document);
    say_verdicts(lot, &mut document);
    say_outliers(lot, &mut document);
    say_trends(lot, &mut document);
    document.both(facts(lot));
    document.both(tables::units(lot));
    document.page(figures::parameters(lot));
    document.both(tables::parameters(lot));
    document.page(figures::noise(lot));
    document.both(tables::noise(lot));
    for table in tables::values(lot) {
        document.page(table);
    }
    document.page(tables::undecided(lot));
    document.data = data::data(lot);
    document.files = vec![("lot.csv".to_owned(), rows::csv(lot))];
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
                gravity / crate::units::PPM
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
    let undecided = names(Verdict::NotDecided);
    if !undecided.is_empty() {
        let words = format!(
            "Not decided with {percent} % confidence: {}. A smaller σ decides.",
            undecided.join(", ")
        );
        document.say(false, words);
    }
    if failing.len() + undecided.len() == 0 {
        let words = format!("All units are within all limits with {percent} % confidence.");
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
    if !any {
        let percent = 100.0 * FALSE_ALARM;
        let words = format!(
            "No unit is apart from the others; a sound lot has one named in {percent} % of all cases."
        );
        document.say(true, words);
    }
}

fn say_trends(lot: &Lot, document: &mut Document) {
    let trends = |of: &'static str| move |statistics: &Statistics| (of, statistics.trends.len());
    let told: usize = lot.statistics.iter().map(trends("")).map(|t| t.1).sum();
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
