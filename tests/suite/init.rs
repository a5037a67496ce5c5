//! `turncal init` as a user meets it.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use turncal::imu::Sensor;
use turncal::run::Run;

use crate::shared::{read, shared};

fn init(arguments: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::new(env!("CARGO_BIN_EXE_turncal"));
    command.arg("init").args(arguments).assert()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// The draft with each field that it leaves open, by table and name, filled in.
fn completed(draft: &str, known: &BTreeMap<&str, String>) -> String {
    let mut table = String::new();
    let line = |line: &str| {
        if line.starts_with('[') {
            table = line.trim_matches(['[', ']']).to_owned();
        }
        match line
            .strip_prefix("# ")
            .and_then(|open| open.split_once(" ="))
        {
            Some((name, rest)) if rest.contains("TODO") => {
                let name = format!("{table}.{name}");
                format!(
                    "{} = {}\n",
                    name.rsplit('.').next().unwrap(),
                    known[name.as_str()]
                )
            }
            _ => format!("{line}\n"),
        }
    };
    draft.lines().map(line).collect()
}

/// What the file says in a row.
fn raw(run: &Run, sensor: Sensor, k: usize) -> [f64; 3] {
    let samples = match sensor {
        Sensor::Gyro => &run.recording.imu.gyro,
        Sensor::Accel => &run.recording.imu.accel,
    };
    samples
        .at(k)
        .component_mul(&run.instrument.nominal.get(sensor).0)
        .into()
}

#[test]
fn drafts_of_real_logs_are_what_their_authors_wrote() {
    for name in [
        "real-mems-six-position",
        "real-mems-raw-sections",
        "real-mems-static",
    ] {
        let Some(directory) = shared(name) else {
            continue;
        };
        let given = read(&directory);
        let place = tempfile::tempdir().unwrap();
        let log = place.path().join("imu.csv.gz");
        fs::copy(directory.join("imu.csv.gz"), &log).unwrap();
        let draft = init(&[log.to_str().unwrap()]).success();
        let draft = text(&draft.get_output().stdout);

        let path = place.path().join("run.toml");
        fs::write(&path, &draft).unwrap();

        let scale = given.instrument.nominal.gyro.0.x.to_string();
        let known = BTreeMap::from([
            ("site.latitude_deg", "49.6".to_owned()),
            ("site.height_m", "280.0".to_owned()),
            (
                "imu.noise.angle_random_walk_deg_per_sqrt_h",
                "0.5".to_owned(),
            ),
            ("imu.prior.gyro.scale", scale),
            ("imu.prior.gyro.bias_sigma", "100.0".to_owned()),
        ]);
        fs::write(&path, completed(&draft, &known)).unwrap();
        let found = turncal_files::read_run(&path)
            .unwrap_or_else(|error| panic!("{name}: {error}\n{draft}"));
        assert_eq!(found.instrument.unit, given.instrument.unit, "{name}");
        assert_eq!(
            found.recording.imu.continuous, given.recording.imu.continuous,
            "{name}"
        );
        assert!(
            (found.recording.imu.period / given.recording.imu.period - 1.0).abs() < 1e-5,
            "{name}"
        );
        for sensor in Sensor::ALL {
            let (found_scale, given_scale) = (
                found.instrument.nominal.get(sensor).0.x,
                given.instrument.nominal.get(sensor).0.x,
            );
            assert!(
                (found_scale / given_scale - 1.0).abs() < 0.1,
                "{name} {found_scale} {given_scale}"
            );
            for k in [0, 1000, 5000] {
                let [found, given] = [&found, &given]
                    .map(|run| raw(run, sensor, k).map(|v| v / run.recording.imu.period));
                let same = found
                    .iter()
                    .zip(given)
                    .all(|(a, b)| (a - b).abs() < 1e-4 * (1.0 + b.abs()));
                assert!(same, "{name} {k}: {found:?} {given:?}");
            }
        }
    }
}

#[test]
fn noise_at_rest_is_near_what_was_identified() {
    // As the runs state them; nothing shows the unit of gyros that never turn.
    let known = [
        ("real-mems-six-position", Some(0.3), 130.0),
        ("three-axis-counts", Some(0.001), 5.0),
        ("real-mems-static", None, 350.0),
    ];
    for (name, gyro, accel) in known {
        let Some(directory) = shared(name) else {
            continue;
        };
        let log = directory.join("imu.csv.gz");
        let draft = init(&[log.to_str().unwrap()]).success();
        let draft = text(&draft.get_output().stdout);
        let value = |key: &str| -> Option<f64> {
            let lines = draft.lines().filter_map(|line| line.strip_prefix("# "));
            let line = { lines }.find(|line| line.starts_with(key))?;
            let value = line.split('=').nth(1)?.split('#').next()?;
            value.trim().parse().ok()
        };
        let near = |found: f64, known: f64| (found / known).ln().abs() < 1.5f64.ln();
        let walk = value("angle_random_walk_deg_per_sqrt_h");
        assert_eq!(walk.is_some(), gyro.is_some(), "{name}");
        if let (Some(found), Some(known)) = (walk, gyro) {
            assert!(near(found, known), "{name} {found}");
        }
        let found = value("velocity_random_walk_ug_per_sqrt_hz").unwrap();
        assert!(near(found, accel), "{name} {found}");
    }
}

fn rows(header: &str) -> String {
    let columns = header.split(',').count() - 1;
    let row = |k: i32| {
        let value = |c: usize| format!(",{}", (k * 37 + c as i32 * 11) % 17 - 8);
        format!(
            "{}{}\n",
            f64::from(k) * 0.01,
            (0..columns).map(value).collect::<String>()
        )
    };
    format!("{header}\n{}", (0..200).map(row).collect::<String>())
}

#[test]
fn a_second_triad_is_said_and_a_missing_one_left_open() {
    let place = tempfile::tempdir().unwrap();
    let log = place.path().join("log.csv");
    fs::write(
        &log,
        rows("t,gx,gy,gz,acc1_x,acc1_y,acc1_z,acc2_x,acc2_y,acc2_z,temp"),
    )
    .unwrap();
    let said = init(&[log.to_str().unwrap()]).success();
    let said = text(&said.get_output().stdout);
    assert!(
        said.contains("# accel could also be [\"acc2_x\", \"acc2_y\", \"acc2_z\"]"),
        "{said}"
    );
    assert!(said.contains("temperature = \"temp\""), "{said}");
    fs::write(&log, rows("t,gx,gy,gz,pressure")).unwrap();
    let said = init(&[log.to_str().unwrap()]).success();
    let said = text(&said.get_output().stdout);
    assert!(said.contains("# accel = three of"), "{said}");
}

#[test]
fn an_existing_file_is_kept_unless_forced_and_the_log_always() {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name).to_str().unwrap().to_owned();
    let (log, run) = (at("log.csv"), at("run.toml"));
    fs::write(&log, rows("t,gx,gy,gz,ax,ay,az")).unwrap();
    init(&[&log, "-o", &run]).success();
    let first = fs::read_to_string(&run).unwrap();
    assert!(first.contains("file = \"log.csv\""), "{first}");
    fs::write(&run, "mine").unwrap();
    let refused = init(&[&log, "-o", &run]).code(1);
    assert!(text(&refused.get_output().stderr).contains("--force"));
    assert_eq!(fs::read_to_string(&run).unwrap(), "mine");
    init(&[&log, "-o", &run, "--force"]).success();
    assert_eq!(fs::read_to_string(&run).unwrap(), first);
    init(&[&log, "-o", &log, "--force"]).code(1);
    assert!(fs::read_to_string(&log).unwrap().starts_with("t,gx"));
    // Elsewhere the log's full name is needed.
    let elsewhere = at("other/run.toml");
    fs::create_dir(Path::new(&elsewhere).parent().unwrap()).unwrap();
    init(&[&log, "-o", &elsewhere]).success();
    let said = fs::read_to_string(&elsewhere).unwrap();
    assert!(
        said.contains(&format!(
            "{}\"",
            Path::new(&log).canonicalize().unwrap().display()
        )),
        "{said}"
    );
    init(&[&at("none.csv")]).code(1);
    init(&[]).code(2);
}

