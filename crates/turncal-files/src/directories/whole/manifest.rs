//! The list of the files that turncal wrote into a directory, to distinguish them from files added by a user.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use turncal_input::small_file;

/// Name of the list file in its directory.
pub const FILE: &str = ".turncal";

const FIRST_LINE: &str = "turncal-output/1: turncal wrote the files listed here; --force replaces this directory only \
if it contains no files other than these";

/// The list of all entries of a directory.
pub fn of_all(directory: &Path) -> io::Result<String> {
    let mut names = Vec::new();
    search(directory, Path::new(""), &mut |entry| {
        names.push(name(entry));
        false
    })?;
    Ok(of_names(names.iter().map(String::as_str)))
}

/// Text of the list for a growing directory with these entries. Entries that end in `/` are directories with their own
/// list.
pub fn of_names<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let lines = std::iter::once(FIRST_LINE).chain(names);
    lines.flat_map(|line| [line, "\n"]).collect()
}

/// The names in the list of a directory, including the list itself; `None` without a list.
fn listed(directory: &Path) -> Option<BTreeSet<String>> {
    let file = directory.join(FILE);
    let text = match fs::symlink_metadata(&file) {
        Ok(found) if found.is_file() => small_file::read_text(&file).unwrap_or_default(),
        _ => String::new(),
    };
    let mut lines = text.lines();
    let is_list = lines.next() == Some(FIRST_LINE);
    is_list.then(|| lines.chain([FILE]).map(str::to_owned).collect())
}

/// Files named in the list of a directory, without subdirectories.
pub fn listed_files(directory: &Path) -> Vec<PathBuf> {
    let names = listed(directory).unwrap_or_default().into_iter();
    let here = names.filter(|name| !name.contains('/') && name != FILE);
    let files = here.map(|name| directory.join(name));
    files.filter(|file| file.is_file()).collect()
}

/// Relative path of the first entry of a directory that is not in its list.
pub fn foreign(directory: &Path) -> io::Result<Option<PathBuf>> {
    let of_all = listed(directory).unwrap_or_default();
    let grows: Vec<&str> = of_all.iter().filter_map(|n| n.strip_suffix('/')).collect();
    let mut of_one: BTreeMap<PathBuf, Option<BTreeSet<String>>> = BTreeMap::new();
    search(directory, Path::new(""), &mut |entry| {
        if of_all.contains(&name(entry)) {
            return false;
        }
        let Some(grown) = grows.iter().find(|grown| entry.starts_with(grown)) else {
            return true;
        };
        let within = entry.strip_prefix(grown).unwrap_or(entry);
        let mut parts = within.iter();
        let one = parts.next().unwrap_or_default();
        let list = of_one
            .entry(one.into())
            .or_insert_with(|| listed(&directory.join(grown).join(one)));
        let rest = name(parts.as_path());
        let names = |list: &BTreeSet<String>| rest.is_empty() || list.contains(&rest);
        !list.as_ref().is_some_and(names)
    })
}

/// The first matching entry below `root`, in order of name; links are not followed.
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

/// Name of an entry in the list, identical on every system.
fn name(entry: &Path) -> String {
    let parts: Vec<_> = entry.iter().map(|part| part.to_string_lossy()).collect();
    parts.join("/")
}
