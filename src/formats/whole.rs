//! Output that appears whole or not at all: written beside its place, then renamed into it.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::error::{FileError, Place};

/// A place that something new is going to take.
struct Stage {
    /// Holds the new thing and, while they change places, the old one. Goes away on drop.
    beside: TempDir,
    target: PathBuf,
    force: bool,
}

impl Stage {
    fn new(target: &Path, force: bool) -> Result<Self, FileError> {
        if target.file_name().is_none() {
            return Err(FileError::new(
                target,
                Place::File,
                "a path without a name of its own",
                "the name of something to be written",
                "Give a name that does not end in `..` or `/`.",
            ));
        }
        let parent = match target.parent() {
            Some(parent) if parent != Path::new("") => parent,
            _ => Path::new("."),
        };
        let beside = fs::create_dir_all(parent)
            .and_then(|()| {
                tempfile::Builder::new()
                    .prefix(".turncal-")
                    .tempdir_in(parent)
            })
            .map_err(|error| {
                FileError::io(
                    target,
                    "write here",
                    &error,
                    "Choose a directory that can be written.",
                )
            })?;
        Ok(Self {
            beside,
            target: target.to_owned(),
            force,
        })
    }

    fn new_path(&self) -> PathBuf {
        self.beside.path().join("new")
    }

    /// Puts the new thing in its place.
    fn commit(self) -> Result<(), FileError> {
        let old = self.beside.path().join("old");
        let exists = fs::symlink_metadata(&self.target).is_ok();
        if exists && !self.force {
            return Err(taken(&self.target));
        }
        let refused = |error| {
            let advice = "Choose a directory that can be written.";
            FileError::io(&self.target, "put the output in place", &error, advice)
        };
        // At no moment is there nothing, where the system can do that.
        if exists && exchange(&self.new_path(), &self.target).is_ok() {
            return Ok(());
        }
        if exists {
            fs::rename(&self.target, &old).map_err(refused)?;
        }
        let Err(error) = fs::rename(self.new_path(), &self.target) else {
            return Ok(());
        };
        if exists && fs::rename(&old, &self.target).is_err() {
            let kept = self.beside.keep();
            let doing = format!(
                "put the output in place; the old one is in {}",
                kept.display()
            );
            return Err(FileError::io(
                &self.target,
                &doing,
                &error,
                "Move it back by hand.",
            ));
        }
        Err(refused(error))
    }
}

/// Lets two things change places at once.
#[cfg(any(target_os = "linux", target_vendor = "apple"))]
fn exchange(a: &Path, b: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE)?)
}

