//! MATLAB MAT files of version 5 (`save -v6`, `-v7`).
//!
//! Source: MathWorks, "MAT-File Format", 2023: a header of 128 bytes, then elements of a type, a size and content,
//! padded to eight bytes.

use std::io::{self, Read};

use super::Log;
use super::arrays::{Array, Arrays, Field};
use super::bytes::{Broken, Input, Kind, Slice};
use super::part::{Packing, Part, Shared, pass};

const HEADER: u64 = 128;
const MATRIX: u64 = 14;
const COMPRESSED: u64 = 15;
const STRUCT: u8 = 2;
/// An object of a class of MATLAB, whose content only MATLAB reads.
const OBJECT: u8 = 17;
/// Maximum nesting depth of structures.
const DEEPEST: usize = 8;
/// Valid types of elements, from numbers to text in UTF-32.
const TYPES: std::ops::RangeInclusive<u64> = 1..=18;
/// Maximum compression ratio of deflate.
const DEFLATE: u64 = 1040;
/// Arrays of at most this many times their compressed size are kept in memory; longer ones are unpacked for each column.
const KEPT: u64 = 16;
/// Maximum length of names and dimensions, bytes.
const LONGEST: u64 = 1 << 20;

pub fn open(mut input: Input) -> Result<Box<dyn Log>, Broken> {
    let mut bytes = Vec::new();
    input.take(HEADER, &mut bytes, "the header")?;
    let big_endian = is_big_endian(&bytes)?;
    let mut elements = Vec::new();
    while input.left() > 0 {
        let offset = input.offset();
        input.take(8, &mut bytes, "the type and size of an element")?;
        let mut tag = Slice::new(&bytes, offset).in_order(big_endian);
        let (kind, size) = (tag.whole(4, "a type")?, tag.whole(4, "a size")?);
        if !TYPES.contains(&kind) {
            let found = format_args!("an element of type {kind}");
            return Err(Broken::new(offset, found, "a type of MAT files, 1 to 18"));
        }
        input.skip(size, "an element")?;
        elements.push((kind, size, offset));
    }
    let file = Shared::new(input);
    let (mut arrays, mut objects) = (Vec::new(), Vec::new());
    for (kind, length, offset) in elements {
        let packing = match kind {
            MATRIX => Packing::Stored,
            COMPRESSED => Packing::Zlib,
            _ => continue,
        };
        let part = Part {
            file: file.clone(),
            begin: offset + 8,
            length,
            packing,
        };
        let mut reader = Reader::new(part, offset, big_endian)?;
        if packing == Packing::Zlib {
            if !reader.is_array()? {
                continue;
            }
            if reader.end <= KEPT * length {
                reader = reader.kept()?;
            }
        }
        let end = reader.end;
        objects.extend(reader.matrix(end, "", 0, &mut arrays)?);
    }
    match objects.is_empty() || !arrays.is_empty() {
        true => Ok(Box::new(Arrays::new(arrays))),
        false => Err(of_objects(&objects)),
    }
}

/// Refuses a file of objects alone, given by name and class, with what to do in MATLAB.
fn of_objects(objects: &[[String; 2]]) -> Broken {
    let found = objects
        .iter()
        .map(|[name, class]| format!("`{name}` ({class})"));
    let found = format!(
        "objects of MATLAB: {}",
        found.collect::<Vec<_>>().join(", ")
    );
    let tables = objects.iter().filter(|[_, class]| class == "timetable");
    let tables: Vec<&str> = tables.map(|[name, _]| &**name).collect();
    let advice = match &tables[..] {
        [] => "In MATLAB, save arrays: save('imu.mat', 'time', 'gyro', 'accel', '-v7').".to_owned(),
        [table] => format!("In MATLAB: writetimetable({table}, 'imu.csv')."),
        _ => {
            let tables = tables.join(", ");
            format!("In MATLAB: writetimetable(synchronize({tables}), 'imu.csv').")
        }
    };
    Broken {
        advice,
        ..Broken::new(0, found, "arrays of numbers")
    }
}

