//! What both methods are worth at the same table time, and the closed form with all the time it takes.

use super::quantity::Quantity;
use crate::report::prelude::*;
use crate::study::navigation::Outlook;

/// One way of navigating by several calibrations.
#[derive(Debug, Clone, PartialEq)]
pub struct Flown {
    /// How the body moved, such as `stationary and level`.
    pub how: &'static str,
    /// What it shows, in a sentence.
    pub shows: &'static str,
    /// The end of it by each calibration, in the order of the methods.
    pub ends: Vec<Outlook>,
}

/// Adds position errors at the end of each mission by each method, a row for each mission.
pub fn add(document: &mut Document, methods: &[String], missions: &[Flown]) {
    let [.., horizontal] = Quantity::ALL;
    let mut columns = vec![String::new()];
    for method in methods {
        columns.extend([format!("{method}: error, nmile"), "σ".to_owned()]);
    }
    let row = |flown: &Flown| {
        let mut row = vec![flown.how.to_owned()];
        for end in &flown.ends {
            let error = end.error.as_ref().map(|error| horizontal.error(error));
            row.push(error.map_or("–".to_owned(), three_digits));
            row.push(three_digits(horizontal.of(&end.sigma)));
        }
        row
    };
    let table = Table::new("Position error after 40 h of navigation", columns)
        .section(missions.iter().map(row));
    let shows = missions.iter().map(|flown| flown.shows);
    let table = shows.fold(table, Table::note);
    document.brief.insert(1, table.into());
}
