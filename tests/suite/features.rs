//! What a program that uses the library has to compile.

use std::process::Command;

/// The crates that one of the workspace needs, by name.
fn needed_by(package: &str) -> Vec<String> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--edges", "normal", "--prefix", "none"])
        .args(["--format", "{p}", "--package", package, "--manifest-path"])
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    let names = text.lines().filter_map(|line| line.split(' ').next());
    names.map(str::to_owned).collect()
}

#[test]
fn the_science_compiles_no_interface_no_log_format_and_no_page() {
    let above = [
        "anyhow",
        "clap",
        "csv",
        "flate2",
        "hdf5-pure",
        "indicatif",
        "krilla",
        "maud",
        "plotters",
        "ruzstd",
        "tempfile",
        "zip",
    ];
    let of_all = needed_by("turncal-cli");
    let of_science = needed_by("turncal");
    for name in above {
        assert!(of_all.iter().any(|of| of == name), "{name} is not used");
        assert!(of_science.iter().all(|of| of != name), "{name}");
    }
}

#[test]
fn crates_depend_on_one_another_in_one_direction() {
    let own = |package: &str| -> Vec<String> {
        let mut names = needed_by(package);
        names.retain(|name| name.starts_with("turncal") && name != package);
        names.sort();
        names.dedup();
        names
    };
    assert!(own("turncal-input").is_empty());
    assert_eq!(own("turncal"), ["turncal-input"]);
    assert_eq!(own("turncal-logs"), ["turncal-input"]);
    assert_eq!(own("turncal-report"), ["turncal", "turncal-input"]);
    let below_files = ["turncal", "turncal-input", "turncal-logs"];
    assert_eq!(own("turncal-files"), below_files);
}
