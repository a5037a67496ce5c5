//! `turncal calibrate --follow`: evaluates rows as they arrive, until the accuracy suffices or no more rows arrive.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::thread;
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::bail;

use super::incoming::Incoming;
use super::screen::Screen;
use crate::arguments::OfLog;
use crate::terminal::{end_gently, is_ended};
use turncal::calibration::Options;
use turncal::lot::Specification;
use turncal::survey::{Evaluator, GROWTH, InterimCalibration};
use turncal_files::Opened;
use turncal_report::terminal::printable;

/// Interval between redraws of the screen.
const REDRAW: Duration = Duration::from_millis(250);
/// Evaluations take at most two thirds of the time, and start at least half a second apart.
const PAUSE: f64 = 1.5;
const APART: Duration = Duration::from_millis(500);

/// Rows to follow.
pub struct Follow<'a> {
    /// A growing file, `-` for standard input, or a device.
    pub source: &'a Path,
    pub of_log: &'a OfLog,
    /// The run.toml that describes the rows; rows from a pipe or a device are saved in the log file that it names.
    pub run: Option<&'a Path>,
    pub options: Options,
    pub specification: Option<Specification>,
    /// File in which rows from a pipe or a device are saved.
    pub keep: Option<&'a Path>,
    /// Time without growth after which a file counts as complete.
    pub patience: Duration,
    /// Whether standard output is reserved for the result.
    pub silent: bool,
}

impl Follow<'_> {
    /// Follows the rows to their end, and returns the run.toml or log to calibrate.
    pub fn run(self) -> anyhow::Result<PathBuf> {
        end_gently();
        let mut rows = self.begin()?;
        let mut screen = Screen::new(self.silent);
        let mut followed = Followed {
            of_log: self.of_log,
            read: self.run.unwrap_or(&rows.log).to_owned(),
            opened: None,
            evaluator: Evaluator::new(self.options.clone(), self.specification.clone()),
            calibrating: None,
        };
        let mut due = Instant::now();
        let mut known = 0;
        let end = loop {
            if is_ended() {
                break "Ctrl-C";
            }
            if !rows.wait(REDRAW)? {
                break "no more rows";
            }
            screen.count(rows.received.lines, rows.left_out())?;
            if rows.received.bytes > known && Instant::now() >= due {
                let begun = Instant::now();
                known = rows.received.bytes;
                if followed.evaluate(known, &mut screen)? {
                    break "the calibration is accurate enough to decide every limit";
                }
                due = begun + APART.max(begun.elapsed().mul_f64(PAUSE));
            }
        };
        rows.end()?;
        if rows.received.bytes > known {
            followed.evaluate(rows.received.bytes, &mut screen)?;
        }
        tell!(
            "stopped following because {end}; the rows are in {}",
            rows.log.display()
        );
        if let Some(text) = rows.left_out() {
            tell!("{}", printable(&text));
        }
        Ok(followed.read)
    }

    fn begin(&self) -> anyhow::Result<Incoming> {
        let named_by_run = self.run.map(turncal_files::imu_file_of).transpose()?;
        if self.source.is_file() {
            self.check_named(named_by_run.as_deref())?;
            return Ok(Incoming::growing(self.source, self.patience));
        }
        if let Some((run, log)) = self.run.zip(named_by_run.as_ref())
            && log.metadata().is_ok_and(|of| of.len() > 0)
        {
            bail!(
                "{}: found the existing file {} in [imu], expected a new file for the rows. Give the name of a new \
                 file in [imu], or follow the existing file",
                run.display(),
                log.display()
            );
        }
        let log = self.keep.map(Path::to_owned).or(named_by_run);
        Incoming::kept(self.source, log.unwrap_or_else(default_log))
    }

    /// Checks that the log in run.toml is the growing file.
    fn check_named(&self, named: Option<&Path>) -> anyhow::Result<()> {
        let (Some(run), Some(named)) = (self.run, named) else {
            return Ok(());
        };
        let same = self.source.canonicalize().ok() == named.canonicalize().ok();
        if same {
            Ok(())
        } else {
            bail!(
                "{}: [imu] gives the log {}, but --follow gives {}. Follow the log given in run.toml",
                run.display(),
                named.display(),
                self.source.display()
            )
        }
    }
}

/// The rows received so far, and their evaluation.
struct Followed<'a> {
    of_log: &'a OfLog,
    /// The run.toml or log to read.
    read: PathBuf,
    /// The run read last, and the size of the log when its fields were found.
    opened: Option<(Opened, u64)>,
    evaluator: Evaluator,
    /// The calibration of earlier rows, in the background because it would delay the status.
    calibrating: Option<JoinHandle<Option<InterimCalibration>>>,
}

impl Followed<'_> {
    /// Shows the result from the rows so far; returns whether these rows suffice.
    fn evaluate(&mut self, size: u64, screen: &mut Screen) -> anyhow::Result<bool> {
        if let Err(error) = self.open(size) {
            screen.trouble(&format!("{error:#}"))?;
            return Ok(false);
        }
        let Some((Opened { run, .. }, _)) = &self.opened else {
            return Ok(false);
        };
        if let Some(done) = self.calibrating.take_if(|of| of.is_finished()) {
            self.evaluator.take(done.join().ok().flatten());
        }
        let status = self.evaluator.outlook(run);
        if self.calibrating.is_none()
            && let Some(due) = self.evaluator.due(run, &status)
        {
            let calibrate = move || due.calibrate(&|_| until_end());
            let thread = thread::Builder::new().name("calibration".into());
            self.calibrating = Some(thread.spawn(calibrate)?);
        }
        screen.show(run, &status, self.evaluator.specification())?;
        Ok(status.is_met())
    }

    /// Reads the rows; the fields of a log are found again after every growth by half.
    fn open(&mut self, size: u64) -> anyhow::Result<()> {
        if let Some((opened, found_at)) = &mut self.opened
            && (size as f64) < GROWTH * *found_at as f64
            && opened.read_again().is_ok()
        {
            return Ok(());
        }
        self.opened = Some((self.of_log.open_with(&self.read, |_| ())?, size));
        Ok(())
    }
}

fn until_end() -> ControlFlow<()> {
    if is_ended() {
        ControlFlow::Break(())
    } else {
        ControlFlow::Continue(())
    }
}

fn default_log() -> PathBuf {
    let now = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    PathBuf::from(format!("follow-{}.csv", now.as_secs()))
}
