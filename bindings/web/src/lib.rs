//! Engine of the page: files in memory in; report, calibration and exports out.
//!
//! `wasm_bindgen` expands to unsafe code, so the crate cannot forbid it; there is none here.

#![cfg(target_arch = "wasm32")]

mod dropped;
mod output;
mod statements;

use std::error::Error;
use std::ops::ControlFlow;
use std::panic;

use serde_json::json;
use turncal::calibration::{Calibration, Method, Options, Problem};
use turncal::run::Run;
use turncal::study::CheckedCalibration;
use turncal_files::Opened;
use turncal_files::draft::{Draft, Found, Stated};
use turncal_logs::DataFile;
use turncal_report::Document;
use turncal_report::calibration;
use wasm_bindgen::prelude::*;

pub use output::Output;
use statements::Statements;

#[wasm_bindgen]
extern "C" {
    /// Shows a text of this kind: the current `activity`, the `draft` for a log, a `note` on the result, a `caution`
    /// about the exports, or the message of a `panic`.
    fn show(kind: &str, text: &str);
}

/// A panic ends the engine, but its message is shown.
#[wasm_bindgen(start)]
fn begin() {
    panic::set_hook(Box::new(|message| show("panic", &message.to_string())));
}

/// Files of a recording.
#[wasm_bindgen]
#[derive(Default)]
pub struct Files(Vec<DataFile>);

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
        let outputs = self.outputs(statements);
        outputs.map_err(|error| JsError::new(&error.to_string()))
    }
}

impl Files {
    fn outputs(mut self, statements: &str) -> Result<Vec<Output>, Box<dyn Error>> {
        let mut statements: Statements = serde_json::from_str(statements)?;
        let accel_file = dropped::sort(&mut self.0)?;
        if self.0.first().is_some_and(dropped::is_run) && statements != Statements::default() {
            statements = Statements::default();
            let note = "The options had no effect, because a run.toml was dropped.";
            show("note", note);
        }
        let stated = Stated {
            accel_file,
            ..statements.stated()?
        };
        show("activity", "reading");
        let first = self.0.first().map(|file| file.display().to_string());
        let show_draft = |draft: &Draft| show_draft(&first.unwrap_or_default(), draft);
        let opened = Opened::in_memory(&self.0, statements.stream(), &stated, show_draft)?;
        let run = &opened.run;
        if let Some(unused) = dropped::unused(&self.0, run) {
            show(
                "note",
                &format!("Not used, because run.toml does not name them: {unused}."),
            );
        }
        let (mut calibration, document) =
            calibrated(run).map_err(|error| with_notes(run, error))?;
        output::stamp(&mut calibration, run, &self.0);
        output::all(run, &calibration, &document)
    }
}

/// Shows the fields detected in a log and its run.toml.
fn show_draft(log: &str, draft: &Draft) {
    let field = |of: &Found| json!([of.what, of.value, of.certainty.word(), of.why]);
    let fields: Vec<_> = draft.found().iter().map(field).collect();
    let run = draft.to_toml(log);
    show(
        "draft",
        &json!({ "fields": fields, "run": run }).to_string(),
    );
}

/// Calibrates by the filter, with all checks.
fn calibrated(run: &Run) -> Result<(Calibration, Document), Box<dyn Error>> {
    show("activity", "calibrating");
    let problem = Problem::new(run, &Options::default());
    let solution = problem.solve(Method::Ekf, &|pass| {
        let step = pass.largest_step;
        show(
            "activity",
            &format!("iteration done, largest step {step:.2} σ"),
        );
        ControlFlow::Continue(())
    })?;
    show("activity", "checking the result");
    let checked = CheckedCalibration::new(&problem, solution)?;
    show("activity", "drawing the report");
    let outcome = checked.solution.outcome();
    let unobserved = outcome.map_or(0, |outcome| outcome.unobserved().len());
    if let Some(caution) = output::caution(&checked.calibration, unobserved) {
        show("caution", &caution);
    }
    let named = (&problem, run.recording.name.as_str());
    let of = (&checked, &checked.consequences(&problem, None));
    let document = calibration::document(named, of, None);
    Ok((checked.calibration, document))
}

/// Problems found in the files may be the cause of an error.
fn with_notes(run: &Run, error: Box<dyn Error>) -> Box<dyn Error> {
    let recording = &run.recording;
    let notes = recording.doubts.iter().chain(&recording.notes);
    let notes: String = notes.map(|note| format!("\nnote: {note}")).collect();
    format!("{}: {error}{notes}", recording.name).into()
}
