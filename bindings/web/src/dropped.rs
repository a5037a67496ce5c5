//! Files of a drop: a log; a log of the gyros and one of the accelerometers; or a run.toml with its files.

use std::path::Path;

use toml::{Table, Value};
use turncal::run::Run;
use turncal_logs::DataFile;

/// Signs of files that are not logs, in their first bytes.
const OTHERS: [(&[u8], &str); 5] = [
    (b"PNG\r\n\x1a\n", "a picture"),
    (b"\xff\xd8\xff", "a picture"),
    (b"%PDF-", "a PDF document"),
    (b"<!DOCTYPE html", "a web page, such as a report of turncal"),
    (b"turncal-calibration/", "a calibration of turncal"),
];

/// Moves the run.toml, or the log of the gyros, to the front; the log of the accelerometers, if it is separate.
pub fn sort(files: &mut [DataFile]) -> Result<Option<DataFile>, String> {
    files.sort_by_key(|file| !is_run(file));
    match files.iter().filter(|file| is_run(file)).count() {
        0 => logs(files),
        1 => missing(&files[0], files).map_or(Ok(None), Err),
        n => Err(format!(
            "Found {}, expected one run.toml. Drop one of them with the files that it names.",
            list(&files[..n])
        )),
    }
}

pub fn is_run(file: &DataFile) -> bool {
    file.extension().is_some_and(|end| end == "toml")
}

fn logs(files: &mut [DataFile]) -> Result<Option<DataFile>, String> {
    if let Some((file, kind)) = files.iter().find_map(|file| Some((file, other(file)?))) {
        let name = file.display();
        return Err(format!(
            "{name}: found {kind}, expected a log. Drop the file that the logger of the sensor wrote."
        ));
    }
    match files.iter().map(triad).collect::<Vec<_>>()[..] {
        [] | [_] => return Ok(None),
        [Some("gyr"), Some("acc")] => {}
        [Some("acc"), Some("gyr")] => files.swap(0, 1),
        _ => return Err(several(files)),
    }
    Ok(files.last().cloned())
}

/// The kind of a file that is not a log.
fn other(file: &DataFile) -> Option<&'static str> {
    let bytes = file.bytes()?;
    let first = &bytes[..bytes.len().min(64)];
    let is_in = |sign: &[u8]| first.windows(sign.len()).any(|bytes| bytes == sign);
    let found = OTHERS.iter().find(|(sign, _)| is_in(sign));
    found.map(|(_, kind)| *kind)
}

/// The only triad in the name of a file: phones and recorders name their files so.
fn triad(file: &DataFile) -> Option<&'static str> {
    let name = file.to_string_lossy().to_lowercase();
    match (name.contains("gyr"), name.contains("acc")) {
        (true, false) => Some("gyr"),
        (false, true) => Some("acc"),
        _ => None,
    }
}

fn several(files: &[DataFile]) -> String {
    format!(
        "Found {} logs: {}. Drop one log; or one of the gyros and one of the accelerometers, with `gyr` and `acc` in \
         their names; or a run.toml with the files that it names.",
        files.len(),
        list(files)
    )
}

/// A message about the files that a run.toml names but that were not dropped.
fn missing(run: &DataFile, files: &[DataFile]) -> Option<String> {
    let text = String::from_utf8_lossy(run.bytes()?);
    // The engine says what is wrong with the text.
    let table: Table = text.parse().ok()?;
    let is_here = |name: &&Path| {
        files
            .iter()
            .any(|file| file.file_name() == name.file_name())
    };
    let absent: Vec<&Path> = named(&table)
        .into_iter()
        .filter(|name| !is_here(name))
        .collect();
    (!absent.is_empty()).then(|| {
        format!(
            "{} names files that you did not drop: {}. Drop it together with all of them (you dropped {}).",
            run.display(),
            list(absent),
            list(files)
        )
    })
}

/// The files that a run.toml names.
fn named(table: &Table) -> Vec<&Path> {
    let fields = table.iter();
    let files = fields.flat_map(|(key, value)| match value {
        Value::String(file) if key == "file" => vec![Path::new(file)],
        Value::Table(table) => named(table),
        _ => Vec::new(),
    });
    files.collect()
}

/// The names of dropped files that a run does not use.
pub fn unused(files: &[DataFile], run: &Run) -> Option<String> {
    let used = &run.recording.files;
    let is_used = |file: &DataFile| used.iter().any(|path| path.file_name() == file.file_name());
    let unused = files.iter().filter(|file| !is_run(file) && !is_used(file));
    let unused: Vec<&DataFile> = unused.collect();
    (!unused.is_empty()).then(|| list(unused))
}

fn list(paths: impl IntoIterator<Item = impl AsRef<Path>>) -> String {
    let name = |path: &Path| path.display().to_string();
    let names: Vec<String> = paths.into_iter().map(|path| name(path.as_ref())).collect();
    names.join(", ")
}