/// Quarter turns about each axis with rests between, at 100 Hz: gyros in rad/s, accelerometers in m/s².
fn motion() -> Vec<[f64; 6]> {
    let (mut up, mut rows) = (
        nalgebra::Vector3::new(0.1, 0.2, 1.0).normalize(),
        Vec::new(),
    );
    for turn in 0..9 {
        for step in 0..300 {
            let rate = if step < 200 {
                0.0
            } else {
                std::f64::consts::FRAC_PI_2
            };
            let rate = nalgebra::Vector3::ith(turn % 3, rate);
            up = nalgebra::Rotation3::new(-rate * 0.01) * up;
            // Noise enough to tell rests from a register that is stuck.
            let noise =
                |k: usize| (((step * 7919 + k * 104_729) % 1009) as f64 / 1009.0 - 0.5) * 1e-2;
            let (gyro, accel) = (rate, up * 9.8);
            let row = [gyro.x, gyro.y, gyro.z, accel.x, accel.y, accel.z];
            rows.push(std::array::from_fn(|k| row[k] + noise(k)));
        }
    }
    rows
}

/// One record as programs write it: name, file, header and a row.
type Shape = (&'static str, String, fn(usize, &str, &str) -> String);

fn shapes() -> Vec<Shape> {
    const ZEROS: &str = "0,0,0,0,0,0,0,0,0";
    let covariance = |of: &str| {
        (0..9)
            .map(|k| format!(",field.{of}_covariance{k}"))
            .collect::<String>()
    };
    let ros1 = format!(
        "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.orientation.x,field.orientation.y,\
         field.orientation.z,field.orientation.w{}{}{}{}{}\n",
        covariance("orientation"),
        ",field.angular_velocity.x,field.angular_velocity.y,field.angular_velocity.z",
        covariance("angular_velocity"),
        ",field.linear_acceleration.x,field.linear_acceleration.y,field.linear_acceleration.z",
        covariance("linear_acceleration"),
    );
    vec![
        ("plain", "t,gx,gy,gz,ax,ay,az\n".into(), |k, gyro, accel| {
            format!("{:.2},{gyro},{accel}", k as f64 * 0.01)
        }),
        ("names in a comment", "% t gx gy gz ax ay az\n".into(), |k, gyro, accel| {
            format!("{:.2},{gyro},{accel}", k as f64 * 0.01).replace(',', " ")
        }),
        ("ROS 1", ros1, |k, gyro, accel| {
            let stamp = 1_520_530_308_000_000_000u64 + 10_000_000 * k as u64;
            let received = stamp + 977;
            format!("{received},{k},{stamp},imu,0,0,0,1,{ZEROS},{gyro},{ZEROS},{accel},{ZEROS}")
        }),
        ("ROS 2", String::new(), |k, gyro, accel| {
            let (seconds, rest) = (1_520_530_308 + k / 100, 10_000_000 * (k % 100));
            format!("{seconds},{rest},imu,0,0,0,1,{ZEROS},{gyro},{ZEROS},{accel},{ZEROS}")
        }),
        (
            "EuRoC",
            "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],\
             a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n"
                .into(),
            |k, gyro, accel| {
                format!("{},{gyro},{accel}", 1_403_636_579_758_555_392u64 + 10_000_000 * k as u64)
            },
        ),
        (
            "PX4",
            "timestamp,gyro_rad[0],gyro_rad[1],gyro_rad[2],gyro_integral_dt,accelerometer_timestamp_relative,\
             accelerometer_m_s2[0],accelerometer_m_s2[1],accelerometer_m_s2[2],accelerometer_integral_dt,\
             accelerometer_clipping\n"
                .into(),
            |k, gyro, accel| format!("{},{gyro},10000,0,{accel},10000,0", 112_345_678 + 10_000 * k),
        ),
        (
            "Xsens",
            "// Start Time: Unknown\n// Update Rate: 100.0Hz\n\
             PacketCounter\tSampleTimeFine\tGyr_X\tGyr_Y\tGyr_Z\tAcc_X\tAcc_Y\tAcc_Z\tRoll\n"
                .into(),
            |k, gyro, accel| {
                let (packet, ticks) = ((65_000 + k) % 65_536, 48_211 + 100 * k);
                format!("{packet},{ticks},{gyro},{accel},").replace(',', "\t")
            },
        ),
        (
            "ArduPilot",
            "timestamp,TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz\n".into(),
            |k, gyro, accel| {
                let time = 112_345_678 + 10_000 * k;
                let row = |instance, gyro: &str| {
                    let seconds = time as f64 * 1e-6;
                    format!("{seconds:.6},{time},{instance},{gyro},{accel},0,0,45,1,1,1000,1000")
                };
                format!("{}\n{}", row(0, gyro), row(1, "0.5,0.25,0.125"))
            },
        ),
        (
            "blank cells",
            "time_s,type,gx,gy,gz,ax,ay,az,pressure\n".into(),
            |k, gyro, accel| {
                let time = k as f64 * 0.01;
                let row = format!("{time:.3},imu,{gyro},{accel},");
                match k % 10 {
                    3 => format!("{row}\n{:.3},baro,,,,,,,1013", time + 0.005),
                    _ => row,
                }
            },
        ),
    ]
}

#[test]
fn nine_shapes_of_one_record_are_one_run_once_the_place_is_filled_in() {
    let place = tempfile::tempdir().unwrap();
    let known = BTreeMap::from([
        ("site.latitude_deg", "49.6".to_owned()),
        ("site.height_m", "280.0".to_owned()),
    ]);
    let mut runs = Vec::new();
    for (name, header, row) in shapes() {
        let text = |of: &[f64]| of.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
        let rows = motion().into_iter().enumerate();
        let rows = rows.map(|(k, v)| row(k, &text(&v[..3]), &text(&v[3..])) + "\n");
        let (log, path) = (place.path().join("imu.csv"), place.path().join("run.toml"));
        fs::write(&log, header + &rows.collect::<String>()).unwrap();
        let draft = init(&[log.to_str().unwrap()]).success();
        let draft = String::from_utf8(draft.get_output().stdout.clone()).unwrap();
        fs::write(&path, completed(&draft, &known)).unwrap();
        let run = turncal_files::read_run(&path)
            .unwrap_or_else(|error| panic!("{name}: {error}\n{draft}"));
        runs.push((name, run));
    }
    let (_, plain) = &runs[0];
    assert_eq!(plain.recording.imu.gyro.len(), 2700);
    for (name, run) in &runs {
        let (found, expected) = (&run.recording.imu, &plain.recording.imu);
        assert!(
            (found.period / expected.period - 1.0).abs() < 1e-7,
            "{name}"
        );
        assert!(found.faults.is_empty(), "{name}: {:?}", found.faults);
        for sensor in Sensor::ALL {
            assert_eq!(found.of(sensor).len(), expected.of(sensor).len(), "{name}");
            for (a, b) in found.of(sensor).iter().zip(expected.of(sensor).iter()) {
                assert!((a - b).norm() < 1e-7 * (b.norm() + 1e-3), "{name}: {a} {b}");
            }
            let scale = |run: &Run| run.instrument.nominal.get(sensor).0;
            assert_eq!(scale(run), scale(plain), "{name}");
        }
    }
}

#[test]
fn a_sensor_brings_the_noise_and_tolerances_of_its_data_sheet() {
    let place = tempfile::tempdir().unwrap();
    let run = place.path().join("run");
    let mut simulate = Command::new(env!("CARGO_BIN_EXE_turncal"));
    simulate.args(["simulate", "mems", "-o"]).arg(&run);
    simulate.assert().success();
    let log = run.join("imu.csv.gz");
    let log = log.to_str().unwrap();
    let draft = init(&[log, "--sensor", "bmi088"]).success();
    let draft = text(&draft.get_output().stdout);
    for line in [
        "angle_random_walk_deg_per_sqrt_h = 0.84 ",
        "velocity_random_walk_ug_per_sqrt_hz = 160.0 ",
        "scale_sigma_ppm = 10000.0",
        // 1 °/s.
        "bias_sigma = 0.01745 ",
    ] {
        assert!(draft.contains(line), "{line}:\n{draft}");
    }
    let unknown = init(&[log, "--sensor", "bmi008"]).failure().code(1);
    let message = text(&unknown.get_output().stderr);
    assert!(message.contains("did you mean \"bmi088\""), "{message}");
}

#[test]
fn triads_in_two_files_calibrate_as_one_log() {
    let place = tempfile::tempdir().unwrap();
    let [run, gyro, accel] = ["run", "gyro.csv", "accel.csv"].map(|name| place.path().join(name));
    let turncal = || Command::new(env!("CARGO_BIN_EXE_turncal"));
    turncal()
        .args(["simulate", "mems", "-o"])
        .arg(&run)
        .assert()
        .success();
    let packed = fs::File::open(run.join("imu.csv.gz")).unwrap();
    let rows = std::io::read_to_string(flate2::read::MultiGzDecoder::new(packed)).unwrap();
    let columns = |which: std::ops::Range<usize>| -> String {
        let row = |row: &str| {
            let cells: Vec<&str> = row.split(',').collect();
            format!("{},{}\n", cells[0], cells[which.clone()].join(","))
        };
        rows.lines().map(row).collect()
    };
    fs::write(&gyro, columns(1..4)).unwrap();
    fs::write(&accel, columns(4..7)).unwrap();
    let mut calibrate = turncal();
    calibrate
        .arg("calibrate")
        .arg(&gyro)
        .arg("--accel-file")
        .arg(&accel);
    let done = calibrate.arg("--json").assert().success();
    let found: serde_json::Value = serde_json::from_slice(&done.get_output().stdout).unwrap();
    assert!((found["accel"]["scale"][0].as_f64().unwrap() - 1.0).abs() < 0.02);
    assert_eq!(found["provenance"]["inputs"].as_array().unwrap().len(), 2);
}
