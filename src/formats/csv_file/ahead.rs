//! A compressed file, decompressed beside those who read what has come out of it.

use std::io::{self, BufRead, Read};
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread;

/// Bytes handed over at once.
const BLOCK: usize = 1 << 16;
/// Blocks that wait to be read at most.
const WAITING: usize = 2;

/// What a source holds, read on a thread of its own a few blocks ahead; dropped, it ends the thread.
pub struct Ahead {
    blocks: Receiver<io::Result<Vec<u8>>>,
    block: Vec<u8>,
    /// Bytes of it that are read.
    read: usize,
}

impl Ahead {
    pub fn of(mut source: impl Read + Send + 'static) -> io::Result<Self> {
        let (sender, blocks) = sync_channel(WAITING);
        thread::Builder::new().spawn(move || {
            loop {
                let mut block = Vec::with_capacity(BLOCK);
                let end = source.by_ref().take(BLOCK as u64).read_to_end(&mut block);
                let ends = block.is_empty() || end.is_err();
                // What came before an error is as good as without it.
                let whole = block.is_empty() || sender.send(Ok(block)).is_ok();
                let told = end.map_or_else(|error| sender.send(Err(error)).is_ok(), |_| true);
                if ends || !whole || !told {
                    return;
                }
            }
        })?;
        Ok(Self {
            blocks,
            block: Vec::new(),
            read: 0,
        })
    }
}

impl BufRead for Ahead {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.read == self.block.len() {
            // Nobody sends any more behind the end.
            self.block = self.blocks.recv().unwrap_or_else(|_| Ok(Vec::new()))?;
            self.read = 0;
        }
        Ok(&self.block[self.read..])
    }

    fn consume(&mut self, bytes: usize) {
        self.read += bytes;
    }
}

impl Read for Ahead {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let mut there = self.fill_buf()?;
        let count = there.read(into)?;
        self.consume(count);
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// So many bytes, then an error.
    struct Breaks(usize);

    impl Read for Breaks {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            let count = into.len().min(self.0);
            if count == 0 {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            into[..count].fill(7);
            self.0 -= count;
            Ok(count)
        }
    }

    #[test]
    fn everything_comes_in_order() {
        let bytes: Vec<u8> = (0..300_000u32).map(|k| (k / 7) as u8).collect();
        let mut read = Vec::new();
        let mut ahead = Ahead::of(io::Cursor::new(bytes.clone())).unwrap();
        ahead.read_to_end(&mut read).unwrap();
        assert!(read == bytes);
    }

    #[test]
    fn what_comes_before_an_error_is_read() {
        for bytes in [0, 1000, BLOCK, BLOCK + 1000] {
            let mut read = Vec::new();
            let error = Ahead::of(Breaks(bytes)).unwrap().read_to_end(&mut read);
            assert_eq!(error.unwrap_err().kind(), io::ErrorKind::UnexpectedEof);
            assert_eq!(read, vec![7; bytes]);
        }
    }
}
