//! Logs of other programs, written by the formats' own Python packages.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use turncal::calibration::result::Calibration;
use turncal::imu::Sensor;

use crate::shared::{read, shared, skipped};

const FORMATS: [&str; 17] = [
    "npz",
    "deflated.npz",
    "npy",
    "mat",
    "plain.mat",
    "v73.mat",
    "h5",
    "mcap",
    "lz4.mcap",
    "plain.mcap",
    "json.mcap",
    "proto.mcap",
    "bag",
    "lz4.bag",
    "bz2.bag",
    "ulg",
    "bin",
];
/// Formats of 32-bit numbers.
const SHORT: [&str; 2] = ["ulg", "bin"];

fn python() -> String {
    std::env::var("TURNCAL_PYTHON").unwrap_or_else(|_| "python3".to_owned())
}

/// Writes a record of accelerometers and gyros as these formats; false where Python or a package is missing.
fn write(log: &Path, directory: &Path, formats: &[&str]) -> bool {
    let script = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/suite/logs/write.py"
    );
    let mut command = Command::new(python());
    command
        .arg(script)
        .arg(log)
        .arg("0.01")
        .arg(directory)
        .args(formats);
    let Ok(output) = command.output() else {
        skipped("no Python");
        return false;
    };
    let said = String::from_utf8_lossy(&output.stdout);
    let error = String::from_utf8_lossy(&output.stderr);
    if error.contains("ModuleNotFoundError") || said.contains("skipped") {
        skipped(&format!("Python lacks packages: {said}{error}"));
        return false;
    }
    assert!(output.status.success(), "{error}");
    true
}

/// The run of a shared record with another log, drafted by `init`.
fn run_of(log: &Path, text: &str, directory: &Path) -> PathBuf {
    let mut init = assert_cmd::Command::new(env!("CARGO_BIN_EXE_turncal"));
    let output = init
        .arg("init")
        .arg(log)
        .assert()
        .success()
        .get_output()
        .clone();
    let draft = String::from_utf8(output.stdout).unwrap();
    let keys = ["stream =", "accel_from =", "time_unit =", "columns ="];
    let drafted = draft
        .lines()
        .filter(|line| keys.iter().any(|key| line.starts_with(key)));
    let mut lines: Vec<String> = text
        .lines()
        .filter(|line| !line.starts_with("columns = { gyro"))
        .map(str::to_owned)
        .collect();
    let file = lines
        .iter()
        .position(|line| line.starts_with("file = "))
        .unwrap();
    lines[file] = format!("file = {:?}", log.to_str().unwrap());
    let drafted: Vec<String> = drafted.map(str::to_owned).collect();
    lines.splice(file + 1..file + 1, drafted);
    let path = directory.join("run.toml");
    fs::write(&path, lines.join("\n")).unwrap();
    path
}

#[test]
fn every_format_gives_the_samples_of_the_text() {
    let Some(record) = shared("real-mems-lot-0") else {
        return;
    };
    let directory = tempfile::tempdir().unwrap();
    // Enough to draft a run from, and quick.
    let rows: Vec<String> = fs::read_to_string(record.join("imu.log"))
        .unwrap()
        .lines()
        .take(6000)
        .map(str::to_owned)
        .collect();
    let log = directory.path().join("imu.log");
    fs::write(&log, rows.join("\n") + "\n").unwrap();
    if !write(&log, directory.path(), &[]) {
        return;
    }
    let text = fs::read_to_string(record.join("run.toml")).unwrap();
    fs::write(directory.path().join("run.toml"), &text).unwrap();
    let expected = read(directory.path()).recording.imu;
    for format in FORMATS {
        let path = directory.path().join(format!("imu.{format}"));
        let run = turncal_files::read_run(&run_of(&path, &text, directory.path()))
            .unwrap_or_else(|e| panic!("{format}: {e}"));
        let imu = run.recording.imu;
        assert_eq!(imu.len(), expected.len(), "{format}");
        // 24 bits of the largest value, times the sample's length.
        let limit = if SHORT.contains(&format) { 4e-8 } else { 1e-12 };
        for sensor in Sensor::ALL {
            let pairs = expected.of(sensor).iter().zip(imu.of(sensor).iter());
            let off = pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(off < limit, "{format}: {} off by {off}", sensor.name());
        }
    }
}

