//! Checks of a run as it is read: what may be true, but is so unusual that the reader points at it.

mod clock;
mod columns;
mod coverage;
mod gravity;
mod quaternions;

use super::Run;

impl Run {
    /// What the checks point at, a few sentences each, in the order in which the reader shows them.
    pub fn doubts(&self) -> Vec<String> {
        let checks: [fn(&Self) -> Option<String>; 5] = [
            gravity::anomaly,
            columns::copied,
            columns::dead,
            coverage::coverage,
            clock::clock,
        ];
        checks.iter().filter_map(|check| check(self)).collect()
    }

    /// In which other order, or of which inverse, the table's quaternions are, in a sentence, if gravity shows it.
    pub fn table_quaternions(&self) -> Option<String> {
        quaternions::order(self)
    }
}
