//! A file of rows on disk, as bytes in memory (for example in a browser), or as columns in memory.

use std::fs::{self, File};
use std::io::{self, Cursor, Read, Seek};
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::table::Table;
use turncal_input::{FileError, nearest};

/// A readable file, with its path as given in `run.toml` and messages.
#[derive(Debug, Clone, PartialEq)]
pub struct DataFile {
    path: PathBuf,
    kind: Kind,
}

#[derive(Debug, Clone, PartialEq)]
enum Kind {
    OnDisk,
    Bytes(Arc<[u8]>),
    Table(Table),
}

/// The content of a file.
pub trait Content: Read + Seek + Send {}
impl<T: Read + Seek + Send> Content for T {}

impl DataFile {
    /// A file in memory.
    pub fn in_memory(path: impl Into<PathBuf>, bytes: impl Into<Arc<[u8]>>) -> Self {
        Self {
            path: path.into(),
            kind: Kind::Bytes(bytes.into()),
        }
    }

    /// The bytes of a file in memory.
    pub fn bytes(&self) -> Option<&[u8]> {
        match &self.kind {
            Kind::Bytes(bytes) => Some(bytes),
            Kind::OnDisk | Kind::Table(_) => None,
        }
    }

    /// The columns, if they are in memory.
    pub fn table(&self) -> Option<&Table> {
        match &self.kind {
            Kind::Table(table) => Some(table),
            Kind::OnDisk | Kind::Bytes(_) => None,
        }
    }

    /// The file in memory with the name of this path, if there is one (files in memory have no directory); otherwise
    /// the file on disk.
    pub fn find(path: PathBuf, in_memory: &[Self]) -> Self {
        let found = in_memory
            .iter()
            .find(|file| file.file_name() == path.file_name());
        found.cloned().unwrap_or_else(|| path.into())
    }

    /// Opens a regular file, so that it can be read more than once.
    pub fn open(&self) -> Result<Box<dyn Content>, FileError> {
        if let Kind::Bytes(bytes) = &self.kind {
            return Ok(Box::new(Cursor::new(bytes.clone())));
        }
        // Opening a pipe would wait for its writer.
        let kind = fs::metadata(self).map_err(|error| self.refused(&error))?;
        if !kind.is_file() {
            let found = if kind.is_dir() {
                "a directory"
            } else {
                "a device or pipe"
            };
            let expected = "a regular file, which can be read more than once";
            let advice = "Save the output of this pipe or device to a file, and give the file.";
            return Err(FileError::of(self, found, expected, advice));
        }
        let file = File::open(self).map_err(|error| self.refused(&error))?;
        Ok(Box::new(file))
    }

    /// Error for a file that the system does not open.
    pub fn refused(&self, error: &io::Error) -> FileError {
        let beside = if error.kind() == io::ErrorKind::NotFound {
            beside(self)
        } else {
            Vec::new()
        };
        let name = self.file_name().map(|name| name.to_string_lossy());
        let names = beside.iter().map(String::as_str);
        let nearest = nearest(&name.unwrap_or_default(), names);
        let asked = nearest.map_or_else(String::new, |name| format!("Did you mean `{name}`? "));
        let advice = format!(
            "{asked}Correct the name or add the file; names in run.toml are relative to run.toml."
        );
        FileError::io(self, "open the file", error, &advice)
    }
}

/// Names of the files in the directory of a path.
fn beside(path: &Path) -> Vec<String> {
    let directory = path.parent().filter(|of| !of.as_os_str().is_empty());
    let entries = fs::read_dir(directory.unwrap_or(Path::new(".")));
    let entries = entries.into_iter().flatten().flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    names.collect()
}

impl From<PathBuf> for DataFile {
    fn from(path: PathBuf) -> Self {
        let kind = Kind::OnDisk;
        Self { path, kind }
    }
}

impl From<Table> for DataFile {
    fn from(table: Table) -> Self {
        Self {
            path: table.name().to_owned(),
            kind: Kind::Table(table),
        }
    }
}

impl From<&Path> for DataFile {
    fn from(path: &Path) -> Self {
        path.to_owned().into()
    }
}

impl Deref for DataFile {
    type Target = Path;

    fn deref(&self) -> &Path {
        &self.path
    }
}

impl AsRef<Path> for DataFile {
    fn as_ref(&self) -> &Path {
        self
    }
}
