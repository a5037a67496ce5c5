//! What a program that uses the library has to compile.

use std::process::Command;

#[test]
fn without_default_features_no_crate_of_a_user_interface_is_compiled() {
    let of_interface = [
        "anyhow",
        "clap",
        "clap_complete",
        "clap_mangen",
        "indicatif",
        "maud",
        "signal-hook",
        "terminal_size",
    ];
    let of_certificates = ["krilla", "skrifa"];
    let tree = |features: &[&str]| {
        let output = Command::new(env!("CARGO"))
            .args(["tree", "--offline", "--edges", "normal", "--prefix", "none"])
            .args(["--format", "{p}", "--manifest-path"])
            .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/../../Cargo.toml"))
            .args(features)
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        let text = String::from_utf8(output.stdout).unwrap();
        let names = text.lines().filter_map(|line| line.split(' ').next());
        names.map(str::to_owned).collect::<Vec<String>>()
    };
    let count = |of: &[&str], names: &[String]| {
        let found = of
            .iter()
            .filter(|name| names.iter().any(|found| found == *name));
        found.count()
    };
    let found = |names: Vec<String>| count(&of_interface, &names);
    assert_eq!(
        count(&of_certificates, &tree(&["--no-default-features"])),
        0
    );
    assert_eq!(count(&of_certificates, &tree(&[])), of_certificates.len());
    assert_eq!(found(tree(&["--no-default-features"])), 0);
    assert_eq!(
        found(tree(&["--no-default-features", "--features", "report"])),
        1
    );
    assert_eq!(
        found(tree(&[])),
        of_interface.len() - usize::from(cfg!(not(unix)))
    );
}
