//! `turncal explain`

use anyhow::bail;

use crate::terminal::show;
use turncal::calibration::{FindingKind, Level};
use turncal_report::document::Block;
use turncal_report::{Document, Facts};

/// Explains a finding: meaning, cause and remedy
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal explain W07
  turncal explain noise-learnt
  turncal explain")]
pub struct Explain {
    /// Code or kind of the finding [default: list all]
    #[arg(value_name = "CODE")]
    code: Option<String>,
}

impl Explain {
    pub fn run(&self) -> anyhow::Result<()> {
        let Some(code) = &self.code else {
            let mut document = Document::default();
            let kinds = FindingKind::ALL.iter();
            let rows = kinds.map(|kind| (kind.code(), kind.name()));
            document.both(Facts::new("", rows));
            return show(&document, false);
        };
        let Some(kind) = FindingKind::named(code) else {
            bail!(
                "found `{code}`, expected the code of a finding, such as W07. Run turncal explain for the list."
            );
        };
        let verdict = match kind.level() {
            Level::Failed => "The verdict is then FAILED.",
            Level::Partial => {
                "The verdict is then PARTIAL, unless the finding itself states another level."
            }
            Level::Care => {
                "The verdict is then USE WITH CARE, unless the problem hardly affects the result."
            }
            Level::Note => "The verdict is not affected.",
        };
        let mut document = Document::new(format!("{}  {}", kind.code(), kind.name()));
        let text = format!("{} {verdict}", kind.explanation());
        document.both(Block::Text(String::new(), text));
        show(&document, false)
    }
}
