//! NumPy arrays, single (`.npy`) and in an archive (`.npz`).
//!
//! Arrays of the same number of rows are one stream; an array of several columns gives `name[0]`, `name[1]`, …
//!
//! Source: NumPy Enhancement Proposal 1, "A Simple File Format for NumPy Arrays".

mod header;

use std::cell::RefCell;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::rc::Rc;

use flate2::CrcReader;
use flate2::read::DeflateDecoder;
use zip::result::ZipError;
use zip::{CompressionMethod, ZipArchive};

use super::Log;
use super::arrays::{Array, Arrays, Open};
use super::bytes::{Broken, Input};
use crate::formats::data_file::Content;
use header::Header;

/// Bytes read at once per separate column.
const AT_ONCE: usize = 1 << 14;

pub fn open_array(input: Input) -> Result<Box<dyn Log>, Broken> {
    let member = Member {
        name: "array".to_owned(),
        begin: 0,
        packed: input.left(),
        size: input.left(),
        sum: None,
        offset: 0,
        is_deflated: false,
    };
    let file: File = Rc::new(RefCell::new(input.into_source()));
    let (array, dropped) = member.array(&file)?;
    let arrays = Arrays::new(vec![array]);
    Ok(Box::new(arrays.with_remarks(dropped.as_slice())))
}

pub fn open_archive(input: Input) -> Result<Box<dyn Log>, Broken> {
    let end = input.left();
    let broken = |offset: u64| move |error: ZipError| Broken::new(offset, error, "a ZIP archive");
    let mut archive = ZipArchive::new(input.into_source()).map_err(broken(end))?;
    let mut members = Vec::new();
    for member in 0..archive.len() {
        let member = archive.by_index(member).map_err(broken(end))?;
        let name = member.name().map_err(broken(end))?.into_owned();
        let Some(name) = name.strip_suffix(".npy") else {
            continue;
        };
        members.push(Member {
            name: name.to_owned(),
            begin: member.data_start().unwrap_or(end),
            packed: member.compressed_size(),
            size: member.size(),
            sum: Some(member.crc32()),
            offset: member.header_start(),
            is_deflated: member.compression() != CompressionMethod::Stored,
        });
    }
    if members.is_empty() {
        let expected = "arrays `NAME.npy` (save the sheet of a workbook as CSV)";
        return Err(Broken::new(0, "a ZIP archive without arrays", expected));
    }
    let file: File = Rc::new(RefCell::new(archive.into_inner()));
    let (mut arrays, mut remarks) = (Vec::new(), Vec::new());
    for member in members {
        let (array, dropped) = member.array(&file)?;
        arrays.push(array);
        remarks.extend(dropped);
    }
    Ok(Box::new(Arrays::new(arrays).with_remarks(&remarks)))
}

/// A file shared by several readers at different offsets.
type File = Rc<RefCell<Box<dyn Content>>>;

struct At {
    file: File,
    place: u64,
}

impl Read for At {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let mut file = self.file.borrow_mut();
        file.seek(SeekFrom::Start(self.place))?;
        let count = file.read(into)?;
        self.place += count as u64;
        Ok(count)
    }
}

/// An array file, single or in an archive.
#[derive(Clone)]
struct Member {
    name: String,
    /// Offset, packed size and unpacked size of its bytes.
    begin: u64,
    packed: u64,
    size: u64,
    /// Expected checksum.
    sum: Option<u32>,
    offset: u64,
    is_deflated: bool,
}

impl Member {
    fn open(&self, file: &File) -> Box<dyn Read> {
        let place = self.begin;
        let file = file.clone();
        let packed = BufReader::with_capacity(AT_ONCE, At { file, place }).take(self.packed);
        let bytes: Box<dyn Read> = match self.is_deflated {
            true => Box::new(DeflateDecoder::new(packed)),
            false => Box::new(packed),
        };
        match self.sum {
            Some(sum) => Box::new(Checked {
                bytes: CrcReader::new(bytes),
                sum,
            }),
            None => bytes,
        }
    }

    /// The array, and its omitted parts.
    fn array(self, file: &File) -> Result<(Array, Option<String>), Broken> {
        let header = Header::read(&mut self.open(file), &self.name, self.offset)?;
        let left_out = header.left_out();
        let (size, begin, offset) = (self.size, header.begin, self.offset);
        let (name, file) = (self.name.clone(), file.clone());
        let open: Open = Box::new(move |skip| {
            let mut bytes = self.open(&file);
            io::copy(&mut bytes.by_ref().take(begin + skip), &mut io::sink())?;
            Ok(bytes)
        });
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
