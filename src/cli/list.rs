//! `turncal list`

use comfy_table::{ContentArrangement, Table, presets};
use serde::Serialize;
use turncal::models::Embedded;

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
        let of_kind = entries.chunk_by(|a, b| a.kind == b.kind).map(|alike| {
            let mut table = Table::new();
            table
                .load_preset(presets::NOTHING)
                .set_content_arrangement(ContentArrangement::Dynamic);
            if let Some(columns) = columns() {
                table.set_width(columns);
            }
            for entry in alike {
                let name = format!(" {:1$}", entry.name, widest.unwrap_or(0));
                table.add_row([&name, &entry.description]);
            }
            format!("{}:\n{}\n", alike[0].kind, table.trim_fmt())
        });
        print(of_kind.collect::<Vec<_>>().join("\n").as_bytes())
    }
}
