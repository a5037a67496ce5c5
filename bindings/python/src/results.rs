//! What is made of calibrations: comparison, export, certificate, navigation.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use turncal::calibration::Named;
use turncal::calibration::result::Calibration as Record;
use turncal::lot::{Lot, Unit};
use turncal::study::navigation::{
    INTERVAL, MethodOutlook, Mission, Motion, NavigationStudyError, Pair,
};
use turncal::units::DEGREE;
use turncal_files::{calibration_json, digest_of_bytes, export as formats, read_laboratory};
use turncal_report::certificate::Certificate;
use turncal_report::certificate::document as of_certificate;
use turncal_report::lot as of_lot;
use turncal_report::navigation::Navigation;

use crate::calibration::Calibration;
use crate::errors::{Given, raise, raised, within};
use crate::report::Report;
use crate::run::{Run, limits};
use crate::wait::finish;

const HOUR: f64 = 3600.0;

#[pyfunction]
pub fn compare(
    names: Vec<String>,
    calibrations: Vec<PyRef<Calibration>>,
    truth: Option<PyRef<Calibration>>,
) -> PyResult<Report> {
    if calibrations.len() < 2 && truth.is_none() {
        return Err(raised(
            "one calibration without a truth cannot be compared. Give a second calibration or a truth",
        ));
    }
    let named = names.into_iter().zip(&calibrations);
    let units = named.map(|(name, of)| Unit::of_record(name, of.record.clone(), None));
    let truth = truth.map(|of| Unit::of_record("truth", of.record.clone(), None));
    let lot = Lot::new(units.collect(), truth, None);
    if let Some((unit, reason)) = lot.failures().next() {
        return Err(raised(format_args!("{}: {reason}", unit.name)));
    }
    Ok(Report(of_lot::document(&lot)))
}

#[pyfunction]
pub fn export(calibration: &Calibration, format: &str, run: Option<&Run>) -> PyResult<Vec<u8>> {
    let names = || formats::FORMATS.iter().map(|format| format.name);
    let format = formats::Format::named(format).ok_or_else(|| {
        let known = names().collect::<Vec<_>>().join(", ");
        raised(format_args!(
            "format: found {format:?}, expected one of {known}"
        ))
    })?;
    let run = run.map(Run::one).transpose()?;
    let exported = formats::write(&calibration.record, format, run).map_err(raise)?;
    Ok(exported.bytes)
}

#[pyfunction]
pub fn certificate(
    calibration: &Calibration,
    laboratory: PathBuf,
    directory: PathBuf,
    specification: Option<PathBuf>,
    as_found: Option<PathBuf>,
) -> PyResult<()> {
    let record = &calibration.record;
    let bytes = calibration_json(record, Path::new("calibration.json")).map_err(raise)?;
    let laboratory = read_laboratory(&laboratory, |key| record.meta.get(key).cloned());
    let laboratory = laboratory.map_err(raise)?;
    let limits = specification.as_deref().map(limits).transpose()?;
    let earlier = as_found
        .as_deref()
        .map(|path| -> PyResult<(String, Record)> {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let digest = digest_of_bytes(&std::fs::read(path)?);
            Ok((
                format!("{name}, SHA-256 {digest}"),
                turncal_files::read_calibration(path).map_err(raise)?,
            ))
        });
    let earlier = earlier.transpose()?;
    let earlier = earlier.as_ref().map(|(name, record)| (&**name, record));
    let digest = digest_of_bytes(&bytes);
    let content = Certificate::new(record.clone(), digest, laboratory, limits.as_ref(), earlier);
    let files = of_certificate::files(&content.map_err(raise)?, bytes).map_err(raise)?;
    std::fs::create_dir_all(&directory)?;
    for (name, bytes) in files {
        std::fs::write(directory.join(name), bytes)?;
    }
    Ok(())
}

#[pyfunction]
pub fn navigate(
    py: Python,
    calibration: &Calibration,
    truth: &Calibration,
    latitude: Given,
    height: Given,
    hours: &Bound<PyAny>,
    trajectory: Option<&str>,
) -> PyResult<Report> {
    let latitude = within("latitude", latitude, -90.0..=90.0)?.map(|of| of * DEGREE);
    let height = within("height", height, -12e3..=1e5)?;
    let hours = within("hours", Some(hours), INTERVAL / HOUR..=1000.0)?.unwrap_or_default();
    let (motion, name) = motion(calibration, latitude, height, trajectory)?;
    let names = ["calibration", "truth"];
    let [own, true_one] = [(names[0], calibration), (names[1], truth)].map(|(name, of)| Named {
        name,
        record: &of.record,
    });
    let (pair, body_frame) = Pair::of_records(own, true_one).map_err(raise)?;
    let mission = Mission {
        motion,
        intervals: (hours * HOUR / INTERVAL).round() as u32,
        interval: INTERVAL,
    };
    let has_terms = |of: &Calibration| !of.record.terms.is_empty();
    let terms = has_terms(calibration) || has_terms(truth);
    let verdict = calibration.record.word();
    let report = finish(py, move || {
        let navigated = MethodOutlook {
            method: "error",
            outlook: mission.navigate(&pair)?,
        };
        let navigation = Navigation {
            calibration: names[0],
            truth: names[1],
            verdict,
            terms,
            body_frame,
            only: None,
            mission: &mission,
            trajectory: name.as_deref(),
            navigated: &navigated,
        };
        Ok::<_, NavigationStudyError>(Report(navigation.document()))
    });
    report?.map_err(raise)
}

/// Along a trajectory, or at rest where it is stated or where the instrument was calibrated.
fn motion(
    calibration: &Calibration,
    latitude: Option<f64>,
    height: Option<f64>,
    trajectory: Option<&str>,
) -> PyResult<(Motion, Option<String>)> {
    if let Some(name) = trajectory {
        let (motion, name) = Motion::along(name, latitude, height).map_err(raise)?;
        return Ok((motion, Some(name)));
    }
    let of_run = calibration.record.provenance.as_ref();
    let latitude = latitude.or(of_run.and_then(|of| Some(of.latitude_deg? * DEGREE)));
    let latitude = latitude.ok_or_else(|| {
        raised(
            "latitude: found none, expected degrees, or a calibration that states its site. Give latitude or \
             trajectory.",
        )
    })?;
    Ok((
        Motion::at_rest(latitude, height.unwrap_or(0.0), [0.0; 3]),
        None,
    ))
}
