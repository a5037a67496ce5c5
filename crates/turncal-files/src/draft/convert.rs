//! The log of another program, converted to rows of text, with a draft that describes them.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;

use super::Draft;
use super::streams::Written;
use crate::write_rows;
use turncal_input::FileError;
use turncal_logs::Source;
use turncal_logs::rows::LogRows;

/// File of the gyros, and of accelerometers in the same stream.
const GYRO_FILE: &str = "imu.csv.gz";
const ACCEL_FILE: &str = "accelerometers.csv.gz";

impl Draft {
    /// Writes the streams of the instrument as text, with this draft, into an existing directory; a damaged log is
    /// written only if the user allowed the use of its intact part.
    ///
    /// # Errors
    /// Returns [`FileError`] if the log is already text, is damaged, or cannot be read or written.
    pub fn convert(mut self, log: &Path, directory: &Path, salvage: bool) -> Result<(), FileError> {
        let streams = self.streams.as_mut().filter(|of| of.written.is_none());
        let Some(streams) = streams else {
            let advice = "`turncal init` can draft a run.toml for it without conversion.";
            let expected = "a log of another program, which needs no conversion";
            let found = "a text file with rows";
            return Err(FileError::of(log, found, expected, advice));
        };
        let source = |stream| Source {
            stream: Some(stream),
            salvage,
            ..Source::of_file(log)
        };
        rows_as_text(&source(&streams.gyro), &directory.join(GYRO_FILE))?;
        if let Some(accel) = &streams.accel {
            rows_as_text(&source(accel), &directory.join(ACCEL_FILE))?;
        }
        let accel = streams.accel.is_some().then(|| ACCEL_FILE.to_owned());
        streams.written = Some(Written {
            accel,
            is_exchanged: false,
        });
        let path = directory.join("run.toml");
        fs::write(&path, self.to_toml(GYRO_FILE))
            .map_err(|error| FileError::unwritten(&path, &error))
    }
}

/// Every column of a stream, with all digits.
fn rows_as_text(source: &Source, path: &Path) -> Result<(), FileError> {
    let mut rows = source.open()?;
    let mut stopped = Ok(());
    let content = |file: &mut dyn Write| -> io::Result<()> {
        let mut csv = csv::Writer::from_writer(file);
        csv.write_record(rows.header())?;
        let columns = rows.header().len();
        let mut advance = |rows: &mut LogRows| {
            let advanced = rows.advance();
            advanced.unwrap_or_else(|error| {
                stopped = Err(error);
                false
            })
        };
        while advance(&mut rows) {
            let field = |k| (rows.number(k)).map_or_else(|_| "".into(), |_| rows.shown(k));
            csv.write_record((0..columns).map(|k| field(k).into_owned()))?;
        }
        csv.flush()
    };
    let written = File::create(path).and_then(|file| write_rows(path, file, content));
    written.map_err(|error| FileError::unwritten(path, &error))?;
    stopped
}
