//! The magnetometer from files to calibration.json.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use nalgebra::{Matrix3, Vector3};
use turncal::calibration::{Method, Options, Problem, UNWATCHED};
use turncal::magnetic::LocalField;
use turncal::recording::Magnetometer;
use turncal::simulation::{MagnetometerModel, Scenario, Simulated};
use turncal_files::{calibration_json, read_calibration, read_run, write_run};

/// Fixed before the first run was made.
const SEED: u64 = 59;

fn simulated() -> Simulated {
    let mut scenario = Scenario::load("mems").unwrap();
    let site = &scenario.site;
    let date = (2026, 5, 1);
    let field = LocalField::of_model(site.latitude, site.longitude, site.height, date).unwrap();
    scenario.magnetometer = Some(MagnetometerModel {
        rate: 10.0,
        noise: 100e-9,
        hard_iron: 20e-6,
        soft_iron: 0.05,
        axes: Matrix3::identity(),
        disturbance: 0.0,
        field: [field.mean, field.sigma],
        date: Some(date),
    });
    scenario.simulate(SEED, 0).unwrap()
}

fn values(of: &Magnetometer) -> Vec<(f64, Vector3<f64>)> {
    of.values().collect()
}

fn assert_near(one: &Magnetometer, other: &Magnetometer, tolerance: f64) {
    let (one, other) = (values(one), values(other));
    assert!(
        one.len().abs_diff(other.len()) <= 1,
        "{} {}",
        one.len(),
        other.len()
    );
    for ((time, value), (at, read)) in one.iter().zip(&other) {
        assert!(
            (time - at).abs() < 0.06 && (value - read).norm() < tolerance,
            "{value} {read}"
        );
    }
}

/// Exchanges a text of run.toml.
fn exchange(run: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(run).unwrap();
    assert!(text.contains(from), "{from} in {text}");
    fs::write(run, text.replace(from, to)).unwrap();
}

#[test]
fn a_log_keeps_the_magnetometer_with_its_unit_and_the_field_of_place_and_date() {
    let made = simulated();
    let directory = tempfile::tempdir().unwrap();
    write_run(directory.path(), &made.run, made.output, None).unwrap();
    let path = directory.path().join("run.toml");
    let read = read_run(&path).unwrap().recording.magnetometer.unwrap();
    let written = made.run.recording.magnetometer.as_ref().unwrap();
    assert_near(written, &read, 1e-9);
    let [expected, found] = [written.field, read.field].map(|field| field.unwrap().mean);
    assert!((expected - found).norm() < 1e-6);
    // In gauss the same field is a hundredth of the number, and the calibration in tesla stays.
    exchange(&path, "mag_unit = \"uT\"", "mag_unit = \"G\"");
    let gauss = read_run(&path).unwrap().recording.magnetometer.unwrap();
    assert_eq!(gauss.nominal, 1e4);
    exchange(&path, "2026-05-01", "1 May 2026");
    let run = read_run(&path).unwrap();
    assert_eq!(run.recording.magnetometer.unwrap().field, None);
    assert!(
        run.recording
            .notes
            .iter()
            .any(|note| note.contains("local field"))
    );
    exchange(&path, "mag_unit = \"G\"", "mag_unit = \"Gs\"");
    let error = read_run(&path).unwrap_err().to_string();
    assert!(
        error.contains("mag_unit") && error.contains("mG"),
        "{error}"
    );
}

#[test]
fn a_magnetometer_in_a_log_of_its_own_is_read_by_its_own_clock() {
    let made = simulated();
    let directory = tempfile::tempdir().unwrap();
    write_run(directory.path(), &made.run, made.output, None).unwrap();
    let written = made.run.recording.magnetometer.as_ref().unwrap();
    let mut text = "ms,x,y,z\n".to_owned();
    for (time, value) in written.values() {
        writeln!(text, "{},{},{},{}", time * 1e3, value.y, value.x, -value.z).unwrap();
    }
    fs::write(directory.path().join("mag.csv"), text).unwrap();
    let path = directory.path().join("run.toml");
    exchange(&path, "\"mx\", \"my\", \"mz\"", "\"y\", \"x\", \"-z\"");
    let from = "mag_from = { file = \"mag.csv\", time = \"ms\", time_unit = \"ms\" }\nmag_unit = ";
    exchange(&path, "mag_unit = ", from);
    let run = read_run(&path).unwrap();
    assert!(
        run.recording
            .files
            .iter()
            .any(|file| file.ends_with("mag.csv"))
    );
    // Spans begin with the first value, so values may be in the next one.
    assert_near(written, run.recording.magnetometer.as_ref().unwrap(), 60.0);
    let first = values(run.recording.magnetometer.as_ref().unwrap())[0].1;
    assert!((first - values(written)[0].1).norm() < 1e-6);
}

#[test]
fn calibration_json_corrects_the_output_to_the_field_and_older_readers_find_what_they_know() {
    let made = simulated();
    let problem = Problem::new(&made.run, &Options::default());
    let solution = problem.solve(Method::Ekf, UNWATCHED).unwrap();
    let assessment = solution.assess(&problem).unwrap();
    let record = solution.calibration(&problem, &assessment);
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("calibration.json");
    fs::write(&path, calibration_json(&record, &path).unwrap()).unwrap();
    let read = read_calibration(&path).unwrap();
    assert_eq!(read.mag, record.mag);
    let mag = read.mag.as_ref().unwrap();
    let matrix = |rows: [[f64; 3]; 3]| Matrix3::from_fn(|i, j| rows[i][j]);
    let correction = matrix(mag.correction);
    let truth = made.truth_record().mag.unwrap();
    // Output in a field of 50 µT along body y, by the truth.
    let field = Vector3::y() * 50e-6;
    let output = matrix(truth.matrix) * field + Vector3::from(truth.bias);
    let corrected = correction * (output - Vector3::from(mag.bias));
    let sigma = mag.field.sigma.unwrap()[0] / mag.field.magnitude;
    assert!(
        (corrected - field).norm() < 5.0 * sigma * 50e-6,
        "{corrected}"
    );
    for axis in ["xx", "xy", "zz"] {
        let name = format!("mag.matrix.{axis}");
        let error = read[name.as_str()] - made.truth_record()[name.as_str()];
        assert!(error.abs() < 4.5 * read.sigma_of(&name).unwrap(), "{name}");
    }
    assert_eq!(mag.parameters.len(), mag.covariance.len());
    let variance = mag.covariance[11][11];
    assert!((variance.sqrt() / read.sigma_of("mag.bias.z").unwrap() - 1.0).abs() < 1e-9);
    assert!(read.parameters.iter().all(|name| !name.starts_with("mag")));
    // The budget names what the magnetometer adds.
    let sources = &read.budget.as_ref().unwrap().sources;
    assert!(!sources.is_empty());
}
