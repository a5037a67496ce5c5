//! Engine of the page: files in memory in; report, calibration and exports out.
//!
//! `wasm_bindgen` expands to unsafe code, so the crate cannot forbid it; there is none here.

#![cfg(target_arch = "wasm32")]

mod statements;

use std::error::Error;
use std::ops::ControlFlow;
use std::panic;
use std::path::Path;

use serde_json::json;
use turncal::calibration::result::InputFile;
use turncal::calibration::{Calibration, Method, Options, Problem, Solution};
use turncal::formats::draft::{Found, Stated};
use turncal::formats::{DataFile, Opened, digest_of_bytes, export};
use turncal::report::calibration::Calibrated;
use turncal::report::{self, Document};
use turncal::run::Run;
use wasm_bindgen::prelude::*;

use statements::Statements;

#[wasm_bindgen]
extern "C" {
    /// Shows a text of this kind: the current `activity`, the fields `found` in a log, or the message of a `panic`.
    fn show(kind: &str, text: &str);
}

/// Shows the message of a panic, which ends the engine.
#[wasm_bindgen(start)]
fn begin() {
    panic::set_hook(Box::new(|message| show("panic", &message.to_string())));
}

/// Files of a recording.
#[wasm_bindgen]
#[derive(Default)]
pub struct Files(Vec<DataFile>);

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

#[wasm_bindgen]
impl Files {
    /// No files.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a file.
    pub fn add(&mut self, name: &str, bytes: Vec<u8>) {
        self.0.push(DataFile::in_memory(name, bytes));
    }

    /// Calibrates a run.toml with its files, a log, or a log of gyros and one of accelerometers, with statements about
    /// a log as JSON.
    ///
    /// # Errors
    /// The message that the command would print.
    pub fn calibrate(self, statements: &str) -> Result<Vec<Output>, JsError> {
        let calibrated = self.outputs(statements);
        calibrated.map_err(|error| JsError::new(&error.to_string()))
    }
}

impl Files {
    fn outputs(mut self, statements: &str) -> Result<Vec<Output>, Box<dyn Error>> {
        let statements: Statements = serde_json::from_str(statements)?;
        let mut stated = statements.stated()?;
        self.sort(&mut stated);
        show("activity", "reading the log");
        let opened = Opened::in_memory(&self.0, statements.stream(), &stated, show_found)?;
        let run = &opened.run;
        let problem = Problem::new(run, &Options::default());
        let (calibration, document) =
            calibrated(&problem).map_err(|error| with_notes(run, error))?;
        let calibration = self.stamped(calibration, run);
        outputs(&opened, &calibration, &document)
    }

    /// Moves the run.toml, or the log of the gyros, to the front.
    fn sort(&mut self, stated: &mut Stated) {
        let is_run = |file: &DataFile| file.extension().is_some_and(|end| end == "toml");
        self.0
            .sort_by_key(|file| (!is_run(file), is_of_accelerometers(file)));
        if let [gyro, accel] = &self.0[..]
            && !is_run(gyro)
        {
            stated.accel_file = Some(accel.clone());
        }
    }

    /// Records the input files in a calibration.
    fn stamped(&self, mut calibration: Calibration, run: &Run) -> Calibration {
        let digest = |path: &Path| {
            let file = self
                .0
                .iter()
                .find(|file| file.file_name() == path.file_name())?;
            Some(InputFile {
                name: file.display().to_string(),
                sha256: digest_of_bytes(file.bytes()?),
            })
        };
        if let Some(provenance) = &mut calibration.provenance {
            provenance.inputs = run
                .recording
                .files
                .iter()
                .filter_map(|path| digest(path))
                .collect();
        }
        calibration
    }
}

/// Whether the name of a file says so, as those of phones do.
fn is_of_accelerometers(file: &DataFile) -> bool {
    let name = file.to_string_lossy().to_lowercase();
    name.contains("acc")
}

fn show_found(found: &[Found]) {
    let field = |of: &Found| json!([of.what, of.value, of.certainty.word(), of.why]);
    let fields: Vec<_> = found.iter().map(field).collect();
    show("found", &json!(fields).to_string());
}

/// Calibrates by the filter, with all checks.
fn calibrated(problem: &Problem) -> Result<(Calibration, Document), Box<dyn Error>> {
    show("activity", "calibrating");
    let mut solution = problem.solve(Method::Ekf, &|pass| {
        let step = pass.largest_step;
        show(
            "activity",
            &format!("iteration done, largest step {step:.2} σ"),
        );
        ControlFlow::Continue(())
    })?;
    show("activity", "checking the result");
    let calibrated = Calibrated::new(problem, &mut solution)?;
    show("activity", "drawing the report");
    let document = document(problem, &solution, &calibrated);
    Ok((calibrated.calibration, document))
}

fn document(problem: &Problem, solution: &Solution, calibrated: &Calibrated) -> Document {
    let name = &problem.run().recording.name;
    calibrated.document((problem, name), solution, Method::Ekf, None)
}

/// Problems found in the files may be the cause of an error.
fn with_notes(run: &Run, error: Box<dyn Error>) -> Box<dyn Error> {
    let recording = &run.recording;
    let notes = recording.doubts.iter().chain(&recording.notes);
    let notes: String = notes.map(|note| format!("\nnote: {note}")).collect();
    format!("{}: {error}{notes}", recording.name).into()
}

/// The calibration, its report, the run.toml of a log, and all exports that the calibration allows.
fn outputs(
    opened: &Opened,
    calibration: &Calibration,
    document: &Document,
) -> Result<Vec<Output>, Box<dyn Error>> {
    let json = calibration.to_json(Path::new("calibration.json"))?;
    let files = report::files(document).into_iter();
    let page = files.filter(|(name, _)| name == "index.html");
    let mut outputs: Vec<Output> = page
        .map(|(_, page)| output("report.html", "Report with all figures", page))
        .collect();
    outputs.push(output(
        "calibration.json",
        "Values, σ, covariance; for turncal apply and export",
        json,
    ));
    let log = opened
        .run
        .recording
        .files
        .first()
        .map(|log| log.display().to_string());
    let run = log.and_then(|log| opened.run_toml(&log));
    let about = "Description of the log; drop it together with the log to change it";
    outputs.extend(run.map(|text| output("run.toml", about, text)));
    let exported = |format: &export::Format| {
        let exported = export::write(calibration, format, Some(&opened.run)).ok()?;
        let name = format!("{}.{}", format.name, format.extension);
        Some(output(&name, format.about, exported.bytes))
    };
    outputs.extend(export::Format::all().iter().filter_map(exported));
    Ok(outputs)
}

fn output(name: &str, about: &str, bytes: impl Into<Vec<u8>>) -> Output {
    Output {
        name: name.to_owned(),
        about: about.to_owned(),
        bytes: bytes.into(),
    }
}
