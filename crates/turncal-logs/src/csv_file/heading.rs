//! Structure of a text file, found from its first lines: preamble, lines of names and units, and rows, possibly tagged.

use super::clock_text::ClockText;
use super::delimiter::Delimiter;
use super::lines::Stop;
use super::look::{Layout, Look, Looks};
use super::names::Named;
use super::preamble::{lone_rate, orientation, rate, units_with};
use super::shape::Stream;
use super::tags::Tags;

/// Content of a text file.
#[derive(Debug, Clone, PartialEq)]
pub struct Heading {
    pub delimiter: Delimiter,
    /// Whether each column holds numbers.
    pub numbers: Vec<bool>,
    /// Column names: `1`, `2`, … if the file has none.
    pub names: Vec<String>,
    /// Line of the names, or of the first row if there are no names.
    pub line: u64,
    /// Column units, if stated.
    pub units: Option<Vec<String>>,
    /// Columns read as clock times.
    pub clocks: Vec<Option<ClockText>>,
    /// Rate of the rows, Hz.
    pub rate: Option<f64>,
    /// Statements of the file that are ignored or interpreted.
    pub remarks: Vec<String>,
    /// Number of lines at the beginning that are not rows.
    pub above: usize,
    /// Number of rows among the first lines.
    pub rows: usize,
}

impl Looks {
    /// Heading of all rows, of the rows with a tag, or of the samples of a labelled stream; `None` for a file without
    /// rows.
    pub fn heading(
        &self,
        tag: Option<(&Tags, &str)>,
        labelled: Option<&Stream>,
    ) -> Result<Option<Heading>, Stop> {
        let is_of_tag =
            |look: &&Look| tag.is_none_or(|(tags, tag)| look.field(tags.column) == Some(tag));
        let rows: Vec<&Look> = self
            .0
            .iter()
            .filter(|look| !look.is_comment)
            .filter(is_of_tag)
            .collect();
        let Some(layout) = Layout::of(&rows, &self.0) else {
            return rows
                .iter()
                .find_map(|row| row.malformed())
                .map_or(Ok(None), Err);
        };
        let is_row = |look: &Look| is_of_tag(&look) && layout.row(look).is_some();
        let first = self.0.iter().position(is_row).unwrap_or(self.0.len());
        let Named {
            names,
            units,
            line,
            above,
            cut,
        } = self
            .of_labels(labelled, first)
            .map_or_else(|| self.named(&layout, first, tag), Ok)?;
        let above = if labelled.is_some() { 0 } else { above };
        let rows: Vec<Vec<String>> = rows.iter().filter_map(|row| layout.row(row)).collect();
        let clocks = clocks(&rows, layout.numbers.len());
        let says = self
            .0
            .iter()
            .enumerate()
            .filter(|(k, look)| look.is_comment || *k < above);
        let says: Vec<&str> = says.map(|(_, look)| look.text.as_str()).collect();
        let of_clocks = clocks.iter().zip(&names);
        let of_clocks = of_clocks.filter_map(|(clock, name)| clock.as_ref()?.remark(name));
        let remarks = of_clocks.chain(orientation(&says)).chain(cut).collect();
        Ok(Some(Heading {
            delimiter: layout.delimiter,
            numbers: layout.numbers,
            units: units_with(units, &names, &clocks, &says),
            names,
            line,
            clocks,
            rate: says
                .iter()
                .find_map(|remark| rate(remark).or(lone_rate(remark))),
            remarks,
            above,
            rows: rows.len(),
        }))
    }
}

/// Conversion of the text of each column to times.
fn clocks(rows: &[Vec<String>], columns: usize) -> Vec<Option<ClockText>> {
    let clock = |column: usize| {
        let texts = rows.iter().map(|row| row[column].as_str());
        let texts: Vec<&str> = texts.filter(|text| !text.is_empty()).collect();
        ClockText::of(&texts)
    };
    (0..columns).map(clock).collect()
}
