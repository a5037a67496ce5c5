//! Output options, which are the same in every command.

use std::path::{Path, PathBuf};

use anyhow::bail;

use crate::terminal::show;
use turncal_files::WholeDirectory;
use turncal_input::FileError;
use turncal_report as report;
use turncal_report::Document;

/// Option to overwrite existing output, shared by all commands that write files.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct Overwrite {
    /// Replace the output directory if it exists and contains only turncal output
    #[arg(long)]
    pub force: bool,
}

impl Overwrite {
    /// Creates an output directory; none of `inputs` may be inside it.
    pub fn directory(self, target: &Path, inputs: &[&Path]) -> Result<WholeDirectory, FileError> {
        WholeDirectory::create(target, self.force, inputs)
    }
}

/// Where the results go: a report in a directory, and JSON or text on standard output.
#[derive(Debug, Clone, clap::Args)]
pub struct Delivery {
    /// Directory in which to write a report
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Print the results as a single JSON document, without any other output
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    overwrite: Overwrite,
}

impl Delivery {
    /// Requested directory.
    pub fn output(&self) -> Option<&Path> {
        self.output.as_deref()
    }

    /// Whether JSON output is requested.
    pub fn json(&self) -> bool {
        self.json
    }

    /// Whether an existing directory may be replaced.
    pub fn force(&self) -> bool {
        self.overwrite.force
    }

    /// Creates the requested directory before any long computation; none of `inputs` may be inside it.
    pub fn begin(&self, inputs: &[&Path]) -> Result<Begun<'_>, FileError> {
        let target = self.output.as_deref();
        let begun = target.map(|target| {
            let whole = self.overwrite.directory(target, inputs)?;
            Ok::<_, FileError>((target, whole))
        });
        Ok(Begun {
            directory: begun.transpose()?,
            json: self.json,
        })
    }
}

/// The delivery, with its output directory created.
pub struct Begun<'a> {
    directory: Option<(&'a Path, WholeDirectory)>,
    json: bool,
}

impl Begun<'_> {
    /// Writes files into the directory without printing.
    pub fn fill(self, write: impl FnOnce(&Path) -> Result<(), FileError>) -> Result<(), FileError> {
        if let Some((_, whole)) = self.directory {
            write(&whole.path())?;
            whole.commit()?;
        }
        Ok(())
    }

    /// Writes and prints a document as requested.
    pub fn deliver(self, document: &Document) -> anyhow::Result<()> {
        let mut page = None;
        if let Some((target, whole)) = self.directory {
            report::write(document, &whole.path())?;
            whole.commit()?;
            page = Some(target.join("index.html"));
        }
        show(document, self.json)?;
        if let Some(page) = page.filter(|_| !self.json) {
            tell!("\nreport: {}", page.display());
        }
        Ok(())
    }
}

/// Refuses an output file that is one of the inputs, even with `--force`.
pub fn keep(
    output: &Path,
    inputs: impl IntoIterator<Item = impl AsRef<Path>>,
) -> anyhow::Result<()> {
    let Ok(target) = output.canonicalize() else {
        return Ok(());
    };
    let mut inputs = inputs
        .into_iter()
        .map(|input| input.as_ref().canonicalize());
    if inputs.any(|input| input.is_ok_and(|input| input == target)) {
        bail!(
            "{}: found an input of this command, expected an unused name. Choose another name, because replacing \
             this file would delete the input.",
            output.display()
        );
    }
    Ok(())
}
