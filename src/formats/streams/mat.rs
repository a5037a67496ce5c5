//! MATLAB MAT files of version 5 (`save -v6`, `-v7`).
//!
//! Source: MathWorks, "MAT-File Format", 2023: a header of 128 bytes, then elements of a type, a size and content,
//! padded to eight bytes.

use std::io::{Cursor, Read};
use std::rc::Rc;

use flate2::read::ZlibDecoder;

use super::Log;
use super::arrays::{Array, Arrays, Field};
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

pub fn open(mut input: Input) -> Result<Box<dyn Log>, Broken> {
    let mut bytes = Vec::new();
    input.take(HEADER, &mut bytes, "the header")?;
    let (version, mark) = ([bytes[124], bytes[125]], [bytes[126], bytes[127]]);
    let big_endian = match &mark {
        b"IM" => false,
        b"MI" => true,
        _ => {
            return Err(Broken::new(
                126,
                format_args!("the byte-order mark {mark:02x?}"),
                "`IM` or `MI`",
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
            format_args!("MAT version {version:04x} in a version-5 header"),
            "version 0100 (save it with -v7)",
        ));
    }
    let mut arrays = Vec::new();
    while input.left() > 0 {
        let offset = input.offset();
        input.take(8, &mut bytes, "the type and size of an element")?;
        let mut tag = Slice::new(&bytes, offset).in_order(big_endian);
        let (kind, size) = (tag.whole(4, "a type")?, tag.whole(4, "a size")?);
        input.take(size, &mut bytes, "an element")?;
        let unpacked;
        let content = match kind {
            MATRIX => Slice::new(&bytes, offset + 8),
            COMPRESSED => {
                unpacked = unpack(&bytes, offset, big_endian)?;
                Slice::packed(&unpacked, offset)
            }
            _ => continue,
        };
        matrix(content.in_order(big_endian), "", 0, &mut arrays)?;
    }
    Ok(Box::new(Arrays::new(arrays)))
}

/// The content of a compressed element; empty if it is not an array.
fn unpack(packed: &[u8], offset: u64, big_endian: bool) -> Result<Vec<u8>, Broken> {
    let broken = |error: std::io::Error| Broken::new(offset, error, "a zlib-compressed element");
    let mut decoder = ZlibDecoder::new(packed);
    let mut tag = [0; 8];
    decoder.read_exact(&mut tag).map_err(broken)?;
    let mut tag = Slice::new(&tag, offset).in_order(big_endian);
    let (kind, size) = (tag.whole(4, "a type")?, tag.whole(4, "a size")?);
    if kind != MATRIX {
        return Ok(Vec::new());
    }
    let is_possible = size <= (packed.len() as u64).saturating_mul(DEFLATE);
    if !is_possible || !room::is_there(size as usize * 2) {
        return Err(Broken::new(
            offset,
            format_args!(
                "an array of {size} bytes compressed to {} bytes",
                packed.len()
            ),
            "an array that fits into memory",
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
            format_args!("{size} bytes for the array"),
        ));
    }
    Ok(unpacked)
}

/// An element's type and content.
struct Element<'a> {
    kind: u64,
    bytes: &'a [u8],
    offset: u64,
    big_endian: bool,
}

impl<'a> Element<'a> {
    fn next(slice: &mut Slice<'a>, what: &str) -> Result<Self, Broken> {
        let first = slice.whole(4, what)?;
        // A short one has its size in the upper half of its type, and four bytes.
        let is_short = first >> 16 != 0;
        let (kind, size) = match is_short {
            true => (first & 0xffff, (first >> 16) as usize),
            false => (first, slice.whole(4, what)? as usize),
        };
        let offset = slice.offset();
        let whole = match is_short {
            true => 4,
            false => size
                .checked_next_multiple_of(8)
                .unwrap_or(size)
                .clamp(size, slice.left().max(size)),
        };
        let bytes = slice.take(whole, what)?.get(..size).ok_or_else(|| {
            let found = format_args!("a small data element of {size} bytes");
            Broken::new(offset, found, "at most 4 bytes")
        })?;
        Ok(Self {
            kind,
            bytes,
            offset,
            big_endian: slice.big_endian,
        })
    }

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

