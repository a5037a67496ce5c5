//! `turncal explain`

use anyhow::bail;
use turncal::calibration::{FindingKind, Level};
use turncal::report::wrapped;

use crate::cli::terminal::{columns, print};

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
        let width = columns().map_or(80, usize::from);
        let Some(code) = &self.code else {
            let line = |kind: &FindingKind| format!("{}  {}\n", kind.code(), kind.name());
            return print(
                FindingKind::ALL
                    .iter()
                    .map(line)
                    .collect::<String>()
                    .as_bytes(),
            );
        };
        let Some(kind) = FindingKind::named(code) else {
            bail!(
                "found `{code}`, expected the code of a finding, such as W07. Run turncal explain for the list."
            );
        };
        let verdict = match kind.level() {
            Level::Failed => "The verdict is FAILED.",
            Level::Care => "The verdict is USE WITH CARE.",
            Level::Note => "The verdict is not affected.",
        };
        let (name, explanation) = (kind.name(), kind.explanation());
        let text = wrapped(&format!("{explanation} {verdict}"), "", Some(width)).join("\n");
        print(format!("{}  {name}\n\n{text}\n", kind.code()).as_bytes())
    }
}
