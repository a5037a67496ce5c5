//! Long work: it leaves the interpreter free, shows its progress and ends on Ctrl-C.

use std::ops::ControlFlow;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use rayon::ThreadPoolBuilder;

/// Longest time between looks at signals.
const LOOK: Duration = Duration::from_millis(20);

/// Progress of work, seen from its thread.
#[derive(Default)]
pub struct Watch {
    steps: AtomicU64,
    is_stopped: AtomicBool,
    is_done: AtomicBool,
    caller: Option<thread::Thread>,
}

impl Watch {
    /// Counts a step; breaks if the work is to end.
    pub fn step(&self) -> ControlFlow<()> {
        self.steps.fetch_add(1, Ordering::Relaxed);
        self.caller.iter().for_each(thread::Thread::unpark);
        if self.is_stopped.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}

/// What a call shows of its progress; nothing by default.
#[derive(Default)]
pub struct Progress {
    show: Option<Py<PyAny>>,
    total: Option<u64>,
}

impl Progress {
    /// A callable, True for a progress bar, or None.
    pub fn new(py: Python, of: Option<Py<PyAny>>, total: Option<u64>) -> PyResult<Self> {
        let show = match of {
            Some(of) => py
                .import("turncal._progress")?
                .call_method1("shown", (of,))?,
            None => return Ok(Self { show: None, total }),
        };
        let show = (!show.is_none()).then(|| show.unbind());
        Ok(Self { show, total })
    }

    fn step(&self, py: Python, steps: u64) -> PyResult<()> {
        self.show
            .as_ref()
            .map_or(Ok(()), |show| show.call1(py, (steps, self.total)).map(drop))
    }

    fn close(&self, py: Python) -> PyResult<()> {
        match self.show.as_ref().map(|show| show.bind(py)) {
            Some(show) if show.hasattr("close")? => show.call_method0("close").map(drop),
            _ => Ok(()),
        }
    }
}

/// Does work in another thread. On Ctrl-C or an exception of `progress` the call ends at once, and the work at its next
/// step.
pub fn wait<T: Send + 'static>(
    py: Python,
    progress: &Progress,
    work: impl FnOnce(&Watch) -> T + Send + 'static,
) -> PyResult<T> {
    let watch = Arc::new(Watch {
        caller: Some(thread::current()),
        ..Watch::default()
    });
    let watched = watch.clone();
    let thread = thread::Builder::new()
        .name("turncal".into())
        .spawn(move || {
            // A pool of its own, because a process that was forked has no other threads.
            let result = match ThreadPoolBuilder::new().build() {
                Ok(pool) => pool.install(|| work(&watched)),
                Err(_) => work(&watched),
            };
            watched.is_done.store(true, Ordering::Release);
            watched.caller.iter().for_each(thread::Thread::unpark);
            result
        });
    let thread = thread.map_err(|error| PyMemoryError::new_err(error.to_string()))?;
    let seen = observe(py, progress, &watch, || thread.is_finished());
    if seen.is_err() {
        watch.is_stopped.store(true, Ordering::Relaxed);
    }
    let closed = progress.close(py);
    seen.and(closed)?;
    py.detach(|| thread.join())
        .map_err(|panic| resume_unwind(panic))
}

/// Does work in another thread without showing progress.
pub fn finish<T: Send + 'static>(
    py: Python,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    wait(py, &Progress::default(), |_| work())
}

/// Looks at signals and shows steps until the work is done.
fn observe(
    py: Python,
    progress: &Progress,
    watch: &Watch,
    has_ended: impl Fn() -> bool,
) -> PyResult<()> {
    let mut shown = 0;
    loop {
        let is_done = watch.is_done.load(Ordering::Acquire) || has_ended();
        py.check_signals()?;
        let steps = watch.steps.load(Ordering::Relaxed);
        if steps > shown {
            shown = steps;
            progress.step(py, steps)?;
        }
        if is_done {
            return Ok(());
        }
        py.detach(|| thread::park_timeout(LOOK));
    }
}