    fn number(&self, kind: Kind, index: usize) -> Option<f64> {
        let at = index.checked_mul(kind.size())?;
        kind.number(self.bytes.get(at..)?, self.big_endian)
    }

    /// An array of its numbers; `None` if it has none.
    fn array(&self, name: String, shape: Vec<usize>) -> Result<Option<Array>, Broken> {
        let Some(kind) = self.kind() else {
            return Ok(None);
        };
        let bytes: Rc<[u8]> = self.bytes.into();
        let left = bytes.len();
        let open = move |skip: u64| {
            let mut bytes = Cursor::new(bytes.clone());
            bytes.set_position(skip);
            Ok(Box::new(bytes) as Box<dyn Read>)
        };
        let field = Field {
            name,
            kind,
            big_endian: self.big_endian,
            place: 0,
        };
        let array = Array {
            shape,
            first_is_fastest: true,
            size: kind.size(),
            fields: vec![field],
            open: Box::new(open),
            offset: self.offset,
        };
        let name = array.fields[0].name.clone();
        array.within(left as u64, &name).map(Some)
    }

    /// A number from zero on; zero if there is none.
    fn count(&self, index: usize) -> usize {
        self.number(Kind::I32, index).unwrap_or(0.0).max(0.0) as usize
    }
}

/// The text before the first zero.
fn text(bytes: &[u8]) -> String {
    let text = bytes.split(|&byte| byte == 0).next().unwrap_or_default();
    String::from_utf8_lossy(text).into_owned()
}

/// Adds the columns of an array; fields of a structure are named after it.
fn matrix(
    mut slice: Slice,
    name: &str,
    depth: usize,
    arrays: &mut Vec<Array>,
) -> Result<(), Broken> {
    if slice.left() == 0 {
        return Ok(());
    }
    let flags = Element::next(&mut slice, "the type of an array")?;
    let class = flags.number(Kind::U32, 0).unwrap_or(0.0) as u32 as u8;
    let dimensions = Element::next(&mut slice, "the size of an array")?;
    let shape: Vec<usize> = (0..dimensions.bytes.len() / 4)
        .map(|k| dimensions.count(k))
        .collect();
    let own = text(Element::next(&mut slice, "the name of an array")?.bytes);
    let name = match (name.is_empty(), own.is_empty()) {
        (true, _) => own,
        (false, true) => name.to_owned(),
        (false, false) => format!("{name}.{own}"),
    };
    match class {
        STRUCT if shape.iter().all(|&size| size == 1) && depth < DEEPEST => {
            structure(&mut slice, &name, depth, arrays)
        }
        // Numbers, from double to uint64.
        6..=15 => {
            let data = Element::next(&mut slice, "numbers")?;
            arrays.extend(data.array(name, shape)?);
            Ok(())
        }
        _ => Ok(()),
    }
}

/// Adds the arrays that are fields of a structure.
fn structure(
    slice: &mut Slice,
    name: &str,
    depth: usize,
    arrays: &mut Vec<Array>,
) -> Result<(), Broken> {
    let length = Element::next(slice, "the length of field names")?.count(0);
    let names = Element::next(slice, "field names")?;
    if length == 0 {
        return Err(Broken::new(
            names.offset,
            "field names of 0 bytes",
            "at least 1 byte",
        ));
    }
    for field in names.bytes.chunks(length) {
        let element = Element::next(slice, "a field")?;
        if element.kind == MATRIX {
            let content = slice.of(element.bytes, element.offset);
            matrix(
                content,
                &format!("{name}.{}", text(field)),
                depth + 1,
                arrays,
            )?;
        }
    }
    Ok(())
}
