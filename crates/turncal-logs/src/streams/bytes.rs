//! Bytes of a file with their offsets.

use std::io::{self, Read, Seek, SeekFrom};

use crate::data_file::Content;

/// The reason for which the reading of a file stopped, and the position.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Broken {
    /// Offset from the start of the file, in bytes.
    pub offset: u64,
    pub found: String,
    pub expected: String,
    pub advice: String,
}

impl Broken {
    pub fn new(offset: u64, found: impl ToString, expected: impl ToString) -> Self {
        Self {
            offset,
            found: found.to_string(),
            expected: expected.to_string(),
            advice: "Record or copy the file again.".to_owned(),
        }
    }
}

/// Maximum number of bytes unpacked at once from a log of this length (a chunk, a row of an array). Real chunks are a
/// few megabytes long; larger stated sizes indicate damage or a decompression bomb.
pub fn most_at_once(length: u64) -> u64 {
    length.max(1 << 27)
}

/// A file read from its start.
pub struct Input {
    source: Box<dyn Content>,
    offset: u64,
    length: u64,
}

impl Input {
    pub fn new(mut source: Box<dyn Content>) -> io::Result<Self> {
        let length = source.seek(SeekFrom::End(0))?;
        source.seek(SeekFrom::Start(0))?;
        Ok(Self {
            source,
            offset: 0,
            length,
        })
    }

    /// The underlying file.
    pub fn into_source(self) -> Box<dyn Content> {
        self.source
    }

    /// Length of the file.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Bytes read or skipped so far.
    pub fn offset(&self) -> u64 {
        self.offset
    }

    /// Bytes not yet read.
    pub fn left(&self) -> u64 {
        self.length.saturating_sub(self.offset)
    }

    /// Reads `count` bytes, all of which must exist; errors call them `what`.
    pub fn take(&mut self, count: u64, into: &mut Vec<u8>, what: &str) -> Result<(), Broken> {
        into.clear();
        if count > self.left() {
            let found = match self.left() {
                0 => "the end of the file".to_owned(),
                left => format!("only {left} bytes left before the end of the file"),
            };
            return Err(Broken::new(
                self.offset,
                found,
                format_args!("{count} bytes for {what}"),
            ));
        }
        let read = (&mut self.source).take(count).read_to_end(into);
        match read {
            Ok(read) if read as u64 == count => {
                self.offset += count;
                Ok(())
            }
            Ok(_) => Err(Broken::new(
                self.offset,
                "a file that became shorter while being read",
                what,
            )),
            Err(error) => Err(Broken::new(self.offset, error, what)),
        }
    }

    /// Moves to another offset.
    pub fn go_to(&mut self, offset: u64) -> Result<(), Broken> {
        if offset > self.length {
            let found = format!("a reference to byte {offset}");
            let expected = format!("an offset within the file ({} bytes)", self.length);
            return Err(Broken::new(self.offset, found, expected));
        }
        let sought = self.source.seek(SeekFrom::Start(offset));
        sought.map_err(|error| Broken::new(offset, error, "a readable position in the file"))?;
        self.offset = offset;
        Ok(())
    }

    /// Skips `count` bytes.
    pub fn skip(&mut self, count: u64, what: &str) -> Result<(), Broken> {
        if count > self.left() {
            let found = format!("only {} bytes before the end of the file", self.left());
            let expected = format!("{count} bytes for {what}");
            return Err(Broken::new(self.offset, found, expected));
        }
        self.go_to(self.offset + count)
    }
}

/// Bytes in memory, read in order.
#[derive(Clone, Copy)]
pub struct Slice<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Offset in the file of the first byte, or of the packed data that contained the bytes.
    base: u64,
    /// Whether the bytes were packed.
    is_packed: bool,
    pub big_endian: bool,
}

impl<'a> Slice<'a> {
    pub fn new(bytes: &'a [u8], base: u64) -> Self {
        Self {
            bytes,
            at: 0,
            base,
            is_packed: false,
            big_endian: false,
        }
    }

    /// Bytes unpacked from data at this offset of the file.
    pub fn packed(bytes: &'a [u8], place: u64) -> Self {
        Self {
            is_packed: true,
            ..Self::new(bytes, place)
        }
    }

    /// A copy with this byte order.
    pub fn in_order(self, big_endian: bool) -> Self {
        Self { big_endian, ..self }
    }

    /// Offset of the next byte in the file.
    pub fn offset(&self) -> u64 {
        if self.is_packed {
            self.base
        } else {
            self.base + self.at as u64
        }
    }

