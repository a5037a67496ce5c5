//! `turncal list`

use serde::Serialize;
use turncal::models::Embedded;
use turncal::report::wrapped;

use crate::cli::terminal::{columns, print};

/// Shows the embedded scenarios, instruments, installations, tables, paths and trajectories
///
/// Commands and your own scenarios accept these names in place of a TOML file. If a file of that name exists,
/// the file is used instead.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal list
  turncal list --json | jq -r '.[].name'")]
pub struct List {
    /// Print the list as one JSON document and nothing else
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
        if self.json {
            return print((serde_json::to_string_pretty(&entries)? + "\n").as_bytes());
        }
        let widest = entries.iter().map(|entry| entry.name.len()).max();
        let widest = widest.unwrap_or(0);
        let indent = " ".repeat(widest + 4);
        let row = |entry: &Entry| {
            let row = format!("  {:widest$}  {}", entry.name, entry.description);
            wrapped(&row, &indent, columns().map(usize::from)).join("\n") + "\n"
        };
        let of_kind = entries.chunk_by(|a, b| a.kind == b.kind).map(|alike| {
            let rows: String = alike.iter().map(row).collect();
            format!("{}:\n{rows}", alike[0].kind)
        });
        print(of_kind.collect::<Vec<_>>().join("\n").as_bytes())
    }
}
