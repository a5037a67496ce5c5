//! The report of a navigation: one table for terminal and page, figures against time in the manner of
//! the paper's Figures 2 to 10, the errors minute by minute as CSV, and one JSON document.

mod document;
mod figures;
pub(super) mod outlook;
mod quantity;
#[cfg(test)]
mod tests;

use std::fmt::Write;
use std::path::Path;

use maud::html;
use serde::Serialize;

use super::page::{document as html_document, drawn};
use super::side_by_side::Table;
use super::{ReportError, facts, number, terminal, write_files};
use crate::attitude::to_pitch_roll_heading;
use crate::imu::Sensor;
use crate::imu::BodyFrame;
use crate::study::navigation::{INTERVAL, Mission, Epoch, Motion};
use crate::units::{DEGREE, NAUTICAL_MILE};
use quantity::Quantity;

const HOUR: f64 = 3600.0;
/// Hours over which the paper gives the drift of position.
const PAPER_HOURS: f64 = 40.0;
const NONE: &str = "–";

/// A navigation with what it was made of.
#[derive(Debug, Clone, Copy)]
pub struct Navigation<'a> {
    /// Name of the calibration.
    pub calibration: &'a str,
    /// Name of the truth.
    pub truth: &'a str,
    /// False if the calibration says that its method did not converge.
    pub converged: bool,
    /// Whether one of the two has further terms, which are not navigated.
    pub terms: bool,
    /// What fixes the body axes.
    pub body_frame: BodyFrame,
    /// The triad whose errors were navigated with; none: both.
    pub only: Option<Sensor>,
    /// How the body moved, and how long.
    pub mission: &'a Mission,
    /// Name of the trajectory, if it moved.
    pub trajectory: Option<&'a str>,
    /// The errors.
    pub moments: &'a [Epoch],
}

