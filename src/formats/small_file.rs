//! Files that are read as a whole: descriptions and results, never records.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;

/// A file of any length may be named, and a device that never ends.
const MOST_BYTES: u64 = 1 << 24;

/// All bytes of a file.
pub fn bytes(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?
        .take(MOST_BYTES + 1)
        .read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MOST_BYTES {
        let what = format!(
            "it is longer than {} MiB, as no file of this kind is",
            MOST_BYTES >> 20
        );
        return Err(io::Error::new(ErrorKind::FileTooLarge, what));
    }
    Ok(bytes)
}

/// The text of a file.
pub fn text(path: &Path) -> io::Result<String> {
    String::from_utf8(bytes(path)?)
        .map_err(|_| io::Error::new(ErrorKind::InvalidData, "it is not text in UTF-8"))
}
