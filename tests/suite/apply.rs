//! `turncal apply`: what it writes is what the body did.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use nalgebra::{Matrix3, Vector3};
use turncal::calibration::result::Calibration;
use turncal::calibration::result::{TermRecord, TriadRecord};
use turncal::calibration::{Correction, CorrectionError, truth_record};
use turncal::imu::{Output, PerSensor, Sensor, Term, TermVector};
use turncal::simulation::{Scenario, true_increments};
use turncal::turntable::{Imperfection, Motion};
use turncal::units::{DEGREE, STANDARD_GRAVITY};
use turncal_files::export::{HEADER, Samples};

use crate::calibration_file::written;

/// A log of 200 rows with one distinct row, and the `run.toml` around it.
fn log(
    directory: &Path,
    imu: &str,
    units: [&str; 2],
    scale: [f64; 2],
    rows: [[f64; 6]; 2],
) -> PathBuf {
    let mut csv = "t,gx,gy,gz,ax,ay,az\n".to_owned();
    for k in 0..200 {
        let row = rows[usize::from(k == 7)].map(|value| value.to_string());
        csv += &format!("{},{}\n", f64::from(k + 1) * 0.01, row.join(","));
    }
    fs::write(directory.join("imu.csv"), csv).unwrap();
    let prior = |name: &str, scale: f64| {
        format!(
            "[imu.prior.{name}]\nscale = {scale:?}\nscale_sigma_ppm = 1e3\n\
             installation_sigma_arcsec = 100.0\nbias_sigma = 1.0\n"
        )
    };
    let toml = format!(
        "format = \"turncal-run/1\"\n[site]\nlatitude_deg = 45.0\nheight_m = 0.0\n[imu]\n\
         file = \"imu.csv\"\n{imu}\ngyro_unit = \"{}\"\naccel_unit = \"{}\"\n\
         sample_period_s = 0.01\ntime_stamp = \"end\"\n\
         columns = {{ time = \"t\", gyro = [\"gx\", \"gy\", \"gz\"], accel = [\"ax\", \"ay\", \"az\"] }}\n\
         [imu.noise]\nangle_random_walk_deg_per_sqrt_h = 0.1\n\
         velocity_random_walk_ug_per_sqrt_hz = 10.0\n{}{}",
        units[0],
        units[1],
        prior("gyro", scale[0]),
        prior("accel", scale[1]),
    );
    let path = directory.join("run.toml");
    fs::write(&path, toml).unwrap();
    path
}

/// A calibration with every kind of error, in these units.
fn calibration(units: [&str; 2], scale: [f64; 2]) -> Calibration {
    let triad = |scale: f64, sign: f64| TriadRecord {
        scale: [scale * 1.01, scale * 0.99, scale * 1.002],
        installation: [
            [1.0, sign * 0.01, -0.02],
            [0.003, 1.0, sign * 0.004],
            [-0.005, 0.006, 1.0],
        ],
        bias: [0.01 * scale, -0.02 * scale, sign * 0.03 * scale],
    };
    Calibration {
        unit: Some(PerSensor {
            gyro: units[0].to_owned(),
            accel: units[1].to_owned(),
        }),
        ..Calibration::new(triad(scale[0], 1.0), triad(scale[1], -1.0))
    }
}

/// `u = correction (N − bias)` written out, N along right, front, up.
fn by_hand(triad: &TriadRecord, n: [f64; 3]) -> Vector3<f64> {
    let a = Matrix3::from_fn(|i, j| triad.scale[i] * triad.installation[i][j]);
    a.lu()
        .solve(&(Vector3::from(n) - Vector3::from(triad.bias)))
        .unwrap()
}

fn turncal(arguments: &[&Path]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
    command.args(arguments);
    command
}

fn parsed(csv: &str) -> Vec<Vec<f64>> {
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some(HEADER));
    let numbers = |line: &str| line.split(',').map(|n| n.parse().unwrap()).collect();
    lines.map(numbers).collect()
}

