//! Report on a navigation: errors with predicted σ as a table, as figures against time like Figures 2 to 10 of the
//! paper, per minute as CSV, and per hour as JSON.

mod outlook;
#[cfg(test)]
mod tests;

use crate::prelude::*;
use turncal::attitude::to_pitch_roll_heading;
use turncal::calibration::Word;
use turncal::imu::{BodyFrame, Sensor};
use turncal::study::navigation::{INTERVAL, MethodOutlook, Mission, Motion, Outlook, Quantity};

pub use outlook::{Flown, add_missions};
pub use outlook::{add, line};

/// Hours over which the paper states the position drift.
const PAPER_HOURS: f64 = 40.0;

/// A navigation with its input.
#[derive(Debug, Clone, Copy)]
pub struct Navigation<'a> {
    /// Name of the calibration.
    pub calibration: &'a str,
    /// Name of the truth.
    pub truth: &'a str,
    /// Verdict of the calibration; `None` if it was not estimated.
    pub verdict: Option<Word>,
    /// Whether the calibration or the truth has error terms in addition to K, E and D; navigation does not use error
    /// terms.
    pub terms: bool,
    /// Definition of the body axes.
    pub body_frame: BodyFrame,
    /// The triad whose errors were included; `None` for both.
    pub only: Option<Sensor>,
    /// Motion of the body and its duration.
    pub mission: &'a Mission,
    /// Name of the trajectory, if the body moved.
    pub trajectory: Option<&'a str>,
    /// The errors.
    pub navigated: &'a MethodOutlook,
}

