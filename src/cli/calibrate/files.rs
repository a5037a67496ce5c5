//! Files of a calibration, the same for a single run and a lot.

use std::path::Path;

use anyhow::{Context, bail};
use turncal::calibration::Calibration;
use turncal::calibration::result::InputFile;
use turncal::formats::input_digests;
use turncal::imu::BodyFrame;
use turncal::report::Document;
use turncal::report::calibration::Truth;
use turncal::run::Run;

/// Records the files of a calibration of a run.toml, a log or a campaign.toml.
pub fn stamp_files(calibration: &mut Calibration, path: &Path, run: &Run) {
    stamp(calibration, path);
    let is_log = path.extension().is_none_or(|end| end != "toml");
    // No run.toml names the second file of a log.
    for file in run.recording.files.iter().skip(1).filter(|_| is_log) {
        add(calibration, file);
    }
}

/// Records the input files in a calibration.
pub fn stamp(calibration: &mut Calibration, path: &Path) {
    if let Some(provenance) = &mut calibration.provenance {
        provenance.inputs.clear();
    }
    add(calibration, path);
}

fn add(calibration: &mut Calibration, path: &Path) {
    if let Some(provenance) = &mut calibration.provenance {
        let inputs = input_digests(path).into_iter();
        let inputs = inputs.map(|(name, sha256)| InputFile { name, sha256 });
        provenance.inputs.extend(inputs);
    }
}

/// Writes a report into a new directory.
pub fn write_report(document: &Document, directory: &Path) -> anyhow::Result<()> {
    std::fs::create_dir(directory)
        .with_context(|| format!("cannot create {}", directory.display()))?;
    Ok(turncal::report::write(document, directory)?)
}

/// Reads the truth of a run.
pub fn read_truth(path: &Path, run: &Run, body_frame: BodyFrame) -> anyhow::Result<Truth> {
    let record = Calibration::read(path)?;
    if let Some(unit) = &record.unit
        && *unit != run.instrument.unit
    {
        bail!(
            "{}: units are {} and {}, but those of the run are {} and {}. Give the truth of this run",
            path.display(),
            unit.gyro,
            unit.accel,
            run.instrument.unit.gyro,
            run.instrument.unit.accel
        );
    }
    Ok(Truth::new(record, run, body_frame))
}
