//! The report on a result as data: facts, tables, plots and findings. Renderers convert the report to text, a page or
//! JSON, independently of the kind of result.

use serde_json::Value;

use super::plot::Plot;
use turncal::calibration::{Finding, Word};

/// The complete report of one result.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Document {
    /// Title of the report.
    pub title: String,
    /// Whether the result may be used, with a one-line summary.
    pub verdict: Option<(Word, String)>,
    /// Method and data, one paragraph each.
    pub lead: Vec<String>,
    /// Findings of a calibration, the most severe first.
    pub findings: Vec<Finding>,
    /// Short version for one screen, shown instead of the blocks; if it is empty, the blocks are shown.
    pub brief: Vec<Block>,
    /// Cautions about using the figures.
    pub warnings: List,
    /// Conclusions from the figures, the most important first.
    pub conclusions: List,
    /// Facts, tables and plots in order, each with a flag that is true if it is shown only on the page.
    pub blocks: Vec<(PageOnly, Block)>,
    /// The figures by name, with the unit in the name; NaN becomes null.
    pub data: Value,
    /// Auxiliary files by name, such as a table as CSV.
    pub files: Vec<(String, String)>,
}

/// Whether a part of a document is left out of its text.
pub type PageOnly = bool;

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
    /// Lines to copy verbatim, below a heading.
    Code(String, String),
    /// Start of a section of details with this heading; the section extends to the next one and is collapsed on a page.
    Fold(String),
}

/// Pairs of a name and a value below a heading.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Facts {
    /// Subject.
    pub heading: String,
    /// Name and value.
    pub rows: Vec<(String, String)>,
}

/// Sentences below a heading.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct List {
    /// Subject.
    pub heading: String,
    /// Remarks of one or two sentences each.
    pub items: Vec<String>,
}

/// Cells in rows; the first cell of a row is its name.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Table {
    /// Heading of the table.
    pub heading: String,
    /// A heading for each column; it may have several lines.
    pub columns: Vec<String>,
    /// Sections of rows.
    pub sections: Vec<Vec<Vec<String>>>,
    /// Notes on how to read the table, one sentence each.
    pub notes: Vec<String>,
    /// Columns that a narrow terminal omits, the least important last.
    pub optional: Vec<usize>,
}

impl Document {
    /// An empty document.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            warnings: List::new("Warnings", []),
            conclusions: List::new("Conclusions", []),
            ..Self::default()
        }
    }

    /// Adds a statement about the figures: a conclusion if `good`, else a warning.
    pub fn say(&mut self, good: bool, text: impl Into<String>) {
        let list = if good {
            &mut self.conclusions
        } else {
            &mut self.warnings
        };
        list.items.push(text.into());
    }

    /// Adds a block for page and terminal; empty blocks are omitted.
    pub fn both(&mut self, block: impl Into<Block>) {
        self.add(false, block.into());
    }

    /// Adds a block for the page only.
    pub fn page(&mut self, block: impl Into<Block>) {
        self.add(true, block.into());
    }

    /// Adds several blocks.
    pub fn pages(&mut self, blocks: impl IntoIterator<Item = impl Into<Block>>) {
        blocks.into_iter().for_each(|block| self.page(block));
    }

    /// Starts a section that is collapsed on a page.
    pub fn fold(&mut self, heading: &str) {
        self.page(Block::Fold(heading.to_owned()));
    }

    fn add(&mut self, page_only: PageOnly, block: Block) {
        let empty = match &block {
            Block::Facts(facts) => facts.rows.is_empty(),
            Block::Table(table) => table.sections.is_empty(),
            Block::List(list) => list.items.is_empty(),
            Block::Plot(_) | Block::Fold(_) => false,
            Block::Text(_, text) | Block::Code(_, text) => text.is_empty(),
        };
        if !empty {
            self.blocks.push((page_only, block));
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

    /// Adds a pair.
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

    /// Adds a section of rows, unless it is empty.
    pub fn section(mut self, rows: impl IntoIterator<Item = Vec<String>>) -> Self {
        let rows: Vec<_> = rows.into_iter().collect();
        if !rows.is_empty() {
            self.sections.push(rows);
        }
        self
    }

    /// Adds several sections.
    pub fn sections(
        self,
        sections: impl IntoIterator<Item = impl IntoIterator<Item = Vec<String>>>,
    ) -> Self {
        sections.into_iter().fold(self, Self::section)
    }

    /// Adds a note on how to read the table.
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

/// The text with a capital first letter.
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    first.chain(letters).collect()
}

/// Merges two JSON objects.
pub fn joined(mut one: Value, other: Value) -> Value {
    if let (Value::Object(one), Value::Object(other)) = (&mut one, other) {
        one.extend(other);
    }
    one
}

/// Placeholder for a missing number.
pub const NONE: &str = "–";

/// Splits a line at bars into the headings of a table's columns.
pub fn columns(line: &str) -> impl Iterator<Item = &str> {
    line.split('|').map(str::trim)
}

/// A row of a table.
macro_rules! cells {
    ($($cell:expr),* $(,)?) => { vec![$(String::from($cell)),*] };
}
pub(crate) use cells;
