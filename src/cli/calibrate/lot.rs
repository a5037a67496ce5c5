//! `turncal calibrate RUN.toml RUN.toml …`: a lot.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::bail;

use super::write_report;
use crate::calibration::{UNWATCHED, Word};
use crate::cli::arguments::{Estimation, OfLog};
use crate::cli::terminal::{Runs, piece_by_piece, show};
use crate::formats::{Job, JobKind, LotDirectory, Part, is_toml, record_inputs, unit_key};
use crate::imu::PerSensor;
use crate::lot::{self, Lot, Unit};
use crate::models;
use crate::noise::RestNoise;
use crate::report;
use crate::report::Document;
use crate::report::calibration;
use crate::report::terminal::printable;
use crate::run::Run;
use crate::study::{CheckedCalibration, Shard};

/// Default output directory.
pub const DIRECTORY: &str = "lot-calibration";

/// Request for a lot.
pub struct Request<'a> {
    pub runs: &'a [PathBuf],
    pub of_log: &'a OfLog,
    pub estimation: &'a Estimation,
    pub specification: Option<&'a Path>,
    pub shard: Option<Shard>,
    pub output: Option<&'a Path>,
    pub json: bool,
    pub force: bool,
}

impl Request<'_> {
    pub fn run(&self) -> anyhow::Result<()> {
        let names = unit_names(self.runs)?;
        let specification = self.specification.map(models::specification).transpose()?;
        let mut words = serde_json::to_value(self.estimation)?;
        if *self.of_log != OfLog::default() {
            words["of_log"] = format!("{:?}", self.of_log).into();
        }
        let mut job = Job::new(JobKind::Lot, words, self.runs.len() as u64);
        job.names.clone_from(&names);
        job.specification.clone_from(&specification);
        let part = Part::new(job, self.shard);
        let directory = self.output.map(|target| self.directory(target, &part));
        let directory = directory.transpose()?;

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
        deliver(&lot, directory.as_ref().zip(self.output), self.json)
    }

    fn directory(&self, target: &Path, part: &Part) -> anyhow::Result<LotDirectory> {
        let inputs: Vec<&Path> = self.runs.iter().map(PathBuf::as_path).collect();
        let waiting = || {
            let name = printable(&target.display().to_string());
            tell!("note: another turncal process is using {name}; waiting for it to finish");
        };
        Ok(LotDirectory::open(
            target, part, self.force, &inputs, &waiting,
        )?)
    }

    /// A stored unit, or else a newly calibrated one.
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
        let (unit, document) = self.calibrate(run, name);
        if let Some(directory) = directory {
            let report = |path: &Path| match &document {
                Some(document) => write_report(document, &path.join("report")),
                None => Ok(()),
            };
            directory.put(&unit, &key, report)?;
        }
        Ok(unit)
    }

    /// The unit with its report; a failure is also a result.
    fn calibrate(&self, path: &Path, name: &str) -> (Unit, Option<Document>) {
        let calibrated = self.calibrated(path);
        let unit = |meta, calibrated| Unit {
            name: name.to_owned(),
            meta,
            calibrated,
        };
        match calibrated {
            Ok((meta, calibrated, document)) => (unit(meta, Ok(calibrated)), Some(document)),
            Err(error) => {
                let meta = is_toml(path).then(|| Run::read_meta(path).unwrap_or_default());
                (
                    unit(meta.unwrap_or_default(), Err(format!("{error:#}"))),
                    None,
                )
            }
        }
    }

    fn calibrated(&self, path: &Path) -> anyhow::Result<(Meta, lot::Calibrated, Document)> {
        let run = self.of_log.open(path)?.run;
        let problem = self.estimation.problem(&run, path)?;
        let solution = problem.solve(self.estimation.method, UNWATCHED)?;
        let mut checked = CheckedCalibration::new(&problem, solution)?;
        record_inputs(&mut checked.calibration, path, &run);
        let of = (&checked, &checked.consequences(&problem, None));
        let document = calibration::document((&problem, &run.recording.name), of, None);
        let calibration = checked.calibration;
        // What cannot be written is no calibration.
        calibration.to_json(path)?;
        let dwells: Vec<_> = problem
            .dwells()
            .map(|dwell| dwell.samples.clone())
            .collect();
        let of_unit = lot::Calibrated {
            calibration,
            noise: RestNoise::of(&run.recording.imu, &dwells),
        };
        Ok((run.recording.meta.clone(), of_unit, document))
    }
}

type Meta = BTreeMap<String, String>;

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
        Some((Word::Fail, words)) => Err(NotMet(words).into()),
        _ => Ok(()),
    }
}

/// The lot was calibrated, but some units do not meet their specification.
#[derive(Debug, thiserror::Error)]
#[error("the specification is not met: {0}")]
pub struct NotMet(pub String);

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
    bail!("{twice}: found this run twice, expected each unit once. Remove one")
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
