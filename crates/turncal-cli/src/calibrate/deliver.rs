//! Writes and shows a calibration, and decides the exit status.

use std::path::{Path, PathBuf};

use anyhow::bail;

use super::{Calibrate, NotMet, read_truth, say, solve, write_report};
use crate::terminal::{Activity, print, show, show_brief};
use turncal::calibration::{Calibration, Method, Problem, Solution, Word};
use turncal::lot::{Lot, Unit};
use turncal::models;
use turncal::run::Run;
use turncal::study::CheckedCalibration;
use turncal_files::{Opened, calibration_json, record_inputs, write_calibration};
use turncal_report as report;
use turncal_report::calibration as of_calibration;
use turncal_report::{Document, Facts};

impl Calibrate {
    /// Writes and shows a calibration that needs no solution of a problem.
    pub fn deliver(
        &self,
        calibration: &Calibration,
        document: &Document,
        (opened, path): (&Opened, &Path),
    ) -> anyhow::Result<()> {
        let run = &opened.run;
        let target = self.default_target(run);
        if let Some(target) = &target {
            let directory = self.overwrite.directory(target, &[path])?;
            let file = directory.path().join("calibration.json");
            write_calibration(calibration, &file, false)?;
            write_report(document, &directory.path().join("report"))?;
            opened.write_run(&directory.path())?;
            directory.commit()?;
        }
        if self.json {
            print(&calibration_json(
                calibration,
                Path::new("standard output"),
            )?)
        } else {
            show(document, false)
        }?;
        say(&run.recording);
        self.check_required(&run.recording.name, calibration)
    }

    /// Output directory, if any, with this default name.
    pub fn target(&self, default: impl FnOnce() -> String) -> Option<PathBuf> {
        let default = || (!self.json).then(|| PathBuf::from(default()));
        self.output.clone().or_else(default)
    }

    /// Output directory of a calibration that needs no solution of a problem.
    pub fn default_target(&self, run: &Run) -> Option<PathBuf> {
        self.target(|| format!("{}-calibration", run.recording.name))
    }

    /// Solves a problem, then writes and shows the result.
    pub fn solved(
        &self,
        problem: &Problem,
        name: &str,
        (path, opened): (&Path, Option<&Opened>),
        activity: Activity,
    ) -> anyhow::Result<()> {
        let run = problem.run();
        let read = |path| read_truth(path, run, problem.model.aiding.body_frame());
        let truth = self.truth.as_deref().map(read).transpose()?;
        let target = self.target(|| match self.estimation.method {
            Method::Ekf => format!("{name}-calibration"),
            Method::SixPosition => format!("{name}-calibration-six-position"),
        });
        let sources: Vec<&Path> = match self.runs.as_slice() {
            [_] => vec![path],
            several => several.iter().map(PathBuf::as_path).collect(),
        };
        let mut inputs = sources.clone();
        inputs.extend(self.truth.as_deref());
        let begin = |target: &PathBuf| self.overwrite.directory(target, &inputs);
        let directory = target.as_ref().map(begin).transpose()?;

        // Problems found in the files may be the cause.
        let solution = solve(problem, self.estimation.method, &activity)
            .inspect_err(|_| say(&run.recording))?;
        let mut checked = CheckedCalibration::new(problem, solution)?;
        record_inputs(&mut checked.calibration, sources, run);
        activity.next("writing");
        // JSON on standard output has no report.
        let document = (directory.is_some() || !self.json).then(|| {
            let triads = truth.as_ref().map(|truth| &truth.triads);
            let of = (&checked, &checked.consequences(problem, triads));
            of_calibration::document((problem, name), of, truth.as_ref())
        });
        let CheckedCalibration {
            calibration,
            solution,
            ..
        } = checked;
        if let (Some(directory), Some(document)) = (directory, &document) {
            let file = directory.path().join("calibration.json");
            write_calibration(&calibration, &file, false)?;
            write_report(document, &directory.path().join("report"))?;
            opened.map_or(Ok(()), |opened| opened.write_run(&directory.path()))?;
            directory.commit()?;
        }
        drop(activity);
        match document {
            Some(document) if self.verbose => show(&document, false)?,
            Some(mut document) if !self.json => {
                let run = read_by(opened, target.as_deref(), path);
                let files = files(target.as_deref(), &run, &document);
                document.brief.push(files.into());
                show_brief(&document)?;
            }
            _ => print(&calibration_json(&calibration, "standard output".as_ref())?)?,
        }
        self.judge(name, &solution, calibration)
    }