/// Byte order of a file with this header.
fn is_big_endian(bytes: &[u8]) -> Result<bool, Broken> {
    let (big_endian, version) = match *bytes.get(124..).unwrap_or_default() {
        [low, high, b'I', b'M'] => (false, u16::from_le_bytes([low, high])),
        [high, low, b'M', b'I'] => (true, u16::from_be_bytes([high, low])),
        ref mark => {
            let found = format_args!("{mark:02x?} as version and byte-order mark");
            return Err(Broken::new(126, found, "`IM` or `MI`"));
        }
    };
    if version != 0x0100 {
        let found = format_args!("MAT version {version:04x} in a version-5 header");
        return Err(Broken::new(124, found, "version 0100 (save it with -v7)"));
    }
    Ok(big_endian)
}

/// A variable of the file, read in order; its numbers are read later.
struct Reader {
    part: Part,
    bytes: Box<dyn Read>,
    /// Number of bytes unpacked so far, and in total.
    at: u64,
    end: u64,
    /// Offset in the file.
    offset: u64,
    big_endian: bool,
}

/// Type and size of an element within a variable, and its size with padding.
struct Tag {
    kind: u64,
    size: u64,
    padded: u64,
}

impl Reader {
    fn new(part: Part, offset: u64, big_endian: bool) -> Result<Self, Broken> {
        let bytes = part.open(0);
        Ok(Self {
            bytes: bytes.map_err(|error| Broken::new(offset, error, "an element"))?,
            at: 0,
            end: part.length,
            part,
            offset,
            big_endian,
        })
    }

    /// Whether a compressed element is an array; its size is then known.
    fn is_array(&mut self) -> Result<bool, Broken> {
        self.end = 8;
        let (kind, size) = (self.whole("a type")?, self.whole("a size")?);
        let packed = self.part.length;
        if kind == MATRIX && size > packed.saturating_mul(DEFLATE) {
            return Err(Broken::new(
                self.offset,
                format_args!("an array of {size} bytes compressed to {packed} bytes"),
                "a size that zlib can reach",
            ));
        }
        self.end += size;
        Ok(kind == MATRIX)
    }

    /// A copy with the remaining bytes in memory.
    fn kept(mut self) -> Result<Self, Broken> {
        let (mut bytes, length) = (Vec::new(), self.end - self.at);
        let read = (&mut self.bytes).take(length).read_to_end(&mut bytes);
        read.map_err(|error| Broken::new(self.offset, error, "a zlib-compressed element"))?;
        if (bytes.len() as u64) < length {
            let found = format_args!("{} bytes", bytes.len());
            let expected = format_args!("{length} bytes for the array");
            return Err(Broken::new(self.offset, found, expected));
        }
        let part = Part {
            file: Shared::of(Box::new(io::Cursor::new(bytes))),
            begin: 0,
            length,
            packing: Packing::Stored,
        };
        Self::new(part, self.offset, self.big_endian)
    }

    fn take(&mut self, count: u64, what: &str) -> Result<Vec<u8>, Broken> {
        let mut bytes = Vec::new();
        let most = LONGEST.min(self.end - self.at);
        let read = (&mut self.bytes)
            .take(count.min(most))
            .read_to_end(&mut bytes);
        read.map_err(|error| Broken::new(self.offset, error, what))?;
        self.at += bytes.len() as u64;
        if (bytes.len() as u64) < count {
            let found = format_args!("only {} bytes in this part of the file", bytes.len());
            let expected = format_args!("{count} bytes for {what} (at most {LONGEST})");
            return Err(Broken::new(self.offset, found, expected));
        }
        Ok(bytes)
    }

    fn whole(&mut self, what: &str) -> Result<u64, Broken> {
        let bytes = self.take(4, what)?;
        Slice::new(&bytes, self.offset)
            .in_order(self.big_endian)
            .whole(4, what)
    }

    /// Skips to an offset in the variable; padding may be missing at its end.
    fn go_to(&mut self, place: u64) -> Result<(), Broken> {
        let broken = |error: &dyn std::fmt::Display| {
            Broken::new(self.offset, error, "an array within its element")
        };
        let count = place.min(self.end).checked_sub(self.at);
        let count = count.ok_or_else(|| broken(&"a longer array"))?;
        pass(&mut self.bytes, count).map_err(|error: io::Error| broken(&error))?;
        self.at += count;
        Ok(())
    }

