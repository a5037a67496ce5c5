//! Stamps of a logger that came late to its rows.

use std::collections::VecDeque;

/// So many rows behind a late one tell that it was: no burst is longer, and over so few a period that is not known
/// well is known well enough.
pub const REACH: usize = 128;

/// Times of rows, those that came late at the time that rows behind them leave.
///
/// A row was sampled before those behind it, a period for each. A stamp that says otherwise by more than a period,
/// which jitter and rounding do not, is the logger's: it was busy, or passed on a burst.
pub fn punctual(stamps: &[(f64, u64)], period: f64) -> Vec<f64> {
    let mut times: Vec<f64> = stamps.iter().map(|&(time, _)| time).collect();
    // Against a clock without gaps; rows behind, each earlier than all between it and this one.
    let against = |row: usize| stamps[row].0 - stamps[0].0 - row as f64 * period;
    let mut behind: VecDeque<usize> = VecDeque::new();
    for row in (0..stamps.len()).rev() {
        while behind
            .front()
            .is_some_and(|&next| against(next) >= against(row))
        {
            behind.pop_front();
        }
        behind.push_front(row);
        while behind.back().is_some_and(|&last| last > row + REACH) {
            behind.pop_back();
        }
        let late = behind
            .back()
            .map_or(0.0, |&last| against(row) - against(last));
        if late > period {
            times[row] -= late;
        }
    }
    times
}