    /// Fails if the values must not be used, or if a requirement is not met.
    fn judge(
        &self,
        name: &str,
        solution: &Solution,
        calibration: Calibration,
    ) -> anyhow::Result<()> {
        if !solution.converged() {
            bail!(
                "{name}: the calibration did not converge; do not use the values or σ, and see the findings"
            );
        }
        if !solution.is_usable() {
            bail!("{name}: do not use the values; see the findings");
        }
        self.check_required(name, &calibration)?;
        self.decide(name, calibration)
    }

    /// Checks the calibration of a followed log against the specification.
    fn decide(&self, name: &str, calibration: Calibration) -> anyhow::Result<()> {
        let Some(specification) = self.specification.as_ref().filter(|_| self.follow) else {
            return Ok(());
        };
        let unit = Unit::of_record(name, calibration, None);
        let lot = Lot::new(
            vec![unit],
            None,
            Some(models::specification(specification)?),
        );
        match report::lot::document(&lot).verdict {
            Some((Word::Fail, words)) => return Err(NotMet::Specification(words).into()),
            Some((word, words)) => {
                tell!("specification: {word}, {words}");
            }
            None => {}
        }
        Ok(())
    }

    /// Fails if a required parameter is not determined.
    pub fn check_required(&self, name: &str, calibration: &Calibration) -> anyhow::Result<()> {
        let is_required = |name: &&String| self.require.iter().any(|of| name.starts_with(of));
        let missing = calibration.undetermined().filter(is_required);
        let missing: Vec<&str> = missing.map(String::as_str).collect();
        if missing.is_empty() {
            return Ok(());
        }
        let words = format!("{name}: not determined: {}", missing.join(", "));
        Err(NotMet::Required(words).into())
    }
}

/// The run.toml of a run: for a log, the one written next to the result; for a campaign, a placeholder.
pub fn read_by(opened: Option<&Opened>, target: Option<&Path>, path: &Path) -> PathBuf {
    match (opened, target) {
        (Some(opened), Some(target)) if opened.is_of_log() => target.join("run.toml"),
        (Some(_), _) => path.to_owned(),
        (None, _) => PathBuf::from("RUN.toml"),
    }
}

/// Prints the files written, and the next command.
pub fn files(target: Option<&Path>, run: &Path, document: &Document) -> Facts {
    let mut facts = Facts::default();
    let shown = |path: PathBuf| path.display().to_string();
    if let Some(target) = target {
        let calibration = shown(target.join("calibration.json"));
        facts.push("calibration", calibration.clone());
        facts.push("report", shown(target.join("report").join("index.html")));
        if !matches!(document.verdict, Some((Word::Failed, _))) {
            let run = run.display();
            facts.push(
                "use it",
                format!("turncal apply {calibration} {run} -o calibrated.csv"),
            );
        }
    }
    let explain = document.findings.first();
    let explain = explain.map(|finding| format!("turncal explain {}", finding.code));
    let calibration = target.map(|target| shown(target.join("calibration.json")));
    let all = calibration.map(|file| format!("turncal show {file} --verbose"));
    let more: Vec<String> = all.into_iter().chain(explain).collect();
    if !more.is_empty() {
        facts.push("more", more.join(", "));
    }
    facts
}
