//! Verdicts in words on the figures in the paper.

use crate::prelude::*;
use turncal::imu::InstallationForm;
use turncal::study::Table1;
use turncal::study::table1::paper::Published;
use turncal::study::table1::{Column, Kind, QUANTITIES, Row, Verdict};

/// A verdict in a few words.
pub fn short(verdict: &Verdict) -> &'static str {
    match verdict {
        Verdict::Reproduced => "reproduced",
        Verdict::Zero => "zero; rounding errors in the paper",
        Verdict::UnderAnotherReading(_) => "reproduced under another reading",
        Verdict::NotReproducible(_) => "not reproducible",
    }
}

/// The last column of the table: for the stated reading, the verdict; for other readings, whether the reading gives the
/// figures in the paper.
pub fn of_row(column: &Column, row: &Row) -> String {
    match row.reading.kind {
        Kind::Stated => short(&column.verdict).to_owned(),
        Kind::Assumption | Kind::Slip => of_reading(row),
    }
}

fn of_reading(row: &Row) -> String {
    let (agree, apart) = split(row);
    match (agree.len(), apart.len()) {
        (_, 0) => "all agree".to_owned(),
        (0, _) => "none agrees".to_owned(),
        (more, few) if few < more => format!("all agree except {}", apart.join(", ")),
        _ => format!("only {} agree", agree.join(", ")),
    }
}

/// Names of the quantities that agree and of those that do not.
fn split(row: &Row) -> (Vec<&'static str>, Vec<&'static str>) {
    let named = |agrees: bool| {
        let those = (0..QUANTITIES.len()).filter(move |&q| row.agrees(q) == agrees);
        those.map(|q| QUANTITIES[q].short()).collect()
    };
    (named(true), named(false))
}

/// A sentence for each column in the paper.
pub fn sentences(table: &Table1) -> Vec<String> {
    let columns = table.columns.iter();
    columns
        .map(|column| format!("{}: {}", title(column.published), sentence(column)))
        .collect()
}

/// A verdict with its basis.
pub fn sentence(column: &Column) -> String {
    match &column.verdict {
        Verdict::Reproduced => "reproduced as stated.".to_owned(),
        Verdict::Zero => {
            "zero except for rounding, because K C is recovered exactly; the figures in the paper are rounding \
             errors of its program."
                .to_owned()
        }
        Verdict::UnderAnotherReading(reading) => {
            let name = reading.name;
            let mut text = format!("not reproduced as stated, but under another reading: {name}.");
            for row in &column.others {
                let (agree, apart) = split(row);
                if !apart.is_empty() && apart.len() < agree.len() {
                    text += &format!(" With {} {}.", row.reading.name, of_reading(row));
                }
            }
            text
        }
        Verdict::NotReproducible(slip) => {
            let mut text = "not reproducible by a correct program".to_owned();
            if column.published.form.holds(InstallationForm::General) {
                text.push_str(", which gives zero because K C is recovered exactly");
            }
            if let Some(slip) = slip {
                text += &format!("; a slip reproduces the figures in the paper: {}", slip.name);
            }
            text + "."
        }
    }
}

/// The name of a column in the paper, in words.
pub fn title(published: &Published) -> String {
    let equation = match published.form {
        InstallationForm::ThreeAngle => 10,
        _ => 8,
    };
    let (triad, form) = (triad_name(published.sensor), published.form.name());
    format!("{}, {form} form (Eq. {equation})", capital(triad))
}
