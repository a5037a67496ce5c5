//! The directory of a lot, which grows unit by unit: `job.json`, the complete directories `units/NAME/`, and finally
//! the summary of all units. If the same job is started again, it continues where it stopped.

use crate::calibration_json;
use std::collections::BTreeMap;
use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::digest::{digest_of, digest_of_bytes, input_digests};
use super::job::{JOB_FILE, Part};
use super::whole::{WholeDirectory, clear_abandoned, list_anew, write_whole};
use turncal::lot::{Calibrated, Unit};
use turncal::noise::RestNoise;
use turncal_input::{FileError, small_file};

/// Name of the directory of the units, within the directory of the lot.
const UNITS: &str = "units";
/// Name of the file with the data of a unit in addition to its calibration.
const UNIT_FILE: &str = "unit.json";
const CALIBRATION_FILE: &str = "calibration.json";
/// The version of the format of [`UNIT_FILE`].
const FORMAT: &str = "turncal-unit/1";

/// A lot directory, locked against other processes during its lifetime.
pub struct LotDirectory {
    root: PathBuf,
    /// The lock file; `None` if the file system has no locks.
    _lock: Option<File>,
}

/// A unit's file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct UnitRecord {
    format: String,
    name: String,
    /// SHA-256 of the inputs that determine the result: job, options, files.
    key: String,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    meta: BTreeMap<String, String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    noise_at_rest: Option<RestNoise>,
    /// SHA-256 of its calibration file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    calibration_sha256: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    failure: Option<String>,
}

/// Inputs that determine the result of a unit: the job without its list of units, and the files that belong to the
/// unit.
pub fn unit_key(job: &str, run: &Path) -> String {
    digest_of(&(job, input_digests(run)))
}

/// A unit in the directory of one part of its lot.
pub fn read_part_unit(part: &Path, name: &str) -> Result<Unit, FileError> {
    Ok(read_unit(&part.join(UNITS).join(name), None)?.0)
}

impl LotDirectory {
    /// Creates a lot directory, or continues one that the same job started; calls `waiting` if another process must
    /// finish first. With `force` the lot restarts from the beginning.
    ///
    /// # Errors
    /// Returns [`FileError`] if the directory contains another job, another part of this job, units that do not belong
    /// to this lot, or files not written by turncal in places that would be overwritten.
    pub fn open(
        target: &Path,
        part: &Part,
        force: bool,
        inputs: &[&Path],
        waiting: &dyn Fn(),
    ) -> Result<Self, FileError> {
        let units = target.join(UNITS);
        let begun = target.join(JOB_FILE).is_file();
        let root = target.to_owned();
        if begun && !force {
            let _lock = lock(&units, waiting);
            check_same(target, &Part::read(target)?, part)?;
            check_units(&units, part)?;
            write_whole(&target.join(JOB_FILE), &part.to_json(), true)?;
            return Ok(Self { root, _lock });
        }
        if begun {
            drop(lock(&units, waiting));
            clear_abandoned(&units);
        }
        let whole = WholeDirectory::create(target, force, inputs)?;
        let refused = |error: std::io::Error| FileError::unwritten(target, &error);
        fs::write(whole.path().join(JOB_FILE), part.to_json()).map_err(refused)?;
        fs::create_dir(whole.path().join(UNITS)).map_err(refused)?;
        whole.commit_growing(&[JOB_FILE, UNITS, &below_units()])?;
        let _lock = lock(&units, waiting);
        Ok(Self { root, _lock })
    }

    /// The unit from an earlier run, if it was calibrated from the same inputs.
    pub fn kept(&self, name: &str, key: &str) -> Option<Unit> {
        let unit = read_unit(&self.root.join(UNITS).join(name), Some(key));
        Some(unit.ok()?.0)
    }

    /// Stores a unit; `write` adds further files to its directory.
    ///
    /// # Errors The error of `write`, or [`FileError`] if the unit cannot be written.
    pub fn put<E: From<FileError>>(
        &self,
        unit: &Unit,
        key: &str,
        write: impl FnOnce(&Path) -> Result<(), E>,
    ) -> Result<(), E> {
        let target = self.root.join(UNITS).join(&unit.name);
        let whole = WholeDirectory::create(&target, true, &[])?;
        write_unit(unit, key, &whole.path())?;
        write(&whole.path())?;
        Ok(whole.commit()?)
    }

    /// Copies a unit from the directory of a part.
    pub fn copy(&self, part: &Path, name: &str) -> Result<Unit, FileError> {
        let from = part.join(UNITS).join(name);
        let (unit, key) = read_unit(&from, None)?;
        if let Some(kept) = self.kept(name, &key) {
            return Ok(kept);
        }
        let target = self.root.join(UNITS).join(name);
        let whole = WholeDirectory::create(&target, true, &[])?;
        copy_all(&from, &whole.path()).map_err(|error| {
            FileError::io(&from, "copy the unit", &error, "Free some disk space.")
        })?;
        whole.commit()?;
        Ok(unit)
    }

