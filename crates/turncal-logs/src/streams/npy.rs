//! NumPy arrays, single (`.npy`) and in an archive (`.npz`).
//!
//! Arrays with the same number of rows form one stream; an array of several columns gives `name[0]`, `name[1]`, …
//!
//! Source: NumPy Enhancement Proposal 1, "A Simple File Format for NumPy Arrays".

mod header;

use std::io::{self, Read};

use flate2::CrcReader;
use zip::result::ZipError;
use zip::{CompressionMethod, ZipArchive};

use super::Log;
use super::arrays::{Array, Arrays, Open};
use super::bytes::{Broken, Input};
use super::part::{Packing, Part, Shared, pass};
use header::Header;

pub fn open_array(input: Input) -> Result<Box<dyn Log>, Broken> {
    let size = input.left();
    let member = Member {
        name: "array".to_owned(),
        part: Part {
            file: Shared::new(input),
            begin: 0,
            length: size,
            packing: Packing::Stored,
        },
        size,
        sum: None,
        offset: 0,
    };
    let (array, dropped) = member.array()?;
    let arrays = Arrays::new(vec![array]);
    Ok(Box::new(arrays.with_remarks(dropped.as_slice())))
}

pub fn open_archive(input: Input) -> Result<Box<dyn Log>, Broken> {
    let end = input.left();
    let broken = |offset: u64| move |error: ZipError| Broken::new(offset, error, "a ZIP archive");
    let mut archive = ZipArchive::new(input.into_source()).map_err(broken(end))?;
    let mut found = Vec::new();
    for member in 0..archive.len() {
        let member = archive.by_index(member).map_err(broken(end))?;
        let name = member.name().map_err(broken(end))?.into_owned();
        let Some(name) = name.strip_suffix(".npy") else {
            continue;
        };
        let packing = if member.compression() == CompressionMethod::Stored {
            Packing::Stored
        } else {
            Packing::Deflate
        };
        let begin = member.data_start().unwrap_or(end);
        let of_file = (begin, member.compressed_size(), packing);
        let sum = (member.size(), member.crc32(), member.header_start());
        found.push((name.to_owned(), of_file, sum));
    }
    if found.is_empty() {
        let expected = "arrays `NAME.npy` (save the sheet of a workbook as CSV)";
        return Err(Broken::new(0, "a ZIP archive without arrays", expected));
    }
    let file = Shared::of(archive.into_inner());
    let (mut arrays, mut remarks) = (Vec::new(), Vec::new());
    for (name, (begin, length, packing), (size, sum, offset)) in found {
        let member = Member {
            name,
            part: Part {
                file: file.clone(),
                begin,
                length,
                packing,
            },
            size,
            sum: Some(sum),
            offset,
        };
        let (array, dropped) = member.array()?;
        arrays.push(array);
        remarks.extend(dropped);
    }
    Ok(Box::new(Arrays::new(arrays).with_remarks(&remarks)))
}

/// An array file, single or in an archive.
struct Member {
    name: String,
    part: Part,
    /// Unpacked size.
    size: u64,
    /// Expected checksum.
    sum: Option<u32>,
    offset: u64,
}

impl Member {
    /// The array, and a remark on omitted parts.
    fn array(self) -> Result<(Array, Option<String>), Broken> {
        let Self {
            name,
            part,
            size,
            sum,
            offset,
        } = self;
        let from = move |skip: u64| -> io::Result<Box<dyn Read>> {
            let Some(sum) = sum else {
                return part.open(skip);
            };
            // The checksum covers all bytes.
            let bytes = CrcReader::new(part.open(0)?);
            let mut bytes = Checked { bytes, sum };
            pass(&mut bytes, skip)?;
            Ok(Box::new(bytes))
        };
        let mut begin = from(0).map_err(|error| Broken::new(offset, error, "an array"))?;
        let header = Header::read(&mut begin, &name, offset)?;
        let left_out = header.left_out();
        let begin = header.begin;
        let open: Open = Box::new(move |skip| from(begin + skip));
        let array = Array {
            shape: header.shape,
            first_is_fastest: header.first_is_fastest,
            size: header.size,
            fields: header.fields,
            open,
            offset,
        };
        Ok((array.within(size.saturating_sub(begin), &name)?, left_out))
    }
}

/// Bytes whose checksum is verified at the end.
struct Checked {
    bytes: CrcReader<Box<dyn Read>>,
    sum: u32,
}

impl Read for Checked {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let count = self.bytes.read(into)?;
        if count == 0 && !into.is_empty() && self.bytes.crc().sum() != self.sum {
            let what = "its checksum differs from that in the archive";
            return Err(io::Error::new(io::ErrorKind::InvalidData, what));
        }
        Ok(count)
    }
}
