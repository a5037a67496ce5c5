use super::*;

fn names(directory: &Path) -> Vec<String> {
    let entries = fs::read_dir(directory).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// A directory as turncal leaves it, with a file and a directory in it.
fn written(target: &Path, file: &str) {
    let whole = WholeDirectory::create(target, false, &[]).unwrap();
    fs::write(whole.path().join(file), "1").unwrap();
    fs::create_dir(whole.path().join("below")).unwrap();
    whole.commit().unwrap();
}

#[test]
fn a_directory_appears_on_commit_and_not_before() {
    let root = tempfile::tempdir().unwrap();
    let target = root.path().join("a/b");
    let whole = WholeDirectory::create(&target, false, &[]).unwrap();
    fs::write(whole.path().join("x"), "1").unwrap();
    assert!(!target.exists());
    whole.commit().unwrap();
    assert_eq!(names(&target), [".turncal", "x"]);
    assert_eq!(names(&root.path().join("a")), ["b"]);
}

#[test]
fn a_directory_that_is_given_up_leaves_nothing() {
    let root = tempfile::tempdir().unwrap();
    let whole = WholeDirectory::create(&root.path().join("a"), false, &[]).unwrap();
    fs::write(whole.path().join("x"), "1").unwrap();
    drop(whole);
    assert!(names(root.path()).is_empty());
}

#[test]
fn an_existing_directory_is_replaced_only_with_force_and_then_wholly() {
    let root = tempfile::tempdir().unwrap();
    let target = root.path().join("a");
    written(&target, "old");
    let error = WholeDirectory::create(&target, false, &[]).err().unwrap();
    assert!(error.to_string().contains("--force"), "{error}");
    let whole = WholeDirectory::create(&target, true, &[]).unwrap();
    fs::write(whole.path().join("new"), "1").unwrap();
    assert_eq!(names(&target), [".turncal", "below", "old"]);
    whole.commit().unwrap();
    assert_eq!(names(&target), [".turncal", "new"]);
    assert_eq!(names(root.path()), ["a"]);
}

#[test]
fn force_refuses_a_directory_with_anything_that_is_not_turncals_and_names_it() {
    let root = tempfile::tempdir().unwrap();
    let target = root.path().join("a");
    let refusal = || {
        let error = WholeDirectory::create(&target, true, &[]).err();
        error.map(|error| error.to_string()).unwrap_or_default()
    };
    // A run directory of the user's own has the names of one that turncal writes.
    fs::create_dir(&target).unwrap();
    fs::write(target.join("run.toml"), "mine").unwrap();
    assert!(refusal().contains("`run.toml`"), "{}", refusal());
    fs::remove_file(target.join("run.toml")).unwrap();
    assert_eq!(refusal(), "", "an empty directory holds nothing to lose");

    fs::remove_dir(&target).unwrap();
    written(&target, "report");
    for foreign in [
        "a.txt",
        "z.txt",
        ".hidden",
        "below/notes.txt",
        "below/empty/",
    ] {
        let path = target.join(foreign);
        if foreign.ends_with('/') {
            fs::create_dir(&path).unwrap();
        } else {
            fs::write(&path, "mine").unwrap();
        }
        let named = foreign.trim_end_matches('/');
        assert!(refusal().contains(&format!("`{named}`")), "{}", refusal());
        assert!(path.exists());
        if path.is_dir() {
            fs::remove_dir(&path).unwrap();
        } else {
            fs::remove_file(&path).unwrap();
        }
    }
    // Nor is a list taken for one that is none.
    fs::write(target.join(".turncal"), "report\nbelow\n").unwrap();
    assert!(refusal().contains("`.turncal`"), "{}", refusal());
}

#[test]
fn what_a_user_adds_while_the_new_directory_is_made_is_kept() {
    let root = tempfile::tempdir().unwrap();
    let target = root.path().join("a");
    written(&target, "x");
    let whole = WholeDirectory::create(&target, true, &[]).unwrap();
    fs::write(target.join("mine.txt"), "precious").unwrap();
    let error = whole.commit().unwrap_err();
    assert!(error.to_string().contains("`mine.txt`"), "{error}");
    assert_eq!(names(&target), [".turncal", "below", "mine.txt", "x"]);
    assert_eq!(names(root.path()), ["a"]);
}

#[test]
fn directories_made_for_an_output_that_is_given_up_go_with_it() {
    let root = tempfile::tempdir().unwrap();
    let whole = WholeDirectory::create(&root.path().join("a/b/c"), false, &[]).unwrap();
    assert_eq!(names(&root.path().join("a")), ["b"]);
    drop(whole);
    assert!(names(root.path()).is_empty());
}

#[test]
fn the_next_output_clears_what_a_killed_process_left_and_touches_no_living_one() {
    let root = tempfile::tempdir().unwrap();
    let living = WholeDirectory::create(&root.path().join("living"), false, &[]).unwrap();
    fs::write(living.path().join("x"), "1").unwrap();
    let stage = |name: &str, files: &[&str]| {
        let directory = root.path().join(name);
        fs::create_dir(&directory).unwrap();
        for file in files {
            fs::write(directory.join(file), "1").unwrap();
        }
    };
    // Killed while it wrote, and after it had moved its output into place.
    stage(".turncal-killed", &["new"]);
    stage(".turncal-late", &["old"]);
    // Perhaps about to be locked.
    stage(".turncal-empty", &[]);
    // The only copy of what was to be replaced, and what was never turncal's.
    stage(".turncal-between", &["new", "old"]);
    stage(".turncal-mine", &["notes.txt"]);
    stage(".turncal-too", &["new", "notes.txt"]);
    write_whole(&root.path().join("file"), b"1", false).unwrap();
    living.commit().unwrap();
    assert_eq!(
        names(root.path()),
        [
            ".turncal-between",
            ".turncal-empty",
            ".turncal-mine",
            ".turncal-too",
            "file",
            "living"
        ]
    );
    assert!(root.path().join(".turncal-too/notes.txt").exists());
    assert_eq!(names(&root.path().join(".turncal-between")), ["new", "old"]);
}

#[test]
fn a_target_that_appeared_meanwhile_is_kept() {
    let root = tempfile::tempdir().unwrap();
    let target = root.path().join("a");
    let whole = WholeDirectory::create(&target, false, &[]).unwrap();
    fs::create_dir(&target).unwrap();
    assert!(whole.commit().is_err());
    assert_eq!(names(root.path()), ["a"]);
}

#[test]
fn force_replaces_neither_a_file_nor_what_holds_an_input_or_this_directory() {
    let root = tempfile::tempdir().unwrap();
    let file = root.path().join("run.toml");
    fs::write(&file, "1").unwrap();
    for (target, inputs) in [
        (file.as_path(), vec![]),
        (root.path(), vec![file.as_path()]),
        (&std::env::current_dir().unwrap(), vec![]),
        (Path::new("/"), vec![]),
    ] {
        assert!(WholeDirectory::create(target, true, &inputs).is_err());
    }
    assert_eq!(names(root.path()), ["run.toml"]);
}

#[test]
fn a_file_is_replaced_only_with_force_and_a_directory_never() {
    let root = tempfile::tempdir().unwrap();
    let file = root.path().join("x");
    write_whole(&file, b"1", false).unwrap();
    assert!(write_whole(&file, b"2", false).is_err());
    assert_eq!(fs::read(&file).unwrap(), b"1");
    write_whole(&file, b"2", true).unwrap();
    assert_eq!(fs::read(&file).unwrap(), b"2");
    assert!(write_whole(root.path(), b"3", true).is_err());
    assert_eq!(names(root.path()), ["x"]);
}

#[test]
fn a_file_on_the_way_to_the_output_is_named() {
    let root = tempfile::tempdir().unwrap();
    fs::write(root.path().join("x"), "1").unwrap();
    let error = write_whole(&root.path().join("x/y/z"), b"1", true).unwrap_err();
    assert!(error.to_string().contains("found the file "), "{error}");
    assert_eq!(names(root.path()), ["x"]);
}

#[test]
#[cfg(unix)]
fn a_link_is_neither_followed_nor_replaced_by_a_directory() {
    let root = tempfile::tempdir().unwrap();
    let (target, link) = (root.path().join("a"), root.path().join("link"));
    written(&target, "x");
    std::os::unix::fs::symlink(&target, &link).unwrap();
    let error = WholeDirectory::create(&link, true, &[]).err().unwrap();
    assert!(error.to_string().contains("a link"), "{error}");
    // A user's directory that a link leads to is not looked into, and outlives the link.
    let mine = root.path().join("mine");
    fs::create_dir(&mine).unwrap();
    fs::write(mine.join("notes.txt"), "precious").unwrap();
    fs::remove_file(target.join("x")).unwrap();
    std::os::unix::fs::symlink(&mine, target.join("x")).unwrap();
    WholeDirectory::create(&target, true, &[])
        .unwrap()
        .commit()
        .unwrap();
    assert_eq!(fs::read(mine.join("notes.txt")).unwrap(), b"precious");
}
