//! `turncal compare` as a user meets it.

use std::path::Path;

use assert_cmd::Command;
use turncal::calibration::result::{Calibration, FieldRecord, MagRecord, MagSigma, TermRecord};
use turncal::imu::PerSensor;
use turncal::magnetic::MagneticTriad;

use crate::calibration_file::{ALIGNED, record, written};

/// A calibration of it whose gyro scale factor x is `ppm` too large, with σ 1 ppm.
fn calibration(ppm: f64) -> Calibration {
    let mut record = record();
    record.gyro.scale[0] *= 1.0 + ppm * 1e-6;
    record.parameters = vec!["gyro.scale.x".to_owned()];
    record.covariance = vec![vec![4.0]];
    record
}

fn compare(arguments: &[&Path]) -> assert_cmd::assert::Assert {
    let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
    command.arg("compare").args(arguments).assert()
}

fn stdout(assert: &assert_cmd::assert::Assert) -> String {
    String::from_utf8(assert.get_output().stdout.clone()).unwrap()
}

fn stderr(assert: &assert_cmd::assert::Assert) -> String {
    String::from_utf8(assert.get_output().stderr.clone()).unwrap()
}

#[test]
fn a_scale_factor_that_is_too_large_by_four_sigma_is_flagged_and_has_its_sign() {
    let root = tempfile::tempdir().unwrap();
    let truth = written(root.path(), "truth.json", &record());
    let good = written(root.path(), "good.json", &calibration(-1.0));
    let bad = written(root.path(), "bad.json", &calibration(4.0));
    let option = Path::new("--truth");
    let text = stdout(&compare(&[&good, &bad, option, &truth]).success());
    let mut rows = text.lines().map(str::trim_start);
    let row = rows.find(|l| l.starts_with("gyro K x")).unwrap();
    assert!(row.contains("−1.0 ± 1.0  −1.0"), "{row}");
    assert!(row.contains("4.0 ± 1.0  ! 4.0"), "{row}");
}

#[test]
fn further_terms_stand_side_by_side_in_the_units_of_data_sheets() {
    let root = tempfile::tempdir().unwrap();
    let with_offset = |milliseconds: f64| {
        let mut record = calibration(0.0);
        let offset = TermRecord {
            value: milliseconds * 1e-3,
            sigma: Some(3e-6),
        };
        record.terms.insert("accel.time_offset".to_owned(), offset);
        record
    };
    let first = written(root.path(), "first.json", &with_offset(5.0));
    let second = written(root.path(), "second.json", &with_offset(5.006));
    let text = stdout(&compare(&[&first, &second]).success());
    let mut rows = text.lines().map(str::trim_start);
    let row = rows.find(|l| l.starts_with("accel.time_offset")).unwrap();
    // 6 µs with a σ of 3 √2 µs.
    let cells: Vec<&str> = row.split_whitespace().collect();
    let expected = [
        "ms", "5.0000", "±", "0.0030", "5.0060", "±", "0.0030", "0.0060", "±", "0.0042", "1.4",
    ];
    assert_eq!(cells[1..], expected, "{row}");
}

#[test]
fn json_is_one_document_with_nees_and_scatter() {
    let root = tempfile::tempdir().unwrap();
    let paths =
        [0.0, 3.0, -3.0].map(|ppm| written(root.path(), &format!("{ppm}.json"), &calibration(ppm)));
    let truth = written(root.path(), "truth.json", &record());
    let (json, option) = (Path::new("--json"), Path::new("--truth"));
    let text = stdout(&compare(&[&paths[0], &paths[1], &paths[2], json, option, &truth]).success());
    let document: serde_json::Value = serde_json::from_str(&text).unwrap();
    let near = |pointer: &str, expected: f64| {
        let found = document.pointer(pointer).and_then(|v| v.as_f64()).unwrap();
        assert!((found - expected).abs() < 1e-3, "{pointer}: {found}");
    };
    near("/units/1/nees_per_n", 9.0);
    near("/units/1/values/gyro.scale.x/difference", 3.0);
    near("/units/2/values/gyro.scale.x/z", -3.0);
    near("/quantities/0/chi2", 18.0);
    near("/all_parameters/chi2", 18.0);
    near("/all_parameters/degrees_of_freedom", 2.0);
}

#[test]
fn a_report_is_written_once_and_replaced_only_with_force() {
    let root = tempfile::tempdir().unwrap();
    let a = written(root.path(), "a.json", &record());
    let b = written(root.path(), "b.json", &record());
    let report = root.path().join("report");
    let option = Path::new("-o");
    compare(&[&a, &b, option, &report]).success();
    let page = std::fs::read_to_string(report.join("index.html")).unwrap();
    assert!(page.contains("<svg") && report.join("values.svg").exists());
    let again = compare(&[&a, &b, option, &report]).failure().code(1);
    assert!(stderr(&again).contains("--force"));
    compare(&[&a, &b, option, &report, Path::new("--force")]).success();
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let root = tempfile::tempdir().unwrap();
    let a = written(root.path(), "a.json", &record());
    let mut other = record();
    other.unit = Some(PerSensor {
        gyro: "rad".to_owned(),
        accel: "count".to_owned(),
    });
    let b = written(root.path(), "b.json", &other);
    let mut unfinished = record();
    unfinished.converged = Some(false);
    let c = written(root.path(), "c.json", &unfinished);
    for (second, says) in [
        (&b, ["b: ", "`count`", "`rad`"]),
        (&c, ["c.json: ", "FAILED", "did not converge"]),
    ] {
        let message = stderr(&compare(&[&a, second]).failure().code(1));
        let missing = says.iter().find(|part| !message.contains(**part));
        assert_eq!(missing, None, "{message}");
    }
    let forced = compare(&[&a, &c, Path::new("--force")]).success();
    assert!(stderr(&forced).contains("FAILED"));
    compare(&[&a]).failure().code(2);
    compare(&[&a, &root.path().join("none.json")])
        .failure()
        .code(1);
}

