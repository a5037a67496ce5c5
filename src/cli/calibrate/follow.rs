//! `turncal calibrate --follow`: evaluates rows as they arrive, until they suffice or no more arrive.

use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::{self, IsTerminal, Read, Seek, SeekFrom, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::{Context, bail};

use super::lines::Lines;
use crate::calibration::Options;
use crate::cli::arguments::OfLog;
use crate::cli::terminal::{columns, end_gently, is_ended, print};
use crate::formats::Opened;
use crate::lot::Specification;
use crate::number::count;
use crate::report::session;
use crate::report::terminal::{printable, wrapped};
use crate::run::Run;
use crate::survey::{Evaluator, GROWTH, Status};

/// Interval between redraws of the screen.
const REDRAW: Duration = Duration::from_millis(250);
/// Evaluations use at most one part in this many of a processor's time, and start at least a second apart.
const SHARE: u32 = 40;
const APART: Duration = Duration::from_secs(1);
/// Interval between attempts to reopen a device that disappeared.
const AGAIN: Duration = Duration::from_secs(1);

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
        if let Some(incomplete @ 1..) = rows.incomplete() {
            tell!("incomplete lines left out: {incomplete}");
        }
        Ok(followed.read)
    }

    fn begin(&self) -> anyhow::Result<Incoming> {
        let named =
            |error: io::Error| anyhow::Error::new(error).context(self.source.display().to_string());
        let named_by_run = self.run.map(Run::imu_file).transpose()?;
        if self.source.is_file() {
            self.check_named(named_by_run.as_deref())?;
            return Ok(Incoming {
                log: self.source.to_owned(),
                received: Received::default(),
                kind: Kind::Growing {
                    grew: Instant::now(),
                    patience: self.patience,
                },
            });
        }
        let is_stdin = self.source == Path::new("-");
        if !is_stdin {
            self.source.metadata().map_err(named)?;
        }
        let log = self.keep.map(Path::to_owned).or(named_by_run);
        let log = log.unwrap_or_else(default_log);
        let file = OpenOptions::new().create(true).append(true).open(&log);
        let file = file.with_context(|| log.display().to_string())?;
        Ok(Incoming {
            received: Received {
                bytes: file.metadata().map_err(named)?.len(),
                lines: 0,
            },
            kind: Kind::Kept {
                file,
                lines: Lines::new(is_serial(self.source)),
                chunks: read_in_background(self.source.to_owned())?,
            },
            log,
        })
    }

    /// A run.toml has to name the growing file.
    fn check_named(&self, named: Option<&Path>) -> anyhow::Result<()> {
        let (Some(run), Some(named)) = (self.run, named) else {
            return Ok(());
        };
        let same = self.source.canonicalize().ok() == named.canonicalize().ok();
        match same {
            true => Ok(()),
            false => bail!(
                "{}: [imu] names {}, but --follow {}. Follow the file named in run.toml",
                run.display(),
                named.display(),
                self.source.display()
            ),
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
        let status = self.evaluator.status(run, &|_| match is_ended() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
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

/// Incoming rows, and the log that contains them.
struct Incoming {
    log: PathBuf,
    received: Received,
    kind: Kind,
}

enum Kind {
    /// Another program writes the log.
    Growing { grew: Instant, patience: Duration },
    /// Lines that are read are written to the log.
    Kept {
        file: File,
        lines: Lines,
        /// Bytes; `None` if the device is gone.
        chunks: Receiver<Option<Vec<u8>>>,
    },
}

impl Incoming {
    /// Waits for bytes; false at the end.
    fn wait(&mut self, most: Duration) -> anyhow::Result<bool> {
        match &mut self.kind {
            Kind::Growing { grew, patience } => {
                thread::sleep(most);
                // A file that is gone for a while does not grow.
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
                        Ok(Some(bytes)) => complete.extend(lines.push(&bytes)),
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

    /// Keeps the last line, complete or not.
    fn end(&mut self) -> anyhow::Result<()> {
        match &mut self.kind {
            Kind::Growing { .. } => Ok(()),
            Kind::Kept { lines, .. } => {
                let rest = lines.end();
                self.keep(&rest)
            }
        }
    }

    fn keep(&mut self, bytes: &[u8]) -> anyhow::Result<()> {
        if let Kind::Kept { file, .. } = &mut self.kind {
            let written = file.write_all(bytes);
            written.with_context(|| self.log.display().to_string())?;
            self.received.write_all(bytes)?;
        }
        Ok(())
    }

    /// Number of incomplete lines; `None` for a file that another program writes.
    fn incomplete(&self) -> Option<usize> {
        match &self.kind {
            Kind::Growing { .. } => None,
            Kind::Kept { lines, .. } => Some(lines.incomplete),
        }
    }
}

/// What has been received.
#[derive(Default)]
struct Received {
    bytes: u64,
    lines: usize,
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

/// Whether this is a serial device, which does not wait for a reader.
#[cfg(unix)]
fn is_serial(source: &Path) -> bool {
    use std::os::unix::fs::FileTypeExt;
    source
        .metadata()
        .is_ok_and(|of| of.file_type().is_char_device())
}

/// Anything but standard input, where the system does not tell.
#[cfg(not(unix))]
fn is_serial(source: &Path) -> bool {
    source != Path::new("-")
}

/// Reads standard input or a device, which is reopened when it returns after it was gone.
fn read_in_background(source: PathBuf) -> anyhow::Result<Receiver<Option<Vec<u8>>>> {
    let (chunks, received) = mpsc::channel();
    let is_stdin = source == Path::new("-");
    let read = move || {
        let mut buffer = [0; 4096];
        loop {
            let opened: io::Result<Box<dyn Read>> = match is_stdin {
                true => Ok(Box::new(io::stdin())),
                false => File::open(&source).map(|file| Box::new(file) as Box<dyn Read>),
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
                    "{}: gone; waiting for it to return (Ctrl-C stops)",
                    source.display()
                );
            }
            thread::sleep(AGAIN);
        }
    };
    thread::Builder::new().name("rows".into()).spawn(read)?;
    Ok(received)
}

/// Output: a screen that is redrawn on a terminal, otherwise a line for each dwell.
struct Screen {
    is_terminal: bool,
    silent: bool,
    /// Lines on the terminal that the next screen replaces.
    drawn: usize,
    /// Number of dwells already reported.
    told: usize,
    trouble: String,
    /// Notes already reported, without their figures.
    noted: BTreeSet<String>,
    /// Content of the screen below the number of lines received.
    content: Vec<String>,
    received: usize,
}

impl Screen {
    fn new(silent: bool) -> Self {
        Self {
            is_terminal: io::stdout().is_terminal(),
            silent,
            drawn: 0,
            told: 0,
            trouble: String::new(),
            noted: BTreeSet::new(),
            content: Vec::new(),
            received: 0,
        }
    }

    fn show(
        &mut self,
        run: &Run,
        status: &Status,
        specification: Option<&Specification>,
    ) -> anyhow::Result<()> {
        self.trouble.clear();
        if self.is_terminal && !self.silent {
            return self.draw(session::screen(run, status, specification));
        }
        for note in session::notes(run, status) {
            let is_new = self
                .noted
                .insert(note.replace(|c: char| c.is_ascii_digit(), ""));
            if is_new {
                self.tell(&note)?;
            }
        }
        // The last dwell is not complete while the instrument is at rest.
        let whole = status.survey.rests.len() - usize::from(status.still > 0.0);
        while self.told < whole {
            if let Some(line) = session::line(status, self.told) {
                self.tell(&line)?;
            }
            self.told += 1;
            if self.told == whole
                && let Some(next) = status.next
            {
                self.tell(&format!("next: {}", session::words(next)))?;
            }
        }
        Ok(())
    }

    /// Reports once why the rows cannot be evaluated.
    fn trouble(&mut self, text: &str) -> anyhow::Result<()> {
        if self.is_terminal && !self.silent {
            return self.draw(vec![
                "waiting for readable rows".to_owned(),
                text.to_owned(),
            ]);
        }
        if self.trouble != text {
            text.clone_into(&mut self.trouble);
            self.tell(&format!("not yet: {text}"))?;
        }
        Ok(())
    }

    fn tell(&self, line: &str) -> anyhow::Result<()> {
        match self.silent {
            true => {
                tell!("{}", printable(line));
                Ok(())
            }
            false => print(format!("{}\n", printable(line)).as_bytes()),
        }
    }

    /// Shows at once that lines arrive, before they are evaluated.
    fn count(&mut self, received: usize) -> anyhow::Result<()> {
        if received == self.received {
            return Ok(());
        }
        self.received = received;
        match self.is_terminal && !self.silent {
            true => self.redraw(),
            false => Ok(()),
        }
    }

    fn draw(&mut self, content: Vec<String>) -> anyhow::Result<()> {
        self.content = content;
        self.redraw()
    }

    fn redraw(&mut self) -> anyhow::Result<()> {
        let width = usize::from(columns().unwrap_or(80)).max(20);
        let mut text = String::new();
        if self.drawn > 0 {
            text += &format!("\u{1b}[{}A", self.drawn);
        }
        text += "\u{1b}[J";
        self.drawn = 0;
        let received = format!("{} lines received", count(self.received));
        for line in std::iter::once(&received).chain(&self.content) {
            for part in wrapped(&printable(line), "  ", Some(width)) {
                text += &part;
                text.push('\n');
                self.drawn += 1;
            }
        }
        print(text.as_bytes())
    }
}
