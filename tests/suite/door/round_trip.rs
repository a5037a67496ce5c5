//! What is written reads back.

use std::fs;

use approx::assert_relative_eq;
use nalgebra::Vector3;
use turncal::calibration::result::{
    Calibration, ConsistencyRecord, EQUATION, Method, NisRecord, TestVector, TriadRecord, rows,
};
use turncal::imu::{BodyFrame, InstallationForm, Nominal, Output, PerSensor};
use turncal::run::Aiding;
use turncal::simulation::{Scenario, Simulated};
use turncal::units::{DEG_PER_H, STANDARD_GRAVITY};
use turncal_files::write_run;

use super::made::{assert_same, made_run};
use crate::shared::{read, shared};

fn triad_record(scale: f64) -> TriadRecord {
    TriadRecord {
        scale: [scale, 1.1 * scale, 0.3 * scale],
        installation: [[1.0, 1e-3, 0.1], [0.0, 1.0, 2e-17], [0.3, 0.0, 1.0]],
        bias: [0.1, -0.2, 1.0 / 3.0],
    }
}

#[test]
fn increments_and_rates_come_back_as_they_went() {
    let directory = tempfile::tempdir().unwrap();
    let mut run = made_run("increments");
    let truth = Calibration::new(triad_record(1.0), triad_record(1e5));
    let place = directory.path().join("increments");
    fs::create_dir(&place).unwrap();
    write_run(&place, &run, Output::Increment, Some(&truth)).unwrap();
    assert_same(&run, &read(&place));
    assert_eq!(
        turncal_files::read_calibration(&place.join("truth.json")),
        Ok(truth)
    );

    run.recording.name = "rates".to_owned();
    run.instrument.unit = PerSensor {
        gyro: "deg/h".to_owned(),
        accel: "g".to_owned(),
    };
    run.instrument.nominal = PerSensor {
        gyro: Nominal(Vector3::repeat(1.0 / DEG_PER_H)),
        accel: Nominal(Vector3::repeat(1.0 / STANDARD_GRAVITY)),
    };
    let place = directory.path().join("rates");
    fs::create_dir(&place).unwrap();
    write_run(&place, &run, Output::Rate, None).unwrap();
    assert_same(&run, &read(&place));
}

#[test]
fn a_term_that_a_run_states_to_be_absent_is_written_with_a_sigma_of_zero() {
    let directory = tempfile::tempdir().unwrap();
    let run = made_run("x");
    write_run(directory.path(), &run, Output::Increment, None).unwrap();
    let text = fs::read_to_string(directory.path().join("run.toml")).unwrap();
    assert!(
        text.contains("[imu.terms.g-sensitivity]\nsigma = 0.0\n"),
        "{text}"
    );
    let back = read(directory.path());
    assert_eq!(back.instrument.absent_terms, run.instrument.absent_terms);
    assert_eq!(back.instrument.term_sigma, run.instrument.term_sigma);
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    let bytes = || {
        let directory = tempfile::tempdir().unwrap();
        write_run(directory.path(), &made_run("x"), Output::Increment, None).unwrap();
        ["run.toml", "imu.csv.gz", "table.csv.gz", "segments.csv"]
            .map(|file| fs::read(directory.path().join(file)).unwrap())
    };
    assert_eq!(bytes(), bytes());
}

#[test]
fn pulses_come_back_exactly() {
    let Some(shared) = shared("three-axis-counts") else {
        return;
    };
    let run = read(&shared);
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path().join("three-axis-counts");
    fs::create_dir(&place).unwrap();
    write_run(&place, &run, Output::Pulse, None).unwrap();
    let back = read(&place);
    assert_eq!(
        (&back.recording.imu.gyro, &back.recording.imu.accel),
        (&run.recording.imu.gyro, &run.recording.imu.accel)
    );
    assert_same(&run, &back);
}

#[test]
fn a_run_that_could_not_be_read_is_not_written() {
    let directory = tempfile::tempdir().unwrap();
    let error = write_run(directory.path(), &made_run("x"), Output::Pulse, None).unwrap_err();
    assert!(
        error.to_string().contains("imu.gyro_unit = \"rad\""),
        "{error}"
    );
    let mut run = made_run("x");
    run.recording
        .meta
        .insert("weather".to_owned(), "fine".to_owned());
    let error = write_run(directory.path(), &run, Output::Increment, None).unwrap_err();
    assert!(error.to_string().contains("weather"), "{error}");
    assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 0);
}