/// A calibration with a magnetometer in a field whose magnitude is known to 2 %. The scale factors have a 1σ of 0.1 %
/// apart from the error of the field.
fn nine_axis(scale: f64, hard_iron: f64) -> Calibration {
    let (own, field) = (1e3, 0.02 * 1e6 * scale);
    let sigma = [f64::hypot(own, field), own, own];
    let at = |row: usize, column: usize| sigma[(3 + column - row) % 3];
    let mut covariance = vec![vec![0.0; 12]; 12];
    for row in 0..3 {
        for column in 0..3 {
            covariance[3 * row + column][3 * row + column] = at(row, column).powi(2);
        }
        covariance[9 + row][9 + row] = 0.01;
    }
    Calibration {
        mag: Some(MagRecord {
            matrix: ALIGNED.map(|row| row.map(|of| of * scale * 1e6)),
            bias: [hard_iron, 0.0, 0.0],
            unit: "uT".to_owned(),
            sigma: Some(MagSigma {
                matrix: [0, 1, 2].map(|row| [0, 1, 2].map(|column| at(row, column))),
                bias: [0.1; 3],
            }),
            correction: ALIGNED.map(|row| row.map(|of| of / scale * 1e-6)),
            field: FieldRecord {
                unit: "T".to_owned(),
                magnitude: 50e-6,
                declination_deg: 0.0,
                inclination_deg: 60.0,
                sigma: Some([1e-6, 0.0, 0.0]),
            },
            parameters: (0..12).map(MagneticTriad::name).collect(),
            covariance,
            equation: String::new(),
            ellipsoid: None,
        }),
        ..record()
    }
}

/// The row of a quantity, with single spaces.
fn row(text: &str, name: &str) -> String {
    let mut rows = text.lines().map(str::trim_start);
    let row = rows.find(|row| row.starts_with(name)).unwrap();
    row.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn a_magnetometer_that_changed_by_less_than_the_error_of_its_field_is_flagged_in_one_field() {
    let root = tempfile::tempdir().unwrap();
    let first = written(root.path(), "first.json", &nine_axis(1.0, 5.0));
    let second = written(root.path(), "second.json", &nine_axis(1.006, 5.2));
    let text = stdout(&compare(&[&first, &second]).success());
    let scale = "mag matrix xx uT per µT 1.000 ± 0.020 1.006 ± 0.020 0.0060 ± 0.0014 ! 4.2";
    assert_eq!(row(&text, "mag matrix xx"), scale);
    let hard_iron = "mag hard iron x uT 5.00 ± 0.10 5.20 ± 0.10 0.20 ± 0.14 1.4";
    assert_eq!(row(&text, "mag hard iron x"), hard_iron);
    assert!(text.contains("error of the magnetic field"), "{text}");
    // In another place the field is another, and its errors are independent.
    let mut elsewhere = nine_axis(1.006, 5.2);
    elsewhere.mag.as_mut().unwrap().field.magnitude = 40e-6;
    let third = written(root.path(), "third.json", &elsewhere);
    let json = stdout(&compare(&[&first, &third, Path::new("--json")]).success());
    let document: serde_json::Value = serde_json::from_str(&json).unwrap();
    let value = &document["units"][1]["values"]["mag.matrix.xx"];
    assert!(
        (value["difference"].as_f64().unwrap() - 0.006).abs() < 1e-9,
        "{value}"
    );
    assert!(
        (value["z"].as_f64().unwrap() - 0.006 / 0.0284).abs() < 1e-3,
        "{value}"
    );
    assert_eq!(value["unit"], "uT per µT");
}

#[test]
fn a_calibration_without_a_magnetometer_or_in_other_units_is_compared_without_and_named() {
    let root = tempfile::tempdir().unwrap();
    let first = written(root.path(), "first.json", &nine_axis(1.0, 5.0));
    let second = written(root.path(), "second.json", &calibration(4.0));
    let mut gauss = nine_axis(1.0, 5.0);
    gauss.mag.as_mut().unwrap().unit = "G".to_owned();
    let third = written(root.path(), "third.json", &gauss);
    for (other, reason) in [
        (&second, "second: no magnetometer"),
        (&third, "other units"),
    ] {
        let compared = compare(&[&first, other]).success();
        let text = stdout(&compared) + &stderr(&compared);
        assert!(text.contains(reason), "{text}");
        let only = "mag matrix xx uT per µT 1.000 ± 0.020 – – –";
        assert_eq!(row(&text, "mag matrix xx"), only);
        assert!(text.contains("gyro K x"), "{text}");
    }
}
