//! A log with a magnetometer alone, and magnetometers without names beside gyros and accelerometers.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;
use turncal::imu::PerSensor;
use turncal::recording::Recording;
use turncal::simulation::Scenario;
use turncal_files::draft::Draft;

use crate::export::numbers;

/// Symmetric output per field, and hard iron, µT.
const MATRIX: [[f64; 3]; 3] = [[1.05, 0.03, -0.02], [0.03, 0.96, 0.01], [-0.02, 0.01, 1.0]];
const HARD_IRON: [f64; 3] = [12.0, -30.0, 8.0];
const FIELD: f64 = 48.0;

fn matrix() -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| MATRIX[i][j])
}

/// Values of a magnetometer turned into random attitudes, with 0.3 µT of noise.
fn values(count: usize) -> Vec<Vector3<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut normal = || Vector3::from_fn(|_, _| StandardNormal.sample(&mut rng));
    let value = |_| {
        let field: Vector3<f64> = normal();
        FIELD * matrix() * field.normalize() + Vector3::from(HARD_IRON) + 0.3 * normal()
    };
    (0..count).map(value).collect()
}

/// Rows of numbers with three decimals.
fn text(heading: &str, separator: &str, rows: &[Vec<f64>]) -> String {
    let mut text = heading.to_owned();
    for row in rows {
        let row: Vec<String> = row.iter().map(|value| format!("{value:.3}")).collect();
        writeln!(text, "{}", row.join(separator)).unwrap();
    }
    text
}

fn rows(values: &[Vector3<f64>]) -> Vec<Vec<f64>> {
    values
        .iter()
        .map(|value| value.as_slice().to_vec())
        .collect()
}

fn turncal(directory: &Path, arguments: &[&str]) -> (bool, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
    let output = command
        .current_dir(directory)
        .args(arguments)
        .output()
        .unwrap();
    let words = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (
        output.status.success(),
        words(&output.stdout),
        words(&output.stderr),
    )
}

#[test]
fn a_magnetometer_alone_is_calibrated_and_its_exports_give_the_field() {
    let (directory, values) = (tempfile::tempdir().unwrap(), values(400));
    let (at, of) = (directory.path(), |arguments: &[&str]| {
        turncal(directory.path(), arguments)
    });
    let timed = (0..values.len()).map(|k| [&[k as f64 * 0.05], values[k].as_slice()].concat());
    fs::write(
        at.join("mag.csv"),
        text("time,mag_x,mag_y,mag_z\n", ",", &timed.collect::<Vec<_>>()),
    )
    .unwrap();
    let (done, shown, said) = of(&["calibrate", "mag.csv", "-o", "out"]);
    assert!(
        done && shown.contains("GOOD") && shown.contains("symmetric"),
        "{shown}{said}"
    );
    let json: Value =
        serde_json::from_slice(&fs::read(at.join("out/calibration.json")).unwrap()).unwrap();
    let mag = &json["mag"];
    let number = |value: &Value| value.as_f64().unwrap();
    for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
        let (off, sigma) = (
            number(&mag["matrix"][i][j]) - FIELD * MATRIX[i][j],
            number(&mag["sigma"]["matrix"][i][j]),
        );
        assert!(
            off.abs() < 4.5 * sigma && sigma < 0.1,
            "matrix {i}{j}: {off} ± {sigma}"
        );
    }
    for k in 0..3 {
        let (off, sigma) = (
            number(&mag["bias"][k]) - HARD_IRON[k],
            number(&mag["sigma"]["bias"][k]),
        );
        assert!(
            off.abs() < 4.5 * sigma && sigma < 0.1,
            "hard iron {k}: {off} ± {sigma}"
        );
    }
    let residual = number(&mag["ellipsoid"]["residual"]);
    assert!((0.8..1.2).contains(&(residual * FIELD / 0.3)), "{residual}");
    // Rows along the axes of the sensor, of magnitude one.
    let (_, applied, _) = of(&["apply", "out/calibration.json", "mag.csv"]);
    assert_eq!(applied.lines().count(), values.len() + 1);
    assert!(applied.starts_with("time_s,mag_x,mag_y,mag_z"), "{applied}");
    // Without times, rows have numbers; what `apply` writes, `calibrate` reads.
    fs::write(at.join("bare.txt"), text("", "\t", &rows(&values))).unwrap();
    let (_, numbered, _) = of(&["apply", "out/calibration.json", "bare.txt"]);
    assert!(numbered.starts_with("row,mag_x,mag_y,mag_z"), "{numbered}");
    assert!(numbered.contains("\n400,"), "{numbered}");
    fs::write(at.join("applied.csv"), numbered).unwrap();
    let (_, again, said) = of(&["calibrate", "applied.csv", "-o", "again"]);
    assert!(again.contains("GOOD"), "{again}{said}");
    let first = numbers(applied.lines().nth(1).unwrap());
    let expected = matrix().try_inverse().unwrap() * (values[0] - Vector3::from(HARD_IRON)) / FIELD;
    assert!(
        (Vector3::from_row_slice(&first[1..4]) - expected).norm() < 5e-3,
        "{first:?}"
    );
    assert!(
        of(&["show", "out/calibration.json"])
            .1
            .contains("hard iron, uT")
    );
    assert!(of(&["check", "out/run.toml"]).1.contains("hard iron, uT"));
    // Gauss along front, right, down of the chip; minus milligauss along those of the vehicle.
    for (format, key, per_ut) in [
        ("px4", "CAL_MAG0_XOFF", 0.01),
        ("ardupilot", "COMPASS_OFS_Y", -10.0),
        ("c", "turncal_mag_bias", 1.0),
    ] {
        let (done, exported, said) = of(&["export", "out/calibration.json", "--format", format]);
        assert!(done && exported.contains(key), "{said}");
        let others = ["ACC", "GYR", "turncal_gyro", "acc_"];
        assert!(
            !others.iter().any(|other| exported.contains(other)),
            "{exported}"
        );
        let rest = exported.split_once(key).unwrap().1;
        let of_key = numbers(rest.trim_start_matches("[3] = "))[0];
        assert!(
            (of_key - per_ut * HARD_IRON[0]).abs() < 0.1 * f64::abs(per_ut),
            "{of_key}"
        );
    }
    let (done, exported, _) = of(&["export", "out/calibration.json", "--format", "text"]);
    assert!(
        done && exported.contains("mag.bias.x") && !exported.contains("gyro."),
        "{exported}"
    );
    let export = ["export", "out/calibration.json", "--format"];
    for (arguments, words) in [
        // Programs that read counts would find nothing in the file.
        ([&export[..], &["inav"]].concat(), "raw counts"),
        ([&export[..], &["betaflight"]].concat(), "raw counts"),
        ([&export[..], &["kalibr"]].concat(), "only a magnetometer"),
        (vec!["allan", "mag.csv"], "magnetometer"),
        (
            vec!["calibrate", "mag.csv", "--method", "six-position"],
            "only a magnetometer",
        ),
        (
            vec!["calibrate", "mag.csv", "--truth", "out/calibration.json"],
            "only a magnetometer",
        ),
    ] {
        let (done, shown, said) = of(&arguments);
        assert!(!done && shown.is_empty() && said.contains(words), "{said}");
    }
}

