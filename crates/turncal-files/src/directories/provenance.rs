//! Input files in the provenance of a calibration.

use std::path::{Path, PathBuf};

use super::digest::input_digests;
use turncal::calibration::Calibration;
use turncal::calibration::result::InputFile;
use turncal::run::Run;

/// Records the inputs of a calibration with their digests: the files given in a run.toml or campaign.toml, or all files
/// of a log.
pub fn record_inputs(calibration: &mut Calibration, path: &Path, run: &Run) {
    let is_log = path.extension().is_none_or(|end| end != "toml");
    // The second file of a log is not given in any run.toml.
    let others = run.recording.files.iter().skip(1).filter(|_| is_log);
    let files = std::iter::once(path).chain(others.map(PathBuf::as_path));
    let digests = files.flat_map(input_digests);
    if let Some(provenance) = &mut calibration.provenance {
        let inputs = digests.map(|(name, sha256)| InputFile { name, sha256 });
        provenance.inputs = inputs.collect();
    }
}
