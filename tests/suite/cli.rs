//! The commands as a user meets them.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use turncal::calibration::result::{Calibration, Method};

fn turncal() -> Command {
    Command::new(env!("CARGO_BIN_EXE_turncal"))
}

/// Every file below a directory with its bytes.
fn bytes_below(directory: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut open = vec![directory.to_owned()];
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                let name = path.strip_prefix(directory).unwrap();
                files.insert(name.display().to_string(), fs::read(&path).unwrap());
            }
        }
    }
    files
}

fn demo(output: &Path, threads: &str) {
    turncal()
        .arg("demo")
        .arg("-o")
        .arg(output)
        .env("RAYON_NUM_THREADS", threads)
        .assert()
        .success();
}

#[test]
#[ignore = "slow: two demonstrations"]
fn the_demo_gives_the_same_bytes_on_one_thread_and_on_two() {
    let directory = tempfile::tempdir().unwrap();
    let (one, two) = (directory.path().join("one"), directory.path().join("two"));
    demo(&one, "1");
    demo(&two, "2");
    let (one, two) = (bytes_below(&one), bytes_below(&two));
    let names: Vec<&str> = one.keys().map(String::as_str).collect();
    for expected in [
        "run.toml",
        "truth.json",
        "ekf/calibration.json",
        "six-position/calibration.json",
        "report/index.html",
    ] {
        assert!(names.contains(&expected), "no {expected} in {names:?}");
    }
    assert!(one == two);
}

#[test]
fn calibrate_gives_one_json_document_whose_model_card_holds() {
    let directory = tempfile::tempdir().unwrap();
    let run = directory.path().join("run");
    turncal()
        .args(["simulate", "demo", "--seed", "5", "-o"])
        .arg(&run)
        .assert()
        .success();
    for method in [
        &["--installation", "general"][..],
        &["--installation", "three-angle"],
        &["--method", "six-position"],
    ] {
        let output = turncal()
            .current_dir(directory.path())
            .arg("calibrate")
            .arg(run.join("run.toml"))
            .arg("--json")
            .args(method)
            .assert()
            .success();
        let document = &output.get_output().stdout;
        let record: Calibration = serde_json::from_slice(document).unwrap();
        assert_eq!(record.parameters.len(), record.covariance.len());
        let sigma = record.sigma.unwrap();
        for (name, variance) in [
            ("gyro.scale.y", sigma.gyro.scale[1].powi(2)),
            ("accel.bias.z", sigma.accel.bias[2].powi(2)),
        ] {
            let index = record.parameters.iter().position(|p| p == name).unwrap();
            let covariance = record.covariance[index][index];
            assert!((covariance / variance - 1.0).abs() < 1e-12, "{name}");
        }
        let correction = record.correction.unwrap();
        for (triad, matrix) in [
            (&record.gyro, correction.gyro),
            (&record.accel, correction.accel),
        ] {
            // Its inverse is K C, whichever way round it was meant.
            for (i, row) in matrix.iter().enumerate() {
                for j in 0..3 {
                    let product: f64 = (0..3)
                        .map(|k| row[k] * triad.scale[k] * triad.installation[k][j])
                        .sum();
                    let expected = f64::from(u8::from(i == j));
                    assert!((product - expected).abs() < 1e-12, "{i} {j}: {product}");
                }
            }
        }
        for vector in &record.test_vectors {
            // u = correction (N − bias), as a user would write it.
            for (triad, matrix, first) in [
                (&record.gyro, correction.gyro, 0),
                (&record.accel, correction.accel, 3),
            ] {
                for (row, coefficients) in matrix.iter().enumerate() {
                    let u: f64 = (0..3)
                        .map(|j| coefficients[j] * (vector.raw[first + j] - triad.bias[j]))
                        .sum();
                    assert!((u - vector.calibrated[first + row]).abs() < 1e-11);
                }
            }
        }
    }
    // With --json and without -o nothing is written.
    assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
}

#[test]
fn an_existing_output_is_kept_unless_forced_and_a_users_file_in_any_case() {
    let directory = tempfile::tempdir().unwrap();
    let output = directory.path().join("out");
    let simulate = |arguments: &[&str]| {
        let mut command = turncal();
        command.args(["simulate", "demo", "-o"]).arg(&output);
        command.args(arguments).assert()
    };
    let refusal = |arguments: &[&str]| {
        let refused = simulate(arguments).code(1);
        String::from_utf8_lossy(&refused.get_output().stderr).into_owned()
    };
    simulate(&[]).success();
    let first = bytes_below(&output);
    let message = refusal(&["--seed", "7"]);
    assert!(message.contains("--force"), "{message}");
    assert!(bytes_below(&output) == first);
    simulate(&["--seed", "7", "--force"]).success();
    let second = bytes_below(&output);
    assert!(second.keys().eq(first.keys()) && second != first);

    fs::write(output.join("mine.txt"), "precious").unwrap();
    let message = refusal(&["--force"]);
    assert!(message.contains("`mine.txt`"), "{message}");
    assert_eq!(bytes_below(&output)["mine.txt"], b"precious");
    assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
}

