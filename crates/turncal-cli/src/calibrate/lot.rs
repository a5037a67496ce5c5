//! `turncal calibrate RUN.toml RUN.toml …`: a lot.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::bail;

use super::not_met::NotMet;
use super::{Calibrate, write_report};
use crate::arguments::OfLog;
use crate::terminal::{Runs, piece_by_piece, show};
use turncal::calibration::{Calibration, UNWATCHED, Word};
use turncal::lot::{Lot, Unit};
use turncal::models;
use turncal::noise::RestNoise;
use turncal::study::CheckedCalibration;
use turncal_files::{Job, JobKind, LotDirectory, Part, is_toml, record_inputs, unit_key};
use turncal_input::FileError;
use turncal_report as report;
use turncal_report::Document;
use turncal_report::calibration;
use turncal_report::terminal::printable;

/// Default output directory.
const DIRECTORY: &str = "lot-calibration";

impl Calibrate {
    /// Calibrates every run and compares the calibrations.
    pub fn lot(&self) -> anyhow::Result<()> {
        let names = unit_names(&self.runs)?;
        let specification = self.specification.as_deref();
        let specification = specification.map(models::specification).transpose()?;
        let mut words = serde_json::to_value(&self.estimation)?;
        if self.of_log != OfLog::default() {
            words["of_log"] = format!("{:?}", self.of_log).into();
        }
        let mut job = Job::new(JobKind::Lot, words, self.runs.len() as u64);
        job.names.clone_from(&names);
        job.specification.clone_from(&specification);
        let part = Part::new(job, self.shard);
        let target = self.target(|| DIRECTORY.to_owned());
        let inputs: Vec<&Path> = self.runs.iter().map(PathBuf::as_path).collect();
        let open = |target| open_directory(target, &part, self.overwrite.force, &inputs);
        let directory = target.as_deref().map(open).transpose()?;

        let held = part.held();
        let progress = Runs::new(held.len() as u64);
        let key = part.job.key();
        let units = piece_by_piece(held.len(), |piece| {
            let place = usize::try_from(held[piece])?;
            let (run, name) = (&self.runs[place], &names[place]);
            let unit = self.unit(run, name, &key, directory.as_ref());
            progress.one_done();
            unit
        });
        let units = units.into_iter().collect::<anyhow::Result<Vec<Unit>>>()?;
        drop(progress);
        if let Some(shard) = self.shard {
            if let Some(directory) = &directory {
                directory.finish(&[])?;
            }
            let failed = units.iter().filter(|unit| unit.calibrated.is_err()).count();
            tell!(
                "part {shard}: {} of {} units, {failed} of them without a calibration; merge all parts with \
                 turncal merge",
                units.len(),
                self.runs.len()
            );
            return Ok(());
        }
        let lot = Lot::new(units, None, specification);
        deliver(&lot, directory.as_ref().zip(target.as_deref()), self.json)
    }

    /// A stored unit, or else a newly calibrated one; a failure is also a result.
    fn unit(
        &self,
        run: &Path,
        name: &str,
        job: &str,
        directory: Option<&LotDirectory>,
    ) -> anyhow::Result<Unit> {
        let key = unit_key(job, run);
        if let Some(kept) = directory.and_then(|directory| directory.kept(name, &key)) {
            return Ok(kept);
        }
        let (unit, document) = match self.calibrated(run) {
            Ok((calibration, noise, document)) => {
                let unit = Unit::of_record(name, calibration, noise);
                (unit, Some(document))
            }
            Err(error) => {
                let meta = is_toml(run).then(|| turncal_files::read_meta(run).unwrap_or_default());
                let unit = Unit {
                    name: name.to_owned(),
                    meta: meta.unwrap_or_default(),
                    calibrated: Err(format!("{error:#}")),
                };
                (unit, None)
            }
        };
        if let Some(directory) = directory {
            let report = |path: &Path| match &document {
                Some(document) => write_report(document, &path.join("report")),
                None => Ok(()),
            };
            directory.put(&unit, &key, report)?;
        }
        Ok(unit)
    }

