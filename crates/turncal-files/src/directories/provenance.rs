//! Input files in the provenance of a calibration.

use std::path::{Path, PathBuf};

use super::digest::input_digests;
use crate::is_toml;
use turncal::calibration::Calibration;
use turncal::calibration::result::InputFile;
use turncal::run::Run;

/// Records the inputs of a calibration with their digests: the files named in a run.toml or campaign.toml, or every
/// log.
pub fn record_inputs<'a>(
    calibration: &mut Calibration,
    paths: impl IntoIterator<Item = &'a Path>,
    run: &'a Run,
) {
    let paths: Vec<&Path> = paths.into_iter().collect();
    let are_logs = !paths.iter().any(|path| is_toml(path));
    // No run.toml names the second file of a log.
    let others = run.recording.files.iter().skip(1).filter(|_| are_logs);
    let files = paths.into_iter().chain(others.map(PathBuf::as_path));
    let digests = files.flat_map(input_digests);
    if let Some(provenance) = &mut calibration.provenance {
        let inputs = digests.map(|(name, sha256)| InputFile { name, sha256 });
        provenance.inputs = inputs.collect();
    }
}
