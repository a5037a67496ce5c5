//! Real and made runs come in through the door as they are, and nothing wrong does.

use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use turncal::attitude;
use turncal::earth::Site;
use turncal::imu::{
    Instability, InstallationForm, Noise, Nominal, Output, PerSensor, Prior, Sensor,
};
use turncal::run::record::{
    Aiding, BodyFrame, ConsistencyRecord, EQUATION, Method, NisRecord, TestVector, TriadRecord,
};
use turncal::run::{
    CalibrationRecord, ImuRecord, Run, Segment, Standstill, TableRecord, write_run,
};
use turncal::units::{DEG_PER_H, DEGREE, STANDARD_GRAVITY};

/// The shared runs, if they are there. Continuous integration must have them.
fn shared(run: &str) -> Option<PathBuf> {
    let data = std::env::var_os("TURNCAL_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    let directory = data.join(run);
    if directory.is_dir() {
        return Some(directory);
    }
    assert!(
        std::env::var_os("CI").is_none_or(|ci| ci != "true"),
        "no {}; set TURNCAL_DATA",
        directory.display()
    );
    println!("skipped: no {}", directory.display());
    None
}

#[test]
fn every_shared_run_and_truth_reads() {
    for (name, samples, table, segments) in [
        ("three-axis-counts", 59_500, true, 0),
        ("nineteen-position-clean", 98_200, true, 0),
        ("nineteen-position-velocity", 98_200, false, 0),
        ("nineteen-position-full", 98_200, false, 0),
        ("real-mems-raw-sections", 9_414, false, 9),
        ("real-mems-six-position", 10_376, false, 9),
        ("real-mems-static", 44_930, false, 1),
    ] {
        let Some(directory) = shared(name) else {
            continue;
        };
        let run = read(&directory);
        assert_eq!(run.name, name);
        assert_eq!(run.imu.len(), samples, "{name}");
        assert_eq!(run.table.is_some(), table, "{name}");
        assert_eq!(run.segments.len(), segments, "{name}");
        let truth = directory.join("truth.json");
        if truth.exists() {
            let truth = CalibrationRecord::read(&truth).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(truth.unit, Some(run.unit), "{name}");
        }
    }
}

fn read(directory: &Path) -> Run {
    Run::read(&directory.join("run.toml")).unwrap_or_else(|error| panic!("{error}"))
}

/// A run that turns and stands, with every optional part.
fn made_run(name: &str) -> Run {
    let imu = ImuRecord {
        start: 3.25,
        period: 1.0 / 128.0,
        continuous: true,
        gyro: (0..300)
            .map(|k| Vector3::new(1.0, -2.0, 0.01) * 1e-3 * f64::from(k).sin())
            .collect(),
        accel: (0..300)
            .map(|k| Vector3::new(0.1, -0.02, 9.8) / 128.0 * (1.0 + 1e-3 * f64::from(k)))
            .collect(),
        pulse: PerSensor::default(),
    };
    let prior = Prior {
        scale_sigma: Vector3::new(1e-3, 2e-3, 3e-3),
        installation_sigma: Vector3::new(1e-4, 2e-4, 3e-4),
        bias: Vector3::new(1e-5, -2e-5, 3e-5),
        bias_sigma: Vector3::new(1e-6, 2e-6, 3e-6),
    };
    Run {
        name: name.to_owned(),
        site: Site::with_normal_gravity(0.7, -1.9, 123.4),
        meta: [("serial", "A \"7\""), ("notes", "two\nlines")]
            .map(|(name, value)| (name.to_owned(), value.to_owned()))
            .into(),
        imu,
        noise: PerSensor {
            gyro: Noise {
                random_walk: 3e-7,
                instability: Some(Instability {
                    sigma: 5e-8,
                    correlation_time: 300.0,
                }),
            },
            accel: Noise {
                random_walk: 5e-5,
                instability: None,
            },
        },
        prior: PerSensor {
            gyro: prior,
            accel: prior,
        },
        nominal: PerSensor {
            gyro: Nominal(Vector3::repeat(1.0)),
            accel: Nominal(Vector3::repeat(1.0)),
        },
        unit: PerSensor {
            gyro: "rad".to_owned(),
            accel: "m/s".to_owned(),
        },
        standstill: Standstill {
            velocity_sigma: Some(2e-6),
            position_sigma: 0.4,
        },
        table: Some(TableRecord {
            time: (0..20).map(|k| 3.25 + 0.125 * f64::from(k)).collect(),
            attitude: (0..20)
                .map(|k| attitude::exp(Vector3::new(0.1, -0.2, 0.3) * f64::from(k)))
                .collect(),
            position_sigma: 5e-6,
            reading_sigma: 2e-6,
        }),
        segments: vec![Segment {
            start: 3.5,
            end: 4.25,
            label: "rot_x+360".to_owned(),
        }],
        notes: Vec::new(),
    }
}

/// Equal but for the rounding of conversions.
fn assert_same(a: &Run, b: &Run) {
    let near = |a: f64, b: f64| assert!((a - b).abs() <= 1e-12 * a.abs(), "{a} {b}");
    let near3 = |a: Vector3<f64>, b: Vector3<f64>| assert!((a - b).norm() <= 1e-12 * a.norm());
    assert_eq!(
        (
            &a.name,
            &a.meta,
            &a.unit,
            &a.nominal,
            &a.segments,
            &a.standstill
        ),
        (
            &b.name,
            &b.meta,
            &b.unit,
            &b.nominal,
            &b.segments,
            &b.standstill
        )
    );
    near(a.site.latitude, b.site.latitude);
    near(a.site.longitude, b.site.longitude);
    assert_eq!(
        (a.site.height, a.site.gravity),
        (b.site.height, b.site.gravity)
    );
    assert_eq!(
        (
            a.imu.start,
            a.imu.period,
            a.imu.continuous,
            a.imu.pulse,
            a.imu.len()
        ),
        (
            b.imu.start,
            b.imu.period,
            b.imu.continuous,
            b.imu.pulse,
            b.imu.len()
        )
    );
    for sensor in Sensor::ALL {
        let (noise_a, noise_b) = (a.noise.get(sensor), b.noise.get(sensor));
        near(noise_a.random_walk, noise_b.random_walk);
        assert_eq!(noise_a.instability.is_some(), noise_b.instability.is_some());
        if let (Some(a), Some(b)) = (noise_a.instability, noise_b.instability) {
            near(a.sigma, b.sigma);
            near(a.correlation_time, b.correlation_time);
        }
        let (prior_a, prior_b) = (a.prior.get(sensor), b.prior.get(sensor));
        near3(prior_a.scale_sigma, prior_b.scale_sigma);
        near3(prior_a.installation_sigma, prior_b.installation_sigma);
        near3(prior_a.bias, prior_b.bias);
        near3(prior_a.bias_sigma, prior_b.bias_sigma);
    }
    for (a, b) in a.imu.gyro.iter().zip(&b.imu.gyro) {
        near3(*a, *b);
    }
    for (a, b) in a.imu.accel.iter().zip(&b.imu.accel) {
        near3(*a, *b);
    }
    assert_eq!(a.table.is_some(), b.table.is_some());
    if let (Some(a), Some(b)) = (&a.table, &b.table) {
        near(a.position_sigma, b.position_sigma);
        near(a.reading_sigma, b.reading_sigma);
        assert_eq!(a.time, b.time);
        for (a, b) in a.attitude.iter().zip(&b.attitude) {
            assert!((a - b).amax() < 1e-14);
        }
    }
}

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
    let truth = CalibrationRecord::new(triad_record(1.0), triad_record(1e5));
    let place = directory.path().join("increments");
    fs::create_dir(&place).unwrap();
    write_run(&place, &run, Output::Increment, Some(&truth)).unwrap();
    assert_same(&run, &read(&place));
    assert_eq!(
        CalibrationRecord::read(&place.join("truth.json")),
        Ok(truth)
    );

    run.name = "rates".to_owned();
    run.unit = PerSensor {
        gyro: "deg/h".to_owned(),
        accel: "g".to_owned(),
    };
    run.nominal = PerSensor {
        gyro: Nominal(Vector3::repeat(1.0 / DEG_PER_H)),
        accel: Nominal(Vector3::repeat(1.0 / STANDARD_GRAVITY)),
    };
    let place = directory.path().join("rates");
    fs::create_dir(&place).unwrap();
    write_run(&place, &run, Output::Rate, None).unwrap();
    assert_same(&run, &read(&place));
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
        (&back.imu.gyro, &back.imu.accel),
        (&run.imu.gyro, &run.imu.accel)
    );
    assert_same(&run, &back);
}

