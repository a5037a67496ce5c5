//! File names for tables and messages.

use std::ffi::OsStr;
use std::path::Path;

/// Returns the file stems if they differ, otherwise the directory names if these differ, otherwise the whole paths.
pub fn short_names(paths: &[&Path]) -> Vec<String> {
    let shown = |name: &OsStr| name.to_string_lossy().into_owned();
    let stem = |path: &Path| path.file_stem().map(shown);
    let parent = |path: &Path| path.parent()?.file_name().map(shown);
    let shortest = |path: &&Path| {
        let unique = |of: &dyn Fn(&Path) -> Option<String>| {
            let name = of(path)?;
            let alike = paths.iter().filter(|p| of(p).as_ref() == Some(&name));
            (alike.count() == 1).then_some(name)
        };
        unique(&stem)
            .or_else(|| unique(&parent))
            .unwrap_or_else(|| path.display().to_string())
    };
    paths.iter().map(shortest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_as_short_as_they_can_be_told_apart() {
        let names = |paths: &[&str]| short_names(&paths.iter().map(Path::new).collect::<Vec<_>>());
        assert_eq!(names(&["a/one.json", "a/two.json"]), ["one", "two"]);
        assert_eq!(
            names(&["mon/calibration.json", "fri/calibration.json", "truth.json"]),
            ["mon", "fri", "truth"]
        );
        assert_eq!(
            names(&["a/b/c.json", "d/b/c.json"]),
            ["a/b/c.json", "d/b/c.json"]
        );
    }
}