impl Navigation<'_> {
    /// The complete report on the navigation.
    pub fn document(&self) -> Document {
        let (calibration, truth) = (self.calibration, self.truth);
        let title = format!("Navigation error of {calibration} against {truth}");
        let mut document = Document::new(title);
        document.warnings.items = self.warnings();
        document.both(self.facts());
        document.both(self.table());
        document.pages(self.figures());
        document.files = vec![("navigation.csv".to_owned(), self.csv())];
        document.data = self.data();
        document
    }

    fn hours(&self) -> f64 {
        f64::from(self.mission.intervals) * INTERVAL / HOUR
    }

    fn facts(&self) -> Facts {
        let degrees = |angle: f64| value(angle / DEGREE, 0.01);
        let motion = match &self.mission.motion {
            Motion::Standing(at) => {
                let [pitch, roll, heading] = to_pitch_roll_heading(&at.attitude).map(degrees);
                format!(
                    "stationary at latitude {}°, height {} m; pitch {pitch}°, roll {roll}°, heading {heading}°",
                    degrees(at.latitude),
                    value(at.height, 10.0),
                )
            }
            Motion::Moving(trajectory) => format!(
                "{} from latitude {}°, height {} m",
                self.trajectory.unwrap_or("a trajectory"),
                degrees(trajectory.start().latitude),
                value(trajectory.start().height, 10.0),
            ),
        };
        let errors = match self.only {
            None => "of gyros and accelerometers",
            Some(Sensor::Gyro) => "of the gyros; the accelerometers are exact",
            Some(Sensor::Accel) => "of the accelerometers; the gyros are exact",
        };
        let start = "perfect alignment, velocity and position; height fixed to the true value";
        let rows = [
            ("motion", motion),
            ("duration", format!("{} h", three_digits(self.hours()))),
            ("errors", errors.to_owned()),
            ("body frame", self.body_frame.words().to_owned()),
            ("start", start.to_owned()),
        ];
        let verdict = self
            .verdict
            .map(|word| ("verdict of the calibration", word.to_string()));
        Facts::new("The navigation", rows.into_iter().chain(verdict))
    }

    fn warnings(&self) -> Vec<String> {
        let name = self.calibration;
        let mut warnings = Vec::new();
        if self.verdict == Some(Word::Failed) {
            warnings.push(format!(
                "The verdict of {name} is FAILED: do not use its values or σ."
            ));
        }
        if self.navigated.outlook.iter().any(|m| m.sigma.is_none()) {
            warnings.push(format!(
                "{name} states no σ, so turncal cannot predict the σ of the navigation errors."
            ));
        }
        if self.terms {
            let text = "Only errors of K, E and D are included; all other error terms are assumed to be exact.";
            warnings.push(text.to_owned());
        }
        warnings
    }

    /// Position error at the end divided by time, nmile/h.
    fn drift(&self) -> Option<f64> {
        let last = self
            .navigated
            .outlook
            .last()
            .filter(|last| last.time > 0.0)?;
        let [.., horizontal] = Quantity::ALL;
        Some(horizontal.error(last)? / (last.time / HOUR))
    }

    fn table(&self) -> Table {
        let table = outlook::table("Errors", std::slice::from_ref(self.navigated));
        match self.drift() {
            None => table,
            Some(drift) => table.note(format!(
                "A drift of {} nmile/{PAPER_HOURS} h.",
                three_digits(drift * PAPER_HOURS)
            )),
        }
    }

    /// Attitude, velocity and position against time with their predicted σ as a band.
    fn figures(&self) -> [Plot; 3] {
        let horizontal =
            " Horizontal: magnitude of the east and north components, with its predicted RMS.";
        let figures = [
            ("attitude.svg", "Attitude error", ""),
            ("velocity.svg", "Velocity error", horizontal),
            ("position.svg", "Position error", horizontal),
        ];
        let mut quantities = Quantity::ALL.chunks(3);
        figures.map(|(file, heading, more)| {
            let quantities = quantities.next().unwrap_or_default().iter();
            let navigated = std::slice::from_ref(self.navigated);
            let panels = quantities.map(|of| outlook::panel(*of, navigated));
            Plot::new(file, heading, (1, 210), panels).caption(format!(
                "Computed minus true. Line: actual error from full navigation; band: ±1σ predicted from the \
                 covariance of the calibration with the linear model. At any given time, about two calibrations in \
                 three have errors within the band.{more}"
            ))
        })
    }

    /// One row per minute: time, errors, and predicted σ if available.
    fn csv(&self) -> String {
        let moments = &self.navigated.outlook;
        let keys = Quantity::ALL.map(|quantity| quantity.key.to_owned());
        let mut heading = [&["t_h".to_owned()][..], &keys].concat();
        if moments.iter().all(|moment| moment.sigma.is_some()) {
            heading.extend(keys.map(|key| format!("sigma_{key}")));
        }
        heading.extend(self.verdict.map(Word::column));
        let row = |moment: &Outlook| {
            let errors = Quantity::ALL.map(|of| of.error(moment));
            let sigmas = Quantity::ALL.map(|of| of.sigma(moment));
            let numbers = errors.into_iter().chain(sigmas).flatten();
            let numbers = numbers.map(|number| format!("{number:e}"));
            let time = (moment.time / HOUR).to_string();
            let verdict = self.verdict.map(|_| "1".to_owned());
            let cells = std::iter::once(time).chain(numbers).chain(verdict);
            cells.collect::<Vec<_>>()
        };
        let rows = std::iter::once(heading).chain(moments.iter().map(row));
        rows.map(|row| row.join(",") + "\n").collect()
    }

    fn data(&self) -> Value {
        let moments = || self.navigated.outlook.iter();
        let hourly = || moments().filter(|moment| moment.time % HOUR == 0.0);
        let (latitude, height, attitude) = match &self.mission.motion {
            Motion::Standing(at) => (
                at.latitude,
                at.height,
                Some(to_pitch_roll_heading(&at.attitude)),
            ),
            Motion::Moving(path) => (path.start().latitude, path.start().height, None),
        };
        json!({
            "calibration": self.calibration,
            "calibration_verdict": self.verdict,
            "truth": self.truth,
            "body_frame": self.body_frame,
            "errors": self.only.map_or("both", |sensor| sensor.name()),
            "trajectory": self.trajectory,
            "latitude_deg": latitude / DEGREE,
            "height_m": height,
            "attitude_deg": attitude.map(|angles| angles.map(|angle| angle / DEGREE)),
            "hours": self.hours(),
            "series": hourly().map(at).collect::<Value>(),
            "max_abs": largest(hourly()),
            "max_abs_by_minute": largest(moments()),
            "final": moments().last().map(at),
            "drift_nmile_per_h": self.drift(),
            "drift_nmile_per_40_h": self.drift().map(|drift| drift * PAPER_HOURS),
        })
    }
}

/// One number for each quantity, under its key.
fn by_key(of: impl Fn(Quantity) -> Option<f64>) -> Map<String, Value> {
    let all = Quantity::ALL.into_iter();
    all.map(|quantity| (quantity.key.to_owned(), of(quantity).into()))
        .collect()
}

/// Errors and their predicted σ at one time.
fn at(moment: &Outlook) -> Value {
    let mut row = Map::from_iter([("t_h".to_owned(), (moment.time / HOUR).into())]);
    row.extend(by_key(|quantity| quantity.error(moment)));
    let sigma = moment
        .sigma
        .map(|_| by_key(|quantity| quantity.sigma(moment)));
    row.insert("sigma".to_owned(), sigma.into());
    row.into()
}

fn largest<'m>(moments: impl Iterator<Item = &'m Outlook> + Clone) -> Value {
    let of = |quantity: Quantity| {
        let errors = moments.clone().filter_map(|m| quantity.error(m));
        Some(errors.map(f64::abs).fold(0.0, f64::max))
    };
    by_key(of).into()
}
