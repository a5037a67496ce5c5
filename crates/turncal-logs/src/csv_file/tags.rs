//! Rows of several kinds, each with a tag.

use std::collections::BTreeMap;

use super::delimiter::is_number;
use super::look::Looks;

/// Minimum number of columns for a time and both triads.
const BOTH_TRIADS: usize = 7;
/// Maximum number of kinds of rows.
const MOST_TAGS: usize = 64;

/// Rows of several kinds, identified by the word or number in one column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tags {
    pub column: usize,
    pub names: Vec<String>,
}

impl Looks {
    /// Tags that distinguish several kinds of rows. Tags are words, or small numbers before a time, in rows that have
    /// different widths or too few columns for both triads.
    pub fn tags(&self) -> Option<Tags> {
        let rows = || {
            self.0
                .iter()
                .filter(|look| !look.is_comment)
                .filter_map(|look| look.fields.as_ref().ok())
        };
        (0..3).find_map(|column| {
            let mut kinds = BTreeMap::<&str, Vec<&Vec<String>>>::new();
            for row in rows() {
                let tag = row.get(column).map_or("", String::as_str);
                kinds.entry(tag).or_default().push(row);
            }
            kinds.retain(|_, rows| rows.len() > 1);
            let of_kinds: usize = kinds.values().map(Vec::len).sum();
            let is_word =
                |tag: &&str| tag.starts_with(|c: char| c.is_alphabetic()) && !is_number(tag);
            let is_digit = |tag: &&str| column == 0 && tag.len() == 1 && is_number(tag);
            let are_digits = kinds.keys().all(is_digit);
            let is_narrow = |rows: &Vec<&Vec<String>>| {
                rows[0].iter().filter(|field| is_number(field)).count()
                    < BOTH_TRIADS + usize::from(are_digits)
            };
            let width = kinds.values().next()?[0].len();
            let is_ragged = kinds.values().any(|rows| rows[0].len() != width);
            // Each kind has its own time; a label of a movement leaves the time of all rows as it is.
            let have_times = || {
                let all: Vec<_> = rows().filter(|row| row.len() == width).collect();
                !goes_on(&all) && kinds.values().all(|rows| goes_on(rows))
            };
            let are_kinds = (2..=MOST_TAGS).contains(&kinds.len())
                && 10 * of_kinds >= 9 * rows().count()
                && (kinds.keys().all(is_word)
                    || are_digits && kinds.values().all(|rows| goes_on(rows)))
                && (is_ragged || kinds.values().all(is_narrow) || have_times());
            are_kinds.then(|| Tags {
                column,
                names: kinds.into_keys().map(str::to_owned).collect(),
            })
        })
    }
}

/// Whether a column after the first increases in all rows.
fn goes_on(rows: &[&Vec<String>]) -> bool {
    (1..rows[0].len()).any(|column| {
        let number =
            |row: &&Vec<String>| row.get(column).and_then(|field| field.parse::<f64>().ok());
        let times: Option<Vec<f64>> = rows.iter().map(number).collect();
        times.is_some_and(|times| times.windows(2).all(|pair| pair[1] > pair[0]))
    })
}
