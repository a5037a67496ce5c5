//! The clock of a log.

use std::collections::BTreeSet;
use std::path::Path;

use super::columns::Columns;
use super::name::Name;
use crate::Sheet;
use crate::instrument::RATE_SIGMA;
use crate::quantity::units_of_time;
use turncal::number::rounded;
use turncal::statistics::median;
use turncal_logs::clock::Uniform;

/// Plausible sample periods, s (5 kHz to 5 Hz): two units that differ by a factor of 1000 cannot both be plausible.
pub const PERIODS: std::ops::Range<f64> = 2e-4..0.2;
/// Time steps and a stated rate agree if they differ by less than this factor.
pub const STATED: f64 = 1.2;
const DAY: f64 = 86_400.0;
/// Most rows by which a row that comes late is out of order.
const FARTHEST: f64 = 100.0;

/// Certainty of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Certainty {
    /// The value is stated in the log and confirmed by motion, determined by motion alone, or stated by the user.
    Certain,
    /// The value is stated in the log or is typical, but motion does not confirm it.
    Guess,
    /// The value is neither stated nor confirmed.
    Unknown,
}

impl Certainty {
    /// The degree of certainty in one word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Certain => "certain",
            Self::Guess => "guess",
            Self::Unknown => "unknown",
        }
    }
}

/// Clock detected from the time column.
#[derive(Debug, Clone, PartialEq)]
pub struct Clock {
    /// The word or number for the field `time_unit`.
    pub unit: String,
    /// Reason and certainty.
    pub why: String,
    pub certainty: Certainty,
    /// Sample period in s, if known.
    pub period: Option<f64>,
    /// Whether the period is stated in the file and not derived from times.
    pub is_stated: bool,
    /// Number of time steps that are longer than the usual step.
    pub gaps: Vec<Gap>,
    /// Rows at which the clock was restarted.
    pub restarts: Vec<usize>,
    /// Number of steps at which the time does not increase.
    pub repeated: usize,
    /// Mean step of the time column, in its unit.
    pub step: Option<f64>,
    /// Relative 1σ of the period, if it is not determined by time stamps.
    pub sigma: f64,
    /// Reason to doubt the clock.
    pub doubt: Option<String>,
}

