//! SHA-256 of bytes and files, which identifies inputs.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use serde::Serialize;
use sha2::{Digest, Sha256};
use toml::{Table, Value};

use crate::is_toml;
use turncal_input::small_file;

/// SHA-256 of a value as JSON, in hexadecimal digits.
pub fn digest_of(value: &impl Serialize) -> String {
    // None of the values hashed here contains a map without names, the only thing that cannot be written as JSON.
    let text = serde_json::to_vec(value).unwrap_or_default();
    hexadecimal(&Sha256::digest(text))
}

/// SHA-256 of some bytes.
pub fn digest_of_bytes(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

fn hexadecimal(digest: &[u8]) -> String {
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn digest_of_file(path: &Path) -> io::Result<String> {
    let mut file = File::open(path)?;
    let mut hash = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok(hexadecimal(&hash.finalize())),
            count => hash.update(&buffer[..count]),
        }
    }
}

/// The files named in the run.toml of a run, each with its digest or, if it cannot be read, with the system error. The
/// run.toml comes first.
///
/// For a campaign: the campaign file, then the files of each recording, in the order of the recordings' paths.
pub fn input_digests(run: &Path) -> Vec<(String, String)> {
    let file = table_of(run);
    let recordings = file.get("recording").and_then(Value::as_array);
    let recordings = recordings.into_iter().flatten();
    let named = recordings.filter_map(|of| of.get("run")?.as_str());
    let mut named: Vec<&str> = named.collect();
    if named.is_empty() {
        return digests_of_run(run);
    }
    named.sort_unstable();
    let directory = run.parent().unwrap_or(Path::new(""));
    let mut all = vec![("campaign.toml".to_owned(), digest_or_error(run))];
    for recording in named {
        let folder = Path::new(recording).parent().unwrap_or(Path::new(""));
        let of_recording = digests_of_run(&directory.join(recording)).into_iter();
        let below = |name: String| folder.join(name).display().to_string();
        all.extend(of_recording.map(|(name, digest)| (below(name), digest)));
    }
    all
}

/// The content of a run.toml or campaign.toml, even if it is invalid; a log refers to no other files.
fn table_of(path: &Path) -> Table {
    if !is_toml(path) {
        return Table::new();
    }
    let text = small_file::text(path, "", "").unwrap_or_default();
    text.parse().unwrap_or_default()
}

/// The digest of a file, or the system error if it cannot be read.
fn digest_or_error(path: &Path) -> String {
    digest_of_file(path).unwrap_or_else(|error| error.kind().to_string())
}

fn digests_of_run(run: &Path) -> Vec<(String, String)> {
    let name = if is_toml(run) {
        "run.toml".into()
    } else {
        run.file_name().unwrap_or_default().to_string_lossy()
    };
    let mut all = vec![(name.into_owned(), digest_or_error(run))];
    let directory = run.parent().unwrap_or(Path::new(""));
    let of = table_of(run);
    let imu = of.get("imu");
    let tables = [
        imu,
        imu.and_then(|imu| imu.get("accel_from")),
        of.get("turntable"),
        of.get("segments"),
    ];
    let files = tables.into_iter().flatten();
    all.extend(files.filter_map(|of| of.get("file")?.as_str()).map(|file| {
        let digest = digest_or_error(&directory.join(file));
        (file.to_owned(), digest)
    }));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_digest_is_sha_256() {
        // FIPS 180-4, the example "abc".
        assert_eq!(
            digest_of_bytes(b"abc"),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        );
        assert_eq!(digest_of(&"abc"), digest_of_bytes(b"\"abc\""));
    }

    #[test]
    fn inputs_are_all_files_of_a_run_and_change_with_each() {
        let directory = tempfile::tempdir().unwrap();
        let run = directory.path().join("run.toml");
        let text = "[imu]\nfile = \"a.csv\"\naccel_from = { file = \"c.csv\" }\n[turntable]\nfile = \"b.csv\"\n";
        std::fs::write(&run, text).unwrap();
        std::fs::write(directory.path().join("a.csv"), "1").unwrap();
        let first = input_digests(&run);
        let names: Vec<&str> = first.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["run.toml", "a.csv", "c.csv", "b.csv"]);
        std::fs::write(directory.path().join("b.csv"), "2").unwrap();
        let second = input_digests(&run);
        assert_eq!(first[..3], second[..3]);
        assert!(first[3] != second[3]);
    }

    #[test]
    fn a_log_names_no_files_whatever_its_text() {
        let directory = tempfile::tempdir().unwrap();
        let log = directory.path().join("imu.csv");
        std::fs::write(&log, "[imu]\nfile = \"b.csv\"\n").unwrap();
        let names = input_digests(&log).into_iter().map(|(name, _)| name);
        assert_eq!(names.collect::<Vec<_>>(), ["imu.csv"]);
    }
}
