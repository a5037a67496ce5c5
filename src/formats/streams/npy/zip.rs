//! The members of a ZIP archive, by its directory.

use std::io::Read;

use flate2::read::DeflateDecoder;

use super::super::bytes::{Broken, Input, Slice};
use crate::room;

const END: &[u8] = b"PK\x05\x06";
const END_64: &[u8] = b"PK\x06\x06";
const ENTRY: u64 = 0x0201_4b50;
/// The directory's end and the longest remark behind it.
const TAIL: u64 = 22 + 65_535;
/// What a directory of the arrays of one record is shorter than.
const DIRECTORY: u64 = 1 << 24;
/// Nothing deflated is shorter by more.
const DEFLATE: u64 = 1040;

pub(super) struct Member {
    pub name: String,
    /// Where it begins.
    pub offset: u64,
    deflated: bool,
    packed: u64,
    size: u64,
}

pub(super) fn members(input: &mut Input) -> Result<Vec<Member>, Broken> {
    let length = input.left();
    let tail = length.min(TAIL);
    input.go_to(length - tail)?;
    let mut bytes = Vec::new();
    input.take(tail, &mut bytes, "the end of the archive")?;
    let find = |mark: &[u8]| bytes.windows(4).rposition(|bytes| bytes == mark);
    let Some(end) = find(END) else {
        return Err(Broken::new(
            length,
            "no directory of the archive",
            "it at the end of the file",
        ));
    };
    let mut at = Slice::new(&bytes[end..], length - tail + end as u64);
    at.take(10, "the directory's end")?;
    let mut count = at.whole(2, "a count of members")?;
    let mut size = at.whole(4, "the directory's size")?;
    let mut begin = at.whole(4, "the directory's place")?;
    if let Some(end) = find(END_64)
        && (begin == u64::from(u32::MAX) || size == u64::from(u32::MAX) || count == 0xffff)
    {
        let mut at = Slice::new(&bytes[end..], length - tail + end as u64);
        at.take(32, "the directory's end")?;
        count = at.whole(8, "a count of members")?;
        size = at.whole(8, "the directory's size")?;
        begin = at.whole(8, "the directory's place")?;
    }
    if begin > length || size > (length - begin).min(DIRECTORY) {
        return Err(Broken::new(
            length - tail + end as u64,
            format_args!("a directory of {size} bytes at byte {begin}"),
            "one within the file",
        ));
    }
    input.go_to(begin)?;
    input.take(size, &mut bytes, "the directory of the archive")?;
    let mut directory = Slice::new(&bytes, begin);
    let mut members = Vec::new();
    for _ in 0..count {
        if directory.left() == 0 {
            break;
        }
        members.push(entry(&mut directory)?);
    }
    Ok(members)
}

fn entry(directory: &mut Slice) -> Result<Member, Broken> {
    let place = directory.offset();
    let wrong = |found: String, expected: &str| Broken::new(place, found, expected);
    let mark = directory.whole(4, "an entry")?;
    if mark != ENTRY {
        return Err(wrong(
            format!("an entry that begins with {mark:08x}"),
            "one of a directory",
        ));
    }
    directory.take(4, "versions")?;
    let flags = directory.whole(2, "flags")?;
    let method = directory.whole(2, "a method")?;
    directory.take(8, "time and sum")?;
    let mut packed = directory.whole(4, "a size")?;
    let mut size = directory.whole(4, "a size")?;
    let name = directory.length(2, "a length")?;
    let extra = directory.length(2, "a length")?;
    let remark = directory.length(2, "a length")?;
    directory.take(8, "attributes")?;
    let mut offset = directory.whole(4, "a place")?;
    let name = directory.text(name, "a name")?;
    let mut further = Slice::new(directory.take(extra, "further fields")?, place);
    directory.take(remark, "a remark")?;
    while further.left() >= 4 {
        let kind = further.whole(2, "a field")?;
        let length = further.length(2, "a field's length")?;
        let mut field = Slice::new(further.take(length, "a field")?, place);
        if kind == 1 {
            for value in [&mut size, &mut packed, &mut offset] {
                if *value == u64::from(u32::MAX) {
                    *value = field.whole(8, "a long size")?;
                }
            }
        }
    }
    if flags & 1 != 0 {
        return Err(wrong(
            format!("`{name}` in secret"),
            "a member without a password",
        ));
    }
    let deflated = match method {
        0 => false,
        8 => true,
        other => {
            return Err(wrong(
                format!("`{name}` packed by method {other}"),
                "0 or 8 (deflate)",
            ));
        }
    };
    Ok(Member {
        name,
        offset,
        deflated,
        packed,
        size,
    })
}

impl Member {
    pub fn read(&self, input: &mut Input) -> Result<Vec<u8>, Broken> {
        let mut bytes = Vec::new();
        input.go_to(self.offset)?;
        input.take(30, &mut bytes, "a member's head")?;
        let mut head = Slice::new(&bytes[26..], self.offset + 26);
        let further = head.whole(2, "a length")? + head.whole(2, "a length")?;
        input.skip(further, "a member's name")?;
        let most = match self.deflated {
            true => self.packed.saturating_mul(DEFLATE),
            false => self.packed,
        };
        let size = usize::try_from(self.size).unwrap_or(usize::MAX);
        if self.size > most || !room::is_there(size.saturating_mul(2)) {
            return Err(Broken::new(
                self.offset,
                format_args!(
                    "`{}` of {} bytes from {}",
                    self.name, self.size, self.packed
                ),
                "an array that fits into memory",
            ));
        }
        input.take(self.packed, &mut bytes, "a member")?;
        if !self.deflated {
            return Ok(bytes);
        }
        let mut unpacked = Vec::new();
        let read = DeflateDecoder::new(&bytes[..])
            .take(self.size)
            .read_to_end(&mut unpacked);
        read.map_err(|error| {
            Broken::new(
                self.offset,
                format_args!("`{}`: {error}", self.name),
                "data by deflate",
            )
        })?;
        Ok(unpacked)
    }
}
