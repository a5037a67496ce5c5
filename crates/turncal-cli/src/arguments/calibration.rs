//! A calibration whose values are used by a command.

use std::path::Path;

use anyhow::{Context, bail};

use turncal::calibration::result::Calibration;
use turncal::calibration::{CorrectionError, Finding, Level};
use turncal_report::terminal::printable;

/// The calibration read from this file, for a command that needs gyros and accelerometers.
pub fn of_triads(record: Calibration, path: &Path) -> anyhow::Result<Calibration> {
    if record.is_of_magnetometer() {
        return Err(CorrectionError::MagnetometerAlone).with_context(|| path.display().to_string());
    }
    Ok(record)
}

/// Reads a calibration; if a temperature in °C is given, evaluates the calibration at this temperature. Refuses a
/// calibration whose verdict is FAILED; with `force`, warns on standard error instead.
pub fn usable(path: &Path, temperature: Option<f64>, force: bool) -> anyhow::Result<Calibration> {
    let record = turncal_files::read_calibration(path)?;
    if record.is_failed() {
        let name = printable(&path.display().to_string());
        let cause = printable(&cause(&record));
        if !force {
            bail!(
                "{name}: the verdict is FAILED ({cause}), so its values must not be used. Calibrate again, or add \
                 --force to use the values anyway"
            );
        }
        tell!("warning: {name}: the verdict is FAILED ({cause}); do not use these values");
    }
    match temperature {
        Some(temperature) => {
            let there = record.at_temperature(temperature);
            there.with_context(|| path.display().to_string())
        }
        None => Ok(record),
    }
}

/// The first finding that makes a calibration fail.
fn cause(record: &Calibration) -> String {
    let mut findings = record.findings.iter();
    match findings.find(|finding| finding.level() == Level::Failed) {
        Some(finding @ Finding { code, .. }) => format!("{code}: {}", finding.headline().0),
        None => "it did not converge".to_owned(),
    }
}
