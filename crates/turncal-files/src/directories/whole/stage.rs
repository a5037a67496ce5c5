//! A temporary location next to an output.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::Duration;

use turncal_input::FileError;

const PREFIX: &str = ".turncal-";
const NEW: &str = "new";
const OLD: &str = "old";
/// Name of new output that is being removed.
const DEAD: &str = "dead";

/// Announces every stage to the thread that ends the process on a signal; not set in a library.
static ANNOUNCED: OnceLock<Sender<Beside>> = OnceLock::new();
/// Whether that thread is about to end the process.
static ENDING: AtomicBool = AtomicBool::new(false);

/// Error if an output must not replace the file or directory at `target`.
pub fn taken(target: &Path) -> FileError {
    let found = "an existing file or directory of this name";
    let advice = "Choose another name, or add --force to replace it.";
    FileError::of(target, found, "an unused name", advice)
}

/// Error if the system does not allow writing at `target`.
pub fn unwritable(target: &Path, doing: &str, error: &io::Error) -> FileError {
    let advice = "Choose a directory that can be written.";
    FileError::io(target, doing, error, advice)
}

/// List of the unfinished outputs of this process, used by the thread that ends the process on a signal.
pub struct Unfinished(Receiver<Beside>);

impl Unfinished {
    /// Starts to collect unfinished outputs; `None` if another thread already does so.
    pub fn of_this_process() -> Option<Self> {
        let (announced, all) = channel();
        ANNOUNCED.set(announced).ok().map(|()| Self(all))
    }

    /// Removes the unfinished outputs, for a process that is about to end. Threads that start, finish or abandon an
    /// output after this call wait until the process has ended.
    pub fn abandon(self) {
        ENDING.store(true, Ordering::SeqCst);
        for beside in self.0.try_iter() {
            // Another thread may be writing into the output or exchanging the old and the new one.
            for _ in 0..100 {
                if beside.remove().is_ok() {
                    break;
                }
                thread::sleep(Duration::from_millis(10));
            }
        }
    }
}

/// A stage, and the directories created for it, innermost first.
#[derive(Clone)]
struct Beside {
    stage: PathBuf,
    parents: Vec<PathBuf>,
}

impl Beside {
    /// Announces the stage; does not return if the process is about to end.
    fn announce(&self) {
        if let Some(all) = ANNOUNCED.get() {
            // Without that thread, nothing receives the announcement.
            let _ = all.send(self.clone());
        }
        if ENDING.load(Ordering::SeqCst) {
            let _ = self.remove();
            loop {
                thread::park();
            }
        }
    }

    /// Removes the stage and the directories created for it, if empty.
    fn remove(&self) -> io::Result<()> {
        let removed = remove(&self.stage);
        // Removal stops at the first directory that is not empty, for example because the target is in place.
        let _ = self.parents.iter().try_for_each(fs::remove_dir);
        removed
    }
}

/// A target for new output.
pub struct Stage {
    /// Contains the new output and, during the exchange, the old one. Removed on drop.
    beside: Beside,
    /// The stage, locked during the lifetime of this process; `None` if the system has no locks of directories.
    lock: Option<File>,
    target: PathBuf,
}

impl Stage {
    pub fn new(target: &Path) -> Result<Self, FileError> {
        if target.file_name().is_none() {
            let found = "a path that does not end in a name";
            let expected = "the name of a file or directory to write";
            let advice = "Give a name that does not end in `..` or `/`.";
            return Err(FileError::of(target, found, expected, advice));
        }
        let parent = match target.parent() {
            Some(parent) if parent != Path::new("") => parent,
            _ => Path::new("."),
        };
        let is_missing = |of: &&Path| **of != *Path::new("") && !of.exists();
        let missing = parent.ancestors().take_while(is_missing);
        let missing: Vec<PathBuf> = missing.map(Path::to_owned).collect();
        let begun = fs::create_dir_all(parent).and_then(|()| {
            remove_abandoned(parent);
            begin(parent)
        });
        let (stage, lock) = begun.map_err(|error| {
            let _ = missing.iter().try_for_each(fs::remove_dir);
            let Some(file) = parent.ancestors().find(|ancestor| ancestor.is_file()) else {
                return unwritable(target, "write here", &error);
            };
            let found = format_args!("the file {} in the path", file.display());
            FileError::of(target, found, "directories", "Choose another name.")
        })?;
        let (target, parents) = (target.to_owned(), missing);
        let beside = Beside { stage, parents };
        beside.announce();
        Ok(Self {
            beside,
            lock,
            target,
        })
    }

