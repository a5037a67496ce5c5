//! What each error term costs and explains: tables, and a sentence where NIS betrays an error that is not
//! modelled.

use super::document::{NONE, Table, cells};
use super::group::Group;
use super::number::{three_digits, value};
use super::terms::title;
use crate::calibration::BlockEffect;

/// Costs of the error terms that were on.
pub(super) fn costs(effects: &[BlockEffect]) -> Table {
    let row = |effect: &BlockEffect| {
        let cells = effect.cost.iter();
        let cells = cells.map(|cost| cost.map_or(NONE.to_owned(), |cost| value(cost, 0.1)));
        let name = title(effect.block).to_owned();
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
pub(super) fn explained(effects: &[BlockEffect]) -> Table {
    let row = |effect: &BlockEffect| {
        let yes_no = |yes: bool, words: [&str; 2]| words[usize::from(!yes)].to_owned();
        cells![
            title(effect.block),
            yes_no(effect.on, ["on", "off"]),
            nis(effect),
            three_digits(effect.gain),
            format!("< {}", three_digits(effect.limit)),
            yes_no(effect.asked_for(), ["yes", "no"]),
        ]
    };
    let shown = |on| {
        effects
            .iter()
            .filter(move |e| e.on == on && (e.on || e.asked_for()))
    };
    let columns = [
        "term",
        "",
        "NIS",
        "cost falls by",
        "by chance",
        "significant",
    ];
    Table::new("What each error term explains", columns)
        .sections([shown(true).map(row), shown(false).map(row)])
        .note(
            "NIS of all observations without → with the term. Cost: −2 ln of likelihood and prior. By chance: \
             the fall at a false-alarm rate of 1 in 10 000.",
        )
        .note("Terms that are off are tried with their usual σ and shown where they are significant.")
}

fn nis(effect: &BlockEffect) -> String {
    let digits = |nis: f64| match nis < 10.0 {
        true => value(nis, 0.01),
        false => three_digits(nis),
    };
    format!("{} → {}", digits(effect.without), digits(effect.with))
}

/// Where terms that are off are significant: which of them most.
pub(super) fn advice(effects: &[BlockEffect]) -> Option<String> {
    let significant = effects
        .iter()
        .filter(|effect| !effect.on && effect.asked_for());
    let best = significant.max_by(|a, b| a.gain.total_cmp(&b.gain))?;
    Some(format!(
        "The data show errors that are not modelled. Of the error terms that are off, {} would explain most \
         (NIS {}): use --with {}, then look again.",
        title(best.block),
        nis(best),
        best.block.name()
    ))
}