    /// Stores the summary of all units, and removes outdated files.
    pub fn finish(&self, files: &[(String, String)]) -> Result<(), FileError> {
        clear_abandoned(&self.root.join(UNITS));
        let below = below_units();
        let mut names = vec![JOB_FILE, UNITS, &below];
        names.extend(files.iter().map(|(name, _)| name.as_str()));
        list_anew(&self.root, &names)?;
        for (name, text) in files {
            write_whole(&self.root.join(name), text.as_bytes(), true)?;
        }
        Ok(())
    }
}

fn below_units() -> String {
    format!("{UNITS}/")
}

/// Waits until no other process works in the directory.
fn lock(units: &Path, waiting: &dyn Fn()) -> Option<File> {
    let file = File::open(units).ok()?;
    match file.try_lock() {
        Ok(()) => Some(file),
        Err(TryLockError::WouldBlock) => {
            waiting();
            file.lock().is_ok().then_some(file)
        }
        Err(TryLockError::Error(_)) => None,
    }
}

/// Refuses a directory started for a different job.
fn check_same(target: &Path, found: &Part, expected: &Part) -> Result<(), FileError> {
    let difference = found.job.difference(&expected.job).or_else(|| {
        let words = |part: &Part| match part.shard {
            None => "the whole lot".to_owned(),
            Some(shard) => format!("part {shard}"),
        };
        (found.shard != expected.shard).then(|| format!("{} and {}", words(found), words(expected)))
    });
    difference.map_or(Ok(()), |difference| {
        let found = format_args!("a lot started with other options ({difference})");
        let expected = "a lot started with the options of this command";
        let advice = "Use the same options, choose another directory, or add --force to restart.";
        Err(FileError::of(target, found, expected, advice))
    })
}

/// Refuses a directory with units that are not in the lot.
fn check_units(units: &Path, part: &Part) -> Result<(), FileError> {
    let name = |run: u64| part.job.names.get(usize::try_from(run).ok()?);
    let held: Vec<&String> = part.held().into_iter().filter_map(name).collect();
    let entries = fs::read_dir(units).into_iter().flatten().flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let others = names.filter(|name| !name.starts_with('.') && !held.contains(&name));
    others.min().map_or(Ok(()), |other| {
        let found = format_args!("unit `{other}`, which is not among the runs of this command");
        let advice = "Also give the run.toml of this unit, choose another directory, or add --force to restart.";
        Err(FileError::of(
            units,
            found,
            "only units of this lot",
            advice,
        ))
    })
}

/// A unit and its key; the key must be the expected one, if there is one.
fn read_unit(directory: &Path, key: Option<&str>) -> Result<(Unit, String), FileError> {
    let path = directory.join(UNIT_FILE);
    let record: UnitRecord =
        small_file::json(&path, "a unit", FORMAT, "Calibrate the unit again.")?;
    let wrong = |found: &str| {
        let (expected, advice) = (
            "the unit.json file as turncal wrote it",
            "Calibrate it again.",
        );
        Err(FileError::of(directory, found, expected, advice))
    };
    if key.is_some_and(|key| record.key != key) {
        return wrong("a different key");
    }
    let path = directory.join(CALIBRATION_FILE);
    let bytes = turncal_input::small_file::read(&path);
    let digest = bytes.ok().map(|bytes| digest_of_bytes(&bytes));
    if record.failure.is_none() && record.calibration_sha256 != digest {
        return wrong("a calibration.json that belongs to another unit");
    }
    let calibrated = match record.failure {
        Some(failure) => Err(failure),
        None => Ok(Calibrated {
            calibration: crate::read_calibration(&path)?,
            noise: record.noise_at_rest,
        }),
    };
    let unit = Unit {
        name: record.name,
        meta: record.meta,
        calibrated,
    };
    Ok((unit, record.key))
}

fn write_unit(unit: &Unit, key: &str, directory: &Path) -> Result<(), FileError> {
    let calibrated = unit.calibrated.as_ref().ok();
    let path = directory.join(CALIBRATION_FILE);
    let json = calibrated.map(|of| calibration_json(&of.calibration, &path));
    let json = json.transpose()?;
    let record = UnitRecord {
        format: FORMAT.to_owned(),
        name: unit.name.clone(),
        key: key.to_owned(),
        meta: unit.meta.clone(),
        noise_at_rest: calibrated.and_then(|of| of.noise),
        calibration_sha256: json.as_deref().map(digest_of_bytes),
        failure: unit.calibrated.as_ref().err().cloned(),
    };
    let refused = |error: std::io::Error| FileError::unwritten(&path, &error);
    let bytes = small_file::pretty(&record).map_err(|error| refused(error.into()))?;
    fs::write(directory.join(UNIT_FILE), bytes).map_err(refused)?;
    if let Some(json) = json {
        fs::write(&path, json).map_err(refused)?;
    }
    Ok(())
}

/// Copies files and directories, except for the manifest: the copy gets its own.
fn copy_all(from: &Path, to: &Path) -> std::io::Result<()> {
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            fs::create_dir(&target)?;
            copy_all(&entry.path(), &target)?;
        } else if entry.file_name() != super::whole::LIST {
            fs::write(&target, fs::read(entry.path())?)?;
        }
    }
    Ok(())
}