    pub fn new_path(&self) -> PathBuf {
        self.beside.stage.join(NEW)
    }

    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Moves the new output into place; existing output is replaced only with `force`.
    pub fn commit(self, force: bool) -> Result<(), FileError> {
        let old = self.beside.stage.join(OLD);
        let exists = fs::symlink_metadata(&self.target).is_ok();
        if exists && !force {
            return Err(taken(&self.target));
        }
        // If the system can exchange two names, the target is never missing.
        if exists && exchange(&self.new_path(), &self.target).is_ok() {
            return Ok(());
        }
        let refused = |error| unwritable(&self.target, "put the output in place", &error);
        if exists {
            fs::rename(&self.target, &old).map_err(refused)?;
        }
        let Err(error) = fs::rename(self.new_path(), &self.target) else {
            return Ok(());
        };
        if exists && fs::rename(&old, &self.target).is_err() {
            let stage = self.beside.stage.display();
            let doing = format!("put the output in its place (the old output is in {stage})");
            let advice = "Move it back by hand.";
            return Err(FileError::io(&self.target, &doing, &error, advice));
        }
        Err(refused(error))
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        self.lock = None;
        let _ = self.beside.remove();
        self.beside.announce();
    }
}

/// Creates and locks a stage.
fn begin(parent: &Path) -> io::Result<(PathBuf, Option<File>)> {
    let stage = tempfile::Builder::new().prefix(PREFIX).tempdir_in(parent)?;
    let stage = stage.keep();
    let lock = File::open(&stage).ok();
    let lock = lock.filter(|stage| stage.try_lock().is_ok());
    Ok((stage, lock))
}

/// Removes from a directory the stages of processes that no longer exist, except empty stages: these may be about to be
/// locked.
pub fn remove_abandoned(parent: &Path) {
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        let (stage, name) = (entry.path(), entry.file_name());
        let is_begun = || {
            [NEW, OLD, DEAD]
                .iter()
                .any(|name| stage.join(name).exists())
        };
        if name.as_encoded_bytes().starts_with(PREFIX.as_bytes())
            && entry.file_type().is_ok_and(|kind| kind.is_dir())
            && is_begun()
            && File::open(&stage).is_ok_and(|lock| lock.try_lock().is_ok())
        {
            // A stage of another user cannot be removed; this does no harm.
            let _ = remove(&stage);
        }
    }
}

/// Removes a stage, except one with the only copy of the output that was to be replaced.
fn remove(stage: &Path) -> io::Result<()> {
    let [new, old, dead] = [NEW, OLD, DEAD].map(|name| stage.join(name));
    if new.exists() && old.exists() {
        return Err(io::ErrorKind::ResourceBusy.into());
    }
    // Renamed first, so that a partly removed output is never put in place.
    let _ = fs::rename(&new, &dead);
    for thing in [dead, old] {
        match fs::symlink_metadata(&thing) {
            Ok(found) if found.is_dir() => fs::remove_dir_all(&thing)?,
            Ok(_) => fs::remove_file(&thing)?,
            Err(_) => {}
        }
    }
    match fs::remove_dir(stage) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Exchanges two paths atomically.
#[cfg(any(target_os = "linux", target_vendor = "apple"))]
fn exchange(a: &Path, b: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE)?)
}

#[cfg(not(any(target_os = "linux", target_vendor = "apple")))]
fn exchange(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}