impl Clock {
    /// Examines the time column, and drops it if it is a counter shared with other packets.
    pub fn find(sheet: &Sheet, columns: &mut Columns) -> Self {
        let stated = sheet.rate.map(f64::recip);
        let Some((column, stamps)) = columns.time.zip(columns.stamps(sheet)) else {
            return Self::without(stated, "no column increases steadily, as a time does");
        };
        let steps = Steps::of(&stamps);
        let name = Name::of_column(&sheet.names[column], &sheet.units[column]);
        if name.is_counter() && name.is_time() < 2 && !steps.is_count {
            columns.time = None;
            return Self::without(
                stated,
                "a counter shared with other packets cannot serve as a time",
            );
        }
        let second = |word: &str| units_of_time().find(|of| of.0 == word);
        let named = (name.unit).and_then(|unit| Some(unit.times * second(unit.word)?.1));
        let tick = name.tick().map(|tick| tick * steps.mean);
        let known = stated.or(tick.filter(|period| PERIODS.contains(period)));
        // Spreadsheets count days.
        let seconds = || units_of_time().map(|(_, second)| second).chain([DAY]);
        let usual = rounded(steps.mean, 6);
        let mut sigma = 0.0;
        let (second, why) = if columns.nanoseconds.is_some() {
            (Some(1.0), "seconds and nanoseconds".to_owned())
        } else if named.is_some() {
            (named, "stated in the file".to_owned())
        } else if (steps.is_count || name.is_counter()) && name.is_time() < 2 {
            (None, "steps of one, as in a sample counter".to_owned())
        } else if let Some((second, period)) = known.and_then(|period| {
            let is_near = |second: &f64| (steps.mean * second / period).ln().abs() < STATED.ln();
            // Ticks of the log's own clock.
            let own = || steps.is_whole.then(|| period / steps.mean);
            let tick = name.tick().filter(is_near);
            let known = seconds().find(is_near).or(tick);
            sigma = if known.is_some() { 0.0 } else { RATE_SIGMA };
            Some((known.or_else(own)?, period))
        }) {
            let rate = rounded(period.recip(), 6);
            (Some(second), format!("steps of {usual} at {rate} Hz"))
        } else {
            let is_usual = |second: &f64| PERIODS.contains(&(steps.mean * second));
            let likely = seconds().find(is_usual).unwrap_or(1.0);
            (Some(likely), format!("steps of {usual}"))
        };
        let is_open = named.is_none() && known.is_none() && name.is_in_ticks();
        let doubt_of_ticks = is_open.then(|| {
            format!(
                "The length of a tick in the column `{}` is not stated. turncal assumed the most usual one. State --rate.",
                sheet.names[column]
            )
        });
        let word = |second: f64| units_of_time().find(|of| (second / of.1 - 1.0).abs() < 1e-9);
        Self {
            unit: second.map_or("count".to_owned(), |second| match word(second) {
                Some((word, _)) => word.to_owned(),
                None => format!("{:?}", rounded(second, 7)),
            }),
            certainty: match named {
                Some(_) if columns.nanoseconds.is_none() => Certainty::Certain,
                _ => Certainty::Guess,
            },
            why,
            period: second.map(|second| steps.mean * second).or(stated),
            is_stated: second.is_none() && stated.is_some(),
            gaps: steps.gaps,
            restarts: steps.restarts,
            repeated: steps.repeated,
            step: Some(steps.mean),
            sigma: if second.is_none() && stated.is_some() {
                RATE_SIGMA
            } else {
                sigma
            },
            doubt: doubt_of_ticks,
        }
    }

    /// A clock whose rate has this uncertainty, if no time stamps determine the rate or if another rate is possible.
    pub fn within(self, off: f64, has_rival: bool) -> Self {
        let is_doubted = self.sigma > 0.0 || has_rival;
        let sigma = if is_doubted {
            self.sigma.hypot(off)
        } else {
            0.0
        };
        Self { sigma, ..self }
    }

    /// A copy of the clock with this row period and its relative 1σ. The copy contains a doubt, unless the user stated
    /// the rate.
    pub fn given_up(self, period: f64, sigma: f64, is_doubted: bool) -> Self {
        let [rate, former] =
            [Some(period), self.period].map(|of| of.map(|of| rounded(of.recip(), 4)));
        let (rate, former) = (rate.unwrap_or(f64::NAN), former.unwrap_or(f64::NAN));
        let times = self.period.map_or(f64::NAN, |of| rounded(period / of, 4));
        let why = format!(
            "turns fit the unit of the gyros at {rate} Hz, not at {former} Hz ({})",
            self.why
        );
        let tick = self
            .step
            .filter(|_| self.unit != "count")
            .map(|step| rounded(period / step, 7));
        let doubt = format!(
            "The clock of the log is doubtful: the turns fit the unit of the gyros only if a row lasts {times} times \
             as long as at {former} Hz ({}; {}). turncal used {rate} Hz{}. State --rate, or --gyro-unit if the unit is \
             wrong.",
            self.unit,
            self.why,
            tick.map_or(String::new(), |tick| format!(", a tick of {tick:?} s")),
        );
        Self {
            unit: tick.map_or(self.unit, |tick| format!("{tick:?}")),
            certainty: Certainty::Guess,
            why,
            period: Some(period),
            is_stated: tick.is_none(),
            sigma,
            doubt: is_doubted.then_some(doubt),
            ..self
        }
    }

