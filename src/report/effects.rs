//! What each error term costs and explains: tables, and a sentence where NIS betrays an error that is not
//! modelled.

use super::terms::title;
use crate::calibration::ErrorTermTest;
use crate::report::prelude::*;

/// Costs of the error terms that were on.
pub(super) fn costs(effects: &[ErrorTermTest]) -> Table {
    let row = |effect: &ErrorTermTest| {
        let cells = effect.sigma_factors.iter();
        let cells = cells.map(|cost| cost.map_or(NONE.to_owned(), |cost| value(cost, 0.1)));
        let name = title(effect.term).to_owned();
        std::iter::once(name).chain(cells).collect()
    };
    let columns = std::iter::once("term".to_owned()).chain(Group::all().map(Group::short));
    Table::new(
        "What each error term costs: σ with it over σ without it",
        columns,
    )
    .section(effects.iter().filter(|effect| effect.on).map(row))
    .note("RMS over the parameters of a group, the other terms as they were.")
}

/// What those explain that were on or that the data show.
pub(super) fn explained(effects: &[ErrorTermTest]) -> Table {
    let row = |effect: &ErrorTermTest| {
        let yes_no = |yes: bool, words: [&str; 2]| words[usize::from(!yes)].to_owned();
        cells![
            title(effect.term),
            yes_no(effect.on, ["on", "off"]),
            nis(effect),
            three_digits(effect.gain),
            format!("< {}", three_digits(effect.limit)),
            yes_no(effect.significant(), ["yes", "no"]),
        ]
    };
    let shown = |on| {
        effects
            .iter()
            .filter(move |e| e.on == on && (e.on || e.significant()))
    };
    Table::new("What each error term explains", columns("term | | NIS | cost falls by | by chance | significant"))
        .sections([shown(true).map(row), shown(false).map(row)])
        .note(
            "NIS of all observations without → with the term. Cost: −2 ln of likelihood and prior. By chance: \
             the fall at a term's share of one false alarm in 1000 runs.",
        )
        .note("Terms that are off are tried with their usual σ and shown where they are significant.")
}

fn nis(effect: &ErrorTermTest) -> String {
    let digits = |nis: f64| match nis < 10.0 {
        true => value(nis, 0.01),
        false => three_digits(nis),
    };
    format!("{} → {}", digits(effect.without), digits(effect.with))
}
