//! HDF5 files, and MAT files of version 7.3 (`save -v7.3`), which are HDF5 after a header of 512 bytes.
//!
//! The crate `hdf5-pure` reads the format; its datasets become arrays named by path.
//!
//! Source: The HDF Group, "HDF5 File Format Specification Version 4.0".

use std::io::{self, Cursor, Read};

use hdf5_pure::{
    Chunk, Dataset, Datatype, DatatypeByteOrder, Error, File, FloatingPointLayout, FormatError,
    Group, Layout, ReadSeekSource,
};

use super::Log;
use super::arrays::{Array, Arrays, Field, Open};
use super::bytes::{Broken, Input, Kind, most_at_once};

/// Limits of group depth and number, because a group may contain itself.
const DEEPEST: usize = 8;
const MOST_GROUPS: usize = 1024;
/// Maximum number of array elements within an item.
const MOST_NUMBERS: usize = 64;
/// Bytes read at once, if rows and chunks are shorter.
const AT_ONCE: u64 = 1 << 16;
/// Maximum compression ratio of deflate.
const DEFLATE: u64 = 1040;

pub fn open(input: Input) -> Result<Box<dyn Log>, Broken> {
    let length = input.left();
    let source = ReadSeekSource::new(input.into_source());
    let file = source.map_err(Error::from).and_then(File::from_source);
    let file = file.map_err(broken)?;
    let end = file.superblock().eof_address;
    if end > length {
        let expected = format!("an HDF5 file of {end} bytes");
        return Err(Broken::new(length, "the end of the file", expected));
    }
    // Fields of MATLAB structures have the same names as in a MAT file of version 5.
    let is_mat = file.superblock().base_address.get() > 0;
    let mut walk = Walk {
        between: if is_mat { "." } else { "/" },
        file: length,
        groups: 0,
        arrays: Vec::new(),
    };
    walk.group(&file.root(), "", 0)?;
    Ok(Box::new(Arrays::new(walk.arrays)))
}

fn broken(error: Error) -> Broken {
    let found = match error {
        // The messages of the crate are addressed to its callers.
        Error::FileMarkedInUse { .. } => "a file that was not closed by its writer".to_owned(),
        Error::Format(FormatError::OffsetOverflow {
            offset: u64::MAX, ..
        }) => "an undefined address, such as that of a soft link".to_owned(),
        error => error.to_string(),
    };
    Broken::new(0, found, "an HDF5 file of version 1.14 or earlier")
}

/// Traversal of the groups of a file.
struct Walk {
    /// Separator between the names of a group and its members.
    between: &'static str,
    /// Bytes of the file.
    file: u64,
    groups: usize,
    arrays: Vec<Array>,
}

impl Walk {
    fn group(&mut self, group: &Group, path: &str, depth: usize) -> Result<(), Broken> {
        self.groups += 1;
        if self.groups > MOST_GROUPS {
            let found = format_args!("more than {MOST_GROUPS} groups");
            return Err(Broken::new(0, found, "a file with one recording"));
        }
        let begin = match path {
            "" => String::new(),
            path => format!("{path}{}", self.between),
        };
        for (name, dataset) in group.iter_datasets().map_err(broken)? {
            let array = array(format!("{begin}{name}"), dataset, self.file)?;
            self.arrays.extend(array);
        }
        for (name, inner) in group.iter_groups().map_err(broken)? {
            // MATLAB keeps the content of cells in groups such as `#refs#`.
            if depth < DEEPEST && !name.starts_with('#') {
                self.group(&inner, &format!("{begin}{name}"), depth + 1)?;
            }
        }
        Ok(())
    }
}

/// A dataset as an array; `None` if not numeric.
fn array(name: String, dataset: Dataset, file: u64) -> Result<Option<Array>, Broken> {
    let of_it = |error| {
        let Broken { found, .. } = broken(error);
        Broken::new(0, format_args!("`{name}`: {found}"), "a dataset")
    };
    let item = dataset.datatype().map_err(of_it)?;
    let mut fields = Vec::new();
    numbers(&name, &item, 0, &mut fields);
    if fields.is_empty() || is_no_number_to_matlab(&dataset) {
        return Ok(None);
    }
    let sizes = dataset.shape().map_err(of_it)?;
    let shape: Vec<usize> = sizes.iter().map(|&size| size as usize).collect();
    let size = item.type_size() as usize;
    let mut inner = shape.iter().skip(1);
    let row = inner.try_fold(size, |all, &size| all.checked_mul(size));
    let all = row.and_then(|row| row.checked_mul(shape.first().copied().unwrap_or(1)));
    let (Some(row), Some(all)) = (row, all) else {
        let found = format_args!("`{name}` with the shape {shape:?}");
        return Err(Broken::new(0, found, "a shape with fewer items"));
    };
    let stored = Stored {
        dataset,
        row: row as u64,
        all: all as u64,
        file,
    };
    let open: Open = Box::new(move |skip| stored.open(skip));
    Ok(Some(Array {
        shape,
        first_is_fastest: false,
        size,
        fields,
        open,
        offset: 0,
    }))
}

/// Whether MATLAB wrote text as numbers, or the size of an empty array.
fn is_no_number_to_matlab(dataset: &Dataset) -> bool {
    let Ok(attributes) = dataset.attrs() else {
        return false;
    };
    let class = attributes.get("MATLAB_class");
    let class = class.and_then(|class| class.as_str());
    class == Some("char") || attributes.contains_key("MATLAB_empty")
}

