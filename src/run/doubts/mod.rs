//! Checks of a run as it is read: what may be true, but is so unusual that the reader points at it.

mod clock;
mod columns;
mod coverage;
mod gravity;
mod quaternions;

use super::Run;

/// False-alarm rate of another order of quaternions, and of a dead axis.
const FALSE_ALARMS: f64 = 1e-6;

/// A check: what it points at, in sentences.
type Check = fn(&Run) -> Option<String>;

/// All checks, in the order in which the reader shows them.
const CHECKS: [Check; 6] = [
    gravity::anomaly,
    columns::copied,
    columns::dead,
    coverage::coverage,
    quaternions::order,
    clock::clock,
];

impl Run {
    /// What the checks point at.
    pub(crate) fn doubts(&self) -> Vec<String> {
        CHECKS.iter().filter_map(|check| check(self)).collect()
    }
}
