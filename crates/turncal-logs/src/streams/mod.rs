//! Logs of other programs: a file provides streams of samples.
//!
//! A format is identified by the first bytes of the file, never by its name.

mod arrays;
mod bytes;
mod corrections;
mod dataflash;
mod hdf5;
mod log;
mod mat;
mod mcap;
mod messages;
mod npy;
mod part;
mod rosbag;
mod rosbag2;
mod rows;
mod sqlite;
mod ulog;

use std::io::{BufReader, Read};
use std::path::Path;

use super::data_file::DataFile;
use bytes::{Broken, Input};
pub use log::{Column, Log, Stream};
pub use rows::{Found, StreamRows, survey};
use turncal_input::{FileError, Place};

/// A log format, with the first bytes of its files.
struct Format {
    begins: &'static [&'static [u8]],
    open: Open,
}

type Open = fn(Input) -> Result<Box<dyn Log>, Broken>;

const fn format(begins: &'static [&'static [u8]], open: Open) -> Format {
    Format { begins, open }
}

static FORMATS: [Format; 9] = [
    format(&[b"ULog\x01\x12\x35"], ulog::open),
    format(&[b"\xa3\x95\x80"], dataflash::open),
    format(&[b"MATLAB 5.0 MAT-file"], mat::open),
    // MAT files of version 7.3 are HDF5.
    format(&[b"\x89HDF\r\n\x1a\n", b"MATLAB 7.3 MAT-file"], hdf5::open),
    format(&[b"\x89MCAP0\r\n"], mcap::open),
    format(&[b"#ROSBAG V2.0\n"], rosbag::open),
    format(&[b"SQLite format 3\0"], rosbag2::open),
    format(&[b"\x93NUMPY"], npy::open_array),
    format(&[b"PK\x03\x04"], npy::open_archive),
];

/// Unsupported files: first bytes, name and remedy.
const CLOSED: [(&[u8], &str, &str); 2] = [
    (
        b"PAR1",
        "a Parquet file",
        "Save the file as CSV, in Python with pandas.read_parquet(file).to_csv('imu.csv', index=False).",
    ),
    (
        b"\xd0\xcf\x11\xe0",
        "an Excel workbook",
        "Save the sheet as CSV.",
    ),
];

/// Opens a log according to its content; `None` if the file is not a supported binary log (it may be text).
pub fn open(path: &DataFile) -> Result<Option<Box<dyn Log>>, FileError> {
    if path.table().is_some() {
        return Ok(None);
    }
    let mut file = path.open()?;
    let mut begin = Vec::new();
    file.by_ref()
        .take(128)
        .read_to_end(&mut begin)
        .map_err(|error| path.refused(&error))?;
    let closed = CLOSED.iter().find(|(bytes, ..)| begin.starts_with(bytes));
    if let Some((_, found, advice)) = closed {
        let expected = "a text log or a supported binary log";
        return Err(FileError::new(path, Place::File, found, expected, advice));
    }
    let Some(format) = FORMATS.iter().find(|format| format.is_of(&begin)) else {
        return Ok(None);
    };
    let file = BufReader::with_capacity(1 << 16, file);
    let input = Input::new(Box::new(file)).map_err(|error| path.refused(&error))?;
    (format.open)(input)
        .map(Some)
        .map_err(|broken| broken.of(path, &broken.advice))
}

impl Format {
    fn is_of(&self, begin: &[u8]) -> bool {
        self.begins.iter().any(|bytes| begin.starts_with(bytes))
    }
}

impl Broken {
    /// Converts to a file error.
    fn of(&self, file: &Path, advice: &str) -> FileError {
        // Zero if the format does not give the position.
        let place = match self.offset {
            0 => Place::File,
            offset => Place::Byte(offset),
        };
        FileError::new(file, place, &self.found, &self.expected, advice)
    }
}

#[cfg(test)]
mod tests;
