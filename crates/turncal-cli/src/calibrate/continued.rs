//! A file of saved rows to which new rows are added.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use anyhow::bail;

use turncal_logs::csv_file::{RowKind, is_remark};

/// Number of bytes examined at the beginning and at the end of the file.
const LOOK: u64 = 1 << 16;

/// A file of rows to which new rows of the same kind are appended.
pub struct Continued {
    log: PathBuf,
    pub kind: RowKind,
    /// Length of the file up to its last complete line.
    pub length: u64,
    /// The first lines.
    head: Vec<Vec<u8>>,
}

impl Continued {
    /// The file, unless it is empty or missing.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, or if its last line is not a row of numbers.
    pub fn of(log: &Path) -> anyhow::Result<Option<Self>> {
        let mut file = match File::open(log) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            file => file?,
        };
        let size = file.metadata()?.len();
        if size == 0 {
            return Ok(None);
        }
        let head = look(&mut file, 0)?;
        let tail = look(&mut file, size.saturating_sub(LOOK))?;
        let whole = tail.iter().rposition(|byte| *byte == b'\n');
        let whole = &tail[..whole.map_or(0, |end| end + 1)];
        let last = lines(whole).rfind(|line| !is_remark(line));
        let kind = last.filter(|_| !head.contains(&0)).and_then(RowKind::of);
        let Some(kind) = kind else {
            bail!(
                "found no rows of numbers at the end of the file, expected rows to continue. Choose another file"
            );
        };
        Ok(Some(Self {
            log: log.to_owned(),
            kind,
            length: size - (tail.len() - whole.len()) as u64,
            head: lines(&head).map(<[u8]>::to_vec).collect(),
        }))
    }

    /// Checks that the first lines of a source continue this file.
    ///
    /// # Errors If no line is a row of the same kind, if the column names differ, or if the file already contains all rows.
    pub fn check(&self, first: &[Vec<u8>]) -> anyhow::Result<()> {
        let log = self.log.display();
        let lines = first.iter().filter(|line| !is_remark(line));
        let (rows, others): (Vec<_>, Vec<_>) =
            lines.partition(|line| self.kind.check(line).is_ok());
        if let (true, Some(why)) = (rows.is_empty(), others.last()) {
            let why = self.kind.check(why).err().unwrap_or_default();
            bail!("{log}: {why} as in this file. Choose another file for these rows");
        }
        let is_names = |line: &&Vec<u8>| self.kind.is_names(line);
        let own = self.head.iter().find(is_names);
        let new = others.into_iter().rfind(is_names);
        if let Some((own, new)) = own.zip(new)
            && own.trim_ascii() != new.trim_ascii()
        {
            let [own, new] = [own, new].map(|names| String::from_utf8_lossy(names.trim_ascii()));
            bail!(
                "{log}: found the columns {new}, expected {own} as in this file. Choose another file"
            );
        }
        if rows.len() > 1 && rows.iter().all(|row| self.head.contains(row)) {
            bail!(
                "{log}: found rows that this file contains already, expected new rows. Choose another file"
            );
        }
        Ok(())
    }
}

/// The bytes from this position on, at most [`LOOK`].
fn look(file: &mut File, from: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(from))?;
    file.take(LOOK).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn lines(bytes: &[u8]) -> impl DoubleEndedIterator<Item = &[u8]> {
    bytes.split_inclusive(|byte| *byte == b'\n')
}