#[test]
#[ignore = "18 calibrations"]
fn every_format_gives_the_calibration_of_the_text() {
    let Some(record) = shared("real-mems-lot-0") else {
        return;
    };
    let directory = tempfile::tempdir().unwrap();
    if !write(&record.join("imu.log"), directory.path(), &[]) {
        return;
    }
    let calibrated = |run: &Path| {
        let result = directory.path().join("result");
        let mut calibrate = assert_cmd::Command::new(env!("CARGO_BIN_EXE_turncal"));
        calibrate
            .arg("calibrate")
            .arg(run)
            .args(["--force", "-o"])
            .arg(&result);
        calibrate.assert().success();
        turncal_files::read_calibration(&result.join("calibration.json")).unwrap()
    };
    let text = fs::read_to_string(record.join("run.toml")).unwrap();
    let values = |calibration: &Calibration| {
        let of = |triad: &turncal::calibration::result::TriadRecord| {
            let installation = triad.installation.as_flattened().to_vec();
            [triad.scale.to_vec(), installation, triad.bias.to_vec()].concat()
        };
        [of(&calibration.gyro), of(&calibration.accel)].concat()
    };
    let expected = calibrated(&record.join("run.toml"));
    let sigma = expected.sigma.as_ref().unwrap();
    let sigma = values(&Calibration::new(sigma.gyro, sigma.accel));
    for format in FORMATS {
        let path = directory.path().join(format!("imu.{format}"));
        let found = values(&calibrated(&run_of(&path, &text, directory.path())));
        for ((found, expected), sigma) in found.iter().zip(values(&expected)).zip(&sigma) {
            let limit = match SHORT.contains(&format) && *sigma > 0.0 {
                true => 1e-3 * sigma,
                // Of the parameter, or of what it is measured against: one. What follows from other parameters, as an
                // entry on the diagonal does, has no σ, and differs by less than they do.
                false => 1e-9 * expected.abs().max(1.0),
            };
            assert!(
                (found - expected).abs() <= limit,
                "{format}: {found} {expected}"
            );
        }
    }
}

/// What `turncal` says to these arguments.
fn turncal(arguments: &[&str]) -> std::process::Output {
    let mut command = assert_cmd::Command::new(env!("CARGO_BIN_EXE_turncal"));
    command.args(arguments).output().unwrap()
}

/// PX4's own log as a run, drafted and completed.
fn flight(directory: &Path) -> Option<PathBuf> {
    let log = shared("logs")?.join("events.ulg");
    let path = directory.join("flight.ulg");
    fs::copy(&log, &path).unwrap();
    let draft = turncal(&["init", path.to_str().unwrap()]);
    let draft = String::from_utf8(draft.stdout).unwrap();
    assert!(draft.contains("\nbody_axes = \"frd\""), "{draft}");
    let text = draft
        .replace("# latitude_deg = ", "latitude_deg = 47.4")
        .replace("# height_m = ", "height_m = 500.0");
    fs::write(directory.join("run.toml"), text).unwrap();
    Some(path)
}

#[test]
fn a_cut_log_is_refused_with_its_place_and_used_if_asked() {
    let directory = tempfile::tempdir().unwrap();
    let Some(log) = flight(directory.path()) else {
        return;
    };
    let run = directory.path().join("run.toml");
    let whole = turncal_files::read_run(&run).unwrap();
    assert!(
        whole
            .recording
            .notes
            .iter()
            .any(|note| note.contains("PX4 correct"))
    );
    let bytes = fs::read(&log).unwrap();
    let cut = bytes.len() * 3 / 5;
    fs::write(&log, &bytes[..cut]).unwrap();
    let error = turncal_files::read_run(&run).unwrap_err().to_string();
    // The message that the end cuts begins not far before it.
    let byte: usize = error
        .split("byte ")
        .nth(1)
        .unwrap()
        .split(':')
        .next()
        .unwrap()
        .parse()
        .unwrap();
    assert!((cut - 5000..=cut).contains(&byte), "{error}");
    assert!(error.contains("salvage = true"), "{error}");
    let text = fs::read_to_string(&run).unwrap();
    let line = "file = \"flight.ulg\"";
    fs::write(&run, text.replace(line, &format!("{line}\nsalvage = true"))).unwrap();
    let part = turncal_files::read_run(&run).unwrap();
    let (part_imu, imu) = (&part.recording.imu, &whole.recording.imu);
    assert!(part_imu.len() > imu.len() / 2 && part_imu.len() < imu.len() * 7 / 10);
    assert!(
        part.recording
            .notes
            .iter()
            .any(|note| note.contains(&format!("byte {byte}")))
    );
}

#[test]
fn a_stream_that_is_not_there_is_named_beside_those_that_are() {
    let directory = tempfile::tempdir().unwrap();
    if flight(directory.path()).is_none() {
        return;
    }
    let run = directory.path().join("run.toml");
    let text = fs::read_to_string(&run).unwrap();
    fs::write(&run, text.replace("sensor_combined[0]", "sensor_combind")).unwrap();
    let error = turncal_files::read_run(&run).unwrap_err().to_string();
    assert!(
        error.contains("flight.ulg") && error.contains("Did you mean `sensor_combined[0]`?"),
        "{error}"
    );
}

