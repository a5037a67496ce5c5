//! The clock of a log.

use super::name;
use super::name::Name;
use crate::formats::Sheet;
use crate::statistics::median;

/// Units of time in s, with the words that `run.toml` has for them.
const UNITS: [(&str, f64); 4] = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];
/// No unit of three orders is right at two of these periods, s: 5 kHz to 5 Hz.
const PERIODS: std::ops::Range<f64> = 2e-4..0.2;
/// A step this much longer than the usual one is a gap.
const GAP: f64 = 1.5;

/// What the column of time shows.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Clock {
    /// The word for `time_unit`.
    pub unit: &'static str,
    /// Why it is that.
    pub why: String,
    /// Time from row to row in s, if the unit is one of time.
    pub period: Option<f64>,
    /// Steps longer than the usual one.
    pub gaps: usize,
    /// Steps that do not go forward.
    pub repeated: usize,
}

impl Clock {
    pub fn find(sheet: &Sheet, column: Option<usize>) -> Self {
        let Some(column) = column else {
            return Self {
                unit: "s",
                why: "no column goes forward like a time".to_owned(),
                period: None,
                gaps: 0,
                repeated: 0,
            };
        };
        let stamps = &sheet.columns[column];
        let steps: Vec<f64> = stamps
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .filter(|step| step.is_finite())
            .collect();
        let mut forward: Vec<f64> = steps.iter().copied().filter(|&step| step > 0.0).collect();
        let usual = median(&mut forward).unwrap_or(1.0);
        // Rounding of printed stamps averages out over the steps without gaps.
        let even: Vec<f64> = forward
            .iter()
            .copied()
            .filter(|&step| step < GAP * usual)
            .collect();
        let mean = even.iter().sum::<f64>() / even.len().max(1) as f64;
        let name = Name::of(&sheet.names[column]);
        let named = name.unit.or_else(|| name::unit(&sheet.units[column]));
        let named = UNITS.iter().find(|(unit, _)| Some(*unit) == named);
        let counts = usual == 1.0 && even.iter().all(|&step| step == 1.0);
        let (unit, why) = match named {
            Some(&(unit, _)) => (unit, "as the file says".to_owned()),
            None if counts && name.is_time() < 2 => {
                ("count", "steps of one: a counter of samples".to_owned())
            }
            None => {
                let likely = UNITS
                    .iter()
                    .find(|(_, second)| PERIODS.contains(&(usual * second)));
                let unit = likely.map_or("s", |&(unit, _)| unit);
                (unit, format!("steps of {}", short(usual)))
            }
        };
        let second = UNITS
            .iter()
            .find(|(word, _)| *word == unit)
            .map(|(_, second)| second);
        Self {
            unit,
            why,
            period: second.map(|second| mean * second),
            gaps: forward.iter().filter(|&&step| step >= GAP * usual).count(),
            repeated: steps.iter().filter(|&&step| step <= 0.0).count(),
        }
    }
}

/// A number to six digits.
fn short(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}
