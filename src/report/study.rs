//! What the reports of studies have in common: facts, tables and a verdict, for terminal and page
//! alike.

use std::fmt::Write;

use maud::html;

use super::page::{document, drawn};
use super::side_by_side::Table;
use super::{Figure, facts, tables, terminal};

/// One thing that a study says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Sentence {
    /// Whether it is as one would wish; if not, a user must know it before trusting the figures.
    pub(super) good: bool,
    /// The sentence.
    pub(super) text: String,
}

/// What the report of a study holds.
pub(super) struct StudyReport {
    /// Heading of the whole.
    pub(super) title: String,
    /// What the facts are of, such as `The study`.
    pub(super) subject: &'static str,
    /// What was done, as pairs of a name and a value.
    pub(super) facts: Vec<(String, String)>,
    pub(super) tables: Vec<Table>,
    /// What the figures say, the most important first.
    pub(super) verdict: Vec<Sentence>,
}

impl StudyReport {
    /// As text; what is not good has an exclamation mark.
    pub(super) fn summary(&self) -> String {
        let mut text = format!("{}\n{}", self.title, terminal::facts(&self.facts));
        for table in &self.tables {
            // Writing to a string cannot fail.
            let _ = write!(text, "\n{}\n{}", table.title, terminal::columns(table));
        }
        text.push_str("\nVerdict\n");
        for sentence in &self.verdict {
            let mark = if sentence.good { ' ' } else { '!' };
            let _ = writeln!(text, "{mark} {}", sentence.text);
        }
        text
    }

    /// As a page that needs nothing else; what is not good comes first.
    pub(super) fn page(&self, figures: &[Figure]) -> String {
        let (good, bad): (Vec<_>, Vec<_>) = self.verdict.iter().partition(|s| s.good);
        let body = html! {
            header { h1 { (self.title) } }
            @if !bad.is_empty() {
                section.warnings { h2 { "To be noted" } ul { @for s in bad { li { (s.text) } } } }
            }
            section { h2 { "What holds" } ul { @for s in good { li { (s.text) } } } }
            section { h2 { (self.subject) } (facts::facts(&self.facts)) }
            @for table in &self.tables { (tables::section(table)) }
            @for figure in figures { (drawn(figure)) }
        };
        document(&self.title, &body)
    }
}