#[test]
fn rows_are_correction_times_output_less_bias_in_every_unit_and_on_every_body_axes() {
    let row = [0.3, -0.2, 0.5, 1.0, -2.0, 9.0];
    let still = [0.0, 0.0, 0.0, 0.0, 0.0, 9.8];
    type Axes = fn([f64; 3]) -> [f64; 3];
    for (imu, units, scale, per_row, to_rfu) in [
        (
            "output = \"rate\"\nbody_axes = \"flu\"",
            ["deg/s", "g"],
            [1.0 / DEGREE, 1.0 / STANDARD_GRAVITY],
            1.0,
            (|v| [-v[1], v[0], v[2]]) as Axes,
        ),
        (
            "output = \"increment\"\nbody_axes = \"frd\"",
            ["rad", "m/s"],
            [1.0, 1.0],
            0.01,
            |v| [v[1], v[0], -v[2]],
        ),
        (
            "output = \"pulse\"\nbody_axes = \"rfu\"",
            ["count", "count"],
            [2e6, 1e5],
            0.01,
            |v| v,
        ),
    ] {
        let root = tempfile::tempdir().unwrap();
        let counts = units[0] == "count";
        let written_row = |u: [f64; 6]| {
            let mut out = [0.0; 6];
            for (k, value) in out.iter_mut().enumerate() {
                *value = u[k] * scale[k / 3] * per_row;
                if counts {
                    *value = value.round();
                }
            }
            out
        };
        let rows = [still, row].map(written_row);
        let run = log(root.path(), imu, units, scale, rows);
        let record = calibration(units, scale);
        let path = written(root.path(), "calibration.json", &record);
        let output = root.path().join("calibrated.csv");
        turncal(&[Path::new("apply"), &path, &run, Path::new("-o"), &output])
            .assert()
            .success();
        let calibrated = parsed(&fs::read_to_string(output).unwrap());
        assert_eq!(calibrated.len(), 200);
        for k in [0, 7, 199] {
            assert!((calibrated[k][0] - 0.01 * k as f64).abs() < 1e-12);
            assert!((calibrated[k][1] - 0.01 * (k + 1) as f64).abs() < 1e-12);
            let n = rows[usize::from(k == 7)].map(|value| value / per_row);
            let rate = by_hand(&record.gyro, to_rfu([n[0], n[1], n[2]]));
            let force = by_hand(&record.accel, to_rfu([n[3], n[4], n[5]]));
            for (found, expected) in calibrated[k][2..].iter().zip(rate.iter().chain(&force)) {
                assert!(
                    (found - expected).abs() < 1e-12,
                    "{units:?} {k}: {found} {expected}"
                );
            }
        }
    }
}

/// Largest errors of calibrated samples of a simulated noiseless instrument with these terms, with
/// them in its calibration and without.
fn errors(terms: &[Term]) -> [PerSensor<f64>; 2] {
    let mut scenario = Scenario::load("demo").unwrap();
    scenario.instrument.noise = Default::default();
    scenario.output = Output::Increment;
    scenario.table.errors = Default::default();
    for term in terms {
        for parameter in term.parameters() {
            scenario.instrument.term_sigma[parameter] = term.usual_sigma();
        }
    }
    let simulated = scenario.simulate(3, 0).unwrap();
    let run = &simulated.run;
    let mut record = truth_record(&simulated.truth, run);
    for parameter in terms.iter().flat_map(|term| term.parameters()) {
        let value = simulated.terms[parameter];
        assert!(value != 0.0);
        let name = Term::parameter_name(parameter).unwrap();
        record.terms.insert(name, TermRecord { value, sigma: None });
    }
    let imperfection = Imperfection::none(&scenario.table);
    let motion = Motion::new(&scenario.table, &scenario.path, &imperfection).unwrap();
    let Scenario {
        site, integrator, ..
    } = &scenario;
    let ideal = true_increments(&motion, site, integrator, &TermVector::zeros());
    let largest = |record: &Calibration| {
        let correction = Correction::for_run(record, run).unwrap();
        let period = run.recording.imu.period;
        let mut largest = PerSensor::from_fn(|_| 0.0_f64);
        for (k, sample) in correction
            .samples(run, 0..run.recording.imu.len())
            .enumerate()
        {
            let rate = (sample.rate - ideal.gyro[k] / period).amax();
            let force = (sample.force - ideal.accel[k] / period).amax();
            largest.gyro = largest.gyro.max(rate);
            largest.accel = largest.accel.max(force);
        }
        largest
    };
    let with = largest(&record);
    record.terms.clear();
    // A constant of the table has no effect on samples.
    let table = TermRecord {
        value: 1.0,
        sigma: None,
    };
    record.terms.insert("table.base.up".to_owned(), table);
    let without = largest(&record);
    println!("{terms:?}: {with:?}, uncorrected {without:?}");
    [with, without]
}

