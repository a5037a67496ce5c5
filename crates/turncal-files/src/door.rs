//! Single entry point for inputs: a `run.toml`, or a log that is described by its own content and by options.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::draft::{Draft, Stated};
use turncal::run::Run;
use turncal_input::FileError;
use turncal_logs::DataFile;

/// The log on standard input.
const STANDARD_INPUT: &str = "-";
/// File name for rows of standard input.
const PIPED: &str = "stdin.csv";

/// A run and, for a log without run.toml, the draft with which the log was read.
#[derive(Debug)]
pub struct Opened {
    /// The run.
    pub run: Run,
    log: Option<Log>,
}

#[derive(Debug)]
struct Log {
    path: PathBuf,
    draft: Draft,
    /// Rows of standard input, until they are written next to a result.
    piped: Option<TempDir>,
}

impl Opened {
    /// Reads a `run.toml` (by extension), a log, or text on standard input (`-`). Shows the draft for a log before any
    /// error.
    ///
    /// # Errors
    /// Returns [`FileError`] if the file cannot be read, or if required fields of a log are neither detected nor
    /// stated.
    pub fn new(
        path: &Path,
        stream: Option<&str>,
        stated: &Stated,
        show: impl FnOnce(&Draft),
    ) -> Result<Self, FileError> {
        if path != Path::new(STANDARD_INPUT) {
            return Self::of_file(&path.into(), &[], (stream, stated), show);
        }
        let piped = piped(path)?;
        let file = piped.path().join(PIPED).into();
        let mut opened = Self::of_file(&file, &[], (stream, stated), show)?;
        if let Some(log) = &mut opened.log {
            log.piped = Some(piped);
        }
        Ok(opened)
    }

    /// Does the same as [`Self::new`] for files in memory: a `run.toml` or a log, and the files that it refers to.
    ///
    /// # Errors
    /// The same errors as [`Self::new`].
    pub fn in_memory(
        files: &[DataFile],
        stream: Option<&str>,
        stated: &Stated,
        show: impl FnOnce(&Draft),
    ) -> Result<Self, FileError> {
        let Some(file) = files.first() else {
            let advice = "Give a log, or give a run.toml together with the files that it names.";
            return Err(FileError::of(Path::new(""), "no file", "a log", advice));
        };
        Self::of_file(file, files, (stream, stated), show)
    }

    /// Reads several logs of one sensor, each recorded in one position; `None` if the sensor was turned in any of them.
    ///
    /// # Errors
    /// The errors of [`Self::new`], and an error if the logs have different columns.
    pub fn of_positions(
        paths: &[PathBuf],
        (stream, stated): (Option<&str>, &Stated),
        mut show: impl FnMut(&Path, &Draft),
    ) -> Result<Option<Vec<Self>>, FileError> {
        let mut drafts: Vec<Draft> = Vec::new();
        for path in paths {
            let mut draft = Draft::of_stream(&path.as_path().into(), stream, stated)?;
            if !draft.is_of_one_position() {
                return Ok(None);
            }
            match drafts.first() {
                Some(first) => draft.as_in(path, first)?,
                None => draft.leave_out_gyros(),
            }
            drafts.push(draft);
        }
        let opened = paths.iter().zip(drafts).map(|(path, draft)| {
            show(path, &draft);
            let mut opened = Self::of_draft(&path.as_path().into(), &[], draft)?;
            opened.run.recording.label_by_name();
            Ok(opened)
        });
        opened.collect::<Result<_, _>>().map(Some)
    }

    fn of_file(
        file: &DataFile,
        in_memory: &[DataFile],
        (stream, stated): (Option<&str>, &Stated),
        show: impl FnOnce(&Draft),
    ) -> Result<Self, FileError> {
        if is_toml(file) {
            if stream.is_some() || *stated != Stated::default() {
                let found = "options that describe a log (rate, units, site, sensor, stream) together with a run.toml";
                let advice = "Write this information into run.toml, or omit the options.";
                let expected = "this information in run.toml";
                return Err(FileError::of(file, found, expected, advice));
            }
            let run = match file.bytes().map(String::from_utf8_lossy) {
                Some(text) => crate::run_of_text(file, &text, Some(file), in_memory)?,
                None => crate::read_run(file)?,
            };
            return Ok(Self { run, log: None });
        }
        let draft = Draft::of_stream(file, stream, stated)?;
        show(&draft);
        Self::of_draft(file, in_memory, draft)
    }

