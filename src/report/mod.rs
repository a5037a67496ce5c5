//! The report: one page that needs nothing else, and every figure as a file of its own.
//!
//! Nothing is estimated here. The report draws and lays out what it is given; what it works out is
//! what showing needs (differences, units, extremes).

pub mod accuracy;
pub mod allan;
mod axis;
mod blocks;
mod canvas;
pub mod check;
mod comparison;
pub mod conversion;
mod correlation;
mod estimates;
pub mod experiment;
mod facts;
mod further;
pub mod group;
mod innovations;
pub mod navigation;
mod number;
mod page;
mod panel;
mod path;
mod quality;
pub mod side_by_side;
mod sigma;
mod study;
#[cfg(test)]
mod synthetic;
pub mod table1;
mod tables;
mod terminal;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::{fs, io};

use crate::calibration::{Estimate, Outcome, to_vector};
use crate::calibration::ParameterVector;
use crate::calibration::{ErrorTermTest, Finding, Quality};
use crate::imu::{PerSensor, Triad};
use crate::recording::TableLog;
use crate::run::{Aiding, Run};
use crate::calibration::result::TermRecord;
use crate::imu::BodyFrame;
use crate::study::navigation::{NavigationStudyError, Outlook};

/// What a report is made of. Every estimate and the truth have the same installation form and the
/// same body frame.
#[derive(Debug, Clone, Copy)]
pub struct Report<'a> {
    /// Heading of the page.
    pub title: &'a str,
    /// The record.
    pub run: &'a Run,
    /// What was observed at rest.
    pub aiding: Aiding,
    /// What fixes the body axes.
    pub body_frame: BodyFrame,
    /// The filter's result, if it ran.
    pub outcome: Option<&'a Outcome>,
    /// What blocks of states did to it, or would do.
    pub effects: &'a [ErrorTermTest],
    /// The closed form's result, if there is one.
    pub closed_form: Option<ClosedForm<'a>>,
    /// The true triads, where they are known.
    pub truth: Option<&'a PerSensor<Triad>>,
    /// True constants beside them by name, as far as they are known.
    pub true_terms: &'a BTreeMap<String, TermRecord>,
    /// What the calibration leaves of gravity and turns.
    pub quality: Option<&'a Quality>,
    /// Intervals during which the table stands, s.
    pub dwells: &'a [Range<f64>],
    /// What the calibrations are worth in navigation, the closed form first; or why that cannot be
    /// said of the run's site.
    pub navigation: Result<&'a [Navigated], &'a NavigationStudyError>,
}

/// The navigation errors that one method's calibration leads to, standing level at the run's site.
#[derive(Debug, Clone, PartialEq)]
pub struct Navigated {
    /// `EKF` or `closed form`.
    pub method: &'static str,
    /// The errors, as far as they are known.
    pub outlook: Vec<Outlook>,
}

/// The closed form's result, the baseline of the comparison.
#[derive(Debug, Clone, Copy)]
pub struct ClosedForm<'a> {
    /// Its estimate with the σ it claims.
    pub estimate: &'a Estimate,
    /// What it was made of, such as `six positions, 60 min of its own`.
    pub note: &'a str,
    /// What must be known before using it.
    pub findings: &'a [Finding],
}

/// A report that could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A file could not be written.
    #[error("cannot write {path}: {source}; the directory must exist and be writable", path = path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A figure could not be drawn.
    #[error("cannot draw the figure {figure}: {reason}")]
    Draw {
        /// The figure's file name.
        figure: &'static str,
        /// What the drawing library said.
        reason: String,
    },
}

/// One figure of the report.
struct Figure {
    /// Name of its file.
    file: &'static str,
    /// Its heading.
    title: &'static str,
    /// One or two sentences: how to read it.
    caption: String,
    /// The SVG document.
    svg: String,
}

impl Report<'_> {
    /// The table's readings, where they were observed.
    fn table(&self) -> Option<&TableLog> {
        self.run.observed_table(self.aiding)
    }

    /// Writes `index.html` and one SVG file for each figure into an existing directory. The page
    /// holds the figures, too, and needs neither the files nor a network.
    pub fn write(&self, directory: &Path) -> Result<(), ReportError> {
        let figures = self.figures()?;
        write_files(directory, &page::page(self, &figures), &figures)
    }

    fn figures(&self) -> Result<Vec<Figure>, ReportError> {
        let mut figures = Vec::new();
        figures.extend(navigation::outlook::figure(
            self.navigation.unwrap_or_default(),
        )?);
        figures.extend(comparison::figure(self)?);
        if let Some(outcome) = self.outcome {
            figures.extend(sigma::figure(self, outcome)?);
            figures.extend(estimates::figure(self, outcome)?);
            figures.extend(innovations::figure(self, outcome)?);
        }
        figures.push(path::figure(self)?);
        if let Some(estimate) = self.estimate() {
            figures.extend(correlation::figure(estimate)?);
        }
        Ok(figures)
    }

    /// The estimate that the report is about.
    fn estimate(&self) -> Option<&Estimate> {
        self.outcome
            .map(|outcome| &outcome.estimate)
            .or(self.closed_form.map(|closed| closed.estimate))
    }

    fn truth_vector(&self) -> Option<ParameterVector> {
        self.truth.map(to_vector)
    }

    /// Begin and end of the record, s.
    fn time_span(&self) -> (f64, f64) {
        let imu = &self.run.recording.imu;
        (imu.start(), imu.start() + imu.duration())
    }

    /// Both methods that ran, the closed form first.
    fn methods(&self) -> Vec<(&'static str, &Estimate)> {
        let closed = self
            .closed_form
            .map(|closed| ("closed form", closed.estimate));
        let filter = self.outcome.map(|outcome| ("EKF", &outcome.estimate));
        closed.into_iter().chain(filter).collect()
    }
}

/// Writes a page as `index.html` and its figures into an existing directory.
fn write_files(directory: &Path, page: &str, figures: &[Figure]) -> Result<(), ReportError> {
    let figures = figures.iter().map(|f| (f.file, f.svg.as_str()));
    for (name, text) in figures.chain([("index.html", page)]) {
        let path = directory.join(name);
        fs::write(&path, text).map_err(|source| ReportError::Write { path, source })?;
    }
    Ok(())
}

impl Figure {
    fn draw(
        file: &'static str,
        title: &'static str,
        caption: String,
        size: (u32, u32),
        content: impl FnOnce(&canvas::Area) -> Result<(), canvas::DrawError>,
    ) -> Result<Self, ReportError> {
        let svg = canvas::svg(size, content).map_err(|error| ReportError::Draw {
            figure: file,
            reason: error.to_string(),
        })?;
        Ok(Self {
            file,
            title,
            caption,
            svg,
        })
    }
}
