//! What a new user is told.

use std::collections::BTreeSet;
use std::fs;

use assert_cmd::Command;

fn turncal(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
    command.args(arguments).env_remove("COLUMNS");
    command
}

fn output(arguments: &[&str], columns: Option<&str>) -> String {
    let mut command = turncal(arguments);
    if let Some(columns) = columns {
        command.env("COLUMNS", columns);
    }
    let done = command.assert().success();
    String::from_utf8(done.get_output().stdout.clone()).unwrap()
}

/// The words of each command, as its manual page is named.
fn commands() -> Vec<Vec<String>> {
    let directory = tempfile::tempdir().unwrap();
    let manual = directory.path().join("man");
    output(&["man", "-o", manual.to_str().unwrap()], None);
    fs::read_dir(manual)
        .unwrap()
        .map(|entry| {
            let name = entry.unwrap().file_name().into_string().unwrap();
            let words = name.strip_suffix(".1").unwrap().split('-').skip(1);
            words.map(str::to_owned).collect()
        })
        .collect()
}

#[test]
fn help_fits_80_and_120_columns_and_breaks_no_example() {
    let commands = commands();
    assert!(commands.len() > 15);
    for words in &commands {
        let mut arguments: Vec<&str> = words.iter().map(String::as_str).collect();
        arguments.push("--help");
        let examples = |text: &str| -> BTreeSet<String> {
            let lines = text.lines().filter(|line| line.starts_with("  turncal "));
            lines.map(str::to_owned).collect()
        };
        let unbroken = examples(&output(&arguments, Some("1000")));
        for columns in ["80", "120"] {
            let help = output(&arguments, Some(columns));
            let width: usize = columns.parse().unwrap();
            let widest = help.lines().map(|line| line.chars().count()).max();
            assert!(
                widest <= Some(width),
                "{arguments:?} at {columns}: {widest:?}"
            );
            assert_eq!(examples(&help), unbroken, "{arguments:?} at {columns}");
        }
    }
}

#[test]
fn manual_pages_go_beside_what_is_there() {
    let directory = tempfile::tempdir().unwrap();
    let other = directory.path().join("ls.1");
    fs::write(&other, "mine").unwrap();
    let man = |arguments: &[&str]| {
        let mut command = turncal(&["man", "-o"]);
        command.arg(directory.path()).args(arguments).assert()
    };
    man(&[]).success();
    man(&[]).code(1);
    man(&["--force"]).success();
    assert_eq!(fs::read(&other).unwrap(), b"mine");
    let page = fs::read_to_string(directory.path().join("turncal-study-accuracy.1")).unwrap();
    assert!(page.contains(".SH EXAMPLES") && page.contains("unmodelled"));
    assert_eq!(
        output(&["man"], None).as_bytes(),
        fs::read(directory.path().join("turncal.1")).unwrap()
    );
}

#[test]
fn shells_are_told_the_commands() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = output(&["completions", shell], None);
        assert!(
            script.contains("six-position") && script.contains("calibrate"),
            "{shell}"
        );
    }
}

#[test]
fn the_list_names_every_model_with_what_it_is() {
    let document: serde_json::Value =
        serde_json::from_str(&output(&["list", "--json"], None)).unwrap();
    let entries = document.as_array().unwrap();
    let of = |entry: &serde_json::Value, key: &str| entry[key].as_str().unwrap().to_owned();
    let text = output(&["list"], None);
    let mut kinds = BTreeSet::new();
    for entry in entries {
        let (kind, name) = (of(entry, "kind"), of(entry, "name"));
        let description = of(entry, "description");
        let line = text.lines().find(|line| line.ends_with(&description));
        assert!(
            line.is_some_and(|line| line.contains(&name)),
            "{kind} {name}"
        );
        kinds.insert(kind);
    }
    let folders = fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../../models")).unwrap();
    let folders = folders.map(|folder| folder.unwrap().file_name().into_string().unwrap());
    assert_eq!(kinds, folders.collect());
    let narrow = output(&["list"], Some("80"));
    assert!(
        narrow
            .lines()
            .all(|line| line.chars().count() <= 80 && line == line.trim_end())
    );
}

#[test]
fn wrong_usage_is_status_two_and_says_what_to_do() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("run.toml"), "").unwrap();
    fs::write(directory.path().join("imu.csv"), "").unwrap();
    let here = directory.path().to_str().unwrap();
    let log = format!("{here}/imu.csv");
    let six = [
        "calibrate",
        "run.toml",
        "--method",
        "six-position",
        "--with",
        "size-effect",
    ];
    let velocity = [
        "calibrate",
        "run.toml",
        "--aiding",
        "velocity",
        "--with",
        "table-base",
    ];
    let study = [
        "study",
        "accuracy",
        "--aiding",
        "velocity",
        "--with",
        "table-axes",
    ];
    let none = [
        "calibrate",
        "run.toml",
        "--with",
        "none",
        "--with",
        "time-offset",
    ];
    let auto = ["path", "evaluate", "three-axis", "--with", "auto,none"];
    for (arguments, says) in [
        (&six[..], "omit --with, or use --method ekf"),
        (
            &none,
            "--with none and --with time-offset exclude each other; write --with none alone",
        ),
        (&auto, "--with auto and --with none exclude each other"),
        (&velocity, "--aiding velocity does not use the table"),
        (&study, "omit one of the two options"),
        (&["calibrate", here], "this is a directory; give"),
        (
            &["export", "c.json", "--format", "c", "--run", &log],
            "turncal init",
        ),
        (&["calibrte"], "'calibrate'"),
        (
            &["calibrate", "run.toml", "--with", "size_effect"],
            "'size-effect'",
        ),
        (
            &["simulate", "demo", "-o", "x", "--seed", "1e3"],
            "expected a whole number from 0",
        ),
        (
            &["simulate", "demo", "-o", "x", "--seed", "-1"],
            "expected a whole number from 0",
        ),
        (
            &["study", "accuracy", "--runs", "1"],
            "expected a whole number from 2 to 1000000",
        ),
        (
            &["study", "table1", "--latitude-deg", "nan"],
            "expected a number from -90 to 90",
        ),
        (
            &["study", "experiment", "--hours", "0"],
            "from 0.0167 (one minute) to 1000",
        ),
        (&["noise", "-1", "deg/h"], "expected a number above zero"),
        (&["compare", "one.json"], "--truth"),
    ] {
        let refused = turncal(arguments).assert().code(2);
        let message = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
        assert!(message.contains(says), "{arguments:?}: {message}");
    }
}
