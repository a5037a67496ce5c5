//! `turncal man`

use std::path::{Path, PathBuf};

use clap_mangen::Man;

use crate::terminal::print;
use turncal_files::write_whole;

/// Writes the manual pages
///
/// Writes one page for turncal and one page per command into DIR, and leaves other files in DIR unchanged. Without -o,
/// writes the turncal page to standard output.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal man | man -l -
  turncal man -o ~/.local/share/man/man1")]
pub struct Manual {
    /// Directory for turncal.1, turncal-calibrate.1 and the other pages
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Replace existing pages; other files in DIR are never changed
    #[arg(long)]
    force: bool,
}

impl Manual {
    pub fn run(&self, command: clap::Command) -> anyhow::Result<()> {
        let mut command = command.disable_help_subcommand(true);
        command.build();
        let Some(directory) = &self.output else {
            return print(&page(&command)?);
        };
        let mut pages = Vec::new();
        collect(&command, directory, &mut pages)?;
        for (path, text) in &pages {
            write_whole(path, text, self.force)?;
        }
        tell!("{} pages written to {}", pages.len(), directory.display());
        Ok(())
    }
}

/// Pages of a command and its subcommands.
fn collect(
    command: &clap::Command,
    directory: &Path,
    pages: &mut Vec<(PathBuf, Vec<u8>)>,
) -> anyhow::Result<()> {
    let name = command.get_display_name().unwrap_or(command.get_name());
    pages.push((directory.join(format!("{name}.1")), page(command)?));
    command
        .get_subcommands()
        .try_for_each(|below| collect(below, directory, pages))
}

fn page(command: &clap::Command) -> anyhow::Result<Vec<u8>> {
    let mut text = Vec::new();
    Man::new(command.clone())
        .source(concat!("turncal ", env!("CARGO_PKG_VERSION")))
        .manual("turncal")
        .render(&mut text)?;
    // The text after the options begins with the examples.
    Ok(String::from_utf8(text)?
        .replace(".SH EXTRA", ".SH EXAMPLES")
        .into_bytes())
}