#[test]
fn a_run_that_could_not_be_read_is_not_written() {
    let directory = tempfile::tempdir().unwrap();
    let error = write_run(directory.path(), &made_run("x"), Output::Pulse, None).unwrap_err();
    assert!(error.to_string().contains("gyro_unit = `rad`"), "{error}");
    let mut run = made_run("x");
    run.meta.insert("weather".to_owned(), "fine".to_owned());
    let error = write_run(directory.path(), &run, Output::Increment, None).unwrap_err();
    assert!(error.to_string().contains("weather"), "{error}");
    assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 0);
}

/// The made run written with increments, with its `run.toml` and CSV rows changed.
fn reread(change: impl Fn(&str) -> String, imu: impl Fn(usize, [f64; 7]) -> String) -> Run {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path().join("made");
    fs::create_dir(&place).unwrap();
    let run = made_run("made");
    write_run(&place, &run, Output::Increment, None).unwrap();
    let text = fs::read_to_string(place.join("run.toml")).unwrap();
    let text = text
        .replace("imu.csv.gz", "imu.csv")
        .replace("table.csv.gz", "table.csv");
    fs::write(place.join("run.toml"), change(&text)).unwrap();
    let mut rows = "t,gx,gy,gz,ax,ay,az,temp\n".to_owned();
    for k in 0..run.imu.len() {
        let (g, a) = (run.imu.gyro[k], run.imu.accel[k]);
        rows += &imu(k, [run.imu.time(k), g.x, g.y, g.z, a.x, a.y, a.z]);
        rows += ",25.0\n";
    }
    fs::write(place.join("imu.csv"), rows).unwrap();
    let mut rows = "t,qw,qx,qy,qz\n".to_owned();
    for k in 0..20 {
        rows += &format!("{},{},-20,10,{}\n", 3.3 + 0.1 * f64::from(k), 3 * k, 2 * k);
    }
    let angles = change(&text).contains("angles");
    if angles {
        fs::write(place.join("table.csv"), rows).unwrap();
    } else {
        fs::rename(place.join("table.csv.gz"), place.join("t.csv.gz")).unwrap();
        let text = change(&text).replace("table.csv", "t.csv.gz");
        fs::write(place.join("run.toml"), text).unwrap();
    }
    read(&place)
}

