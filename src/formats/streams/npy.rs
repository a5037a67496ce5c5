//! NumPy's arrays, single (`.npy`) and in an archive (`.npz`).
//!
//! Arrays of the same number of rows are one stream; an array of several columns gives `name[0]`, `name[1]`, …
//!
//! Source: NumPy Enhancement Proposal 1, "A Simple File Format for NumPy Arrays"; APPNOTE.TXT of the ZIP format.

mod header;
mod zip;

use super::Log;
use super::arrays::{Array, Arrays};
use super::bytes::{Broken, Input};
use header::Header;

/// A header is a few names.
const LONGEST_HEADER: u64 = 1 << 20;

pub(super) fn open_array(mut input: Input) -> Result<Box<dyn Log>, Broken> {
    let mut bytes = Vec::new();
    let left = input.left();
    input.take(left, &mut bytes, "an array")?;
    let arrays = array("array", &bytes, 0)?;
    Ok(Box::new(Arrays::new(arrays)))
}

pub(super) fn open_archive(mut input: Input) -> Result<Box<dyn Log>, Broken> {
    let mut arrays = Vec::new();
    for member in zip::members(&mut input)? {
        let Some(name) = member.name.strip_suffix(".npy") else {
            continue;
        };
        let bytes = member.read(&mut input)?;
        arrays.extend(array(name, &bytes, member.offset)?);
    }
    Ok(Box::new(Arrays::new(arrays)))
}

/// The columns of an array; none if its items are no numbers.
fn array(name: &str, bytes: &[u8], offset: u64) -> Result<Vec<Array>, Broken> {
    let header = Header::read(bytes, offset)?;
    header.arrays(name, bytes, offset)
}
