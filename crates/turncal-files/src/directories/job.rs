//! `job.json`: identifies the job (or part of a job) in a directory, so that parts of different jobs can be
//! distinguished and a job can be resumed.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::digest::digest_of;
use turncal::study::Shard;
use turncal_input::{FileError, small_file};

/// The name of this file in its directory.
pub const JOB_FILE: &str = "job.json";
/// The version of the file format.
const FORMAT: &str = "turncal-job/1";

/// A job that consists of many runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Job {
    /// Always [`FORMAT`].
    format: String,
    /// Kind of job.
    pub job: JobKind,
    /// The program's version.
    pub version: String,
    /// Processor type and features, which affect rounding.
    pub processor: Vec<String>,
    /// All options that affect the result of a run.
    pub options: Value,
    /// Total number of runs.
    pub runs: u64,
    /// Names of the runs of a lot.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub names: Vec<String>,
    /// Specification for evaluating the results, which does not change the result of a run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub specification: Option<turncal::lot::Specification>,
}

/// Kind of job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum JobKind {
    /// Calibrations of a lot.
    Lot,
    /// `study accuracy`.
    StudyAccuracy,
    /// `study experiment`.
    StudyExperiment,
}

/// A job or part, as recorded in its directory.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// The job.
    #[serde(flatten)]
    pub job: Job,
    /// SHA-256 of the job.
    pub digest: String,
    /// The part in this directory; `None` for the whole job.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shard: Option<Shard>,
    /// Numbers of the part's runs, from zero; empty for the whole job.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub holds: Vec<u64>,
    /// SHA-256 of the results file in the same directory.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub results: Option<String>,
}

impl Job {
    /// A job of this version of the program on this processor.
    pub fn new(job: JobKind, options: Value, runs: u64) -> Self {
        Self {
            format: FORMAT.to_owned(),
            job,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            processor: processor(),
            options,
            runs,
            names: Vec::new(),
            specification: None,
        }
    }

    /// SHA-256 of all options that affect the result of a run.
    pub fn key(&self) -> String {
        digest_of(&(&self.version, &self.processor, self.job, &self.options))
    }

    /// The first difference between two jobs that affects the result of a run, in words; `None` if there is no such
    /// difference.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let decisive = |of: &Self| {
            serde_json::json!({
                "job": of.job,
                "turncal": of.version,
                "processor": of.processor,
                "options": of.options,
            })
        };
        first_difference("", &decisive(self), &decisive(other))
    }

    /// The first difference between two jobs, of any kind.
    pub fn any_difference(&self, other: &Self) -> Option<String> {
        let [one, other] = [self, other].map(|of| serde_json::to_value(of).unwrap_or_default());
        first_difference("", &one, &other)
    }
}

/// The first value that differs between two jobs, with its name.
fn first_difference(name: &str, a: &Value, b: &Value) -> Option<String> {
    if a == b {
        return None;
    }
    if let (Value::Object(a), Value::Object(b)) = (a, b) {
        let mut names = a.keys().chain(b.keys());
        return names.find_map(|key| {
            let [one, other] = [a, b].map(|of| of.get(key).unwrap_or(&Value::Null));
            let full = [name, key].into_iter().filter(|part| !part.is_empty());
            first_difference(&full.collect::<Vec<_>>().join("."), one, other)
        });
    }
    let short = |value: &Value| {
        let text = value.to_string();
        match text.char_indices().nth(60) {
            Some((end, _)) => format!("{}…", &text[..end]),
            None => text,
        }
    };
    Some(format!("{name} = {} and {}", short(a), short(b)))
}

impl Part {
    /// The whole job, or the part that contains these runs.
    pub fn new(job: Job, shard: Option<Shard>) -> Self {
        Self {
            digest: digest_of(&job),
            holds: shard.map_or_else(Vec::new, |shard| shard.runs(job.runs).collect()),
            shard,
            results: None,
            job,
        }
    }

    /// Numbers of the runs in this job or part.
    pub fn held(&self) -> Vec<u64> {
        match self.shard {
            Some(_) => self.holds.clone(),
            None => (0..self.job.runs).collect(),
        }
    }