#[test]
fn a_calibration_comes_back_as_it_went() {
    let mut record = Calibration::new(triad_record(2e6), triad_record(-1e5));
    record.method = Some(Method::Ekf);
    record.installation_form = Some(InstallationForm::ThreeAngle);
    record.aiding = Some(Aiding::Velocity);
    record.body_frame = BodyFrame::Accelerometer;
    record.unit = Some(PerSensor {
        gyro: "count".to_owned(),
        accel: "count".to_owned(),
    });
    let sigma = triad_record(1.0).scale.map(|_| 0.1);
    let sigma = TriadRecord {
        bias: sigma,
        ..triad_record(1.0)
    };
    record.sigma = Some(PerSensor {
        gyro: sigma,
        accel: sigma,
    });
    record.parameters = vec!["gyro.installation.yz".to_owned(), "accel.bias.x".to_owned()];
    let variance = |name: &str| record.sigma_of(name).unwrap().powi(2);
    let [angle, bias] = [0, 1].map(|n| variance(&record.parameters[n]));
    record.covariance = vec![vec![angle, 1e-300], vec![1e-300, bias]];
    record.passes = Some(3);
    record.converged = Some(true);
    let nis = NisRecord {
        nis: 1.01,
        nis_interval: [0.9, 1.1],
    };
    record.consistency = Some(ConsistencyRecord {
        all: nis,
        velocity: Some(nis),
        table: None,
        attitude: None,
    });
    record.warnings = vec!["heading is not observed".to_owned()];
    record.fixed = vec!["accel.installation.xy".to_owned()];
    record.equation = Some(EQUATION.to_owned());
    let triads = [&record.gyro, &record.accel];
    let [gyro, accel] = triads.map(|of| rows(&of.sensitivity().try_inverse().unwrap()));
    record.correction = Some(PerSensor { gyro, accel });
    let input = Vector3::repeat(0.1);
    let raw = triads.map(|of| (of.sensitivity() * input + Vector3::from(of.bias)).data.0[0]);
    record.test_vectors = vec![TestVector {
        raw: raw.concat().try_into().unwrap(),
        calibrated: [0.1; 6],
    }];
    record.meta.insert("serial".to_owned(), "7".to_owned());

    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("calibration.json");
    turncal_files::write_calibration(&record, &path, false).unwrap();
    assert_eq!(turncal_files::read_calibration(&path), Ok(record.clone()));
    let json: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    assert_eq!(json["consistency"]["nis_interval"][1], 1.1);
    assert_eq!(json["installation_form"], "three-angle");
    assert_eq!(json["body_frame"], "accelerometer");

    record.gyro.bias[0] = f64::NAN;
    let error =
        turncal_files::write_calibration(&record, &directory.path().join("other.json"), false)
            .unwrap_err();
    assert!(error.to_string().contains("gyro"), "{error}");
    assert!(!directory.path().join("other.json").exists());
}

#[test]
fn errors_of_a_tables_axes_come_back_with_the_angles_that_tell_them_apart() {
    let simulated = Scenario::load("real-table").unwrap().simulate(3, 0);
    let Simulated { run, output, .. } = simulated.unwrap();
    let directory = tempfile::tempdir().unwrap();
    write_run(directory.path(), &run, output, None).unwrap();
    let back = read(directory.path());
    let stated = [&run, &back].map(|run| run.table.geometry.vector());
    assert!(stated[0].rows(3, 4).min() > 0.0);
    assert_relative_eq!(stated[0], stated[1], max_relative = 1e-12);
    let angles = [&run, &back].map(|run| {
        let axes = &run.recording.table.as_ref().unwrap().axes;
        let of_all = axes.iter().flat_map(|axes| axes.iter().flatten());
        of_all
            .map(|(axis, angle)| axis * *angle)
            .collect::<Vec<_>>()
    });
    assert_eq!(angles[0].len(), angles[1].len());
    for (one, other) in angles[0].iter().zip(&angles[1]) {
        assert_relative_eq!(one, other, epsilon = 1e-12);
    }
}