#[cfg(not(any(target_os = "linux", target_vendor = "apple")))]
fn exchange(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

fn taken(target: &Path) -> FileError {
    FileError::new(
        target,
        Place::File,
        "something of this name already",
        "a name that is free",
        "Choose another name, or give --force to replace it.",
    )
}

/// A directory in the making. Dropped without [`Self::commit`] it leaves nothing behind.
pub struct WholeDirectory {
    stage: Stage,
}

impl WholeDirectory {
    /// Begins a directory that will appear at `target`.
    ///
    /// An existing directory is replaced only with `force`, a file never, and never a directory that
    /// holds one of `inputs` or the current directory: replacing it would delete them.
    pub fn create(target: &Path, force: bool, inputs: &[&Path]) -> Result<Self, FileError> {
        if let Ok(existing) = fs::symlink_metadata(target) {
            if !force {
                return Err(taken(target));
            }
            if !existing.is_dir() {
                return Err(FileError::new(
                    target,
                    Place::File,
                    "a file of this name",
                    "a directory or nothing",
                    "Choose another name or remove the file.",
                ));
            }
            let inside = |path: &Path| match (path.canonicalize(), target.canonicalize()) {
                (Ok(path), Ok(target)) => path.starts_with(target),
                _ => false,
            };
            let held = inputs
                .iter()
                .copied()
                .chain([Path::new(".")])
                .find(|path| inside(path));
            if let Some(held) = held {
                return Err(FileError::new(
                    target,
                    Place::File,
                    format_args!("a directory that holds {}", held.display()),
                    "one that can be replaced",
                    "Choose another name; replacing this one would delete what is still needed.",
                ));
            }
        }
        let stage = Stage::new(target, force)?;
        fs::create_dir(stage.new_path()).map_err(|error| {
            FileError::io(
                target,
                "write here",
                &error,
                "Choose a directory that can be written.",
            )
        })?;
        Ok(Self { stage })
    }

    /// Where to write until then.
    pub fn path(&self) -> PathBuf {
        self.stage.new_path()
    }

    /// Puts the directory in its place.
    pub fn commit(self) -> Result<(), FileError> {
        self.stage.commit()
    }
}

/// Writes a file whole or not at all; an existing one is replaced only with `force`, a directory
/// never.
pub fn write_whole(path: &Path, bytes: &[u8], force: bool) -> Result<(), FileError> {
    write_whole_with(path, force, |mut file| file.write_all(bytes))
}

/// The same for what is too long to be held: `write` gets the file that will appear.
pub(crate) fn write_whole_with(
    path: &Path,
    force: bool,
    write: impl FnOnce(File) -> io::Result<()>,
) -> Result<(), FileError> {
    match fs::symlink_metadata(path) {
        Ok(_) if !force => return Err(taken(path)),
        Ok(existing) if existing.is_dir() => {
            return Err(FileError::new(
                path,
                Place::File,
                "a directory of this name",
                "a file or nothing",
                "Choose another name.",
            ));
        }
        _ => {}
    }
    let stage = Stage::new(path, force)?;
    File::create_new(stage.new_path())
        .and_then(write)
        .map_err(|error| {
            FileError::io(
                path,
                "write the file",
                &error,
                "Make room or choose another place.",
            )
        })?;
    stage.commit()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(directory: &Path) -> Vec<String> {
        let entries = fs::read_dir(directory).unwrap();
        let mut names: Vec<String> = entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_directory_appears_on_commit_and_not_before() {
        let root = tempfile::tempdir().unwrap();
        let target = root.path().join("a/b");
        let whole = WholeDirectory::create(&target, false, &[]).unwrap();
        fs::write(whole.path().join("x"), "1").unwrap();
        assert!(!target.exists());
        whole.commit().unwrap();
        assert_eq!(names(&target), ["x"]);
        assert_eq!(names(&root.path().join("a")), ["b"]);
    }

    #[test]
    fn a_directory_that_is_given_up_leaves_nothing() {
        let root = tempfile::tempdir().unwrap();
        let whole = WholeDirectory::create(&root.path().join("a"), false, &[]).unwrap();
        fs::write(whole.path().join("x"), "1").unwrap();
        drop(whole);
        assert!(names(root.path()).is_empty());
    }

    #[test]
    fn an_existing_directory_is_replaced_only_with_force_and_then_wholly() {
        let root = tempfile::tempdir().unwrap();
        let target = root.path().join("a");
        fs::create_dir(&target).unwrap();
        fs::write(target.join("old"), "1").unwrap();
        let error = WholeDirectory::create(&target, false, &[]).err().unwrap();
        assert!(error.to_string().contains("--force"), "{error}");
        let whole = WholeDirectory::create(&target, true, &[]).unwrap();
        fs::write(whole.path().join("new"), "1").unwrap();
        assert_eq!(names(&target), ["old"]);
        whole.commit().unwrap();
        assert_eq!(names(&target), ["new"]);
        assert_eq!(names(root.path()), ["a"]);
    }

    #[test]
    fn a_target_that_appeared_meanwhile_is_kept() {
        let root = tempfile::tempdir().unwrap();
        let target = root.path().join("a");
        let whole = WholeDirectory::create(&target, false, &[]).unwrap();
        fs::create_dir(&target).unwrap();
        assert!(whole.commit().is_err());
        assert_eq!(names(root.path()), ["a"]);
    }

    #[test]
    fn force_replaces_neither_a_file_nor_what_holds_an_input_or_this_directory() {
        let root = tempfile::tempdir().unwrap();
        let file = root.path().join("run.toml");
        fs::write(&file, "1").unwrap();
        for (target, inputs) in [
            (file.as_path(), vec![]),
            (root.path(), vec![file.as_path()]),
            (&std::env::current_dir().unwrap(), vec![]),
            (Path::new("/"), vec![]),
        ] {
            assert!(WholeDirectory::create(target, true, &inputs).is_err());
        }
        assert_eq!(names(root.path()), ["run.toml"]);
    }

    #[test]
    fn a_file_is_replaced_only_with_force_and_a_directory_never() {
        let root = tempfile::tempdir().unwrap();
        let file = root.path().join("x");
        write_whole(&file, b"1", false).unwrap();
        assert!(write_whole(&file, b"2", false).is_err());
        assert_eq!(fs::read(&file).unwrap(), b"1");
        write_whole(&file, b"2", true).unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"2");
        assert!(write_whole(root.path(), b"3", true).is_err());
        assert_eq!(names(root.path()), ["x"]);
    }
}
