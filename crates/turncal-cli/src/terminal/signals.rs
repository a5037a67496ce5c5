//! Handling of interrupts.

use std::sync::atomic::{AtomicBool, Ordering};

/// Whether Ctrl-C ends the current activity instead of the command.
static ENDS_GENTLY: AtomicBool = AtomicBool::new(false);
/// Whether Ctrl-C was pressed.
static ENDED: AtomicBool = AtomicBool::new(false);

/// After this call, the first Ctrl-C or termination request makes [`is_ended`] return true; the next one ends the
/// command.
pub fn end_gently() {
    ENDS_GENTLY.store(true, Ordering::SeqCst);
}

/// Whether Ctrl-C was pressed after [`end_gently`].
pub fn is_ended() -> bool {
    ENDED.load(Ordering::SeqCst)
}

/// Ends the command without leaving incomplete output on Ctrl-C, on a termination request, or if the terminal is lost;
/// shells report status 130, 143 and 129.
#[cfg(unix)]
pub fn leave_nothing_behind() {
    use std::process;
    use std::sync::Arc;
    use std::thread;

    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::flag::register_conditional_default;
    use signal_hook::iterator::Signals;
    use signal_hook::low_level::emulate_default_handler;
    use turncal_files::Unfinished;

    let heeded = || {
        let all = [SIGINT, SIGTERM, SIGHUP].into_iter();
        all.filter(|&signal| !is_ignored(signal))
    };
    // From here on, a signal waits for the thread, however long its start takes.
    let Ok(mut signals) = Signals::new(heeded()) else {
        return;
    };
    let unfinished = Unfinished::of_this_process();
    let thread = thread::Builder::new()
        .name("signals".into())
        .spawn(move || {
            for signal in signals.forever() {
                if signal != SIGHUP && ENDS_GENTLY.swap(false, Ordering::SeqCst) {
                    ENDED.store(true, Ordering::SeqCst);
                    continue;
                }
                if let Some(unfinished) = unfinished {
                    unfinished.abandon();
                }
                // The command is ended by the signal itself, so that a shell loop over many runs also ends.
                let _ = emulate_default_handler(signal);
                process::exit(128 + signal);
            }
        });
    // Without a thread, the signals have their default effect; the next run cleans up.
    if thread.is_err() {
        for signal in heeded() {
            let _ = register_conditional_default(signal, Arc::new(AtomicBool::new(true)));
        }
    }
}

/// Whether the process was started with a signal ignored, as by `nohup`; it then stays ignored. False if the system
/// does not provide this.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

/// On other systems, the next run removes the incomplete output.
#[cfg(not(unix))]
pub fn leave_nothing_behind() {}
