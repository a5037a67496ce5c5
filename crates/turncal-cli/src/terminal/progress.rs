//! Progress display on a terminal; if standard error is a file or a pipe, nothing is shown.

use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use turncal::calibration::Pass;
use turncal_report::terminal::printable;

/// Current activity with its elapsed time.
pub struct Activity {
    bar: ProgressBar,
    /// Dropping the sender ends the thread that updates the time.
    ticking: Option<Sender<()>>,
}

impl Activity {
    /// Shows an activity.
    pub fn new(message: impl Into<String>) -> Self {
        let bar = ProgressBar::new_spinner().with_message(printable(&message.into()));
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} {elapsed:>4}") {
            bar.set_style(style);
        }
        let ticking = if bar.is_hidden() { None } else { tick(&bar) };
        Self { bar, ticking }
    }

    /// Shows the next activity of the command.
    pub fn next(&self, message: impl Into<String>) {
        self.bar.set_message(printable(&message.into()));
    }

    /// Shows a message while the filter runs.
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

/// Updates the time until the sender is dropped. The ticker of indicatif panics if no thread can be started; here the
/// time is not updated until the next message.
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

/// Number of finished runs out of a known total.
pub struct Runs(ProgressBar);

impl Runs {
    /// Shows that no run is finished yet.
    pub fn new(runs: u64) -> Self {
        let bar = ProgressBar::new(runs);
        let template = "{wide_bar} {pos} of {len} runs, {eta} to go";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        Self(bar)
    }

    /// Counts one more finished run.
    pub fn one_done(&self) {
        self.0.inc(1);
    }
}

impl Drop for Runs {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
