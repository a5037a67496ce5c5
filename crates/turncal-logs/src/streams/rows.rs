//! One stream of a log, row by row.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use super::bytes::Broken;
use super::{Log, Stream};
use crate::data_file::DataFile;
use crate::rows::Rows;
use turncal_input::{FileError, Place, list, suggestion};

/// A log with the current sample of one of its streams.
pub struct StreamRows {
    file: PathBuf,
    log: Box<dyn Log>,
    stream: usize,
    name: String,
    names: Vec<String>,
    units: Vec<String>,
    /// Whether the intact part before damage is used.
    salvage: bool,
    damage: Option<Broken>,
    row: Vec<f64>,
    /// Number of samples of the stream so far, including this one.
    samples: u64,
    /// Whether the row is the first and has not been returned yet.
    is_ahead: bool,
}

/// A stream with its statistics from the whole file.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The stream.
    pub stream: Stream,
    /// Number of samples in the stream.
    pub samples: u64,
}

/// All streams of a log that contain samples, and the error at the first damage.
pub fn survey(file: &Path, mut log: Box<dyn Log>) -> (Vec<Found>, Option<FileError>) {
    let mut samples: Vec<u64> = Vec::new();
    let mut row = Vec::new();
    let damage = loop {
        match log.advance() {
            Ok(None) => break None,
            Err(broken) => break Some(broken),
            Ok(Some(stream)) => {
                if samples.len() <= stream {
                    samples.resize(stream + 1, 0);
                }
                // The first sample shows whether there are remarks on the stream; later samples may add to them.
                let is_told = |of: &Stream| !of.remarks.is_empty();
                if (samples[stream] == 0 || is_told(&log.streams()[stream]))
                    && let Err(broken) = log.values(&mut row)
                {
                    break Some(broken);
                }
                samples[stream] += 1;
            }
        }
    };
    let streams = log.streams().iter().cloned().zip(samples);
    let found = streams.map(|(stream, samples)| Found { stream, samples });
    let with_samples = found.filter(|found| found.samples > 0).collect();
    (with_samples, damage.map(|broken| broken.of(file, CUT_OFF)))
}

const CUT_OFF: &str = "Copy or record the file again, or set `salvage = true` to use the intact data \
                       before this point.";

impl StreamRows {
    /// Opens a stream with at least one sample; if no name is given, opens the only stream.
    pub fn open(
        file: &DataFile,
        mut log: Box<dyn Log>,
        name: Option<&str>,
        salvage: bool,
    ) -> Result<Self, FileError> {
        let mut with_samples: Vec<usize> = Vec::new();
        let mut damage = None;
        let mut row = Vec::new();
        let stream = loop {
            let next = match log.advance() {
                Err(broken) if salvage => {
                    damage = Some(broken);
                    None
                }
                next => next.map_err(|broken| broken.of(file, CUT_OFF))?,
            };
            let Some(stream) = next else {
                break None;
            };
            if !with_samples.contains(&stream) {
                with_samples.push(stream);
            }
            if name.is_some_and(|name| is_called(&log.streams()[stream].name, name)) {
                break Some(stream);
            }
        };
        if let (None, None, &[_]) = (stream, name, &with_samples[..]) {
            // The file was read to its end to ensure that there is no other stream.
            let only = log.streams()[with_samples[0]].name.clone();
            let again = super::open(file)?.ok_or_else(|| changed(file))?;
            return Self::open(file, again, Some(&only), salvage);
        }
        let Some(stream) = stream else {
            return Err(no_stream(file, log.as_ref(), &with_samples, name));
        };
        log.values(&mut row)
            .map_err(|broken| broken.of(file, CUT_OFF))?;
        let found = &log.streams()[stream];
        let columns = found.columns.iter();
        let columns = columns.map(|column| (column.name.clone(), column.unit.to_owned()));
        let (names, units) = columns.unzip();
        Ok(Self {
            file: file.to_path_buf(),
            name: found.name.clone(),
            names,
            units,
            log,
            stream,
            salvage,
            damage,
            row,
            samples: 0,
            is_ahead: true,
        })
    }