#[test]
fn both_methods_may_follow_one_another_without_a_name_for_their_output() {
    let directory = tempfile::tempdir().unwrap();
    let here = |arguments: &[&str]| {
        let mut command = turncal();
        command.current_dir(&directory).args(arguments);
        command.assert().success();
    };
    here(&["simulate", "demo", "-o", "mine"]);
    here(&["calibrate", "mine/run.toml"]);
    here(&["calibrate", "mine/run.toml", "--method", "six-position"]);
    let method = |name: &str| {
        let path = directory.path().join(name).join("calibration.json");
        let record = turncal_files::read_calibration(&path).unwrap();
        record.method
    };
    assert_eq!(method("mine-calibration"), Some(Method::Ekf));
    assert_eq!(
        method("mine-calibration-six-position"),
        Some(Method::SixPosition)
    );
}

#[test]
fn a_calibration_without_convergence_is_written_whole_and_fails() {
    let directory = tempfile::tempdir().unwrap();
    let (run, out) = (directory.path().join("run"), directory.path().join("out"));
    turncal()
        .args(["simulate", "demo", "--seed", "3", "-o"])
        .arg(&run)
        .assert()
        .success();
    // Gravity is wrong by one part in a hundred, so is the form, and noise is next to nothing and not to be learnt.
    let run = run.join("run.toml");
    let text = fs::read_to_string(&run).unwrap();
    let stated = |line: &str| {
        let wrong = [
            ("gravity_m_s2", "9.7"),
            ("angle_random_walk_deg_per_sqrt_h", "1e-10"),
            ("velocity_random_walk_ug_per_sqrt_hz", "1e-4"),
            ("position_sigma_arcsec", "1e-2"),
            ("reading_sigma_arcsec", "1e-2"),
        ];
        let wrong = wrong.into_iter().find(|(name, _)| line.starts_with(name));
        wrong.map_or(line.to_owned(), |(name, value)| format!("{name} = {value}"))
    };
    let lines: Vec<String> = text.lines().map(stated).collect();
    fs::write(&run, lines.join("\n")).unwrap();
    let failed = turncal()
        .arg("calibrate")
        .arg(&run)
        .args(["--installation", "three-angle", "--noise", "stated", "-o"])
        .arg(&out)
        .assert()
        .code(1);
    let said = String::from_utf8_lossy(&failed.get_output().stderr).into_owned();
    assert!(said.contains("did not converge"), "{said}");
    let record = turncal_files::read_calibration(&out.join("calibration.json")).unwrap();
    assert_eq!(record.converged, Some(false));
    assert!(record.findings.iter().any(|f| f.kind == "not-converged"));
    assert!(
        record
            .warnings
            .iter()
            .any(|w| w.starts_with("Not converged"))
    );
    assert!(out.join("report").join("index.html").is_file());
}

#[test]
fn wrong_usage_is_status_two_and_names_the_way() {
    for (arguments, way) in [
        (
            &["calibrate"][..],
            "Usage: turncal calibrate <RUN.toml|LOG>",
        ),
        (
            &["calibrate", "run.toml", "--installation", "four-angle"],
            "general, six-angle, three-angle",
        ),
        (&["simulate", "demo"], "--output <DIR>"),
        (&["dance"], "unrecognized subcommand 'dance'"),
        (&["demo", "--seed", "many"], "'many' for '--seed <N>'"),
    ] {
        let refused = turncal().args(arguments).assert().code(2).stdout("");
        let message = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
        for said in [way, "--help"] {
            assert!(message.contains(said), "no `{said}` in {message}");
        }
    }
}

#[test]
fn a_scenario_that_does_not_exist_is_named_with_those_that_do() {
    let failed = turncal()
        .args(["simulate", "demoo", "-o", "never-written"])
        .assert()
        .code(1);
    let message = String::from_utf8_lossy(&failed.get_output().stderr).into_owned();
    assert!(message.contains("demoo") && message.contains("demo-six-position"));
    assert!(!Path::new("never-written").exists());
}