    /// Reads the `job.json` of a directory.
    pub fn read(directory: &Path) -> Result<Self, FileError> {
        let path = directory.join(JOB_FILE);
        let advice = "Give a directory that turncal wrote for a lot or with --shard.";
        let part: Self = small_file::json(&path, "a job", FORMAT, advice)?;
        // The runs are compared one by one, because the file may state any number of runs.
        let named = part.job.names.len() as u64 == part.job.runs;
        let is_whole = match part.shard {
            Some(shard) => shard.runs(part.job.runs).eq(part.holds.iter().copied()),
            None => named,
        };
        let is_lot = part.job.job == JobKind::Lot;
        if part.digest != digest_of(&part.job) || !is_whole || (is_lot && !named) {
            let found = "a job file whose digest or run list does not match its content";
            let expected = "the job file as turncal wrote it";
            return Err(FileError::of(&path, found, expected, advice));
        }
        Ok(part)
    }

    /// The bytes of `job.json`.
    pub fn to_json(&self) -> Vec<u8> {
        // The job contains only names, numbers and texts; these can always be written.
        small_file::pretty(self).unwrap_or_default()
    }
}

/// Architecture, system and the features that select numerical code at run time.
fn processor() -> Vec<String> {
    let system = [std::env::consts::ARCH, std::env::consts::OS];
    let all = system.into_iter().chain(features());
    all.map(str::to_owned).collect()
}

#[cfg(target_arch = "x86_64")]
fn features() -> Vec<&'static str> {
    let all = [
        ("sse4.1", std::is_x86_feature_detected!("sse4.1")),
        ("avx", std::is_x86_feature_detected!("avx")),
        ("avx2", std::is_x86_feature_detected!("avx2")),
        ("fma", std::is_x86_feature_detected!("fma")),
        ("avx512f", std::is_x86_feature_detected!("avx512f")),
    ];
    let has = all.into_iter().filter(|(_, has)| *has);
    has.map(|(name, _)| name).collect()
}

#[cfg(not(target_arch = "x86_64"))]
fn features() -> Vec<&'static str> {
    Vec::new()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn job(options: Value) -> Job {
        let mut job = Job::new(JobKind::Lot, options, 5);
        job.names = (1..=5).map(|unit| format!("unit-{unit}")).collect();
        job
    }

    #[test]
    fn jobs_differ_by_what_decides_a_run_and_say_by_what() {
        let one = job(json!({"noise": "auto", "with": []}));
        assert_eq!(one.difference(&one.clone()), None);
        let mut other = job(json!({"noise": "stated", "with": []}));
        let words = one.difference(&other).unwrap();
        assert_eq!(words, "options.noise = \"auto\" and \"stated\"");
        assert!(one.key() != other.key());
        other.version = "0.0.0".to_owned();
        other.options = one.options.clone();
        assert!(one.difference(&other).unwrap().starts_with("turncal = "));
        other = one.clone();
        other.runs = 6;
        assert_eq!(one.difference(&other), None);
        assert_eq!(one.any_difference(&other).unwrap(), "runs = 5 and 6");
    }

    #[test]
    fn a_part_comes_back_from_its_file_and_a_changed_one_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join(JOB_FILE);
        let shard = "2/3".parse().unwrap();
        let part = Part::new(job(json!({"step": 0.1 + 0.2})), Some(shard));
        assert_eq!(part.held(), [1, 4]);
        std::fs::write(&path, part.to_json()).unwrap();
        assert_eq!(Part::read(directory.path()), Ok(part.clone()));
        let text = String::from_utf8(part.to_json()).unwrap();
        for (from, to) in [
            ("\"runs\": 5", "\"runs\": 6"),
            ("turncal-job/1", "turncal-job/2"),
            ("\"index\": 2", "\"index\": 3"),
        ] {
            assert!(text.contains(from), "{text}");
            std::fs::write(&path, text.replace(from, to)).unwrap();
            assert!(Part::read(directory.path()).is_err(), "{to}");
        }
    }
}
