//! Parts of a job. Each part is written by one machine, and one machine merges all parts.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::digest::digest_of_bytes;
use super::job::{JOB_FILE, Job, Part};
use turncal_input::{FileError, list};

/// Results of the runs of a study as MessagePack, which preserves every bit of a number.
const RESULTS: &str = "runs.msgpack";
/// Maximum number of missing runs listed in an error.
const NAMED: usize = 5;

/// Writes a part of a study into an existing directory.
pub fn write_part<T: Serialize>(directory: &Path, part: Part, runs: &[T]) -> Result<(), FileError> {
    let write = |name: &str, bytes: &[u8]| {
        let path = directory.join(name);
        fs::write(&path, bytes).map_err(|error| FileError::unwritten(&path, &error))
    };
    let results = rmp_serde::to_vec(runs).map_err(|error| {
        let path = directory.join(RESULTS);
        let expected = "writable results";
        FileError::of(&path, error, expected, "Nothing was written.")
    })?;
    let part = Part {
        results: Some(digest_of_bytes(&results)),
        ..part
    };
    write(RESULTS, &results)?;
    write(JOB_FILE, &part.to_json())
}

/// Whether a directory contains this part of a study, and the part is complete.
pub fn part_is_there(directory: &Path, part: &Part) -> bool {
    let found = (Part::read(directory), fs::read(directory.join(RESULTS)));
    let (Ok(found), Ok(results)) = found else {
        return false;
    };
    let whole = found.results.as_deref() == Some(digest_of_bytes(&results).as_str());
    let expected = Part {
        results: found.results.clone(),
        ..part.clone()
    };
    whole && found == expected
}

/// All parts of one job.
#[derive(Debug, Clone)]
pub struct Parts {
    /// The job.
    pub job: Job,
    /// Directory of each part with its job record.
    parts: Vec<(PathBuf, Part)>,
}

impl Parts {
    /// Reads the job records in several directories.
    ///
    /// # Errors [`FileError`] if a directory is not a part, if the parts belong to different jobs, or if a run is missing or is in two parts.
    pub fn read(directories: &[PathBuf]) -> Result<Self, FileError> {
        let read = |directory: &PathBuf| Ok((directory.clone(), Part::read(directory)?));
        let parts: Result<Vec<_>, FileError> = directories.iter().map(read).collect();
        let parts = parts?;
        let Some((first, reference)) = parts.first() else {
            let (found, expected) = ("no part", "all parts of a job");
            let advice = "Give the directories that were written with --shard.";
            return Err(FileError::of(Path::new("."), found, expected, advice));
        };
        for (directory, part) in &parts[1..] {
            if let Some(difference) = reference.job.any_difference(&part.job) {
                let first = first.display();
                let found =
                    format!("a part of a job that differs from that of {first} ({difference})");
                let advice = "Merge only parts made by the same version, with the same arguments, on processors of the \
                              same type.";
                return Err(FileError::of(
                    directory,
                    found,
                    "parts of the same job",
                    advice,
                ));
            }
        }
        let parts = Self {
            job: reference.job.clone(),
            parts,
        };
        parts.check_all_there()?;
        Ok(parts)
    }

    /// Checks that every run is in exactly one part.
    fn check_all_there(&self) -> Result<(), FileError> {
        let mut held = self.held();
        held.sort();
        if let Some([(run, other), (_, directory)]) = held.array_windows().find(|[a, b]| a.0 == b.0)
        {
            let (run, other) = (self.name(*run), other.display());
            let found = format_args!("run {run}, which is also in {other}");
            let (expected, advice) = (
                "each run in only one part",
                "Leave out one of these two parts.",
            );
            return Err(FileError::of(directory, found, expected, advice));
        }
        let missing = self.job.runs.saturating_sub(held.len() as u64);
        let Some(first) = self.parts.first().filter(|_| missing > 0) else {
            return Ok(());
        };
        let is_there = |run: &u64| held.binary_search_by_key(run, |(run, _)| *run).is_ok();
        let named = (0..self.job.runs).filter(|run| !is_there(run)).take(NAMED);
        let named: Vec<String> = named.map(|run| self.name(run)).collect();
        let mut words = named.join(", ");
        if missing > named.len() as u64 {
            words += &format!(" and {} more", missing - named.len() as u64);
        }
        let given = self.parts.iter().filter_map(|(_, part)| part.shard);
        let given: Vec<String> = given.map(|shard| shard.to_string()).collect();
        let given = list(given.iter().map(String::as_str));
        let found = format_args!("no part that contains run {words}");
        let expected = format!("all {} runs; the parts given are {given}", self.job.runs);
        Err(FileError::of(
            &first.0,
            found,
            expected,
            "Add the missing parts.",
        ))
    }

    /// All runs, each with the directory of its part.
    fn held(&self) -> Vec<(u64, &Path)> {
        let all = self.parts.iter();
        all.flat_map(|(directory, part)| {
            let held = part.held().into_iter();
            held.map(move |run| (run, directory.as_path()))
        })
        .collect()
    }

    /// Name of a run in messages: its number, or its unit in a lot.
    fn name(&self, run: u64) -> String {
        let name = usize::try_from(run).ok();
        let name = name.and_then(|run| self.job.names.get(run));
        name.map_or_else(|| run.to_string(), Clone::clone)
    }

    /// The results of all runs of a study, in the order of their numbers.
    ///
    /// # Errors
    /// Returns [`FileError`] if the results were modified.
    pub fn results<T: DeserializeOwned>(&self) -> Result<Vec<T>, FileError> {
        let mut all: Vec<(u64, T)> = Vec::new();
        for (directory, part) in &self.parts {
            let path = directory.join(RESULTS);
            let advice = "Make this part again.";
            let bytes = fs::read(&path)
                .map_err(|error| FileError::io(&path, "read the part", &error, advice))?;
            let wrong = |found: String| {
                let expected = "the results as turncal wrote them";
                FileError::of(&path, found, expected, advice)
            };
            if part.results.as_deref() != Some(digest_of_bytes(&bytes).as_str()) {
                return Err(wrong(
                    "results that do not match their SHA-256 digest".to_owned(),
                ));
            }
            let runs: Vec<T> =
                rmp_serde::from_slice(&bytes).map_err(|error| wrong(error.to_string()))?;
            let held = part.held();
            if runs.len() != held.len() {
                return Err(wrong(format!("{} runs of {}", runs.len(), held.len())));
            }
            all.extend(held.into_iter().zip(runs));
        }
        all.sort_by_key(|(run, _)| *run);
        Ok(all.into_iter().map(|(_, result)| result).collect())
    }

    /// Name of every unit of a lot, and the part that contains it, in the order of the lot.
    pub fn units(&self) -> Vec<(&str, &Path)> {
        let mut all = self.held();
        all.sort();
        let unit = |(run, directory)| {
            let name = self.job.names.get(usize::try_from(run).ok()?)?;
            Some((name.as_str(), directory))
        };
        all.into_iter().filter_map(unit).collect()
    }
}
