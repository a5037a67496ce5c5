//! Parts of a file, stored or compressed. Each part can be read from its start as often as needed.

use std::cell::RefCell;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::rc::Rc;

use flate2::read::{DeflateDecoder, ZlibDecoder};

use super::bytes::Input;
use crate::data_file::Content;

/// Bytes read at once per reader.
const AT_ONCE: usize = 1 << 14;

/// A file shared by several readers at different offsets.
#[derive(Clone)]
pub struct Shared(Rc<RefCell<Box<dyn Content>>>);

impl Shared {
    pub fn new(input: Input) -> Self {
        Self::of(input.into_source())
    }

    pub fn of(source: Box<dyn Content>) -> Self {
        Self(Rc::new(RefCell::new(source)))
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Packing {
    Stored,
    Deflate,
    Zlib,
}

/// Consecutive bytes of a file.
#[derive(Clone)]
pub struct Part {
    pub file: Shared,
    pub begin: u64,
    /// Bytes of the file, stored without compression.
    pub length: u64,
    pub packing: Packing,
}

impl Part {
    /// The unpacked bytes from this offset on.
    pub fn open(&self, skip: u64) -> io::Result<Box<dyn Read>> {
        let stored = |skip: u64| {
            let (file, place) = (self.file.clone(), self.begin.saturating_add(skip));
            let bytes = BufReader::with_capacity(AT_ONCE, At { file, place });
            bytes.take(self.length.saturating_sub(skip))
        };
        let mut bytes: Box<dyn Read> = match self.packing {
            Packing::Stored => return Ok(Box::new(stored(skip))),
            Packing::Deflate => Box::new(DeflateDecoder::new(stored(0))),
            Packing::Zlib => Box::new(ZlibDecoder::new(stored(0))),
        };
        pass(&mut bytes, skip)?;
        Ok(bytes)
    }
}

/// Skips this number of bytes, or fewer at the end.
pub fn pass(bytes: &mut dyn Read, count: u64) -> io::Result<u64> {
    io::copy(&mut bytes.take(count), &mut io::sink())
}

/// A reader of a shared file at its own offset.
struct At {
    file: Shared,
    place: u64,
}

impl Read for At {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let mut file = self.file.0.borrow_mut();
        file.seek(SeekFrom::Start(self.place))?;
        let count = file.read(into)?;
        self.place += count as u64;
        Ok(count)
    }
}
