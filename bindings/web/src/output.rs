//! Files to download.

use std::error::Error;
use std::path::Path;

use turncal::calibration::Calibration;
use turncal::calibration::result::InputFile;
use turncal::formats::{DataFile, digest_of_bytes, export};
use turncal::report::{self, Document};
use turncal::run::Run;
use wasm_bindgen::prelude::*;

/// A file to download.
#[wasm_bindgen(getter_with_clone)]
pub struct Output {
    /// Its name.
    pub name: String,
    /// Its purpose.
    pub about: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

impl Output {
    fn new(name: &str, about: &str, bytes: impl Into<Vec<u8>>) -> Self {
        Self {
            name: name.to_owned(),
            about: about.to_owned(),
            bytes: bytes.into(),
        }
    }
}

/// Records the files of a run in its calibration.
pub fn stamp(calibration: &mut Calibration, run: &Run, files: &[DataFile]) {
    let digest = |path: &Path| {
        let is_it = |file: &&DataFile| file.file_name() == path.file_name();
        let file = files.iter().find(is_it)?;
        Some(InputFile {
            name: file.display().to_string(),
            sha256: digest_of_bytes(file.bytes()?),
        })
    };
    let inputs = run.recording.files.iter().filter_map(|path| digest(path));
    if let Some(provenance) = &mut calibration.provenance {
        provenance.inputs = inputs.collect();
    }
}

/// The report, the calibration, and all exports that the calibration allows.
pub fn all(
    run: &Run,
    calibration: &Calibration,
    document: &Document,
) -> Result<Vec<Output>, Box<dyn Error>> {
    let pages = report::files(document).into_iter();
    let page = pages.filter(|(name, _)| name == "index.html");
    let page = page.map(|(_, page)| Output::new("report.html", "Report with all figures", page));
    let json = calibration.to_json(Path::new("calibration.json"))?;
    let about = "Values, σ and covariance, for turncal apply, export and certificate";
    let exported = |format: &export::Format| {
        let exported = export::write(calibration, format, Some(run)).ok()?;
        let name = format!("{}.{}", format.name, format.extension);
        Some(Output::new(&name, format.about, exported.bytes))
    };
    let exports = export::Format::all().iter().filter_map(exported);
    let own = page.chain([Output::new("calibration.json", about, json)]);
    Ok(own.chain(exports).collect())
}
