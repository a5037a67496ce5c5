//! The clock of a log.

use super::columns::Columns;
use super::name;
use super::name::Name;
use crate::formats::Sheet;
use crate::statistics::median;

/// Units of time in s, with the words that `run.toml` has for them.
const UNITS: [(&str, f64); 4] = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];
/// No unit of three orders is right at two of these periods, s: 5 kHz to 5 Hz.
pub(super) const PERIODS: std::ops::Range<f64> = 2e-4..0.2;
/// A step this much longer than the usual one is a gap.
const GAP: f64 = 1.5;
/// Steps within this factor are those of a stated rate.
const STATED: f64 = 1.2;

/// What the column of time shows.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Clock {
    /// The word for `time_unit`.
    pub unit: &'static str,
    /// Why it is that.
    pub why: String,
    /// Time from row to row in s, if something tells it.
    pub period: Option<f64>,
    /// Whether that is what the file states, which its times do not tell.
    pub is_stated: bool,
    /// Steps longer than the usual one.
    pub gaps: Vec<Gap>,
    /// Steps that do not go forward.
    pub repeated: usize,
}

impl Clock {
    /// Looks at the column of time, or takes another or none where `run.toml` has no word for its unit.
    pub fn find(sheet: &Sheet, columns: &mut Columns) -> Self {
        let Some((column, stamps)) = columns.time.zip(columns.stamps(sheet)) else {
            let period = sheet.rate.map(f64::recip);
            return Self::without(period, "no column goes forward like a time");
        };
        let steps = Steps::of(&stamps);
        let name = Name::of(&sheet.names[column]);
        if name.is_counter() && name.is_time() < 2 && steps.usual != 1.0 {
            let period = sheet.rate.map(f64::recip);
            columns.time = None;
            return Self::without(period, "a counter that other packets share is no time");
        }
        let named = name.unit.or_else(|| name::unit(&sheet.units[column]));
        let named = UNITS.iter().find(|(unit, _)| Some(*unit) == named);
        let stated = sheet.rate.map(f64::recip);
        let known = stated.or(name.tick().map(|tick| tick * steps.mean));
        let near = |period: f64| {
            move |second: f64| (steps.usual * second / period).ln().abs() < STATED.ln()
        };
        let (unit, why) = match (named, known) {
            _ if columns.nanoseconds.is_some() => ("s", "seconds and nanoseconds".to_owned()),
            (Some(&(unit, _)), _) => (unit, "as the file says".to_owned()),
            _ if (steps.is_count || name.is_counter()) && name.is_time() < 2 => {
                ("count", "steps of one: a counter of samples".to_owned())
            }
            (None, Some(period)) => {
                let fits = near(period);
                let Some(&(unit, _)) = UNITS.iter().find(|unit| fits(unit.1)) else {
                    return Self::of_counter(sheet, columns, period);
                };
                let rate = short(period.recip());
                (
                    unit,
                    format!("steps of {} at {rate} Hz", short(steps.usual)),
                )
            }
            (None, None) => {
                let likely = UNITS
                    .iter()
                    .find(|(_, second)| PERIODS.contains(&(steps.usual * second)));
                let unit = likely.map_or("s", |&(unit, _)| unit);
                (unit, format!("steps of {}", short(steps.usual)))
            }
        };
        let second = UNITS.iter().find(|(word, _)| *word == unit);
        Self {
            unit,
            why,
            period: second.map(|(_, second)| steps.mean * second).or(stated),
            is_stated: second.is_none() && stated.is_some(),
            gaps: steps.gaps,
            repeated: steps.repeated,
        }
    }

    /// Which of the samples of some rows, with this period, come after a gap of so many seconds.
    pub fn breaks(&self, rows: &[usize], period: f64, seconds: f64) -> Vec<usize> {
        let long = |gap: &&Gap| gap.missing * period > seconds;
        let first = |gap: &Gap| rows.partition_point(|&row| row < gap.before);
        self.gaps.iter().filter(long).map(first).collect()
    }

    /// By a counter of rows of this period, in s; without one rows follow one another.
    fn of_counter(sheet: &Sheet, columns: &mut Columns, period: f64) -> Self {
        let time = columns.time;
        columns.time = columns.counter.filter(|counter| {
            Some(*counter) != time && Steps::of(&sheet.columns[*counter]).is_count
        });
        let unit = "no unit of time here is that of the file's";
        let Some(stamps) = columns.stamps(sheet) else {
            return Self::without(Some(period), unit);
        };
        let Steps { gaps, repeated, .. } = Steps::of(&stamps);
        Self {
            unit: "count",
            why: format!("{unit} times, but rows are counted"),
            period: Some(period),
            is_stated: true,
            gaps,
            repeated,
        }
    }

    fn without(period: Option<f64>, why: &str) -> Self {
        Self {
            unit: "s",
            why: why.to_owned(),
            period,
            is_stated: period.is_some(),
            gaps: Vec::new(),
            repeated: 0,
        }
    }
}

/// A step longer than the usual one.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Gap {
    /// The row after it.
    before: usize,
    /// The rows that are missing.
    missing: f64,
}

/// How times go on.
struct Steps {
    usual: f64,
    /// Of those that are no gap.
    mean: f64,
    /// Whether those are all one.
    is_count: bool,
    gaps: Vec<Gap>,
    repeated: usize,
}

impl Steps {
    fn of(stamps: &[f64]) -> Self {
        let steps = || {
            let steps = stamps.windows(2).map(|pair| pair[1] - pair[0]);
            steps.filter(|step| step.is_finite())
        };
        let mut forward: Vec<f64> = steps().filter(|&step| step > 0.0).collect();
        let usual = median(&mut forward).unwrap_or(1.0);
        // Rounding of printed stamps averages out over the steps without gaps.
        let even: Vec<f64> = forward
            .iter()
            .copied()
            .filter(|&step| step < GAP * usual)
            .collect();
        let gap = |before: usize| {
            let step = stamps[before] - stamps[before - 1];
            let missing = step / usual - 1.0;
            (step >= GAP * usual).then_some(Gap { before, missing })
        };
        Self {
            usual,
            mean: even.iter().sum::<f64>() / even.len().max(1) as f64,
            is_count: usual == 1.0 && even.iter().all(|&step| step == 1.0),
            gaps: (1..stamps.len()).filter_map(gap).collect(),
            repeated: steps().filter(|&step| step <= 0.0).count(),
        }
    }
}

/// A number to six digits.
fn short(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}