#[test]
fn a_simulated_instrument_gives_back_what_the_body_did() {
    let [with, _] = errors(&[]);
    assert!(with.gyro < 1e-13 && with.accel < 1e-12, "{with:?}");
    // The bounds are those of means over a sample: how a term's input bends within it. Earth rate
    // times 10 ms times gravity is 7e-6 m/s².
    let [with, without] = errors(&Term::ALL);
    assert!(1e3 * with.gyro < without.gyro && 1e3 * with.accel < without.accel);
    for (term, sensor, bound) in [
        // The square of what gravity moves by within a sample at 60 °/s, over 12.
        (Term::AccelSecondOrder, Sensor::Accel, 4e-8),
        (Term::AccelAsymmetry, Sensor::Accel, 6e-6),
        (Term::SizeEffect, Sensor::Accel, 6e-5),
        (Term::TimeOffset, Sensor::Accel, 7.2e-6),
        (Term::GSensitivity, Sensor::Gyro, 1e-12),
        (Term::G2Sensitivity, Sensor::Gyro, 2e-11),
    ] {
        let [with, without] = errors(&[term]);
        let (with, without) = (with.get(sensor), without.get(sensor));
        assert!(
            *with < bound && 50.0 * with < *without,
            "{term:?}: {with:e} of {without:e}"
        );
    }
}

#[test]
fn the_calibrated_record_is_a_record_again() {
    let root = tempfile::tempdir().unwrap();
    let (units, scale) = (["deg/s", "g"], [1.0 / DEGREE, 1.0 / STANDARD_GRAVITY]);
    let row = [1.0, 2.0, 3.0, 0.1, 0.2, 0.9];
    let run = log(root.path(), "output = \"rate\"", units, scale, [row; 2]);
    let record = calibration(units, scale);
    let path = written(root.path(), "calibration.json", &record);
    let again = root.path().join("again");
    fs::create_dir(&again).unwrap();
    let output = again.join("imu.csv.gz");
    turncal(&[Path::new("apply"), &path, &run, Path::new("-o"), &output])
        .assert()
        .success();
    let toml = fs::read_to_string(&run).unwrap();
    let toml = toml
        .replace("imu.csv", "imu.csv.gz")
        .replace("deg/s", "rad/s")
        .replace("\"g\"", "\"m/s^2\"")
        .replace("\"t\"", "\"end_s\"")
        .replace(&format!("scale = {:?}", scale[0]), "scale = 1.0")
        .replace(&format!("scale = {:?}", scale[1]), "scale = 1.0");
    let names = ["x", "y", "z"].map(|axis| {
        [
            (format!("\"g{axis}\""), format!("\"gyro_{axis}_rad_s\"")),
            (format!("\"a{axis}\""), format!("\"accel_{axis}_m_s2\"")),
        ]
    });
    let toml = names
        .iter()
        .flatten()
        .fold(toml, |toml, (from, to)| toml.replace(from, to));
    fs::write(again.join("run.toml"), toml).unwrap();
    let read = turncal_files::read_run(&again.join("run.toml")).unwrap();
    let expected = by_hand(&record.gyro, [1.0, 2.0, 3.0]);
    assert!((read.recording.imu.gyro.at(50) / 0.01 - expected).amax() < 1e-12);
    assert_eq!(read.recording.imu.start(), 0.0);
}

/// A calibration and a log of two rows, both in SI.
fn in_si(directory: &Path) -> (PathBuf, PathBuf) {
    let (units, scale) = (["rad/s", "m/s^2"], [1.0, 1.0]);
    let run = log(directory, "output = \"rate\"", units, scale, [[0.5; 6]; 2]);
    let path = written(directory, "calibration.json", &calibration(units, scale));
    (path, run)
}

#[test]
fn standard_output_has_the_same_bytes_as_a_file() {
    let root = tempfile::tempdir().unwrap();
    let (path, run) = in_si(root.path());
    let output = root.path().join("calibrated.csv");
    let apply = [Path::new("apply"), &path, &run];
    let printed = turncal(&apply).assert().success();
    turncal(&apply).arg("-o").arg(&output).assert().success();
    assert_eq!(fs::read(&output).unwrap(), printed.get_output().stdout);
}

/// Standard error of a command that fails with this status.
fn failure(command: &mut Command, status: i32) -> String {
    let failed = command.assert().code(status);
    String::from_utf8(failed.get_output().stderr.clone()).unwrap()
}

