//! Progress on a terminal; nothing where standard error is a file or a pipe.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use turncal::calibration::Pass;

/// What is being done, with the time it has taken.
pub struct Activity(ProgressBar);

impl Activity {
    /// Begins to show an activity.
    pub fn new(message: impl Into<String>) -> Self {
        let bar = ProgressBar::new_spinner().with_message(message.into());
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} {elapsed:>4}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(100));
        Self(bar)
    }

    /// Says what comes next.
    pub fn next(&self, message: impl Into<String>) {
        self.0.set_message(message.into());
    }

    /// Tells of a pass of the filter.
    pub fn pass(&self, pass: &Pass) {
        let kind = if pass.feedback { "live" } else { "held" };
        self.next(format!(
            "{kind} pass done, largest step {:.2} σ",
            pass.largest_step
        ));
    }
}

impl Drop for Activity {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
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
