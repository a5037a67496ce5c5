//! Small files (descriptions and results), read as a whole.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;

use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::error::FileError;

/// Length limit, because the user may give any file or an endless device.
const MOST_BYTES: u64 = 1 << 24;

/// All bytes of a file of at most 16 MiB.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let file = File::open(path)?;
    file.take(MOST_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MOST_BYTES {
        let most = MOST_BYTES >> 20;
        let why = format!("it is longer than {most} MiB, which is the limit for such files");
        return Err(io::Error::new(ErrorKind::FileTooLarge, why));
    }
    Ok(bytes)
}

/// The text of a file of at most 16 MiB.
pub fn read_text(path: &Path) -> io::Result<String> {
    let not_text = |_| io::Error::new(ErrorKind::InvalidData, "it is not UTF-8 text");
    String::from_utf8(read(path)?).map_err(not_text)
}

/// All bytes of a small file; errors call its content `what`.
pub fn bytes(path: &Path, what: &str, advice: &str) -> Result<Vec<u8>, FileError> {
    let bytes = read(path);
    bytes.map_err(|error| FileError::io(path, &format!("read {what}"), &error, advice))
}

/// The text of a small file; errors call its content `what`.
pub fn text(path: &Path, what: &str, advice: &str) -> Result<String, FileError> {
    let text = read_text(path);
    text.map_err(|error| FileError::io(path, &format!("read {what}"), &error, advice))
}

/// Reads a small JSON file and checks that its `format` is the given one.
pub fn json<T: DeserializeOwned>(
    path: &Path,
    what: &str,
    format: &str,
    advice: &str,
) -> Result<T, FileError> {
    #[derive(Deserialize)]
    struct Format {
        format: String,
    }
    let bytes = bytes(path, what, advice)?;
    let wrong = |found: String| {
        let expected = format_args!("{what} in the format {format}");
        FileError::of(path, found, expected, advice)
    };
    let parsed = serde_json::from_slice(&bytes).map_err(|error| wrong(error.to_string()));
    let Format { format: found } = parsed?;
    if found != format {
        return Err(wrong(format!("format = {found:?}")));
    }
    serde_json::from_slice(&bytes).map_err(|error| wrong(error.to_string()))
}

/// The bytes of a JSON file.
pub fn pretty(value: &impl serde::Serialize) -> serde_json::Result<Vec<u8>> {
    let mut bytes = serde_json::to_vec_pretty(value)?;
    bytes.push(b'\n');
    Ok(bytes)
}
