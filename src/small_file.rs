//! Files read as a whole: descriptions and results, never recordings.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;

/// Length limit, because any file or an endless device may be named.
const MOST_BYTES: u64 = 1 << 24;

/// All bytes of a file of at most 16 MiB.
pub fn bytes(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let file = File::open(path)?;
    file.take(MOST_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MOST_BYTES {
        let most = MOST_BYTES >> 20;
        let why = format!("it is longer than {most} MiB, the limit for such files");
        return Err(io::Error::new(ErrorKind::FileTooLarge, why));
    }
    Ok(bytes)
}

/// The text of such a file.
pub fn text(path: &Path) -> io::Result<String> {
    let not_text = |_| io::Error::new(ErrorKind::InvalidData, "it is not UTF-8 text");
    String::from_utf8(bytes(path)?).map_err(not_text)
}