/// Adds the numbers of an item that starts at this offset.
fn numbers(name: &str, item: &Datatype, place: usize, into: &mut Vec<Field>) {
    match item {
        Datatype::Enumeration { base_type, .. } => numbers(name, base_type, place, into),
        Datatype::Array {
            base_type,
            dimensions,
        } => {
            let mut sizes = dimensions.iter();
            let count = sizes.try_fold(1usize, |all, &size| all.checked_mul(size as usize));
            for index in 0..count.filter(|&count| count <= MOST_NUMBERS).unwrap_or(0) {
                let place = place + index * base_type.type_size() as usize;
                numbers(&format!("{name}[{index}]"), base_type, place, into);
            }
        }
        Datatype::Compound { members, .. } => {
            for member in members {
                let place = place + member.byte_offset as usize;
                let name = format!("{name}.{}", member.name);
                numbers(&name, &member.datatype, place, into);
            }
        }
        item => into.extend(kind(item).map(|(kind, big_endian)| Field {
            name: name.to_owned(),
            kind,
            big_endian,
            place,
        })),
    }
}

/// How a number is stored, and whether big-endian.
fn kind(item: &Datatype) -> Option<(Kind, bool)> {
    let (kind, order) = match item {
        Datatype::FloatingPoint {
            size,
            byte_order,
            layout,
        } => match (size, *layout) {
            (4, FloatingPointLayout::IEEE754_BINARY32) => (Kind::F32, byte_order),
            (8, FloatingPointLayout::IEEE754_BINARY64) => (Kind::F64, byte_order),
            _ => return None,
        },
        Datatype::FixedPoint {
            size,
            byte_order,
            layout,
        } if layout.bit_offset == 0 && u32::from(layout.bit_precision) == 8 * size => (
            Kind::whole_number(layout.signed, *size as usize)?,
            byte_order,
        ),
        _ => return None,
    };
    match order {
        DatatypeByteOrder::LittleEndian => Some((kind, false)),
        DatatypeByteOrder::BigEndian => Some((kind, true)),
        DatatypeByteOrder::Vax => None,
    }
}

/// The bytes of a dataset.
struct Stored {
    dataset: Dataset,
    /// Bytes of a row of its first dimension, and of all rows.
    row: u64,
    all: u64,
    /// Bytes of the file.
    file: u64,
}

impl Stored {
    /// The bytes from this offset on.
    fn open(&self, skip: u64) -> io::Result<Box<dyn Read>> {
        let possible = self.possible()?;
        if self.all > possible {
            let found = format!("the file contains at most {possible} of {} bytes", self.all);
            return Err(io::Error::other(found));
        }
        let row = self.row.max(1);
        let at_once = self.rows_at_once()?;
        let needed = at_once.saturating_mul(row).min(self.all);
        let most = most_at_once(self.file);
        if needed > most {
            let found = format!("{needed} bytes must be read at once, more than {most} bytes");
            return Err(io::Error::other(found));
        }
        let mut rows = Rows {
            dataset: self.dataset.clone(),
            next: skip / row,
            at_once,
            read: Cursor::default(),
        };
        io::copy(&mut rows.by_ref().take(skip % row), &mut io::sink())?;
        Ok(Box::new(rows))
    }

    /// One long row, or short rows in whole chunks, because reading part of a chunk unpacks the whole chunk.
    fn rows_at_once(&self) -> io::Result<u64> {
        let row = self.row.max(1);
        if row >= AT_ONCE {
            return Ok(1);
        }
        let sizes = self.dataset.chunk_shape().map_err(io::Error::other)?;
        let chunk = sizes.and_then(|sizes| sizes.first().copied());
        let chunk = chunk.unwrap_or(1).max(1);
        let chunks = (AT_ONCE / row.saturating_mul(chunk)).max(1);
        Ok(chunk.saturating_mul(chunks).min(self.all / row + 1))
    }

    /// Maximum number of bytes in the file, because the crate allocates sizes stated by damaged files.
    fn possible(&self) -> io::Result<u64> {
        let layout = self.dataset.layout().map_err(io::Error::other)?;
        Ok(match layout {
            Layout::Compact { size } => size,
            Layout::Contiguous { address, size } => address.map_or(0, |_| size),
            Layout::Chunked { .. } => {
                let chunks = self.dataset.chunks().map_err(io::Error::other)?;
                let end = |chunk: &Chunk| chunk.address.saturating_add(chunk.storage_size);
                if chunks.iter().any(|chunk| end(chunk) > self.file) {
                    return Err(io::Error::other("a chunk ends beyond the file"));
                }
                let sizes = chunks.iter().map(|chunk| chunk.storage_size);
                let stored = sizes.fold(0u64, u64::saturating_add);
                stored.saturating_mul(DEFLATE)
            }
            _ => 0,
        })
    }
}

/// Reads some rows of a dataset at a time.
struct Rows {
    dataset: Dataset,
    next: u64,
    at_once: u64,
    read: Cursor<Vec<u8>>,
}

impl Read for Rows {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let is_read = self.read.position() == self.read.get_ref().len() as u64;
        if is_read && !into.is_empty() {
            let rows = self.dataset.read_raw_rows(self.next, self.at_once);
            self.read = Cursor::new(rows.map_err(io::Error::other)?);
            self.next = self.next.saturating_add(self.at_once);
        }
        self.read.read(into)
    }
}