    fn of_draft(file: &DataFile, in_memory: &[DataFile], draft: Draft) -> Result<Self, FileError> {
        draft.check(file)?;
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let mut run = crate::run_of_text(file, &draft.to_toml(&name), None, in_memory)?;
        run.recording.doubts.extend(draft.doubts());
        let path = file.to_path_buf();
        let log = Some(Log {
            path,
            draft,
            piped: None,
        });
        Ok(Self { run, log })
    }

    /// Reads a log that has grown, using the fields detected earlier.
    ///
    /// # Errors
    /// Returns [`FileError`] if the log cannot be read.
    pub fn read_again(&mut self) -> Result<(), FileError> {
        if let Some(Log { path, draft, .. }) = &self.log {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            self.run = crate::run_of_text(path, &draft.to_toml(&name), None, &[])?;
        }
        Ok(())
    }

    /// Whether the input was a log without a `run.toml`.
    pub fn is_of_log(&self) -> bool {
        self.log.is_some()
    }

    /// Writes the `run.toml` used to read a log into a result directory.
    ///
    /// # Errors
    /// Returns [`FileError`] if the file cannot be written.
    pub fn write_run(&self, directory: &Path) -> Result<(), FileError> {
        let Some(log) = &self.log else {
            return Ok(());
        };
        let path = directory.join("run.toml");
        let written = match &log.piped {
            Some(_) => fs::copy(&log.path, directory.join(PIPED)).map(|_| PIPED.into()),
            None => log.path.canonicalize(),
        };
        let written = written
            .and_then(|file: PathBuf| fs::write(&path, log.draft.to_toml(&file.to_string_lossy())));
        written.map_err(|error| FileError::unwritten(&path, &error))
    }
}

/// Whether the file extension shows that the file is a `run.toml` or `campaign.toml`, which refers to other files, and
/// not a log.
pub fn is_toml(path: &Path) -> bool {
    path.extension() == Some(OsStr::new("toml"))
}

/// All rows of standard input as a file.
fn piped(path: &Path) -> Result<TempDir, FileError> {
    let spool = || -> io::Result<TempDir> {
        let directory = tempfile::tempdir()?;
        let mut file = File::create(directory.path().join(PIPED))?;
        io::copy(&mut io::stdin().lock(), &mut file)?;
        Ok(directory)
    };
    let advice = "Give the log as a file.";
    spool().map_err(|error| FileError::io(path, "keep standard input", &error, advice))
}

#[cfg(test)]
mod tests {
    use super::*;

    const RUN: &str = r#"
        format = "turncal-run/1"
        [imu]
        file = "/home/me/imu.csv"
        output = "rate"
        gyro_unit = "rad/s"
        accel_unit = "m/s^2"
        time_stamp = "end"
        columns = { time = "t", gyro = ["p", "q", "r"], accel = ["ax", "ay", "az"] }
    "#;

    fn rows() -> String {
        let row = |k: u32| format!("{},0.001,0,0.002,0,0.{k},9.8\n", f64::from(k) / 100.0);
        let rows: String = (1..500).map(row).collect();
        format!("t,p,q,r,ax,ay,az\n{rows}")
    }

    #[test]
    fn files_in_memory_give_the_samples_of_those_on_disk() {
        let directory = tempfile::tempdir().unwrap();
        let log = directory.path().join("imu.csv");
        fs::write(&log, rows()).unwrap();
        let run = directory.path().join("run.toml");
        let text = RUN.replace("/home/me/", "");
        let expected = crate::run_of_text(&run, &text, None, &[])
            .unwrap()
            .recording
            .imu;
        // A directory that a run.toml names does not exist in a browser.
        let files = [
            DataFile::in_memory("run.toml", RUN.as_bytes()),
            DataFile::in_memory("imu.csv", rows().as_bytes()),
        ];
        let opened = Opened::in_memory(&files, None, &Stated::default(), |_| {}).unwrap();
        assert_eq!(opened.run.recording.imu, expected);
        let missing = Opened::in_memory(&files[..1], None, &Stated::default(), |_| {});
        let message = missing.unwrap_err().to_string();
        assert!(message.contains("add the file"), "{message}");
    }
}