#[test]
fn three_columns_without_names_are_a_magnetometer_if_they_lie_about_an_ellipsoid_and_accelerometers_stay()
 {
    let directory = tempfile::tempdir().unwrap();
    let draft = |text: String| {
        let path = directory.path().join("log.txt");
        fs::write(&path, text).unwrap();
        Draft::of_file(&path)
            .map(|draft| draft.to_toml("log.txt"))
            .unwrap_or_default()
    };
    let is_mag = |text: String| {
        let draft = draft(text);
        let mag = draft.contains("mag = [\"1\", \"2\", \"3\"]");
        assert!(!mag || !draft.contains("accel ="), "{draft}");
        mag
    };
    let of_values = values(300);
    for separator in ["\t", ",", "  "] {
        assert!(
            is_mag(text("", separator, &rows(&of_values))),
            "{separator:?}"
        );
    }
    let counts = of_values.iter().map(|value| (value * 10.0).map(f64::round));
    assert!(is_mag(text("", "\t", &rows(&counts.collect::<Vec<_>>()))));
    assert!(is_mag(text("", "\t", &rows(&of_values[..40]))));
    // Gravity in turns, in m/s² and in counts, with biases; and other clouds of numbers.
    let gravity = |unit: f64| {
        let of_gravity = |value: &Vector3<f64>| {
            (value - Vector3::from(HARD_IRON)) * unit / FIELD + Vector3::repeat(0.02 * unit)
        };
        rows(&of_values.iter().map(of_gravity).collect::<Vec<_>>())
    };
    for (unit, step) in [(9.81, 1e-3), (1.0, 1e-3), (16384.0, 1.0), (1000.0, 0.1)] {
        let rounded = |row: &Vec<f64>| {
            row.iter()
                .map(|value| (value / step).round() * step)
                .collect()
        };
        let rounded: Vec<Vec<f64>> = gravity(unit).iter().map(rounded).collect();
        assert!(!is_mag(text("", ",", &rounded)), "{unit}");
    }
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut cloud = |shape: &dyn Fn(Vector3<f64>) -> Vector3<f64>| {
        let mut normal = || Vector3::from_fn(|_, _| StandardNormal.sample(&mut rng));
        rows(&(0..400).map(|_| shape(normal()) * 40.0).collect::<Vec<_>>())
    };
    assert!(!is_mag(text("", ",", &cloud(&|normal| normal))));
    // A filled ball, and the vector part of random quaternions.
    assert!(!is_mag(text(
        "",
        ",",
        &cloud(&|normal| normal * (normal.norm() * 0.7).tanh() / normal.norm())
    )));
    assert!(!is_mag(text(
        "",
        ",",
        &cloud(&|normal| normal.map(f64::tanh))
    )));
}

