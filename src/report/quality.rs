//! How well a calibration explains gravity and turns, which needs no truth.

use super::number::{count, three_digits};
use super::side_by_side::Table;
use crate::calibration::{Measures, Quality, Spread};
use crate::recording::TableLog;
use crate::units::{ARCSEC, DEGREE, MICRO_G, MILLI_G};

const NONE: &str = "–";

/// Each measure over the whole record and over what was held out; none where there is nothing to measure.
pub(super) fn table(quality: &Quality, table: Option<&TableLog>) -> Option<Table> {
    let turns = match table {
        Some(_) => "attitude after a turn, gyros less table",
        None => "labelled turns, gyros less label",
    };
    let rows = [
        row(
            quality,
            "size of specific force at rest less gravity",
            &FORCE,
            |m| &m.gravity,
        ),
        row(
            quality,
            "up after a turn, gyros less accelerometers",
            &ANGLE,
            |m| &m.direction,
        ),
        row(quality, turns, &ANGLE, |m| &m.turns),
    ];
    let rows: Vec<_> = rows.into_iter().flatten().collect();
    if rows.is_empty() {
        return None;
    }
    let mut headings = vec!["", "unit", "all", "RMS", "largest"];
    let mut notes = Vec::new();
    if quality.held_out.is_some() {
        headings.extend(["held out", "RMS", "largest"]);
        notes.push(
            "Held out: in dwells whose observations a calibration did without, and over the turns that \
             end in them."
                .to_owned(),
        );
    }
    Some(Table {
        title: "What is left of gravity and turns",
        headings: headings.into_iter().map(str::to_owned).collect(),
        sections: vec![rows],
        notes,
    })
}

fn row(
    quality: &Quality,
    name: &str,
    units: &[(&str, f64)],
    of: impl Fn(&Measures) -> &Spread,
) -> Option<Vec<String>> {
    let all = of(&quality.all);
    if all.count == 0 {
        return None;
    }
    // The smallest unit in which the figure is below a thousand, else the largest.
    let fits = |&&(_, size): &&(&str, f64)| all.rms < 1000.0 * size;
    let &(unit, size) = units.iter().find(fits).or(units.last())?;
    let cells = |spread: &Spread| match spread.count {
        0 => [NONE; 3].map(str::to_owned),
        n => [
            count(n),
            three_digits(spread.rms / size),
            three_digits(spread.largest / size),
        ],
    };
    let mut row = vec![name.to_owned(), unit.to_owned()];
    row.extend(cells(all));
    if let Some(held_out) = &quality.held_out {
        row.extend(cells(of(held_out)));
    }
    Some(row)
}

const FORCE: [(&str, f64); 2] = [("µg", MICRO_G), ("mg", MILLI_G)];
const ANGLE: [(&str, f64); 2] = [("″", ARCSEC), ("°", DEGREE)];