    fn calibrated(
        &self,
        path: &Path,
    ) -> anyhow::Result<(Calibration, Option<RestNoise>, Document)> {
        let run = self.of_log.open(path)?.run;
        let problem = self.estimation.problem(&run, path)?;
        let solution = problem.solve(self.estimation.method, UNWATCHED)?;
        let mut checked = CheckedCalibration::new(&problem, solution)?;
        record_inputs(&mut checked.calibration, [path], &run);
        let of = (&checked, &checked.consequences(&problem, None));
        let limits = self.specification.as_deref().map(models::specification);
        let limits = limits.transpose()?;
        let named = (&problem, run.recording.name.as_str());
        let document = calibration::within(named, of, None, limits.as_ref());
        let calibration = checked.calibration;
        // A calibration that cannot be written counts as failed.
        turncal_files::calibration_json(&calibration, path)?;
        let dwells = problem.dwells().map(|dwell| dwell.samples.clone());
        let noise = RestNoise::of(&run.recording.imu, &dwells.collect::<Vec<_>>());
        Ok((calibration, noise, document))
    }
}

/// Opens the directory of a lot; prints a note if it has to wait for another process.
pub fn open_directory(
    target: &Path,
    part: &Part,
    force: bool,
    inputs: &[&Path],
) -> Result<LotDirectory, FileError> {
    let waiting = || {
        let name = printable(&target.display().to_string());
        tell!("note: another turncal process is using {name}; waiting for it to finish");
    };
    LotDirectory::open(target, part, force, inputs, &waiting)
}

/// Writes and prints the report of a lot; fails if a unit was not calibrated.
pub fn deliver(
    lot: &Lot,
    directory: Option<(&LotDirectory, &Path)>,
    json: bool,
) -> anyhow::Result<()> {
    let document = report::lot::document(lot);
    if let Some((directory, _)) = directory {
        let mut files = report::files(&document);
        files.push(("lot.json".to_owned(), report::json(&document)));
        directory.finish(&files)?;
    }
    show(&document, json)?;
    if let Some((_, target)) = directory.filter(|_| !json) {
        let page = target.join("index.html");
        tell!("\nreport: {}", printable(&page.display().to_string()));
    }
    let failed: Vec<&str> = lot.failures().map(|(unit, _)| unit.name.as_str()).collect();
    if !failed.is_empty() {
        bail!(
            "{} of {} units were not calibrated: {} (see the warnings for reasons)",
            failed.len(),
            lot.rows.len(),
            failed.join(", ")
        );
    }
    match document.verdict {
        Some((Word::Fail, words)) => Err(NotMet::Specification(words).into()),
        _ => Ok(()),
    }
}

/// A name for each unit: its run directory, or its file if that is not called run.toml, with as many parent directories
/// as needed to make names unique.
fn unit_names(runs: &[PathBuf]) -> anyhow::Result<Vec<String>> {
    let full: Vec<PathBuf> = runs
        .iter()
        .map(|run| {
            let full = run.canonicalize().unwrap_or_else(|_| run.clone());
            match full.file_name() {
                Some(file) if file == "run.toml" => full.parent().unwrap_or(&full).to_owned(),
                _ => full.with_extension(""),
            }
        })
        .collect();
    let deepest = full.iter().map(|path| path.iter().count()).max();
    for depth in 1..=deepest.unwrap_or(0) {
        let name = |path: &PathBuf| {
            let parts: Vec<_> = path.iter().map(|part| part.to_string_lossy()).collect();
            parts[parts.len().saturating_sub(depth)..].join("-")
        };
        let names: Vec<String> = full.iter().map(name).collect();
        if names.iter().collect::<BTreeSet<_>>().len() == names.len() {
            return Ok(names);
        }
    }
    let twice = (0..full.len()).find(|&k| full[..k].contains(&full[k]));
    let twice = twice.map_or_else(String::new, |k| runs[k].display().to_string());
    bail!("{twice}: found this run twice, expected each unit only once. Remove one")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_called_by_their_directories_as_far_up_as_it_takes() {
        let names = |runs: &[&str]| unit_names(&runs.iter().map(PathBuf::from).collect::<Vec<_>>());
        assert_eq!(
            names(&["lot/a/run.toml", "lot/b/run.toml"]).unwrap(),
            ["a", "b"]
        );
        assert_eq!(
            names(&["lot/a/mon/run.toml", "lot/b/mon/run.toml"]).unwrap(),
            ["a-mon", "b-mon"]
        );
        assert_eq!(names(&["lot/a.toml", "lot/b.toml"]).unwrap(), ["a", "b"]);
        let twice = names(&["lot/a/run.toml", "lot/a/run.toml"]).unwrap_err();
        assert!(twice.to_string().contains("twice"), "{twice}");
    }
}
