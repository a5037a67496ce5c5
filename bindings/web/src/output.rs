//! Files to download.

use std::error::Error;
use std::path::{Path, PathBuf};

use turncal::calibration::Calibration;
use turncal::calibration::result::InputFile;
use turncal::run::Run;
use turncal_files::{digest_of_bytes, export};
use turncal_logs::DataFile;
use turncal_report as report;
use turncal_report::Document;
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

/// What a user should know before using the exports.
pub fn caution(calibration: &Calibration, unobserved: usize) -> Option<String> {
    let of = match unobserved {
        _ if calibration.is_failed() => {
            return Some("None, because the calibration failed.".into());
        }
        0 => return None,
        1 => "One parameter is not determined by this recording: its value is assumed".to_owned(),
        n => {
            format!("{n} parameters are not determined by this recording: their values are assumed")
        }
    };
    Some(format!("{of} in these files, not measured."))
}

/// The report, the calibration, and all exports that the calibration allows, with the name of the log.
pub fn all(
    run: &Run,
    calibration: &Calibration,
    document: &Document,
) -> Result<Vec<Output>, Box<dyn Error>> {
    let log = log(run);
    let pages = report::files(document).into_iter();
    let page = pages.filter(|(name, _)| name == "index.html");
    let name = format!("{log}-report.html");
    let page = page.map(|(_, page)| Output::new(&name, "Report with all figures", page));
    let name = format!("{log}-calibration.json");
    let json = turncal_files::calibration_json(calibration, Path::new(&name))?;
    let about = "Values, σ and covariance, for turncal apply, export and certificate";
    let exported = |format: &export::Format| {
        let exported = export::write(calibration, format, Some(run)).ok()?;
        let name = format!("{log}-{}.{}", format.name, format.extension);
        // Here the run is always there.
        let about = format.about.trim_end_matches("; needs --run");
        Some(Output::new(&name, about, exported.bytes))
    };
    let formats = export::FORMATS.iter().filter(|_| !calibration.is_failed());
    let own = page.chain([Output::new(&name, about, json)]);
    Ok(own.chain(formats.filter_map(exported)).collect())
}

/// The name of the log without its extensions.
fn log(run: &Run) -> String {
    let files = &run.recording.files;
    let log = files
        .iter()
        .find(|file| file.extension().is_none_or(|end| end != "toml"));
    let stem = |path: &Path| path.file_stem().map(PathBuf::from).unwrap_or_default();
    let log = log.map_or_else(PathBuf::new, |log| match log.extension() {
        Some(end) if end == "gz" => stem(&stem(log)),
        _ => stem(log),
    });
    log.display().to_string()
}
