//! Where output goes, alike in every command.

use std::io::Write;
use std::path::Path;

use turncal::run::{RunError, WholeDirectory};

/// What every command that writes has in common.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct Overwrite {
    /// Replace the output directory if it exists
    #[arg(long)]
    force: bool,
}

impl Overwrite {
    /// Begins an output directory; none of `inputs` may lie in it.
    pub fn directory(self, target: &Path, inputs: &[&Path]) -> Result<WholeDirectory, RunError> {
        WholeDirectory::create(target, self.force, inputs)
    }
}

/// Writes to standard output. A reader that has seen enough, such as `head`, is no failure.
pub fn print(bytes: &[u8]) -> anyhow::Result<()> {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(bytes).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(anyhow::Error::new(error).context("cannot write to standard output"))
        }
        _ => Ok(()),
    }
}
