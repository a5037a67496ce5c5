//! What tells one input from another: SHA-256 of bytes and of files.

use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use serde::Serialize;
use sha2::{Digest, Sha256};
use toml::de::DeTable;

use super::small_file;

/// Tables of a run.toml that name a file beside it.
const WITH_FILE: [&str; 3] = ["imu", "turntable", "segments"];

/// SHA-256 of a value as JSON, in hexadecimal digits.
pub fn digest_of(value: &impl Serialize) -> String {
    // What cannot be written as JSON, a map without names, is in none of the values that come here.
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

/// The files of a run, as its run.toml names them, each with its digest, or with what the system says
/// where it cannot be read. The run.toml comes first; the others are those that it names.
///
/// Of a campaign its file, then those of each recording, in the order of their paths.
pub fn input_digests(run: &Path) -> Vec<(String, String)> {
    let recordings = recordings(run);
    if !recordings.is_empty() {
        let directory = run.parent().unwrap_or(Path::new(""));
        let digest = digest_of_file(run).unwrap_or_else(|error| error.kind().to_string());
        let mut all = vec![("campaign.toml".to_owned(), digest)];
        for recording in recordings {
            let of_recording = digests_of_run(&directory.join(&recording));
            let folder = Path::new(&recording).parent().unwrap_or(Path::new(""));
            let named = of_recording
                .into_iter()
                .map(|(name, digest)| (folder.join(name).display().to_string(), digest));
            all.extend(named);
        }
        return all;
    }
    digests_of_run(run)
}

fn digests_of_run(run: &Path) -> Vec<(String, String)> {
    let digest = |name: String, path: PathBuf| {
        let digest = digest_of_file(&path).unwrap_or_else(|error| error.kind().to_string());
        (name, digest)
    };
    let name = match run.extension() == Some(OsStr::new("toml")) {
        true => "run.toml".into(),
        false => run.file_name().unwrap_or_default().to_string_lossy(),
    };
    let mut all = vec![digest(name.into_owned(), run.to_owned())];
    let text = small_file::text(run).unwrap_or_default();
    let Ok(table) = DeTable::parse(&text) else {
        return all;
    };
    let directory = run.parent().unwrap_or(Path::new(""));
    for name in WITH_FILE {
        let file = table.get_ref().get(name).and_then(|value| {
            let table = value.get_ref().as_table()?;
            table.get("file")?.get_ref().as_str()
        });
        if let Some(file) = file {
            all.push(digest(file.to_owned(), directory.join(file)));
        }
    }
    all
}

/// The recordings that a campaign names, sorted; none of a run.
fn recordings(campaign: &Path) -> Vec<String> {
    let text = small_file::text(campaign).unwrap_or_default();
    let Ok(table) = DeTable::parse(&text) else {
        return Vec::new();
    };
    let all = table.get_ref().get("recording");
    let all = all.and_then(|value| value.get_ref().as_array());
    let run = |value: &toml::Spanned<toml::de::DeValue>| {
        let table = value.get_ref().as_table()?;
        Some(table.get("run")?.get_ref().as_str()?.to_owned())
    };
    let mut named: Vec<String> = all
        .into_iter()
        .flat_map(|all| all.iter().filter_map(run))
        .collect();
    named.sort();
    named
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
        let text = "[imu]\nfile = \"a.csv\"\n[turntable]\nfile = \"b.csv\"\n";
        std::fs::write(&run, text).unwrap();
        std::fs::write(directory.path().join("a.csv"), "1").unwrap();
        let first = input_digests(&run);
        let names: Vec<&str> = first.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["run.toml", "a.csv", "b.csv"]);
        std::fs::write(directory.path().join("b.csv"), "2").unwrap();
        let second = input_digests(&run);
        assert_eq!(first[..2], second[..2]);
        assert!(first[2] != second[2]);
    }
}
