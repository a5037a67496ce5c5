//! `turncal calibrate --follow`: evaluates rows as they arrive, until they suffice or no more arrive.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::bail;

use super::incoming::Incoming;
use super::screen::Screen;
use crate::arguments::OfLog;
use crate::terminal::{end_gently, is_ended};
use turncal::calibration::Options;
use turncal::lot::Specification;
use turncal::survey::{Evaluator, GROWTH};
use turncal_files::Opened;

/// Interval between redraws of the screen.
const REDRAW: Duration = Duration::from_millis(250);
/// Evaluations use at most one part in this many of a processor's time, and start at least a second apart.
const SHARE: u32 = 40;
const APART: Duration = Duration::from_secs(1);

/// Rows to follow.
pub struct Follow<'a> {
    /// A growing file, `-` or a device.
    pub source: &'a Path,
    pub of_log: &'a OfLog,
    /// The run.toml of the rows; it names the file that keeps those of a pipe or a device.
    pub run: Option<&'a Path>,
    pub options: Options,
    pub specification: Option<Specification>,
    /// File that keeps the rows of a pipe or a device.
    pub keep: Option<&'a Path>,
    /// A file that has not grown for this time is complete.
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
            screen.count(rows.received.lines)?;
            if rows.received.bytes > known && Instant::now() >= due {
                let (begun, spent) = (Instant::now(), processor_time());
                known = rows.received.bytes;
                if followed.evaluate(known, &mut screen)? {
                    break "the specification can be decided";
                }
                due = begun + APART.max(processor_time().saturating_sub(spent) * SHARE);
            }
        };
        rows.end()?;
        if rows.received.bytes > known {
            followed.evaluate(rows.received.bytes, &mut screen)?;
        }
        tell!(
            "stopped following: {end}; the rows are in {}",
            rows.log.display()
        );
        if rows.incomplete() > 0 {
            tell!("incomplete lines left out: {}", rows.incomplete());
        }
        Ok(followed.read)
    }

    fn begin(&self) -> anyhow::Result<Incoming> {
        let named_by_run = self.run.map(turncal_files::imu_file_of).transpose()?;
        if self.source.is_file() {
            self.check_named(named_by_run.as_deref())?;
            return Ok(Incoming::growing(self.source, self.patience));
        }
        let log = self.keep.map(Path::to_owned).or(named_by_run);
        Incoming::kept(self.source, log.unwrap_or_else(default_log))
    }

    /// A run.toml has to name the growing file.
    fn check_named(&self, named: Option<&Path>) -> anyhow::Result<()> {
        let (Some(run), Some(named)) = (self.run, named) else {
            return Ok(());
        };
        let same = self.source.canonicalize().ok() == named.canonicalize().ok();
        if same {
            Ok(())
        } else {
            bail!(
                "{}: [imu] names {}, but --follow {}. Follow the file named in run.toml",
                run.display(),
                named.display(),
                self.source.display()
            )
        }
    }
}

/// The rows so far, and their evaluation.
struct Followed<'a> {
    of_log: &'a OfLog,
    /// The run.toml or log to read.
    read: PathBuf,
    /// What was read, and the size of the log when its fields were found.
    opened: Option<(Opened, u64)>,
    evaluator: Evaluator,
}

impl Followed<'_> {
    /// Shows the result of the rows so far; returns whether they suffice.
    fn evaluate(&mut self, size: u64, screen: &mut Screen) -> anyhow::Result<bool> {
        if let Err(error) = self.open(size) {
            screen.trouble(&format!("{error:#}"))?;
            return Ok(false);
        }
        let Some((Opened { run, .. }, _)) = &self.opened else {
            return Ok(false);
        };
        let status = self.evaluator.status(run, &|_| {
            if is_ended() {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
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

/// Processor time of the command.
#[cfg(any(target_os = "linux", target_vendor = "apple"))]
fn processor_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Duration::try_from(time).unwrap_or_default()
}

/// Elapsed time, where the system does not report processor time.
#[cfg(not(any(target_os = "linux", target_vendor = "apple")))]
fn processor_time() -> Duration {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default()
}

fn default_log() -> PathBuf {
    let now = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    PathBuf::from(format!("follow-{}.csv", now.as_secs()))
}
