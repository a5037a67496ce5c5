//! Rows that arrive while a log is followed; they come from a growing file, a pipe or a device.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Context;

use super::continued::Continued;
use super::lines::Lines;

/// Interval between attempts to reopen a device that disappeared.
const AGAIN: Duration = Duration::from_secs(1);

/// The incoming rows, and the log that contains them.
pub struct Incoming {
    pub log: PathBuf,
    pub received: Received,
    kind: Kind,
}

enum Kind {
    /// Another program writes the log.
    Growing { grew: Instant, patience: Duration },
    /// Lines that are read are written to the log.
    Kept {
        file: File,
        /// Length of the file without its incomplete last line, until that line is removed.
        cut: Option<u64>,
        lines: Box<Lines>,
        /// Bytes received; `None` if the device is gone.
        chunks: Receiver<Option<Vec<u8>>>,
    },
}

impl Incoming {
    /// Rows of a growing file. The file counts as complete when it has not grown for this time.
    pub fn growing(log: &Path, patience: Duration) -> Self {
        let grew = Instant::now();
        Self {
            log: log.to_owned(),
            received: Received::default(),
            kind: Kind::Growing { grew, patience },
        }
    }

    /// Rows from standard input (`-`) or a device, which are appended to a file with rows of the same kind.
    pub fn kept(source: &Path, log: PathBuf) -> anyhow::Result<Self> {
        if source != Path::new("-") {
            let there = source.metadata();
            there.with_context(|| source.display().to_string())?;
        }
        let continued = Continued::of(&log).with_context(|| log.display().to_string())?;
        let file = OpenOptions::new().create(true).append(true).open(&log);
        let file = file.with_context(|| log.display().to_string())?;
        let bytes = continued.as_ref().map_or(0, |of| of.length);
        let length = file.metadata().map_or(0, |of| of.len());
        let cut = (length > bytes).then_some(bytes);
        Ok(Self {
            log,
            received: Received { bytes, lines: 0 },
            kind: Kind::Kept {
                file,
                cut,
                lines: Box::new(Lines::new(is_serial(source), continued)),
                chunks: read_in_background(source.to_owned())?,
            },
        })
    }

    /// Waits for bytes; returns false at the end of the source.
    pub fn wait(&mut self, most: Duration) -> anyhow::Result<bool> {
        match &mut self.kind {
            Kind::Growing { grew, patience } => {
                thread::sleep(most);
                // A file that is temporarily missing counts as not growing.
                let mut file = File::open(&self.log);
                let read = file.as_mut().map(|file| {
                    file.seek(SeekFrom::Start(self.received.bytes))?;
                    io::copy(file, &mut self.received)
                });
                if matches!(read, Ok(Ok(1..))) {
                    *grew = Instant::now();
                }
                Ok(grew.elapsed() < *patience)
            }
            Kind::Kept { lines, chunks, .. } => {
                let begun = Instant::now();
                let mut complete = Vec::new();
                let more = loop {
                    let Some(left) = most.checked_sub(begun.elapsed()) else {
                        break true;
                    };
                    match chunks.recv_timeout(left) {
                        Ok(Some(bytes)) => complete.extend(lines.push(&bytes)?),
                        Ok(None) => lines.interrupt(),
                        Err(RecvTimeoutError::Timeout) => break true,
                        Err(RecvTimeoutError::Disconnected) => break false,
                    }
                };
                self.keep(&complete)?;
                Ok(more)
            }
        }
    }

    /// Keeps the last line, whether or not it is complete.
    pub fn end(&mut self) -> anyhow::Result<()> {
        match &mut self.kind {
            Kind::Growing { .. } => Ok(()),
            Kind::Kept { lines, .. } => {
                let rest = lines.end()?;
                self.keep(&rest)
            }
        }
    }

    fn keep(&mut self, bytes: &[u8]) -> anyhow::Result<()> {
        if let Kind::Kept { file, cut, .. } = &mut self.kind
            && !bytes.is_empty()
        {
            if let Some(length) = cut.take() {
                let log = self.log.display();
                file.set_len(length).with_context(|| log.to_string())?;
                tell!("{log}: removed the last line because it is incomplete");
            }
            let written = file.write_all(bytes);
            written.with_context(|| self.log.display().to_string())?;
            self.received.write_all(bytes)?;
        }
        Ok(())
    }

    /// Number of lines that were not kept, with the reasons for the first of them; `None` if all lines were kept.
    pub fn left_out(&self) -> Option<String> {
        match &self.kind {
            Kind::Growing { .. } => None,
            Kind::Kept { lines, .. } => lines.left_out.text(),
        }
    }
}

/// Rows received so far.
#[derive(Default)]
pub struct Received {
    pub bytes: u64,
    pub lines: usize,
}

impl Write for Received {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.bytes += bytes.len() as u64;
        self.lines += bytes.iter().filter(|byte| **byte == b'\n').count();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Whether this is a serial device (such a device does not wait for a reader).
#[cfg(unix)]
fn is_serial(source: &Path) -> bool {
    use std::os::unix::fs::FileTypeExt;
    source
        .metadata()
        .is_ok_and(|of| of.file_type().is_char_device())
}

/// Anything except standard input, if the system does not provide this information.
#[cfg(not(unix))]
fn is_serial(source: &Path) -> bool {
    source != Path::new("-")
}

/// Reads standard input or a device; a device that disappeared is reopened when it returns.
fn read_in_background(source: PathBuf) -> anyhow::Result<Receiver<Option<Vec<u8>>>> {
    let (chunks, received) = mpsc::channel();
    let is_stdin = source == Path::new("-");
    let read = move || {
        let mut buffer = [0; 4096];
        loop {
            let opened: io::Result<Box<dyn Read>> = if is_stdin {
                Ok(Box::new(io::stdin()))
            } else {
                File::open(&source).map(|file| Box::new(file) as Box<dyn Read>)
            };
            if let Ok(mut input) = opened {
                while let Ok(count @ 1..) = input.read(&mut buffer) {
                    if chunks.send(Some(buffer[..count].to_vec())).is_err() {
                        return;
                    }
                }
                if is_stdin || chunks.send(None).is_err() {
                    return;
                }
                tell!(
                    "{} has disappeared; waiting for its return (press Ctrl-C to stop)",
                    source.display()
                );
            }
            thread::sleep(AGAIN);
        }
    };
    thread::Builder::new().name("rows".into()).spawn(read)?;
    Ok(received)
}