    /// Indices of the samples that follow a gap longer than `seconds`, or a restart of the clock.
    pub fn breaks(&self, rows: &[usize], period: f64, seconds: f64) -> Vec<usize> {
        let long = |gap: &&Gap| gap.missing * period > seconds;
        let gaps = self.gaps.iter().filter(long).map(|gap| gap.before);
        let all: BTreeSet<usize> = gaps.chain(self.restarts.iter().copied()).collect();
        let first = |before: usize| rows.partition_point(|&row| row < before);
        all.into_iter().map(first).collect()
    }

    /// Evidence, stated value and remedy, if the steps of a time column contradict a stated rate.
    pub fn contradiction(&self, rate: f64) -> Option<[String; 3]> {
        let found = self.period?.recip();
        let (hertz, unit, why) = (rounded(found, 6), &self.unit, &self.why);
        ((found / rate).ln().abs() > STATED.ln()).then(|| {
            [
                format!("time stamps at {hertz} Hz ({unit}; {why})"),
                format!("{rate} Hz, as stated"),
                "Correct or omit --rate, or update_rate in --noise-file.".to_owned(),
            ]
        })
    }

    fn without(period: Option<f64>, why: &str) -> Self {
        Self {
            unit: "s".to_owned(),
            why: why.to_owned(),
            certainty: Certainty::Guess,
            period,
            is_stated: period.is_some(),
            gaps: Vec::new(),
            restarts: Vec::new(),
            repeated: 0,
            step: None,
            sigma: period.map_or(0.0, |_| RATE_SIGMA),
            doubt: None,
        }
    }
}

/// A time step that is longer than the usual step.
#[derive(Debug, Clone, PartialEq)]
pub struct Gap {
    /// The row after the step.
    before: usize,
    /// Number of missing rows.
    missing: f64,
}

/// Steps of the times, as interpreted by the reader.
struct Steps {
    /// Mean step per sample, with missing rows counted.
    mean: f64,
    /// Whether steps are whole numbers.
    is_whole: bool,
    /// Whether steps are whole numbers, mostly one.
    is_count: bool,
    gaps: Vec<Gap>,
    pub restarts: Vec<usize>,
    repeated: usize,
}

impl Steps {
    fn of(stamps: &[f64]) -> Self {
        let steps = || stamps.windows(2).map(|pair| pair[1] - pair[0]);
        let mut forward: Vec<f64> = steps().filter(|&step| step > 0.0).collect();
        let is_whole = forward.iter().all(|step| step.fract() == 0.0);
        let repeated = steps().filter(|&step| step <= 0.0).count();
        let usual = median(&mut forward).unwrap_or(1.0);
        // A clock that steps back was restarted or set.
        let goes_on = |time: &mut f64, step: f64| {
            *time += if step < 0.0 { usual } else { step.max(0.0) };
            Some(*time)
        };
        let times = std::iter::once(0.0).chain(steps().scan(0.0, goes_on));
        let rows: Vec<(f64, u64)> = times.zip(1..).collect();
        let clock = || Uniform::new(Path::new(""), &rows, None).ok();
        let clock = (!forward.is_empty()).then(clock).flatten();
        let numbers = clock.as_ref().map_or(&[][..], |clock| &clock.numbers);
        // Rows out of order are close to one another.
        let is_restart = |(_, step): &(usize, f64)| *step < -FARTHEST * usual;
        let gap = |(row, pair): (usize, &[usize])| {
            let missing = pair[1].saturating_sub(pair[0] + 1) as f64;
            (missing > 0.0).then_some(Gap {
                before: row + 1,
                missing,
            })
        };
        Self {
            mean: clock.as_ref().map_or(usual, |clock| clock.period),
            is_count: usual == 1.0 && is_whole,
            is_whole,
            gaps: numbers.windows(2).enumerate().filter_map(gap).collect(),
            restarts: (1..)
                .zip(steps())
                .filter(is_restart)
                .map(|(row, _)| row)
                .collect(),
            repeated,
        }
    }
}
