//! Calibrates a magnetometer from its own values.

use std::path::Path;

use anyhow::Context;
use clap::error::ErrorKind;

use super::Calibrate;
use super::deliver::{files, read_by};
use turncal::calibration::{Calibration, Method};
use turncal::run::Run;
use turncal_files::{Opened, record_inputs};
use turncal_report::record;

impl Calibrate {
    /// Calibrates a log with a magnetometer alone.
    pub fn magnetometer(&self, opened: &Opened, path: &Path) -> anyhow::Result<()> {
        let run = &opened.run;
        if self.temperature || self.truth.is_some() || self.estimation.method != Method::Ekf {
            let message = "--temperature, --truth and --method apply to gyros and accelerometers, but the log has only a \
                           magnetometer\n";
            clap::Error::raw(ErrorKind::ArgumentConflict, message).exit();
        }
        let mut calibration = of_magnetometer(run)?;
        record_inputs(&mut calibration, [path], run);
        let mut document = record::document(&calibration, &run.recording.name);
        let target = self.default_target(run);
        let read = read_by(Some(opened), target.as_deref(), path);
        let files = files(target.as_deref(), &read, &document);
        document.brief.push(files.into());
        self.deliver(&calibration, &document, (opened, path))
    }
}

/// The calibration of a magnetometer alone.
pub fn of_magnetometer(run: &Run) -> anyhow::Result<Calibration> {
    Calibration::of_magnetometer(run).with_context(|| {
        format!(
            "{}: the values of the magnetometer do not determine an ellipsoid. Turn the sensor about all axes, so that \
             the field points into all directions",
            run.recording.name
        )
    })
}