fn plain(_: usize, row: [f64; 7]) -> String {
    row.map(|value| value.to_string()).join(",")
}

#[test]
fn other_body_axes_describe_the_same_run() {
    let mut expected = made_run("made");
    // Priors differ from axis to axis, so a swap of σ shows too.
    for axes in ["frd", "flu"] {
        let run = reread(
            |text| {
                let turned = |v: [&str; 3], sign: [&str; 3]| match axes {
                    "frd" => format!("[{}, {}, {}{}]", v[1], v[0], sign[2], v[2]),
                    _ => format!("[{}, {}{}, {}]", v[1], sign[0], v[0], v[2]),
                };
                let mut out = text.replace("[imu]", &format!("[imu]\nbody_axes = \"{axes}\""));
                let none = ["", "", ""];
                let minus = ["-", "-", "-"];
                for (x, y, z, sign) in [
                    ("1000.0", "2000.0", "3000.0", none),
                    ("1e-5", "-2e-5", "3e-5", minus),
                    ("1e-6", "2e-6", "3e-6", none),
                ] {
                    let from = format!("[{x}, {y}, {z}]");
                    assert!(out.contains(&from), "{from} in {out}");
                    out = out.replace(&from, &turned([x, y, z], sign));
                }
                let line = out
                    .lines()
                    .find(|l| l.starts_with("installation_sigma"))
                    .unwrap();
                let v: Vec<&str> = line.split(['[', ',', ']']).map(str::trim).collect();
                let to = format!(
                    "installation_sigma_arcsec = {}",
                    turned([v[1], v[2], v[3]], none)
                );
                out.replace(line, &to)
            },
            |_, [t, gx, gy, gz, ax, ay, az]| match axes {
                "frd" => format!("{t},{gy},{gx},{},{ay},{ax},{}", -gz, -az),
                _ => format!("{t},{gy},{},{gz},{ay},{},{az}", -gx, -ax),
            },
        );
        expected.name.clone_from(&run.name);
        assert_same(&expected, &run);
    }
}

