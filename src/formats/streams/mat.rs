//! MATLAB's MAT files of version 5 (`save -v6`, `-v7`).
//!
//! Source: MathWorks, "MAT-File Format", 2023: a header of 128 bytes, then elements of a type, a size and content,
//! padded to eight bytes.

use std::io::Read;

use flate2::read::ZlibDecoder;

use super::Log;
use super::arrays::{Array, Arrays, columns};
use super::bytes::{Broken, Input, Kind, Slice};
use crate::room;

const HEADER: u64 = 128;
const MATRIX: u64 = 14;
const COMPRESSED: u64 = 15;
const STRUCT: u8 = 2;
/// Structures within structures.
const DEEPEST: usize = 8;
/// Nothing deflated is shorter by more.
const DEFLATE: u64 = 1040;

pub(super) fn open(mut input: Input) -> Result<Box<dyn Log>, Broken> {
    let mut bytes = Vec::new();
    input.take(HEADER, &mut bytes, "the header")?;
    let (version, mark) = ([bytes[124], bytes[125]], [bytes[126], bytes[127]]);
    let big_endian = match &mark {
        b"IM" => false,
        b"MI" => true,
        _ => {
            return Err(Broken::new(
                126,
                format_args!("the mark {mark:02x?}"),
                "`IM` or `MI`, the order of bytes",
            ));
        }
    };
    let version = u16::from_le_bytes(match big_endian {
        true => [version[1], version[0]],
        false => version,
    });
    if version != 0x0100 {
        return Err(Broken::new(
            124,
            format_args!("a MAT file of version {version:04x}, HDF5 if it is 0200"),
            "version 5: save it with -v7",
        ));
    }
    let mut arrays = Vec::new();
    while input.left() > 0 {
        let offset = input.offset();
        input.take(8, &mut bytes, "an element's type and size")?;
        let mut tag = Bytes::new(&bytes, offset, big_endian);
        let (kind, size) = (tag.whole(4, "a type")?, tag.whole(4, "a size")?);
        input.take(size, &mut bytes, "an element")?;
        match kind {
            MATRIX => matrix(
                Bytes::new(&bytes, offset + 8, big_endian),
                "",
                0,
                &mut arrays,
            )?,
            COMPRESSED => {
                let unpacked = unpack(&bytes, offset, big_endian)?;
                matrix(
                    Bytes::packed(&unpacked, offset, big_endian),
                    "",
                    0,
                    &mut arrays,
                )?;
            }
            _ => {}
        }
    }
    Ok(Box::new(Arrays::new(arrays)))
}

/// The content of the element in a compressed one; nothing if it is no array.
fn unpack(packed: &[u8], offset: u64, big_endian: bool) -> Result<Vec<u8>, Broken> {
    let broken = |error: std::io::Error| Broken::new(offset, error, "an element by zlib");
    let mut decoder = ZlibDecoder::new(packed);
    let mut tag = [0; 8];
    decoder.read_exact(&mut tag).map_err(broken)?;
    let mut tag = Bytes::new(&tag, offset, big_endian);
    let (kind, size) = (tag.whole(4, "a type")?, tag.whole(4, "a size")?);
    if kind != MATRIX {
        return Ok(Vec::new());
    }
    let is_possible = size <= (packed.len() as u64).saturating_mul(DEFLATE);
    if !is_possible || !room::is_there(size as usize * 2) {
        return Err(Broken::new(
            offset,
            format_args!("an array of {size} bytes in {} packed ones", packed.len()),
            "one that fits into memory",
        ));
    }
    let mut unpacked = Vec::new();
    decoder
        .take(size)
        .read_to_end(&mut unpacked)
        .map_err(broken)?;
    if unpacked.len() as u64 != size {
        let found = format!("{} bytes", unpacked.len());
        return Err(Broken::new(
            offset,
            found,
            format_args!("{size} bytes of an array"),
        ));
    }
    Ok(unpacked)
}

/// Elements in memory.
#[derive(Clone, Copy)]
struct Bytes<'a> {
    slice: Slice<'a>,
    big_endian: bool,
}

/// An element's type and content.
struct Element<'a> {
    kind: u64,
    bytes: &'a [u8],
    offset: u64,
}

impl<'a> Bytes<'a> {
    fn new(bytes: &'a [u8], offset: u64, big_endian: bool) -> Self {
        Self {
            slice: Slice::new(bytes, offset),
            big_endian,
        }
    }

    fn packed(bytes: &'a [u8], place: u64, big_endian: bool) -> Self {
        Self {
            slice: Slice::packed(bytes, place),
            big_endian,
        }
    }