#[test]
fn px4s_flights_have_the_streams_that_pyulog_finds() {
    let Some(logs) = shared("logs") else {
        return;
    };
    for log in ["small.ulg", "events.ulg"] {
        let path = logs.join(log);
        let script = format!(
            "from pyulog import ULog
for d in ULog({path:?}).data_list:
    print(d.name, d.multi_id, len(d.data['timestamp']))
d = ULog({path:?}).get_dataset('vehicle_attitude')
print('first', *(float(d.data[f][0]) for f in ('timestamp', 'q[0]', 'q[1]', 'q[2]', 'q[3]')))
"
        );
        let Ok(ran) = Command::new(python()).args(["-c", &script]).output() else {
            skipped("no Python");
            return;
        };
        let error = String::from_utf8_lossy(&ran.stderr);
        if error.contains("ModuleNotFoundError") {
            skipped("Python without pyulog");
            return;
        }
        let said = String::from_utf8(ran.stdout).unwrap();
        let draft = turncal(&["init", path.to_str().unwrap()]);
        let draft = String::from_utf8(draft.stdout).unwrap();
        let mut streams = 0;
        for line in said.lines() {
            let words: Vec<&str> = line.split(' ').collect();
            if let ["first", values @ ..] = &words[..] {
                let directory = tempfile::tempdir().unwrap();
                let output = directory.path().join("run");
                let (from, to) = (path.to_str().unwrap(), output.to_str().unwrap());
                let ran = turncal(&["convert", from, "--stream", "vehicle_attitude[0]", "-o", to]);
                assert!(
                    ran.status.success(),
                    "{}",
                    String::from_utf8_lossy(&ran.stderr)
                );
                let mut text = String::new();
                let file = fs::File::open(output.join("imu.csv.gz")).unwrap();
                std::io::Read::read_to_string(&mut flate2::read::GzDecoder::new(file), &mut text)
                    .unwrap();
                let mut rows = text.lines().map(|row| row.split(',').collect::<Vec<_>>());
                let (names, first) = (rows.next().unwrap(), rows.next().unwrap());
                for (name, value) in ["timestamp", "q[0]", "q[1]", "q[2]", "q[3]"]
                    .iter()
                    .zip(values)
                {
                    let place = names.iter().position(|known| known == name).unwrap();
                    let (found, expected): (f64, f64) =
                        (first[place].parse().unwrap(), value.parse().unwrap());
                    assert_eq!(found, expected, "{log}: {name}");
                }
                continue;
            }
            let [name, instance, samples] = words[..] else {
                panic!("{line}");
            };
            let detailed = format!("# {name}[{instance}]: {samples} samples of ");
            let short = format!("{name}[{instance}] ({samples})");
            assert!(
                draft.contains(&detailed) || draft.contains(&short),
                "{log}: {line}"
            );
            streams += 1;
        }
        assert!(streams > 30);
    }
}

#[test]
fn a_phones_two_files_are_drafted_as_one_run() {
    let Some(record) = shared("real-mems-lot-0") else {
        return;
    };
    let directory = tempfile::tempdir().unwrap();
    let rows = fs::read_to_string(record.join("imu.log")).unwrap();
    let mut files = [
        "time,seconds_elapsed,z,y,x\n".to_owned(),
        "time,seconds_elapsed,z,y,x\n".to_owned(),
    ];
    // Unix time in ns, the axes in a phone's order.
    for (k, row) in rows.lines().take(6000).enumerate() {
        let values: Vec<&str> = row.split_whitespace().collect();
        for (file, triad) in files.iter_mut().zip([&values[3..], &values[..3]]) {
            let time = 1_700_000_000_000_000_000 + 10_000_000 * k as u64;
            let elapsed = 0.01 * k as f64;
            *file += &format!("{time},{elapsed},{},{},{}\n", triad[2], triad[1], triad[0]);
        }
    }
    for (name, file) in ["Gyroscope.csv", "TotalAcceleration.csv"]
        .iter()
        .zip(&files)
    {
        fs::write(directory.path().join(name), file).unwrap();
    }
    let [gyro, accel, run] = ["Gyroscope.csv", "TotalAcceleration.csv", "run.toml"]
        .map(|name| directory.path().join(name));
    let arguments = [&gyro, &accel].map(|path| path.to_str().unwrap());
    let ran = turncal(&[
        "init",
        arguments[0],
        arguments[1],
        "-o",
        run.to_str().unwrap(),
    ]);
    assert!(
        ran.status.success(),
        "{}",
        String::from_utf8_lossy(&ran.stderr)
    );
    let text = fs::read_to_string(&run).unwrap();
    assert!(text.contains(
        "accel_from = { file = \"TotalAcceleration.csv\", time = \"time\", time_unit = \"ns\" }"
    ));
    let text = text
        .replace("# latitude_deg = ", "latitude_deg = 61.8")
        .replace("# height_m = ", "height_m = 60.0");
    fs::write(&run, text).unwrap();
    let found = turncal_files::read_run(&run)
        .unwrap_or_else(|error| panic!("{error}"))
        .recording
        .imu;
    let log = directory.path().join("imu.log");
    let short: String = rows
        .lines()
        .take(6000)
        .map(|row| format!("{row}\n"))
        .collect();
    fs::write(&log, short).unwrap();
    fs::copy(record.join("run.toml"), &run).unwrap();
    let expected = read(directory.path()).recording.imu;
    assert_eq!(found.len(), expected.len());
    for sensor in Sensor::ALL {
        let pairs = expected.of(sensor).iter().zip(found.of(sensor).iter());
        let off = pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(off < 1e-9, "{}: {off}", sensor.name());
    }
}
