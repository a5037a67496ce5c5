//! Standard output and standard error, threads and signals.

mod names;
mod output;
mod progress;
mod signals;
mod threads;

pub use names::short_names;
pub use output::{columns, print, show, show_brief, stream};
pub use progress::{Activity, Runs};
pub use signals::{end_gently, is_ended, leave_nothing_behind};
pub use threads::{piece_by_piece, with_threads};
