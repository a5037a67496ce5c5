//! Output that is either complete or absent: turncal writes it next to its target and then renames it.
//!
//! A process that is ended by a signal removes unfinished output ([`Unfinished`]); the leftovers of a killed process
//! are removed when the next output is started in the same place.

mod manifest;
mod stage;
#[cfg(test)]
mod tests;

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

pub use manifest::FILE as LIST;
pub use stage::Unfinished;
use stage::{Stage, taken, unwritable};
use turncal_input::FileError;

/// A directory under construction. If it is dropped without [`Self::commit`], no file remains.
pub struct WholeDirectory {
    stage: Stage,
    force: bool,
}

impl WholeDirectory {
    /// Starts a directory that will appear at `target`.
    ///
    /// An existing directory is replaced only with `force`, and only if it contains nothing but files written by a
    /// [`WholeDirectory`]. Files, and directories that contain one of `inputs` or the current directory, are never
    /// replaced.
    pub fn create(target: &Path, force: bool, inputs: &[&Path]) -> Result<Self, FileError> {
        if let Ok(existing) = fs::symlink_metadata(target) {
            if !force {
                return Err(taken(target));
            }
            if !existing.is_dir() {
                let is_link = existing.is_symlink();
                let what = if is_link { "link" } else { "file" };
                let found = format_args!("a {what} of this name");
                let advice = format_args!("Choose another name or remove the {what}.");
                let expected = "a directory or an unused name";
                return Err(FileError::of(target, found, expected, advice));
            }
            let inside = |path: &&Path| match (path.canonicalize(), target.canonicalize()) {
                (Ok(path), Ok(target)) => path.starts_with(target),
                _ => false,
            };
            let here = Path::new(".");
            let mut needed = inputs.iter().copied().chain([here]);
            if let Some(held) = needed.find(inside) {
                let found = if held == here {
                    "the current working directory inside it".to_owned()
                } else {
                    format!("{} in it", held.display())
                };
                let expected = "a directory that can be replaced";
                let advice = "Choose another name, because replacing this directory would delete files that are in \
                              use.";
                return Err(FileError::of(target, found, expected, advice));
            }
            only_output(target)?;
        }
        let stage = Stage::new(target)?;
        fs::create_dir(stage.new_path())
            .map_err(|error| unwritable(target, "write here", &error))?;
        Ok(Self { stage, force })
    }

    /// Temporary location.
    pub fn path(&self) -> PathBuf {
        self.stage.new_path()
    }

    /// Moves the directory into place, with a list of its entries in the file `.turncal`.
    pub fn commit(self) -> Result<(), FileError> {
        let list = manifest::of_all(&self.path())
            .map_err(|error| unwritable(self.stage.target(), "put the output in place", &error))?;
        self.commit_with(&list)
    }

    /// Moves a growing directory into place; see `list_anew`.
    pub fn commit_growing(self, names: &[&str]) -> Result<(), FileError> {
        let list = manifest::of_names(names.iter().copied());
        self.commit_with(&list)
    }

    fn commit_with(self, list: &str) -> Result<(), FileError> {
        let target = self.stage.target();
        // Another program may have put a file into the directory in the meantime.
        if self.force && target.is_dir() {
            only_output(target)?;
        }
        fs::write(self.path().join(manifest::FILE), list)
            .map_err(|error| unwritable(target, "put the output in place", &error))?;
        self.stage.commit(self.force)
    }
}

/// Writes the list of a growing directory; it states that only these names belong to turncal. Entries that end in `/`
/// are directories with their own list. Files that are named only in the previous list are deleted.
pub fn list_anew(directory: &Path, names: &[&str]) -> Result<(), FileError> {
    for old in manifest::listed_files(directory) {
        let still = |name: &&str| old.file_name() == Some(name.as_ref());
        if !names.iter().any(still) {
            fs::remove_file(&old)
                .map_err(|error| unwritable(directory, "remove outdated files", &error))?;
        }
    }
    let list = manifest::of_names(names.iter().copied());
    write_whole(&directory.join(manifest::FILE), list.as_bytes(), true)
}

/// Removes the unfinished output of a killed process from a directory.
pub fn clear_abandoned(directory: &Path) {
    stage::remove_abandoned(directory);
}

/// Refuses a directory with anything not written by a [`WholeDirectory`].
fn only_output(directory: &Path) -> Result<(), FileError> {
    let foreign = manifest::foreign(directory)
        .map_err(|error| unwritable(directory, "list the directory", &error))?;
    foreign.map_or(Ok(()), |foreign| {
        let (name, list) = (foreign.display(), manifest::FILE);
        let found = format!("the file `{name}` in it, which is not in turncal's list of its own files (`{list}`)");
        let expected = "a directory that contains only files written by turncal";
        let advice = "Move this file elsewhere or choose another name, because replacing the directory would delete \
            the file.";
        Err(FileError::of(directory, found, expected, advice))
    })
}

/// Writes a file completely or not at all. An existing file is replaced only with `force`; a directory is never
/// replaced.
pub fn write_whole(path: &Path, bytes: &[u8], force: bool) -> Result<(), FileError> {
    write_whole_with(path, force, |mut file| file.write_all(bytes))
}

/// Does the same as [`write_whole`] for output too large for memory: `write` receives the temporary file.
pub fn write_whole_with(
    path: &Path,
    force: bool,
    write: impl FnOnce(File) -> io::Result<()>,
) -> Result<(), FileError> {
    match fs::symlink_metadata(path) {
        Ok(_) if !force => return Err(taken(path)),
        Ok(existing) if existing.is_dir() => {
            let (found, expected) = ("a directory of this name", "a file or an unused name");
            return Err(FileError::of(path, found, expected, "Choose another name."));
        }
        _ => {}
    }
    let stage = Stage::new(path)?;
    File::create_new(stage.new_path())
        .and_then(write)
        .map_err(|error| FileError::unwritten(path, &error))?;
    stage.commit(force)
}