impl Navigation<'_> {
    /// The navigation as text.
    pub fn summary(&self) -> String {
        let mut text = format!("{}\n{}", self.title(), terminal::facts(&self.facts()));
        for warning in self.warnings() {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "\nWarning: {warning}");
        }
        let _ = write!(text, "\n{}", terminal::columns(&self.table()));
        text
    }

    /// The errors hour by hour, and their extremes, as one JSON document.
    pub fn document(&self) -> impl Serialize {
        document::document(self)
    }

    /// Writes `navigation.csv`, `index.html`, which needs nothing else, and every figure as an SVG file
    /// of its own into an existing directory.
    ///
    /// # Errors
    /// [`ReportError`] if a figure cannot be drawn or a file not be written.
    pub fn write(&self, directory: &Path) -> Result<(), ReportError> {
        let figures = figures::figures(&[figures::Side {
            name: "error",
            moments: self.moments,
        }])?;
        let path = directory.join("navigation.csv");
        std::fs::write(&path, self.csv()).map_err(|source| ReportError::Write { path, source })?;
        let title = self.title();
        let body = html! {
            header { h1 { (title) } }
            @for warning in self.warnings() { p.warnings { (warning) } }
            (super::tables::section(&self.table()))
            @for figure in &figures { (drawn(figure)) }
            section { h2 { "The navigation" } (facts::facts(&self.facts())) }
        };
        write_files(directory, &html_document(&title, &body), &figures)
    }

    fn title(&self) -> String {
        format!(
            "Navigation error of {} against {}",
            self.calibration, self.truth
        )
    }

    fn hours(&self) -> f64 {
        f64::from(self.mission.intervals) * INTERVAL / HOUR
    }

    fn facts(&self) -> Vec<(String, String)> {
        let degrees = |angle: f64| number::value(angle / DEGREE, 0.01);
        let motion = match &self.mission.motion {
            Motion::Standing(at) => {
                let [pitch, roll, heading] = to_pitch_roll_heading(&at.attitude).map(degrees);
                format!(
                    "standing at latitude {}°, height {} m; pitch {pitch}°, roll {roll}°, heading \
                     {heading}°",
                    degrees(at.latitude),
                    number::value(at.height, 10.0),
                )
            }
            Motion::Moving(trajectory) => format!(
                "{} from latitude {}°, height {} m",
                self.trajectory.unwrap_or("a trajectory"),
                degrees(trajectory.start().latitude),
                number::value(trajectory.start().height, 10.0),
            ),
        };
        let errors = match self.only {
            None => "of gyros and accelerometers",
            Some(Sensor::Gyro) => "of the gyros; the accelerometers are exact",
            Some(Sensor::Accel) => "of the accelerometers; the gyros are exact",
        };
        let hours = number::three_digits(self.hours());
        [
            ("motion", motion),
            ("duration", format!("{hours} h")),
            ("errors", errors.to_owned()),
            ("body frame", self.body_frame.words().to_owned()),
            (
                "start",
                "perfect alignment, velocity and position; height is held to the true one"
                    .to_owned(),
            ),
        ]
        .map(|(name, value)| (name.to_owned(), value))
        .to_vec()
    }

    fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if !self.converged {
            warnings.push(format!(
                "{} did not converge: its σ mean nothing.",
                self.calibration
            ));
        }
        if self.moments.iter().any(|m| m.covariance.is_none()) {
            warnings.push(format!(
                "{} claims no σ, so none is predicted.",
                self.calibration
            ));
        }
        if self.terms {
            warnings.push(
                "Auxiliary error terms are taken for exact: these are the errors that K, E and D leave."
                    .to_owned(),
            );
        }
        warnings
    }

    fn table(&self) -> Table {
        let headings = [
            "",
            "unit",
            "largest",
            "after h",
            "at the end",
            "σ",
            "error/σ",
        ];
        let rows = Quantity::ALL.map(|quantity| self.row(quantity));
        let [attitude, velocity, position] = [0..3, 3..6, 6..9].map(|r| rows[r].to_vec());
        let mut notes = vec![
            "Computed less true. σ: of the error at the end, predicted from the calibration's \
             covariance; of horizontal errors the root of the mean square."
                .to_owned(),
        ];
        if let Some(last) = self.moments.last().filter(|last| last.time > 0.0) {
            let end = last.error.horizontal_position() / NAUTICAL_MILE;
            let drift = end / (last.time / HOUR);
            notes.push(format!(
                "Position at the end over the time: {} nmile/h, {} nmile/{PAPER_HOURS} h.",
                number::three_digits(drift),
                number::three_digits(drift * PAPER_HOURS),
            ));
        }
        Table {
            title: "Errors",
            headings: headings.map(str::to_owned).to_vec(),
            sections: vec![attitude, velocity, position],
            notes,
        }
    }

    fn row(&self, quantity: Quantity) -> Vec<String> {
        let error = |moment: &Epoch| quantity.error(&moment.error);
        let size = |m: &&Epoch| error(m).abs();
        let largest = self
            .moments
            .iter()
            .max_by(|a, b| size(a).total_cmp(&size(b)));
        let last = self.moments.last();
        let sigma = last.and_then(|m| quantity.sigma(m)).filter(|s| *s > 0.0);
        let shown =
            |m: Option<&Epoch>| m.map_or(NONE.to_owned(), |m| number::three_digits(error(m)));
        let ratio = last.zip(sigma).filter(|_| quantity.is_component());
        vec![
            quantity.name().to_owned(),
            quantity.unit().to_owned(),
            shown(largest),
            largest.map_or(NONE.to_owned(), |m| number::value(m.time / HOUR, 1.0)),
            shown(last),
            sigma.map_or(NONE.to_owned(), number::three_digits),
            ratio.map_or(NONE.to_owned(), |(m, s)| number::value(error(m) / s, 1.0)),
        ]
    }

    /// A row a minute: time, errors, predicted σ where there is one.
    fn csv(&self) -> String {
        let with_sigma = self.moments.iter().all(|m| m.covariance.is_some());
        let keys = Quantity::ALL.map(Quantity::key);
        let mut text = format!("t_h,{}", keys.join(","));
        if with_sigma {
            text.extend(keys.iter().map(|key| format!(",sigma_{key}")));
        }
        text.push('\n');
        for moment in self.moments {
            let _ = write!(text, "{}", moment.time / HOUR);
            let errors = Quantity::ALL.map(|q| Some(q.error(&moment.error)));
            let sigmas = Quantity::ALL.map(|q| q.sigma(moment));
            for value in errors.into_iter().chain(sigmas).flatten() {
                let _ = write!(text, ",{value:e}");
            }
            text.push('\n');
        }
        text
    }
}
