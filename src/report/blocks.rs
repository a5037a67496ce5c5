//! What each block of states costs and explains: tables, and a sentence where NIS betrays an error
//! that is not modelled.

use super::further::title;
use super::group::Group;
use super::number::{three_digits, value};
use super::side_by_side::Table;
use crate::calibration::ErrorTermTest;

const NONE: &str = "–";

/// The tables: costs of the blocks that were on, and what those explain that were on or that the data
/// ask for; none if there are no such blocks.
pub(super) fn tables(effects: &[ErrorTermTest]) -> Vec<Table> {
    let mut tables = Vec::new();
    if effects.iter().any(|effect| effect.on) {
        tables.push(costs(effects));
    }
    let shown = |effect: &&ErrorTermTest| effect.on || effect.significant();
    let shown: Vec<&ErrorTermTest> = effects.iter().filter(shown).collect();
    if !shown.is_empty() {
        tables.push(explained(&shown));
    }
    tables
}

fn costs(effects: &[ErrorTermTest]) -> Table {
    let on = effects.iter().filter(|effect| effect.on);
    let row = |effect: &ErrorTermTest| {
        let cells = effect.sigma_factors.iter();
        let cells = cells.map(|cost| cost.map_or(NONE.to_owned(), |cost| value(cost, 0.1)));
        std::iter::once(title(effect.term).to_owned())
            .chain(cells)
            .collect()
    };
    Table {
        title: "What each block of states costs: σ with it over σ without it",
        headings: std::iter::once("block".to_owned())
            .chain(Group::all().map(Group::short))
            .collect(),
        sections: vec![on.map(row).collect()],
        notes: vec![
            "RMS over the parameters of a group, the other blocks as they were.".to_owned(),
        ],
    }
}

fn explained(effects: &[&ErrorTermTest]) -> Table {
    let headings = [
        "block",
        "",
        "NIS",
        "merit falls by",
        "by chance",
        "asked for",
    ];
    let row = |effect: &&ErrorTermTest| {
        vec![
            title(effect.term).to_owned(),
            if effect.on { "on" } else { "off" }.to_owned(),
            nis(effect),
            three_digits(effect.gain),
            format!("< {}", three_digits(effect.limit)),
            if effect.significant() { "yes" } else { "no" }.to_owned(),
        ]
    };
    let sections = effects.chunk_by(|a, b| a.on == b.on);
    Table {
        title: "What each block of states explains",
        headings: headings.map(str::to_owned).to_vec(),
        sections: sections
            .map(|section| section.iter().map(row).collect())
            .collect(),
        notes: [
            "NIS of all observations without → with the block. Merit: −2 ln of likelihood and prior; by \
             chance it falls by less than this in 9999 runs of 10 000 whose errors the block has not.",
            "Blocks that are off are tried with their usual σ and shown where the data ask for them.",
        ]
        .map(str::to_owned)
        .to_vec(),
    }
}

fn nis(effect: &ErrorTermTest) -> String {
    let digits = |nis: f64| {
        if nis < 10.0 {
            value(nis, 0.01)
        } else {
            three_digits(nis)
        }
    };
    format!("{} → {}", digits(effect.without), digits(effect.with))
}

/// Where the data ask for blocks that are off: for which of them most.
pub(super) fn advice(effects: &[ErrorTermTest]) -> Option<String> {
    let off = effects.iter().filter(|effect| !effect.on);
    let asked = off.filter(|effect| effect.significant());
    let best = asked.max_by(|a, b| a.gain.total_cmp(&b.gain))?;
    Some(format!(
        "The data show errors that are not modelled. Of the blocks of states that are off, {} would \
         explain most (NIS {}): use --with {}, then look again.",
        title(best.term),
        nis(best),
        best.term.name()
    ))
}