    /// Bytes read so far.
    pub fn position(&self) -> usize {
        self.at
    }

    pub fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    pub fn take(&mut self, count: usize, what: &str) -> Result<&'a [u8], Broken> {
        let end = self.at.checked_add(count);
        let bytes = end.and_then(|end| self.bytes.get(self.at..end));
        let bytes = bytes.ok_or_else(|| {
            Broken::new(
                self.offset(),
                format_args!("only {} bytes left in this part of the file", self.left()),
                format_args!("{count} bytes for {what}"),
            )
        })?;
        self.at += count;
        Ok(bytes)
    }

    /// A whole number of at most eight bytes.
    pub fn whole(&mut self, size: usize, what: &str) -> Result<u64, Broken> {
        let bytes = self.take(size, what)?;
        let add = |whole: u64, &byte: &u8| whole << 8 | u64::from(byte);
        Ok(if self.big_endian {
            bytes.iter().fold(0, add)
        } else {
            bytes.iter().rev().fold(0, add)
        })
    }

    /// A length field.
    pub fn length(&mut self, size: usize, what: &str) -> Result<usize, Broken> {
        let length = self.whole(size, what)?;
        usize::try_from(length).map_err(|_| Broken::new(self.offset(), length, what))
    }

    /// Content preceded by a length field of this many bytes.
    pub fn measured(&mut self, size: usize, what: &str) -> Result<&'a [u8], Broken> {
        let length = self.length(size, "a length")?;
        self.take(length, what)
    }

    /// Text preceded by a length field of this many bytes.
    pub fn measured_text(&mut self, size: usize, what: &str) -> Result<String, Broken> {
        let length = self.length(size, "a length")?;
        self.text(length, what)
    }

    /// A text of this length; invalid UTF-8 is replaced.
    pub fn text(&mut self, count: usize, what: &str) -> Result<String, Broken> {
        let bytes = self.take(count, what)?;
        let end = bytes.iter().position(|&byte| byte == 0);
        Ok(String::from_utf8_lossy(&bytes[..end.unwrap_or(count)]).into_owned())
    }
}

/// How a number is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Kind {
    /// Whole numbers of this many bytes.
    pub fn whole_number(is_signed: bool, size: usize) -> Option<Self> {
        Some(match (is_signed, size) {
            (true, 1) => Self::I8,
            (true, 2) => Self::I16,
            (true, 4) => Self::I32,
            (true, 8) => Self::I64,
            (false, 1) => Self::U8,
            (false, 2) => Self::U16,
            (false, 4) => Self::U32,
            (false, 8) => Self::U64,
            _ => return None,
        })
    }

    /// Kind from its name in C or ROS, such as `uint16_t` and `float32`.
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "bool" => return Some(Self::U8),
            "float" | "float32" => return Some(Self::F32),
            "double" | "float64" => return Some(Self::F64),
            _ => {}
        }
        let name = name.strip_suffix("_t").unwrap_or(name);
        let (is_signed, bits) = match name.strip_prefix("uint") {
            Some(bits) => (false, bits),
            None => (true, name.strip_prefix("int")?),
        };
        Self::whole_number(is_signed, bits.parse::<usize>().ok()? / 8)
    }

    /// Bytes.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The number in the first bytes; `None` if there are too few.
    pub fn number(self, bytes: &[u8], big_endian: bool) -> Option<f64> {
        let bits = self.bits(bytes, big_endian)?;
        Some(match self {
            Self::F32 => f64::from(f32::from_bits(bits as u32)),
            Self::F64 => f64::from_bits(bits),
            _ => self.whole(bytes, big_endian)? as f64,
        })
    }

    /// The whole number in the first bytes, exact; `None` for other kinds.
    pub fn whole(self, bytes: &[u8], big_endian: bool) -> Option<i128> {
        let bits = self.bits(bytes, big_endian)?;
        Some(match self {
            Self::I8 => i128::from(bits as i8),
            Self::I16 => i128::from(bits as i16),
            Self::I32 => i128::from(bits as i32),
            Self::I64 => i128::from(bits as i64),
            Self::U8 | Self::U16 | Self::U32 | Self::U64 => i128::from(bits),
            Self::F32 | Self::F64 => return None,
        })
    }

    fn bits(self, bytes: &[u8], big_endian: bool) -> Option<u64> {
        let mut all = [0; 8];
        let place = all.get_mut(..self.size())?;
        place.copy_from_slice(bytes.get(..self.size())?);
        if big_endian {
            place.reverse();
        }
        Some(u64::from_le_bytes(all))
    }
}
