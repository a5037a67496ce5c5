//! Progress on a terminal; nothing where standard error is a file or a pipe.

use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use turncal::calibration::Pass;
use turncal::report::terminal::printable;

/// What is being done, with the time it has taken.
pub struct Activity {
    bar: ProgressBar,
    /// Goes to end the thread that moves the time on.
    ticking: Option<Sender<()>>,
}

impl Activity {
    /// Begins to show an activity.
    pub fn new(message: impl Into<String>) -> Self {
        let bar = ProgressBar::new_spinner().with_message(printable(&message.into()));
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} {elapsed:>4}") {
            bar.set_style(style);
        }
        let ticking = if bar.is_hidden() { None } else { tick(&bar) };
        Self { bar, ticking }
    }

    /// Says what comes next.
    pub fn next(&self, message: impl Into<String>) {
        self.bar.set_message(printable(&message.into()));
    }

    /// Tells of a pass of the filter.
    pub fn pass(&self, pass: &Pass) {
        let step = pass.largest_step;
        self.next(format!("iteration done, largest step {step:.2} σ"));
    }
}

impl Drop for Activity {
    fn drop(&mut self) {
        self.ticking = None;
        self.bar.finish_and_clear();
    }
}

/// Moves the time on until the sender goes. Indicatif's own ticker panics where no thread can be started;
/// here the time stands still until the next message.
fn tick(bar: &ProgressBar) -> Option<Sender<()>> {
    let (ticking, end) = mpsc::channel();
    let bar = bar.clone();
    let ticker = move || {
        while end.recv_timeout(Duration::from_millis(100)) == Err(RecvTimeoutError::Timeout) {
            bar.tick();
        }
    };
    thread::Builder::new().spawn(ticker).ok().map(|_| ticking)
}

/// How many of a known number of runs are done.
pub struct Runs(ProgressBar);

impl Runs {
    /// Begins to show that none is.
    pub fn new(runs: u64) -> Self {
        let bar = ProgressBar::new(runs);
        let template = "{wide_bar} {pos} of {len} runs, {eta} to go";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        Self(bar)
    }

    /// One more is done.
    pub fn one_done(&self) {
        self.0.inc(1);
    }
}

impl Drop for Runs {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
