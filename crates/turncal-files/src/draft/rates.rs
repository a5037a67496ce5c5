//! Chooses the clock of a log by comparing all evidence about the rate: the time stamps in their unit, the stated rate,
//! the rate in the preamble, and the turns in the unit of the gyros.

use super::columns::Columns;
use super::motion::{FOLLOWED, Motion};
use super::name::Name;
use super::raw_samples::RawSamples;
use super::stated::Stated;
use super::time::{Certainty, Clock, PERIODS, STATED};
use super::units::{Quantities, TURNS_TOLD_APART};
use crate::Sheet;
use crate::instrument::{RATE_SIGMA, USUAL_PERIOD, USUAL_SCALE};
use turncal::imu::Sensor;
use turncal::number::rounded;

/// Information about the rate of a log.
pub struct Rates<'a> {
    pub sheet: &'a Sheet,
    pub columns: &'a Columns,
    pub stated: &'a Stated,
    /// Rate stated in the preamble, Hz.
    pub written: Option<f64>,
}

/// The sample period, s, or a usual one if the clock has none.
pub fn period(clock: &Clock) -> f64 {
    clock.period.unwrap_or(USUAL_PERIOD)
}

fn are_near(one: f64, other: f64, factor: f64) -> bool {
    (one / other).ln().abs() < factor.ln()
}

impl Rates<'_> {
    /// The rows to which a clock applies.
    pub fn rows(&self, clock: &Clock) -> Option<RawSamples> {
        let (numbers, triads) = self.columns.samples(self.sheet)?;
        let period = period(clock);
        let breaks = clock.breaks(&numbers, period, FOLLOWED);
        Some(RawSamples::new(triads, breaks, period))
    }

    /// Returns the clock that agrees with most of the information, with a doubt if information in the file was
    /// rejected; `rows` are those to which the given clock applies. Also returns the evidence against information from the user, with this information and the remedy.
    pub fn agreed(&self, clock: Clock, rows: Option<&RawSamples>) -> (Clock, Option<[String; 3]>) {
        let told = clock
            .period
            .zip(rows.and_then(|rows| self.shown(&clock, rows)));
        let contradiction = (self.stated.rate_hz).and_then(|rate| clock.contradiction(rate));
        let Some((period, (shown, is_another_unit))) = told else {
            return match contradiction {
                Some(contradiction) => (clock, Some(contradiction)),
                None => (self.doubted_by_preamble(clock), None),
            };
        };
        let rates = self.stated.rate_hz.into_iter().chain(self.written);
        let mut rates = rates.map(f64::recip);
        if are_near(shown, period, TURNS_TOLD_APART) {
            let off = |of: f64| (shown / of).ln().abs();
            let is_rival = rates.any(|other| off(other) < off(period));
            return match contradiction {
                Some(contradiction) => (clock, Some(contradiction)),
                None => (clock.within(excess(shown / period), is_rival), None),
            };
        }
        let other = rates.find(|&other| are_near(shown, other, TURNS_TOLD_APART));
        if let Some(other) = other {
            let sigma = RATE_SIGMA.hypot(excess(shown / other));
            let clock = clock.given_up(other, sigma, self.stated.rate_hz.is_none());
            return (clock, None);
        }
        let is_usual = |period: &f64| PERIODS.contains(period);
        let is_of_stamps = clock.sigma == 0.0;
        let by_turns = || self.contradicted_by_turns(shown).filter(|_| !is_of_stamps);
        let of_turns = |[found, stated, _]: [String; 3]| {
            let turned = rounded(shown.recip(), 3);
            [
                format!("{found}, and turns that fit the unit of the gyros only at {turned} Hz"),
                stated,
                "Correct --rate, or state the unit of the gyros with --gyro-unit.".to_owned(),
            ]
        };
        match contradiction.map(of_turns).or_else(by_turns) {
            Some(contradiction) => (clock, Some(contradiction)),
            // A unit of the file that another replaces leaves stamps right, but not a rate that nothing confirms.
            None if is_usual(&shown)
                && !(is_of_stamps && (is_another_unit || is_usual(&period))) =>
            {
                (clock.given_up(shown, USUAL_SCALE / 3f64.sqrt(), true), None)
            }
            None => (clock, None),
        }
    }

    /// The period that turns show in the unit of the gyros, s, and whether they fit another unit at the period of the
    /// clock.
    fn shown(&self, clock: &Clock, rows: &RawSamples) -> Option<(f64, bool)> {
        let period = clock.period?;
        let found = |clock: &Clock, motion: &Motion| {
            Quantities::find(self.sheet, self.columns, clock, rows.whole, motion)
        };
        let motion = rows.motion();
        let triad = self.columns.triads.gyro?;
        let named = Name::of_column(&self.sheet.names[triad[0]], &self.sheet.units[triad[0]]).unit;
        let quantities = found(clock, motion);
        let angle = |motion: &Motion| quantities.turned_period(self.stated, named, motion);
        let shown = angle(motion)?;
        let is_another = named.is_some() && quantities.units.get(Sensor::Gyro).is_shown;
        if are_near(shown, period, TURNS_TOLD_APART) {
            return Some((shown, is_another));
        }
        // Windows at rest are as long as the clock makes them.
        let again = self.rows(&clock.clone().given_up(shown, 0.0, false))?;
        Some((angle(again.motion()).unwrap_or(shown), is_another))
    }

    /// A stated rate that turns contradict.
    fn contradicted_by_turns(&self, shown: f64) -> Option<[String; 3]> {
        let (rate, turned) = (self.stated.rate_hz?, rounded(shown.recip(), 3));
        let times = rounded(shown * rate, 3);
        Some([
            format!(
                "turns that fit the unit of the gyros only at {turned} Hz, so that a row lasts {times} times as long"
            ),
            format!("{rate} Hz, as stated"),
            format!("State --rate {turned}, or the unit of the gyros with --gyro-unit."),
        ])
    }

    /// Two rates of the file, of which nothing tells the right one.
    fn doubted_by_preamble(&self, clock: Clock) -> Clock {
        let pair = self.written.zip(clock.period.map(f64::recip));
        let other = pair.filter(|(written, of_stamps)| !are_near(*written, *of_stamps, STATED));
        match other.filter(|_| self.stated.rate_hz.is_none()) {
            None => clock,
            Some((written, of_stamps)) => Clock {
                certainty: Certainty::Guess,
                doubt: Some(format!(
                    "The preamble of the log states {written} Hz and its time stamps {} Hz; no turn shows which of \
                     the two rates is right. turncal used the time stamps. State --rate.",
                    rounded(of_stamps, 4)
                )),
                ..clock
            },
        }
    }
}

/// The size of the error of a rate if turns take this many times the period: what the usual error of a mean scale factor
/// does not explain.
fn excess(longer: f64) -> f64 {
    let unexplained = (longer - 1.0).powi(2) - USUAL_SCALE.powi(2) / 3.0;
    unexplained.max(0.0).sqrt()
}
