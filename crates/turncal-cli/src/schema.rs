//! `turncal schema`

use crate::terminal::print;
use turncal_files::run_schema;

/// Prints the JSON schema of run.toml, which editors can use for completion and validation
///
/// Save the schema and refer to it in the first line of a run.toml: #:schema ./run.schema.json
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:  turncal schema > run.schema.json")]
pub struct Schema {}

impl Schema {
    pub fn run(&self) -> anyhow::Result<()> {
        print((serde_json::to_string_pretty(&run_schema())? + "\n").as_bytes())
    }
}