    fn next(&mut self) -> Result<bool, Broken> {
        if self.damage.is_some() {
            return Ok(false);
        }
        while let Some(stream) = self.log.advance()? {
            if stream == self.stream {
                self.log.values(&mut self.row)?;
                return Ok(true);
            }
        }
        Ok(false)
    }
}

impl Rows for StreamRows {
    fn file(&self) -> &Path {
        &self.file
    }

    fn header(&self) -> &[String] {
        &self.names
    }

    fn units(&self) -> &[String] {
        &self.units
    }

    fn remarks(&self) -> &[String] {
        &self.log.streams()[self.stream].remarks
    }

    /// The result is also false at damage, if the part before it is to be used.
    fn advance(&mut self, _used: &[usize]) -> Result<bool, FileError> {
        if self.is_ahead {
            self.is_ahead = false;
            self.samples = 1;
            return Ok(true);
        }
        match self.next() {
            Ok(more) => {
                self.samples += u64::from(more);
                Ok(more)
            }
            Err(broken) if self.salvage => {
                self.damage = Some(broken);
                Ok(false)
            }
            Err(broken) => Err(broken.of(&self.file, CUT_OFF)),
        }
    }

    fn cut_off(&self, _done: &str) -> Option<String> {
        let Broken {
            offset,
            found,
            expected,
            ..
        } = self.damage.as_ref()?;
        Some(format!(
            "{}, byte {offset}: found {found}, expected {expected}. turncal used the {} samples of `{}` that precede \
             this byte.",
            self.file.display(),
            self.samples,
            self.name
        ))
    }

    fn line(&self) -> u64 {
        self.samples
    }

    fn value(&self, column: usize) -> f64 {
        self.row.get(column).copied().unwrap_or(f64::NAN)
    }

    fn shown(&self, column: usize) -> Cow<'_, str> {
        match self.log.whole(column) {
            Some(whole) => whole.to_string().into(),
            None => self.value(column).to_string().into(),
        }
    }

    fn place(&self, column: Option<usize>) -> Place {
        Place::Sample {
            number: self.samples,
            stream: self.name.clone(),
            byte: self.log.offset(),
            column: column.and_then(|column| self.names.get(column)).cloned(),
        }
    }

    fn placed(&self, mut error: FileError) -> FileError {
        if let Place::Line(number) = error.place {
            error.place = Place::Sample {
                number,
                stream: self.name.clone(),
                byte: 0,
                column: None,
            };
        }
        error
    }
}

/// Error for a log without a matching stream with samples.
fn no_stream(file: &Path, log: &dyn Log, with_samples: &[usize], name: Option<&str>) -> FileError {
    let names = || with_samples.iter().map(|&k| &*log.streams()[k].name);
    let (found, expected) = match name {
        _ if with_samples.is_empty() => (
            "no samples".to_owned(),
            "at least one stream of samples".to_owned(),
        ),
        name => (
            format!("the streams {}", list(names())),
            name.map_or_else(
                || "one stream or `stream` in run.toml".to_owned(),
                |name| format!("a stream `{name}` with samples"),
            ),
        ),
    };
    let advice = suggestion(
        name.unwrap_or_default(),
        names(),
        "Name one of these streams; `turncal init FILE` shows the content of each.",
    );
    FileError::new(file, Place::File, found, expected, advice)
}

/// Whether this is the name of the stream; the index of the first instance may be omitted.
fn is_called(stream: &str, name: &str) -> bool {
    stream == name || stream.strip_suffix("[0]") == Some(name)
}

fn changed(file: &Path) -> FileError {
    FileError::new(
        file,
        Place::File,
        "a file that was changed while turncal read it",
        "an unchanged file",
        "Wait until the file is complete, then try again.",
    )
}
