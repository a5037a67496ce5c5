//! What a result has to say, as data: facts, tables, plots, findings. Renderers turn it into text, a page or
//! JSON; none of them knows what the result was.

use serde_json::Value;

use super::plot::Plot;
use crate::calibration::{Finding, Word};

/// Everything that is said about one result.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Document {
    /// Heading of the whole.
    pub title: String,
    /// Whether the result may be used, and what it amounts to in a line.
    pub verdict: Option<(Word, String)>,
    /// What was done on what, a paragraph each.
    pub lead: Vec<String>,
    /// What was found in a calibration, the most severe first.
    pub findings: Vec<Finding>,
    /// What one screen shows in place of the blocks; they are all there is where it is empty.
    pub brief: Vec<Block>,
    /// What must be known before the figures are used.
    pub warnings: List,
    /// What the figures show, the most important first.
    pub conclusions: List,
    /// Facts, tables and plots in their order, each with where it is shown.
    pub blocks: Vec<(Medium, Block)>,
    /// The figures by name, with the unit in the name; what is not a number is null.
    pub data: Value,
    /// Auxiliary files by name, such as a table as CSV.
    pub files: Vec<(String, String)>,
}

/// Where a part of a document is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Medium {
    /// On the page, which has room for all.
    Page,
    /// In a terminal alone.
    Terminal,
    /// On both.
    Both,
}

/// A part of a document.
#[derive(Debug, Clone, PartialEq)]
pub enum Block {
    /// Pairs of a name and a value.
    Facts(Facts),
    /// Cells in rows.
    Table(Table),
    /// A figure.
    Plot(Plot),
    /// Sentences.
    List(List),
    /// A paragraph below a heading, which may be empty.
    Text(String, String),
    /// Lines to be copied as they are, below a heading.
    Code(String, String),
    /// What follows is detail under this heading, up to the next of them: folded away on a page.
    Fold(String),
}

/// Pairs of a name and a value below a heading.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Facts {
    /// What they are about.
    pub heading: String,
    /// Name and value.
    pub rows: Vec<(String, String)>,
}

/// Sentences below a heading.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct List {
    /// What they are about.
    pub heading: String,
    /// A sentence or two each.
    pub items: Vec<String>,
}

/// Cells in rows, the first of each naming it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Table {
    /// What it shows.
    pub heading: String,
    /// A heading for each column; may be of several lines.
    pub columns: Vec<String>,
    /// Rows that belong together.
    pub sections: Vec<Vec<Vec<String>>>,
    /// How to read it, a sentence each.
    pub notes: Vec<String>,
    /// Columns that a narrow terminal does without, the least important last.
    pub optional: Vec<usize>,
}

impl Document {
    /// A document that says nothing yet.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            warnings: List::new("Warnings", []),
            conclusions: List::new("Conclusions", []),
            ..Self::default()
        }
    }

    /// Says what the figures show: a conclusion if it is as one would wish, else a warning.
    pub fn say(&mut self, good: bool, text: impl Into<String>) {
        let list = if good {
            &mut self.conclusions
        } else {
            &mut self.warnings
        };
        list.items.push(text.into());
    }

    /// Adds what page and terminal show; what is empty is left out.
    pub fn both(&mut self, block: impl Into<Block>) {
        self.add(Medium::Both, block.into());
    }

    /// Adds what the page alone has room for.
    pub fn page(&mut self, block: impl Into<Block>) {
        self.add(Medium::Page, block.into());
    }

    /// The same for several.
    pub fn pages(&mut self, blocks: impl IntoIterator<Item = impl Into<Block>>) {
        blocks.into_iter().for_each(|block| self.page(block));
    }

    /// Adds what stands in a terminal in the place of a plot or of a longer table.
    pub fn terminal(&mut self, block: impl Into<Block>) {
        self.add(Medium::Terminal, block.into());
    }

    /// Begins a part that a page folds away.
    pub fn fold(&mut self, heading: &str) {
        self.page(Block::Fold(heading.to_owned()));
    }

    fn add(&mut self, medium: Medium, block: Block) {
        let empty = match &block {
            Block::Facts(facts) => facts.rows.is_empty(),
            Block::Table(table) => table.sections.is_empty(),
            Block::List(list) => list.items.is_empty(),
            Block::Plot(_) | Block::Fold(_) => false,
            Block::Text(_, text) | Block::Code(_, text) => text.is_empty(),
        };
        if !empty {
            self.blocks.push((medium, block));
        }
    }

    /// Every plot, in order.
    pub fn plots(&self) -> impl Iterator<Item = &Plot> {
        self.blocks.iter().filter_map(|(_, block)| match block {
            Block::Plot(plot) => Some(plot),
            _ => None,
        })
    }
}

impl List {
    /// Sentences below a heading.
    pub fn new(heading: &str, items: impl IntoIterator<Item = String>) -> Self {
        Self {
            heading: heading.to_owned(),
            items: items.into_iter().collect(),
        }
    }
}

impl Facts {
    /// Pairs below a heading.
    pub fn new<N: Into<String>, V: Into<String>>(
        heading: &str,
        rows: impl IntoIterator<Item = (N, V)>,
    ) -> Self {
        let rows = rows
            .into_iter()
            .map(|(name, value)| (name.into(), value.into()));
        Self {
            heading: heading.to_owned(),
            rows: rows.collect(),
        }
    }

    /// One more pair.
    pub fn push(&mut self, name: &str, value: impl Into<String>) {
        self.rows.push((name.to_owned(), value.into()));
    }
}

impl Table {
    /// A table without rows.
    pub fn new<H: Into<String>>(
        heading: impl Into<String>,
        columns: impl IntoIterator<Item = H>,
    ) -> Self {
        Self {
            heading: heading.into(),
            columns: columns.into_iter().map(Into::into).collect(),
            ..Self::default()
        }
    }

    /// Rows that belong together; none if there are none.
    pub fn section(mut self, rows: impl IntoIterator<Item = Vec<String>>) -> Self {
        let rows: Vec<_> = rows.into_iter().collect();
        if !rows.is_empty() {
            self.sections.push(rows);
        }
        self
    }

    /// The same for several sections.
    pub fn sections(
        self,
        sections: impl IntoIterator<Item = impl IntoIterator<Item = Vec<String>>>,
    ) -> Self {
        sections.into_iter().fold(self, Self::section)
    }

    /// A sentence on how to read it.
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }
}

macro_rules! into_block {
    ($($of:ident),*) => {$(
        impl From<$of> for Block {
            fn from(of: $of) -> Self {
                Self::$of(of)
            }
        }
    )*};
}
into_block!(Facts, Table, Plot, List);

/// In the place of a number that there is not.
pub(super) const NONE: &str = "–";

/// The headings of a table's columns, of a line with bars between them.
pub(super) fn columns(line: &str) -> impl Iterator<Item = &str> {
    line.split('|').map(str::trim)
}

/// A row of a table.
macro_rules! cells {
    ($($cell:expr),* $(,)?) => { vec![$(String::from($cell)),*] };
}
pub(super) use cells;
