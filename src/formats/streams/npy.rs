//! NumPy's arrays, single (`.npy`) and in an archive (`.npz`).
//!
//! Arrays of the same number of rows are one stream; an array of several columns gives `name[0]`, `name[1]`, …
//!
//! Source: NumPy Enhancement Proposal 1, "A Simple File Format for NumPy Arrays".

mod header;

use std::io::Read;

use zip::ZipArchive;
use zip::result::ZipError;

use super::Log;
use super::arrays::{Array, Arrays};
use super::bytes::{Broken, Input};
use crate::room;
use header::Header;

/// Nothing deflated is shorter by more.
const DEFLATE: u64 = 1040;
/// A header is a few names.
const LONGEST_HEADER: u64 = 1 << 20;

pub(super) fn open_array(mut input: Input) -> Result<Box<dyn Log>, Broken> {
    let mut bytes = Vec::new();
    let left = input.left();
    input.take(left, &mut bytes, "an array")?;
    let arrays = array("array", &bytes, 0)?;
    Ok(Box::new(Arrays::new(arrays)))
}

pub(super) fn open_archive(input: Input) -> Result<Box<dyn Log>, Broken> {
    let end = input.left();
    let broken = |offset: u64| move |error: ZipError| Broken::new(offset, error, "a ZIP archive");
    let mut archive = ZipArchive::new(input.into_source()).map_err(broken(end))?;
    let mut arrays = Vec::new();
    for member in 0..archive.len() {
        let member = archive.by_index(member).map_err(broken(end))?;
        let name = member.name().map_err(broken(end))?.into_owned();
        let Some(name) = name.strip_suffix(".npy") else {
            continue;
        };
        let (offset, size) = (member.header_start(), member.size());
        let most = member.compressed_size().saturating_mul(DEFLATE);
        let room = usize::try_from(size).map_or(usize::MAX, |size| size.saturating_mul(2));
        if size > most || !room::is_there(room) {
            let found = format!("`{name}` of {size} bytes from {}", member.compressed_size());
            return Err(Broken::new(offset, found, "an array that fits into memory"));
        }
        let mut bytes = Vec::new();
        (member.take(size).read_to_end(&mut bytes)).map_err(|error| {
            Broken::new(
                offset,
                format_args!("`{name}`: {error}"),
                "a member of the archive",
            )
        })?;
        arrays.extend(array(name, &bytes, offset)?);
    }
    Ok(Box::new(Arrays::new(arrays)))
}

/// The columns of an array; none if its items are no numbers.
fn array(name: &str, bytes: &[u8], offset: u64) -> Result<Vec<Array>, Broken> {
    let header = Header::read(bytes, offset)?;
    header.arrays(name, bytes, offset)
}
