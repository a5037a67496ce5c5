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
    samples[k]
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
        let error = Run::read(&path).unwrap_err().to_string();
        assert!(error.contains("no `latitude_deg`"), "{error}");

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
        let found = Run::read(&path).unwrap_or_else(|error| panic!("{name}: {error}\n{draft}"));
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
            let line = draft.lines().find(|line| line.starts_with(key))?;
            line.split('=').nth(1)?.trim().parse().ok()
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
        said.contains("# accel could be [\"acc2_x\", \"acc2_y\", \"acc2_z\"], too"),
        "{said}"
    );
    assert!(said.contains("temperature = \"temp\""), "{said}");
    fs::write(&log, rows("t,gx,gy,gz,pressure")).unwrap();
    let said = init(&[log.to_str().unwrap()]).success();
    let said = text(&said.get_output().stdout);
    assert!(said.contains("TODO: accel = three of"), "{said}");
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