    fn tag(&mut self, what: &str) -> Result<Tag, Broken> {
        let first = self.whole(what)?;
        // A short element has its size in the upper half of its type, and four bytes of content.
        if first >> 16 != 0 {
            let (kind, size) = (first & 0xffff, first >> 16);
            if size > 4 {
                let found = format_args!("a small data element of {size} bytes");
                return Err(Broken::new(self.offset, found, "at most 4 bytes"));
            }
            let padded = 4;
            return Ok(Tag { kind, size, padded });
        }
        let size = self.whole(what)?;
        Ok(Tag {
            kind: first,
            size,
            padded: size.next_multiple_of(8),
        })
    }

    /// A short element.
    fn element(&mut self, what: &str) -> Result<Vec<u8>, Broken> {
        let Tag { size, padded, .. } = self.tag(what)?;
        let end = self.at + padded;
        let bytes = self.take(size, what)?;
        self.go_to(end)?;
        Ok(bytes)
    }

    /// The number at this index (from zero) in an element; zero if there is none.
    fn count(&self, bytes: &[u8], index: usize) -> usize {
        let number = Kind::I32.number(bytes.get(4 * index..).unwrap_or_default(), self.big_endian);
        number.unwrap_or(0.0).max(0.0) as usize
    }

    /// Adds the columns of the array that ends at this offset; fields of a structure are named after it. Returns name
    /// and class if it is an object.
    fn matrix(
        &mut self,
        end: u64,
        name: &str,
        depth: usize,
        arrays: &mut Vec<Array>,
    ) -> Result<Option<[String; 2]>, Broken> {
        if self.at >= end {
            return Ok(None);
        }
        let flags = self.element("the type of an array")?;
        let class = Kind::U32.number(&flags, self.big_endian).unwrap_or(0.0) as u32 as u8;
        if class == OBJECT {
            let mut word = || Ok(text(&self.element("the class of an object")?));
            let [name, _, class] = [word()?, word()?, word()?];
            return Ok(Some([name, class]));
        }
        let dimensions = self.element("the size of an array")?;
        let shape = (0..dimensions.len() / 4).map(|k| self.count(&dimensions, k));
        let shape: Vec<usize> = shape.collect();
        let own = text(&self.element("the name of an array")?);
        let name = match (name.is_empty(), own.is_empty()) {
            (true, _) => own,
            (false, true) => name.to_owned(),
            (false, false) => format!("{name}.{own}"),
        };
        match class {
            STRUCT if shape.iter().all(|&size| size == 1) && depth < DEEPEST => {
                self.structure(&name, depth, arrays)?;
            }
            // Numbers, from double to uint64. The content of objects has no name.
            6..=15 if !name.is_empty() => arrays.extend(self.numbers(name, shape)?),
            _ => {}
        }
        Ok(None)
    }

    /// Adds the arrays that are fields of a structure.
    fn structure(
        &mut self,
        name: &str,
        depth: usize,
        arrays: &mut Vec<Array>,
    ) -> Result<(), Broken> {
        let length = self.element("the length of field names")?;
        let length = self.count(&length, 0);
        let names = self.element("field names")?;
        if length == 0 {
            let found = "field names of 0 bytes";
            return Err(Broken::new(self.offset, found, "at least 1 byte"));
        }
        for field in names.chunks(length) {
            let Tag { kind, padded, .. } = self.tag("a field")?;
            let end = self.at + padded;
            if kind == MATRIX {
                self.matrix(end, &format!("{name}.{}", text(field)), depth + 1, arrays)?;
            }
            self.go_to(end)?;
        }
        Ok(())
    }

    /// The array of numbers at this place; `None` if the array is not numeric.
    fn numbers(&mut self, name: String, shape: Vec<usize>) -> Result<Option<Array>, Broken> {
        let Tag { kind, size, .. } = self.tag("numbers")?;
        let Some(kind) = number_kind(kind) else {
            return Ok(None);
        };
        let (part, begin) = (self.part.clone(), self.at);
        let array = Array {
            shape,
            first_is_fastest: true,
            size: kind.size(),
            fields: vec![Field {
                name: name.clone(),
                kind,
                big_endian: self.big_endian,
                place: 0,
            }],
            open: Box::new(move |skip| part.open(begin + skip)),
            offset: self.offset,
        };
        array.within(size.min(self.end - begin), &name).map(Some)
    }
}

fn number_kind(kind: u64) -> Option<Kind> {
    Some(match kind {
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

/// The text before the first zero.
fn text(bytes: &[u8]) -> String {
    let text = bytes.split(|&byte| byte == 0).next().unwrap_or_default();
    String::from_utf8_lossy(text).into_owned()
}
