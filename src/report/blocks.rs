//! What each block of states costs and explains: tables, and a sentence where NIS betrays an error
//! that is not modelled.

use super::further::title;
use super::group::Group;
use super::number::{three_digits, value};
use super::side_by_side::Table;
use crate::calibration::BlockEffect;
use crate::calibration::outcome::{Consistency, Nis};

const NONE: &str = "–";

/// The tables; none if no block was on or tried.
pub(super) fn tables(effects: &[BlockEffect]) -> Vec<Table> {
    let mut tables = Vec::new();
    if effects.iter().any(|effect| effect.on) {
        tables.push(costs(effects));
    }
    if !effects.is_empty() {
        tables.push(explained(effects));
    }
    tables
}

fn costs(effects: &[BlockEffect]) -> Table {
    let on = effects.iter().filter(|effect| effect.on);
    let row = |effect: &BlockEffect| {
        let cells = effect.cost.iter();
        let cells = cells.map(|cost| cost.map_or(NONE.to_owned(), |cost| value(cost, 0.1)));
        std::iter::once(title(effect.block).to_owned())
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

fn explained(effects: &[BlockEffect]) -> Table {
    let of_table = effects.iter().any(|e| e.with.table.count > 0);
    let mut headings = vec!["block", "", "NIS velocity"];
    if of_table {
        headings.push("NIS table");
    }
    headings.extend(["merit falls by", "by chance", "asked for"]);
    let row = |effect: &BlockEffect| {
        let nis = |of: fn(&Consistency) -> Nis| {
            let (without, with) = (of(&effect.without).mean, of(&effect.with).mean);
            format!("{} → {}", three_digits(without), three_digits(with))
        };
        let mut row = vec![
            title(effect.block).to_owned(),
            if effect.on { "on" } else { "tried" }.to_owned(),
            nis(|c| c.velocity),
        ];
        if of_table {
            row.push(nis(|c| c.table));
        }
        row.extend([
            three_digits(effect.gain),
            format!("< {}", three_digits(effect.limit)),
            if effect.asked_for() { "yes" } else { "no" }.to_owned(),
        ]);
        row
    };
    let sections = effects.chunk_by(|a, b| a.on == b.on);
    Table {
        title: "What each block of states explains",
        headings: headings.into_iter().map(str::to_owned).collect(),
        sections: sections
            .map(|section| section.iter().map(row).collect())
            .collect(),
        notes: vec![
            "NIS without → with the block. Merit: −2 ln of likelihood and prior; by chance it falls by \
             less than this in 999 runs of 1000 where the block's errors are not there."
                .to_owned(),
        ],
    }
}

/// Where NIS is larger than chance allows: which block that is off would reduce it most.
pub(super) fn advice(effects: &[BlockEffect]) -> Option<String> {
    let tried = || effects.iter().filter(|effect| !effect.on);
    tried().next()?;
    let asked = tried().filter(|effect| effect.asked_for());
    let Some(best) = asked.max_by(|a, b| a.gain.total_cmp(&b.gain)) else {
        return Some(
            "NIS is larger than chance allows, and no block of states explains it: noise figures, \
             pulses or disturbances are the likelier cause."
                .to_owned(),
        );
    };
    let all = |consistency: &Consistency| three_digits(consistency.all.mean);
    Some(format!(
        "NIS is larger than chance allows. Of the blocks that are off, {} would reduce it most, from \
         {} to {}: --with {}.",
        title(best.block),
        all(&best.without),
        all(&best.with),
        best.block.name()
    ))
}
