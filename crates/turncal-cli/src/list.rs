//! `turncal list`

use serde::Serialize;

use crate::terminal::show;
use turncal::models::Embedded;
use turncal_report::{Document, Facts};

/// Lists the embedded scenarios, instruments, installations, tables, paths and trajectories
///
/// You can give these names instead of TOML files on the command line and in your own scenarios. If a file with this
/// name exists, turncal uses the file instead.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal list
  turncal list --json | jq -r '.[].name'")]
pub struct List {
    /// Print the list as a single JSON document, without any other output
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Entry {
    kind: &'static str,
    name: &'static str,
    description: String,
}

impl List {
    pub fn run(&self) -> anyhow::Result<()> {
        let entries: Vec<Entry> = Embedded::all()
            .map(|model| Entry {
                kind: model.room.name(),
                name: model.name,
                description: model.description(),
            })
            .collect();
        let mut document = Document::default();
        for alike in entries.chunk_by(|a, b| a.kind == b.kind) {
            let rows = alike.iter().map(|entry| (entry.name, &entry.description));
            document.both(Facts::new(alike[0].kind, rows));
        }
        document.data = serde_json::to_value(&entries)?;
        show(&document, self.json)
    }
}