    fn whole(&mut self, size: usize, what: &str) -> Result<u64, Broken> {
        let bytes = self.slice.take(size, what)?;
        let add = |whole: u64, byte: &u8| whole << 8 | u64::from(*byte);
        Ok(match self.big_endian {
            true => bytes.iter().fold(0, add),
            false => bytes.iter().rev().fold(0, add),
        })
    }

    fn element(&mut self, what: &str) -> Result<Element<'a>, Broken> {
        let first = self.whole(4, what)?;
        // A short one has its size in the upper half of its type, and four bytes.
        if first >> 16 != 0 {
            let offset = self.slice.offset();
            let (kind, size) = (first & 0xffff, (first >> 16) as usize);
            let all = self.slice.take(4, what)?;
            let bytes = all.get(..size).ok_or_else(|| {
                Broken::new(
                    offset,
                    format_args!("a short element of {size} bytes"),
                    "at most 4",
                )
            })?;
            return Ok(Element {
                kind,
                bytes,
                offset,
            });
        }
        let size = self.whole(4, what)? as usize;
        let offset = self.slice.offset();
        let bytes = self.slice.take(size, what)?;
        let padding = (8 - size % 8) % 8;
        self.slice.take(padding.min(self.slice.left()), what)?;
        Ok(Element {
            kind: first,
            bytes,
            offset,
        })
    }
}

impl Element<'_> {
    fn kind(&self) -> Option<Kind> {
        Some(match self.kind {
            1 => Kind::I8,
            2 => Kind::U8,
            3 => Kind::I16,
            4 => Kind::U16,
            5 => Kind::I32,
            6 => Kind::U32,
            7 => Kind::F32,
            9 => Kind::F64,
            12 => Kind::I64,
            13 => Kind::U64,
            _ => return None,
        })
    }

    fn number(&self, kind: Kind, index: usize, big_endian: bool) -> Option<f64> {
        let at = index.checked_mul(kind.size())?;
        kind.number(self.bytes.get(at..)?, big_endian)
    }

    fn text(&self) -> String {
        let end = self.bytes.iter().position(|&byte| byte == 0);
        String::from_utf8_lossy(&self.bytes[..end.unwrap_or(self.bytes.len())]).into_owned()
    }
}

/// Adds the columns of an array, those of the fields of a structure by their names.
fn matrix(
    mut bytes: Bytes,
    name: &str,
    depth: usize,
    arrays: &mut Vec<Array>,
) -> Result<(), Broken> {
    if bytes.slice.left() == 0 {
        return Ok(());
    }
    let big_endian = bytes.big_endian;
    let flags = bytes.element("an array's kind")?;
    let class = Kind::U32.number(flags.bytes, big_endian).unwrap_or(0.0) as u32 as u8;
    let dimensions = bytes.element("an array's size")?;
    let count = dimensions.bytes.len() / 4;
    let size = |k| {
        let size = dimensions.number(Kind::I32, k, big_endian).unwrap_or(0.0);
        size.max(0.0) as usize
    };
    let shape: Vec<usize> = (0..count).map(size).collect();
    let own = bytes.element("an array's name")?.text();
    let name = match (name.is_empty(), own.is_empty()) {
        (true, _) => own,
        (false, true) => name.to_owned(),
        (false, false) => format!("{name}.{own}"),
    };
    match class {
        STRUCT if shape.iter().all(|&size| size == 1) && depth < DEEPEST => {
            let length = bytes.element("the length of names")?;
            let length = length.number(Kind::I32, 0, big_endian).unwrap_or(0.0) as usize;
            let names = bytes.element("names of fields")?;
            let broken = || {
                Broken::new(
                    names.offset,
                    format_args!("names of {length} bytes"),
                    "some",
                )
            };
            let names = names
                .bytes
                .chunks(Some(length).filter(|&l| l > 0).ok_or_else(broken)?);
            for field in names {
                let end = field
                    .iter()
                    .position(|&byte| byte == 0)
                    .unwrap_or(field.len());
                let field = format!("{name}.{}", String::from_utf8_lossy(&field[..end]));
                let element = bytes.element("a field")?;
                if element.kind == MATRIX {
                    let content = Bytes {
                        slice: bytes.slice.of(element.bytes, element.offset),
                        big_endian,
                    };
                    matrix(content, &field, depth + 1, arrays)?;
                }
            }
        }
        // Numbers, from double to uint64.
        6..=15 => {
            let data = bytes.element("numbers")?;
            if let Some(kind) = data.kind() {
                let number = |index| data.number(kind, index, big_endian);
                arrays.extend(columns(&name, &shape, true, data.offset, number)?);
            }
        }
        _ => {}
    }
    Ok(())
}
