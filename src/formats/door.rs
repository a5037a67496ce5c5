//! Single entry point for inputs: a `run.toml`, or a log whose description is found in it or stated by options.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::draft::{Draft, Found, Stated};
use super::error::FileError;
use super::table::Table;
use crate::run::Run;

/// The log on standard input.
const STANDARD_INPUT: &str = "-";
/// File name for rows of standard input.
const PIPED: &str = "stdin.csv";

/// A run and, for a log without run.toml, the draft used to read it.
#[derive(Debug)]
pub struct Opened {
    /// The run.
    pub run: Run,
    log: Option<Log>,
}

#[derive(Debug)]
struct Log {
    path: PathBuf,
    draft: Draft,
    /// Rows of standard input, until written next to a result.
    piped: Option<TempDir>,
}

impl Opened {
    /// Reads a `run.toml` (by extension), a log, or text on standard input (`-`). Detected fields of a log are shown
    /// before any error.
    ///
    /// # Errors
    /// [`FileError`] if it cannot be read, or if required fields of a log are neither detected nor stated.
    pub fn new(
        path: &Path,
        stream: Option<&str>,
        stated: &Stated,
        show: impl FnOnce(&[Found]),
    ) -> Result<Self, FileError> {
        if path.extension() == Some(OsStr::new("toml")) {
            let run = Run::read(path)?;
            return Ok(Self { run, log: None });
        }
        let piped = match path == Path::new(STANDARD_INPUT) {
            true => Some(piped(path)?),
            false => None,
        };
        let file = match &piped {
            Some(directory) => directory.path().join(PIPED),
            None => path.to_owned(),
        };
        let draft = Draft::of_stream(&file, stream, stated)?;
        show(&draft.found());
        if let Some([found, expected, advice]) = draft.open_question() {
            return Err(FileError::of(path, found, expected, advice));
        }
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let run = Run::of_text(&file, &draft.to_toml(&name), None)?;
        let log = Log {
            path: file,
            draft,
            piped,
        };
        Ok(Self {
            run,
            log: Some(log),
        })
    }

    /// Reads a log that has grown, with the fields found before.
    ///
    /// # Errors
    /// [`FileError`] if it cannot be read.
    pub fn read_again(&mut self) -> Result<(), FileError> {
        if let Some(Log { path, draft, .. }) = &self.log {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            self.run = Run::of_text(path, &draft.to_toml(&name), None)?;
        }
        Ok(())
    }

    /// The same for a table in memory.
    ///
    /// # Errors
    /// [`FileError`] if required fields are neither detected nor stated.
    pub fn of_table(table: &Table, stated: &Stated) -> Result<Self, FileError> {
        let draft = Draft::of_table(table, stated)?;
        if let Some([found, expected, advice]) = draft.open_question() {
            return Err(FileError::of(table.name(), found, expected, advice));
        }
        let name = table.name().to_string_lossy();
        let run = Run::of_table(table, &draft.to_toml(&name))?;
        Ok(Self { run, log: None })
    }

    /// Whether there was no `run.toml`.
    pub fn is_of_log(&self) -> bool {
        self.log.is_some()
    }

    /// Writes the `run.toml` used to read a log into a result directory.
    ///
    /// # Errors
    /// [`FileError`] if it cannot be written.
    pub fn write_run(&self, directory: &Path) -> Result<(), FileError> {
        let Some(log) = &self.log else {
            return Ok(());
        };
        let path = directory.join("run.toml");
        let written = match &log.piped {
            Some(_) => fs::copy(&log.path, directory.join(PIPED)).map(|_| PIPED.into()),
            None => log.path.canonicalize(),
        };
        let written = written
            .and_then(|file: PathBuf| fs::write(&path, log.draft.to_toml(&file.to_string_lossy())));
        written.map_err(|error| FileError::unwritten(&path, &error))
    }
}

/// All rows of standard input as a file.
fn piped(path: &Path) -> Result<TempDir, FileError> {
    let spool = || -> io::Result<TempDir> {
        let directory = tempfile::tempdir()?;
        let mut file = File::create(directory.path().join(PIPED))?;
        io::copy(&mut io::stdin().lock(), &mut file)?;
        Ok(directory)
    };
    spool().map_err(|error| {
        FileError::io(
            path,
            "keep standard input",
            &error,
            "Give the log as a file.",
        )
    })
}
