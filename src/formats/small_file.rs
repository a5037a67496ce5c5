//! Descriptions and results, read as a whole.

use std::path::Path;

use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::error::FileError;
use crate::small_file;

/// All bytes of a small file that contains `what`.
pub fn bytes(path: &Path, what: &str, advice: &str) -> Result<Vec<u8>, FileError> {
    let bytes = small_file::bytes(path);
    bytes.map_err(|error| FileError::io(path, &format!("read {what}"), &error, advice))
}

/// The text of such a file.
pub fn text(path: &Path, what: &str, advice: &str) -> Result<String, FileError> {
    let text = small_file::text(path);
    text.map_err(|error| FileError::io(path, &format!("read {what}"), &error, advice))
}

/// Such a file of this JSON format.
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
