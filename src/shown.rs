//! Display of external text.

use std::path::{Path, PathBuf};

/// Most characters of an input that a message shows.
pub const LONGEST: usize = 200;

/// An input short enough for a message.
pub fn excerpt(text: &str) -> String {
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{} …", &text[..end]),
        None => text.to_owned(),
    }
}

/// Longest file name of any file system.
const LONGEST_NAME: usize = 255;

/// A path as given, except that names too long for a file are cut.
pub fn path(path: &Path) -> String {
    let names = || {
        path.components()
            .map(|name| name.as_os_str().to_string_lossy())
    };
    if names().all(|name| name.chars().count() <= LONGEST_NAME) {
        return path.display().to_string();
    }
    let names: PathBuf = names().map(|name| excerpt(&name)).collect();
    names.display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_shown_as_it_is_but_for_names_that_no_file_has() {
        for short in ["/a/b c/run.toml", "../run.toml", "./run.toml", "run.toml"] {
            assert_eq!(path(Path::new(short)), short);
        }
        let long = format!("/a/{}/run.toml", "x".repeat(5_000));
        assert!(path(Path::new(&long)).chars().count() < LONGEST + 20);
    }

    #[test]
    fn an_excerpt_ends_between_two_characters() {
        assert_eq!(excerpt("µg"), "µg");
        let long = excerpt(&"µ".repeat(1_000_000));
        assert_eq!(long.chars().filter(|&c| c == 'µ').count(), LONGEST);
    }
}
