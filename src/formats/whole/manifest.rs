//! The list that tells what turncal wrote into a directory from what a user put beside it.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The list's name in its directory.
pub(super) const FILE: &str = ".turncal";

const FIRST_LINE: &str = "turncal-output/1: turncal wrote what is listed here, and --force replaces \
                          this directory only while it holds nothing else";

/// Lists all that is in a directory.
pub(super) fn write(directory: &Path) -> io::Result<()> {
    let mut list = FIRST_LINE.to_owned() + "\n";
    let all = search(directory, Path::new(""), &mut |entry| {
        list += &name(entry);
        list.push('\n');
        false
    });
    all?;
    fs::write(directory.join(FILE), list)
}

/// The first entry of a directory that its list does not name, relative to it.
pub(super) fn foreign(directory: &Path) -> io::Result<Option<PathBuf>> {
    let file = directory.join(FILE);
    let text = match fs::symlink_metadata(&file) {
        Ok(found) if found.is_file() => fs::read_to_string(&file).unwrap_or_default(),
        _ => String::new(),
    };
    let mut lines = text.lines();
    let is_list = lines.next() == Some(FIRST_LINE);
    let listed: BTreeSet<&str> = lines.chain([FILE]).filter(|_| is_list).collect();
    search(directory, Path::new(""), &mut |entry| {
        !listed.contains(name(entry).as_str())
    })
}

/// The first entry below `root` that is wanted, in the order of their names; links are not followed.
fn search(
    root: &Path,
    below: &Path,
    wanted: &mut impl FnMut(&Path) -> bool,
) -> io::Result<Option<PathBuf>> {
    let entries = fs::read_dir(root.join(below))?;
    let mut entries = entries
        .map(|entry| entry.and_then(|entry| Ok((entry.file_name(), entry.file_type()?.is_dir()))))
        .collect::<io::Result<Vec<(OsString, bool)>>>()?;
    entries.sort();
    for (name, is_directory) in entries {
        let entry = below.join(name);
        if wanted(&entry) {
            return Ok(Some(entry));
        }
        if is_directory && let Some(found) = search(root, &entry, wanted)? {
            return Ok(Some(found));
        }
    }
    Ok(None)
}

/// An entry as the list names it, alike on every system.
fn name(entry: &Path) -> String {
    let parts: Vec<_> = entry.iter().map(|part| part.to_string_lossy()).collect();
    parts.join("/")
}