#[test]
fn names_of_many_programs_are_those_of_a_magnetometer() {
    let directory = tempfile::tempdir().unwrap();
    for names in [
        "mag_x,mag_y,mag_z",
        "mx,my,mz",
        "Mag_X,Mag_Y,Mag_Z",
        "RawCompassX,RawCompassY,RawCompassZ",
        "%float(RawCompassX),%float(RawCompassY),%float(RawCompassZ)",
        "magnetic field x (µT),magnetic field y (µT),magnetic field z (µT)",
        "Magnetometer X (G),Magnetometer Y (G),Magnetometer Z (G)",
    ] {
        let path = directory.path().join("log.csv");
        fs::write(&path, text(&format!("{names}\n"), ",", &rows(&values(120)))).unwrap();
        let draft = Draft::of_file(&path).unwrap().to_toml("log.csv");
        // A line that begins with % is a comment with names.
        let names = names.trim_start_matches('%').replace(',', "\", \"");
        let quoted = format!("mag = [\"{names}\"]");
        assert!(
            draft.contains(&quoted) && !draft.contains("TODO:"),
            "{draft}"
        );
    }
}

/// Further columns of a row.
type Columns<'a> = &'a dyn Fn(usize) -> Vec<f64>;

/// The nine columns of a recording, row by row, and the attitude of each row from its gyros.
fn nine_columns(recording: &Recording) -> (Vec<Vec<f64>>, Vec<UnitQuaternion<f64>>) {
    let imu = &recording.imu;
    let mut values = recording.magnetometer.as_ref().unwrap().values().peekable();
    let mut field = values.peek().unwrap().1;
    let mut attitude = UnitQuaternion::identity();
    let (mut rows, mut attitudes) = (Vec::new(), Vec::new());
    for k in 0..imu.len() {
        let PerSensor { gyro, accel } = PerSensor {
            gyro: imu.gyro.at(k),
            accel: imu.accel.at(k),
        };
        while values.peek().is_some_and(|(time, _)| *time <= imu.time(k)) {
            field = values.next().map_or(field, |(_, value)| value);
        }
        attitude *= UnitQuaternion::from_scaled_axis(gyro);
        let triads = [gyro / imu.period, accel / imu.period, field];
        rows.push(triads.iter().flat_map(|of| of.iter().copied()).collect());
        attitudes.push(attitude);
    }
    (rows, attitudes)
}

#[test]
fn columns_that_turn_as_a_field_are_a_magnetometer_and_attitudes_are_not() {
    let run = Scenario::load("nine-axis")
        .unwrap()
        .simulate(1, 0)
        .unwrap()
        .run;
    let (nine, attitudes) = nine_columns(&run.recording);
    let directory = tempfile::tempdir().unwrap();
    let draft = |others: Columns| {
        let row = |k: usize| [&nine[k][..6], &others(k)].concat();
        let mut text = String::new();
        for k in 0..nine.len() {
            let row: Vec<String> = row(k).iter().map(|value| format!("{value:.6}")).collect();
            writeln!(text, "{}", row.join(" ")).unwrap();
        }
        let path = directory.path().join("log.txt");
        fs::write(&path, text).unwrap();
        Draft::of_file(&path).unwrap().to_toml("log.txt")
    };
    let with_field = draft(&|k| nine[k][6..].to_vec());
    assert!(
        with_field.contains("mag = [\"7\", \"8\", \"9\"]"),
        "{with_field}"
    );
    let after_temperature = draft(&|k| {
        [
            &[25.0 + 1e-4 * k as f64 + 0.1 * (k as f64).sin()],
            &nine[k][6..],
        ]
        .concat()
    });
    assert!(
        after_temperature.contains("mag = [\"8\", \"9\", \"10\"]"),
        "{after_temperature}"
    );
    let of_matrix = |k: usize| attitudes[k].to_rotation_matrix().into_inner();
    let euler = |k: usize| {
        let (roll, pitch, yaw) = attitudes[k].euler_angles();
        vec![roll.to_degrees(), pitch.to_degrees(), yaw.to_degrees()]
    };
    let not: [(&str, Columns); 8] = [
        ("quaternion", &|k| attitudes[k].coords.as_slice().to_vec()),
        ("its vector part", &|k| {
            attitudes[k].coords.as_slice()[..3].to_vec()
        }),
        ("Euler angles", &euler),
        ("orientation matrix", &|k| of_matrix(k).as_slice().to_vec()),
        ("its transpose", &|k| {
            of_matrix(k).transpose().as_slice().to_vec()
        }),
        ("direction of gravity", &|k| {
            (of_matrix(k).transpose() * Vector3::z())
                .as_slice()
                .to_vec()
        }),
        ("gravity in m/s²", &|k| {
            nine[k][3..6].iter().map(|of| 1.01 * of + 0.1).collect()
        }),
        ("counters", &|k| {
            vec![
                (k % 256) as f64,
                (k % 1000) as f64,
                20.0 + (k as f64 * 1e-3).sin(),
            ]
        }),
    ];
    for (name, others) in not {
        let draft = draft(others);
        assert!(!draft.contains("mag = "), "{name}: {draft}");
        assert!(draft.contains("accel = "), "{name}: {draft}");
    }
}
