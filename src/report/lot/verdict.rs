//! The verdict on a lot by its specification.

use crate::calibration::Word;
use crate::lot::{Lot, Verdict};

/// Of all limits of all units, how many are exceeded, kept or neither for certain.
pub fn of(lot: &Lot) -> Option<(Word, String)> {
    let specification = lot.specification.as_ref()?;
    let all: Vec<Verdict> = { lot.rows.iter() }
        .flat_map(|row| row.checks.iter().map(|check| check.verdict))
        .collect();
    let number = |verdict| all.iter().filter(|of| **of == verdict).count();
    let [passed, open, failed] = [Verdict::Pass, Verdict::NotDecided, Verdict::Fail].map(number);
    let word = match (failed, open + lot.failures().count()) {
        (0, 0) => Word::Pass,
        (0, _) => Word::Undecided,
        _ => Word::Fail,
    };
    let percent = 100.0 * specification.confidence;
    let words = format!(
        "{failed} of {} limits exceeded, {passed} kept, {open} undecided ({percent} % each)",
        all.len()
    );
    Some((word, words))
}