#[test]
fn a_calibration_of_another_instrument_is_refused_with_the_reason() {
    let root = tempfile::tempdir().unwrap();
    let (units, scale) = (["count", "count"], [2e6, 1e5]);
    let row = [0.0, 0.0, 0.0, 0.0, 0.0, 9800.0];
    let run = log(root.path(), "output = \"pulse\"", units, scale, [row; 2]);
    let of = |name: &str, record: &Calibration| {
        let path = written(root.path(), name, record);
        failure(&mut turncal(&[Path::new("apply"), &path, &run]), 1)
    };
    let message = of("unit.json", &calibration(["deg/s", "g"], [57.0, 0.1]));
    assert!(
        message.contains("`deg/s`") && message.contains("`count`"),
        "{message}"
    );
    let message = of("scale.json", &calibration(units, [2e6, 1e3]));
    assert!(
        message.contains("accel x") && message.contains("imu.prior.accel"),
        "{message}"
    );
    // Within a factor of two, but forty of the run's σ off.
    let path = written(root.path(), "near.json", &calibration(units, [2.08e6, 1e5]));
    let done = turncal(&[Path::new("apply"), &path, &run])
        .assert()
        .success();
    let said = String::from_utf8_lossy(&done.get_output().stderr);
    assert!(
        said.contains("gyro scale factors differ from the nominal values of the run by up to"),
        "{said}"
    );
    let mut reversed = calibration(units, scale);
    reversed.gyro.scale[2] *= -1.0;
    let message = of("sign.json", &reversed);
    assert!(
        message.contains("gyro z") && message.contains("body_axes"),
        "{message}"
    );
}

#[test]
fn a_term_that_is_not_known_is_not_passed_over() {
    let mut record = calibration(["rad", "m/s"], [1.0, 1.0]);
    let term = TermRecord {
        value: 1.0,
        sigma: None,
    };
    record.terms.insert("accel.fourth_order.x".to_owned(), term);
    let error = Correction::of_record(&record).unwrap_err();
    assert_eq!(
        error,
        CorrectionError::UnknownTerm("accel.fourth_order.x".to_owned())
    );
    record.terms.clear();
    record.accel.installation[1] = record.accel.installation[0];
    let error = Correction::of_record(&record).unwrap_err();
    assert_eq!(error, CorrectionError::Singular(Sensor::Accel));
}

#[test]
fn the_raw_record_is_never_replaced_and_a_name_says_what_is_written() {
    let root = tempfile::tempdir().unwrap();
    let (path, run) = in_si(root.path());
    let raw = root.path().join("imu.csv");
    let before = fs::read(&raw).unwrap();
    let apply = [Path::new("apply"), &path, &run, Path::new("-o")];
    failure(turncal(&apply).arg(&raw), 1);
    let message = failure(turncal(&apply).arg(&raw).arg("--force"), 1);
    assert!(message.contains("another name"), "{message}");
    assert_eq!(fs::read(&raw).unwrap(), before);
    let message = failure(turncal(&apply).arg(root.path().join("calibrated.txt")), 2);
    assert!(message.contains(".csv.gz"), "{message}");
}

#[test]
fn rows_written_in_parts_are_the_samples_to_the_last_bit_even_as_the_temperature_changes() {
    let mut scenario = Scenario::load("warming-mems").unwrap();
    scenario.integrator.period = 0.05;
    let simulated = scenario.simulate(1, 0).unwrap();
    let run = &simulated.run;
    let correction = Correction::for_run(&simulated.truth_record(), run).unwrap();
    assert!(correction.changes());
    let samples: Vec<_> = correction
        .samples(run, 0..run.recording.imu.len())
        .collect();
    // More than one part, and parts that begin within a second of temperature.
    assert!(samples.len() > 4097, "{}", samples.len());
    let mut text = Vec::new();
    let all = Samples {
        run,
        correction: &correction,
        magnetometer: None,
        fill: false,
        verdict: None,
    };
    all.rows(&mut text).unwrap();
    let text = String::from_utf8(text).unwrap();
    let rows: Vec<&str> = text.lines().skip(1).collect();
    assert_eq!(rows.len(), samples.len());
    for (row, sample) in rows.iter().zip(&samples) {
        let row: Vec<f64> = row.split(',').map(|n| n.parse().unwrap()).collect();
        assert_eq!(row[2..5], *sample.rate.as_slice());
        assert_eq!(row[5..8], *sample.force.as_slice());
        assert_eq!(row[8], f64::from(u8::from(sample.in_range)));
    }
}
