//! Checks of a run when it is read: facts that may be true, but are so unusual that they are reported.

mod clock;
mod columns;
mod coverage;
mod gravity;
mod quaternions;

use super::Run;

impl Run {
    /// The reports of all checks, a few sentences each, in the order in which the reader shows them.
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

    /// A sentence on the true order of the table's quaternions, or on their inverse, if gravity contradicts the stated
    /// one.
    pub fn table_quaternions(&self) -> Option<String> {
        quaternions::order(self)
    }
}