#[test]
fn time_stamps_may_name_any_moment_of_a_sample_and_be_rounded() {
    for (word, lag) in [("start", 0.0), ("middle", 0.5), ("end", 1.0)] {
        let run = reread(
            |text| {
                text.replace(
                    "time_stamp = \"start\"",
                    &format!("time_stamp = \"{word}\""),
                )
                .replace("sample_period_s = 0.0078125\n", "")
            },
            |_, mut row| {
                row[0] = ((row[0] + lag / 128.0) * 1e4).round() / 1e4;
                plain(0, row)
            },
        );
        // Stamps rounded to 0.1 ms fix the period over 300 samples to better than 1 µs.
        assert!((run.imu.period - 1.0 / 128.0).abs() < 1e-6);
        assert!(
            (run.imu.start - 3.25).abs() < 1e-4,
            "{word}: {}",
            run.imu.start
        );
    }
}

#[test]
fn axis_angles_multiply_from_the_outer_axis_in() {
    let run = reread(
        |text| {
            text.replace(
                "quaternion = [\"qw\", \"qx\", \"qy\", \"qz\"]",
                "angles = [\"qw\", \"qx\", \"qz\"], axes = [\"z\", \"x\", \"y\"]",
            )
        },
        plain,
    );
    let table = run.table.unwrap();
    for (k, c_b_n) in table.attitude.iter().enumerate() {
        // Heading is clockwise and the outer angle is not.
        let [outer, middle, inner] = [3.0 * k as f64, -20.0, 2.0 * k as f64].map(|a| a * DEGREE);
        let expected = attitude::from_pitch_roll_heading(middle, inner, -outer);
        assert!((c_b_n - expected).amax() < 1e-14);
    }
}

#[test]
fn what_has_no_effect_yet_is_noted() {
    let run = reread(
        |text| {
            text.replace(
                "time = \"t\", gyro",
                "time = \"t\", temperature = \"temp\", gyro",
            )
            .replace(
                "[turntable]",
                "[turntable]\nlevel_sigma_arcsec = 2\ntime_sigma_ms = 1",
            )
        },
        plain,
    );
    assert_eq!(run.notes.len(), 3);
    for (note, word) in run
        .notes
        .iter()
        .zip(["temperature", "level_sigma", "time_sigma"])
    {
        assert!(
            note.contains(word) && note.contains("no effect yet"),
            "{note}"
        );
    }
}

#[test]
fn a_calibration_comes_back_as_it_went() {
    let mut record = CalibrationRecord::new(triad_record(2e6), triad_record(-1e5));
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
    record.covariance = vec![vec![1.0 / 3.0, 1e-300], vec![1e-300, 2.0]];
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
    });
    record.warnings = vec!["heading is not observed".to_owned()];
    record.fixed = vec!["accel.installation.xy".to_owned()];
    record.equation = Some(EQUATION.to_owned());
    record.correction = Some(PerSensor {
        gyro: sigma.installation,
        accel: sigma.installation,
    });
    record.test_vectors = vec![TestVector {
        raw: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        calibrated: [0.1; 6],
    }];
    record.meta.insert("serial".to_owned(), "7".to_owned());

    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("calibration.json");
    record.write(&path, false).unwrap();
    assert_eq!(CalibrationRecord::read(&path), Ok(record.clone()));
    let json: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    assert_eq!(json["consistency"]["nis_interval"][1], 1.1);
    assert_eq!(json["installation_form"], "three-angle");
    assert_eq!(json["body_frame"], "accelerometer");

    record.gyro.bias[0] = f64::NAN;
    let error = record
        .write(&directory.path().join("other.json"), false)
        .unwrap_err();
    assert!(error.to_string().contains("gyro"), "{error}");
    assert!(!directory.path().join("other.json").exists());
}
