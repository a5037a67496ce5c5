//! Logs of other programs: a file provides streams of samples.
//!
//! A format is identified by the first bytes of the file, never by its name. Each format is a feature of the crate.

#[cfg(any(feature = "hdf5", feature = "mat", feature = "npy"))]
mod arrays;
// A build that reads no logs only tells what they are.
#[cfg_attr(not(feature = "logs"), allow(dead_code))]
mod bytes;
#[cfg(any(feature = "dataflash", feature = "ulog"))]
mod corrections;
#[cfg(feature = "dataflash")]
mod dataflash;
#[cfg(feature = "hdf5")]
mod hdf5;
mod log;
#[cfg(feature = "mat")]
mod mat;
#[cfg(feature = "mcap")]
mod mcap;
#[cfg(any(feature = "mcap", feature = "rosbag"))]
mod messages;
#[cfg(feature = "npy")]
mod npy;
#[cfg(feature = "rosbag")]
mod rosbag;
#[cfg(feature = "rosbag")]
mod rosbag2;
mod rows;
#[cfg(feature = "rosbag")]
mod sqlite;
#[cfg(feature = "ulog")]
mod ulog;

use std::io::{BufReader, Read};
use std::path::Path;

use super::data_file::DataFile;
use super::error::{FileError, Place};
use bytes::{Broken, Input};
pub use log::{Column, Log, Stream};
pub(super) use rows::{Found, StreamRows, survey};

/// A log format, with its feature and the first bytes of its files.
struct Format {
    name: &'static str,
    feature: &'static str,
    begins: &'static [&'static [u8]],
    open: Option<Open>,
}

type Open = fn(Input) -> Result<Box<dyn Log>, Broken>;

/// One row per format: feature, reader, name, and first bytes.
macro_rules! formats {
    ($($feature:literal $open:path, $name:literal, $begins:expr;)*) => {
        [$(Format {
            name: $name,
            feature: $feature,
            begins: &$begins,
            #[cfg(feature = $feature)]
            open: Some($open),
            #[cfg(not(feature = $feature))]
            open: None,
        }),*]
    };
}

static FORMATS: [Format; 9] = formats! {
    "ulog" ulog::open, "a PX4 ULog file", [b"ULog\x01\x12\x35"];
    "dataflash" dataflash::open, "an ArduPilot DataFlash log", [b"\xa3\x95\x80"];
    "mat" mat::open, "a MAT file", [b"MATLAB 5.0 MAT-file"];
    "hdf5" hdf5::open, "an HDF5 file (MAT files of version 7.3 included)", [b"\x89HDF\r\n\x1a\n", b"MATLAB 7.3 \
        MAT-file"];
    "mcap" mcap::open, "an MCAP file", [b"\x89MCAP0\r\n"];
    "rosbag" rosbag::open, "a ROS 1 bag", [b"#ROSBAG V2.0\n"];
    "rosbag" rosbag2::open, "a ROS 2 bag", [b"SQLite format 3\0"];
    "npy" npy::open_array, "a NumPy array", [b"\x93NUMPY"];
    "npy" npy::open_archive, "a ZIP archive of NumPy arrays", [b"PK\x03\x04"];
};

/// Unsupported files: first bytes, name and remedy.
const CLOSED: [(&[u8], &str, &str); 2] = [
    (
        b"PAR1",
        "a Parquet file",
        "Save it as CSV, in Python with pandas.read_parquet(file).to_csv('imu.csv', index=False).",
    ),
    (
        b"\xd0\xcf\x11\xe0",
        "an Excel workbook",
        "Save the sheet as CSV.",
    ),
];

/// Opens a log according to its content; `None` if it is not such a log, but perhaps text.
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
    let Some(open) = format.open else {
        return Err(FileError::new(
            path,
            Place::File,
            format_args!("{}, which this build cannot read", format.name),
            format_args!("a build with the feature `{}`", format.feature),
            "Build turncal with its default features, or convert the file to CSV.",
        ));
    };
    let file = BufReader::with_capacity(1 << 16, file);
    let input = Input::new(Box::new(file)).map_err(|error| path.refused(&error))?;
    open(input)
        .map(Some)
        .map_err(|broken| broken.of(path, ADVICE))
}

const ADVICE: &str = "Record or copy the file again.";

impl Format {
    fn is_of(&self, begin: &[u8]) -> bool {
        self.begins.iter().any(|bytes| begin.starts_with(bytes))
    }
}

impl Broken {
    /// Converts to a file error.
    fn of(&self, file: &Path, advice: &str) -> FileError {
        // Zero where the format does not tell the place.
        let place = match self.offset {
            0 => Place::File,
            offset => Place::Byte(offset),
        };
        FileError::new(file, place, &self.found, &self.expected, advice)
    }
}

#[cfg(all(test, feature = "logs"))]
mod tests;
