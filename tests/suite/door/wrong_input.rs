//! Whatever is wrong with a run: one message that names the file and says what to do.

use std::fs;
use std::path::Path;

const RUN: &str = r#"format = "turncal-run/1"
[site]
latitude_deg = 34.0
height_m = 10.0
gravity_m_s2 = 9.797
[meta]
serial = "7"
[imu]
file = "imu.csv"
output = "pulse"
gyro_unit = "count"
accel_unit = "count"
sample_period_s = 0.01
time_stamp = "end"
columns = { time = "t", gyro = ["gx", "gy", "gz"], accel = ["ax", "ay", "az"] }
[imu.noise]
angle_random_walk_deg_per_sqrt_h = 0.001
velocity_random_walk_ug_per_sqrt_hz = 5.0
[imu.prior.gyro]
scale = 2000000.0
scale_sigma_ppm = 1000.0
installation_sigma_arcsec = 200.0
bias_sigma = 10.0
[imu.prior.accel]
scale = [100000.0, 100000.0, 100000.0]
scale_sigma_ppm = 1000.0
installation_sigma_arcsec = 200.0
bias = 3.0
bias_sigma = [10.0, 11.0, 12.0]
[standstill]
position_sigma_m = 1.0
[turntable]
file = "table.csv"
columns = { time = "t", quaternion = ["qw", "qx", "qy", "qz"] }
position_sigma_arcsec = 1.0
reading_sigma_arcsec = 0.5
[segments]
file = "segments.csv"
"#;

fn imu() -> String {
    let rows = (1..=200).map(|k| format!("{:.2},1,-2,3,0,1,9790\n", f64::from(k) * 0.01));
    "t,gx,gy,gz,ax,ay,az\n".to_owned() + &rows.collect::<String>()
}

fn table() -> String {
    let rows = (0..=20).map(|k| format!("{:.1},1,0,0,0\n", f64::from(k) * 0.1));
    "t,qw,qx,qy,qz\n".to_owned() + &rows.collect::<String>()
}

fn good_run(directory: &Path) {
    fs::write(directory.join("run.toml"), RUN).unwrap();
    fs::write(directory.join("imu.csv"), imu()).unwrap();
    fs::write(directory.join("table.csv"), table()).unwrap();
    fs::write(
        directory.join("segments.csv"),
        "start,end,label\n0,1,z_up\n",
    )
    .unwrap();
}

/// The error of a run in which one text of one file was replaced by another.
fn error_after(file: &str, from: &str, to: &str) -> String {
    let directory = tempfile::tempdir().unwrap();
    good_run(directory.path());
    let path = directory.path().join(file);
    let text = fs::read_to_string(&path).unwrap();
    assert_eq!(text.matches(from).count(), 1, "`{from}` in {file}");
    fs::write(&path, text.replace(from, to)).unwrap();
    match turncal_files::read_run(&directory.path().join("run.toml")) {
        Ok(_) => panic!("`{to}` for `{from}` in {file} was accepted"),
        Err(error) => {
            let message = error.to_string();
            assert_command_says(directory.path(), &message);
            message
        }
    }
}

/// `calibrate` fails with status 1 and this message alone, and leaves nothing behind.
fn assert_command_says(directory: &Path, message: &str) {
    let output = directory.join("calibration");
    assert_cmd::Command::new(env!("CARGO_BIN_EXE_turncal"))
        .arg("calibrate")
        .arg(directory.join("run.toml"))
        .arg("-o")
        .arg(&output)
        .assert()
        .code(1)
        .stdout("")
        .stderr(format!("turncal: {message}\n"));
    assert!(!output.exists());
}

fn assert_says(message: &str, file: &str, words: &str) {
    for word in [file].into_iter().chain(words.split(" & ")) {
        assert!(message.contains(word), "no `{word}` in: {message}");
    }
    assert!(message.ends_with(['.', '?']), "no advice in: {message}");
    println!("{message}\n");
}

#[test]
fn the_run_that_the_cases_spoil_is_good() {
    let directory = tempfile::tempdir().unwrap();
    good_run(directory.path());
    let run = turncal_files::read_run(&directory.path().join("run.toml")).unwrap();
    assert_eq!(
        (
            run.recording.imu.len(),
            run.recording.imu.start(),
            run.recording.imu.period
        ),
        (200, 0.0, 0.01)
    );
    assert!(run.recording.notes.is_empty());
}

#[test]
fn each_wrong_value_in_run_toml_has_its_message() {
    let prior = "scale = 2000000.0\nscale_sigma_ppm = 1000.0";
    for (from, to, words) in [
        ("[site]", "[site", "line 2 & TOML"),
        (
            "turncal-run/1",
            "turncal-run/2",
            "line 1 & turncal-run/2 & turncal-run/1",
        ),
        (
            "position_sigma_arcsec = 1.0",
            "position_sigma_arcsec = 1e300",
            "1e300 & from 1e-30 to 1e30",
        ),
        (
            "reading_sigma_arcsec = 0.5",
            "reading_sigma_arcsec = 7e5",
            "turntable.reading_sigma_arcsec = 7e5 & at most 648000",
        ),
        (
            "[imu.noise]",
            "[imu.terms]\ntime-offset = { sigma = 1e12 }\n[imu.noise]",
            "imu.terms.time-offset.sigma = 1e12 & at most 573",
        ),
        (
            "[imu.noise]",
            "[imu.terms]\ntime-offset = { sigma = -1.0 }\n[imu.noise]",
            "imu.terms.time-offset.sigma = -1.0 & at least zero",
        ),
        (
            "reading_sigma_arcsec = 0.5",
            "reading_sigma_arcsec = 0.5\nsettling_sigma_arcsec = 0",
            "turntable.settling_sigma_arcsec = 0 & above zero",
        ),
        (
            "gravity_m_s2 = 9.797",
            "gravity_m_s2 = 9.797\ngravity_sigma_mgal = 1e6",
            "site.gravity_sigma_mgal = 1e6 & from 0 to 100000",
        ),
        (
            "height_m",
            "heigth_m",
            "line 4, column 1 & heigth_m & mean `height_m`",
        ),
        (
            "[standstill]",
            "[standstil]",
            "standstil & mean `standstill`",
        ),
        ("serial", "seriel", "[meta] & mean `serial`"),
        ("latitude_deg = 34.0", "", "[site] & latitude_deg & Add"),
        (
            "34.0",
            "91.0",
            "line 3, column 16 & site.latitude_deg = 91.0 & -90 to 90",
        ),
        ("34.0", "nan", "site.latitude_deg = nan & finite"),
        ("34.0", "\"north\"", "\"north\" & finite number"),
        ("height_m = 10.0", "height_m = 1e6", "height_m & 9000"),
        ("9.79", "979.0", "gravity_m_s2 = 979.0 & 9.7 to 9.9"),
        ("\"pulse\"", "\"pulses\"", "`pulse` & Did you mean"),
        (
            "gyro_unit = \"count\"",
            "gyro_unit = \"rad\"",
            "imu.gyro_unit & `count`",
        ),
        ("\"end\"", "\"ned\"", "imu.time_stamp & `end`"),
        ("time_stamp = \"end\"", "", "[imu] & time_stamp"),
        ("= 0.01\n", "= 0.0\n", "sample_period_s & above zero"),
        ("= 0.01\n", "= -0.01\n", "sample_period_s & above zero"),
        (
            "[\"gx\", \"gy\", \"gz\"]",
            "[\"gx\", \"gy\"]",
            "imu.columns.gyro & three",
        ),
        ("= 0.001", "= -0.001", "angle_random_walk & at least zero"),
        ("scale = 2000000.0", "", "[imu.prior.gyro] & scale & Add"),
        (
            "bias_sigma = 10.0",
            "bias_sigma = -1.0",
            "bias_sigma & above zero",
        ),
        (
            "bias_sigma = 10.0",
            "bias_sigma = 0",
            "bias_sigma & above zero",
        ),
        (
            "[10.0, 11.0, 12.0]",
            "[10.0, 11.0]",
            "bias_sigma & three numbers",
        ),
        (
            prior,
            "scale_sigma_ppm = 1000.0",
            "[imu.prior.gyro] & `scale` & count",
        ),
        ("scale = 2000000.0", "scale = 0.0", "scale = 0.0 & non-zero"),
        (
            "[standstill]",
            "[imu.terms]\nlever_arm = { sigma = 0.1 }\n[standstill]",
            "lever_arm & unknown field & size-effect",
        ),
        (
            "position_sigma_m = 1.0",
            "position_sigma_m = 0",
            "position_sigma_m & above zero",
        ),
        (
            "reading_sigma_arcsec = 0.5",
            "reading_sigma_arcsec = -0.5",
            "reading_sigma_arcsec & above zero",
        ),
        (
            "reading_sigma_arcsec = 0.5",
            "reading_sigma_arcsec = 0.5\nnonorthogonality_sigma_arcsec = 1",
            "nonorthogonality & angles",
        ),
        (
            "quaternion = [\"qw\", \"qx\", \"qy\", \"qz\"]",
            "angles = [\"qw\", \"qx\", \"qy\"]",
            "axes",
        ),
        (
            "quaternion = [\"qw\", \"qx\", \"qy\", \"qz\"]",
            "angles = [\"qw\"], axes = [\"u\"]",
            "[\"u\"] & `x`",
        ),
        (
            "quaternion = [\"qw\", \"qx\", \"qy\", \"qz\"]",
            "angles = [\"qw\"], axes = [\"x\", \"y\"]",
            "angles & per axis",
        ),
        ("\"qz\"]", "\"qz\", \"qw\"]", "\"qw\"] & four columns"),
    ] {
        assert_says(&error_after("run.toml", from, to), "run.toml", words);
    }
}

#[test]
fn a_scale_that_its_unit_rules_out_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    good_run(directory.path());
    let text = RUN
        .replace("\"pulse\"", "\"rate\"")
        .replace("gyro_unit = \"count\"", "gyro_unit = \"deg/s\"")
        .replace("scale = 2000000.0", "scale = 1.0");
    fs::write(directory.path().join("run.toml"), text).unwrap();
    let error = turncal_files::read_run(&directory.path().join("run.toml")).unwrap_err();
    assert_says(
        &error.to_string(),
        "run.toml",
        "imu.prior.gyro.scale & 57.29",
    );
}

#[test]
fn each_wrong_row_or_column_has_its_message() {
    for (file, from, to, words) in [
        (
            "imu.csv",
            "gx,gy",
            "gX,gy",
            "line 1 & named `gx` & mean `gX`",
        ),
        (
            "imu.csv",
            "gx,gy",
            "gx,gx",
            "line 1 & two columns named `gx`",
        ),
        (
            "imu.csv",
            "\n0.50,1,",
            "\n0.50,inf,",
            "line 51, column `gx` & `inf` & finite",
        ),
        (
            "imu.csv",
            "\n0.50,1,",
            "\n0.50,inf,",
            "line 51, column `gx` & `inf` & finite",
        ),
        (
            "imu.csv",
            "\n0.50,1,",
            "\n0.50,1.5,",
            "line 51, column `gx` & `1.5` & whole & increment",
        ),
        (
            "imu.csv",
            "\n0.50,",
            "\n-3.5,",
            "line 51 & steps back from 0.49 s to -3.5 s",
        ),
        (
            "table.csv",
            "\n0.5,1,0",
            "\n0.5,1,1",
            "line 7 & norm 1.414214 & w, x, y, z",
        ),
        (
            "table.csv",
            "\n0.5,1,0,",
            "\n0.4,0,1,",
            "line 7 & same time",
        ),
        ("table.csv", "\n0.5,", "\n-1,", "line 7 & steps back"),
        ("table.csv", "qw,", "q0,", "line 1 & named `qw`"),
        (
            "segments.csv",
            "0,1,",
            "1,1,",
            "line 2 & end later than the start",
        ),
        (
            "segments.csv",
            "0,1,",
            "0,3,",
            "line 2 & within the IMU log",
        ),
        (
            "segments.csv",
            "z_up",
            "",
            "line 2, column `label` & an empty field",
        ),
    ] {
        assert_says(&error_after(file, from, to), file, words);
    }
}

#[test]
fn each_wrong_file_has_its_message() {
    let good = imu();
    let two_rows: String = good.split_inclusive('\n').take(3).collect();
    let table_elsewhere = table()
        .replace("\n0.", "\n90.")
        .replace("\n1.", "\n91.")
        .replace("\n2.", "\n92.");
    let header = "t,gx,gy,gz,ax,ay,az\n";
    let twice_as_slow: String = header.to_owned()
        + &(1..=200)
            .map(|k| format!("{:.2},1,1,1,1,1,1\n", f64::from(k) * 0.02))
            .collect::<String>();
    let parted: String = header.to_owned()
        + &(1..=200)
            .map(|k| f64::from(k) * 0.01 + if k > 100 { 98.99 } else { 0.0 })
            .map(|time| format!("{time:.2},1,1,1,1,1,1\n"))
            .collect::<String>();
    for (file, content, words) in [
        ("imu.csv", "", "an empty file"),
        ("imu.csv", header, "0 samples & at least 100"),
        ("imu.csv", &two_rows, "2 samples & at least 100"),
        (
            "imu.csv",
            &twice_as_slow,
            "a time step of 0.02 s & sample_period_s",
        ),
        ("imu.csv", &parted, "line 102 & gap & 1 s to 100 s & split"),
        ("table.csv", &table_elsewhere, "90 s to 92 s & overlap"),
        (
            "table.csv",
            "t,qw,qx,qy,qz\n0,1,0,0,0\n",
            "fewer than 2 readings & at least 2",
        ),
        ("run.toml", "", "no `format`"),
        ("run.toml", "format = \"turncal-run/1\"", "no [imu] & file"),
    ] {
        let directory = tempfile::tempdir().unwrap();
        good_run(directory.path());
        fs::write(directory.path().join(file), content).unwrap();
        let error = turncal_files::read_run(&directory.path().join("run.toml")).expect_err(words);
        assert_says(&error.to_string(), file, words);
    }
}

#[test]
fn missing_damaged_and_foreign_files_have_their_message() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    good_run(directory.path());
    let error = || {
        turncal_files::read_run(&at("run.toml"))
            .unwrap_err()
            .to_string()
    };

    fs::remove_file(at("imu.csv")).unwrap();
    assert_says(&error(), "imu.csv", "cannot open & relative to run.toml");

    let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    std::io::Write::write_all(&mut gz, imu().as_bytes()).unwrap();
    let whole = gz.finish().unwrap();
    let mut flipped = whole.clone();
    flipped[whole.len() - 8] ^= 0xff;
    fs::write(at("run.toml"), RUN.replace("imu.csv", "imu.csv.gz")).unwrap();
    fs::write(at("imu.csv.gz"), &whole).unwrap();
    assert!(turncal_files::read_run(&at("run.toml")).is_ok());
    for damaged in [&whole[..whole.len() / 2], &flipped] {
        fs::write(at("imu.csv.gz"), damaged).unwrap();
        assert_says(&error(), "imu.csv.gz", "damaged or truncated");
    }

    fs::write(at("imu.csv"), imu()).unwrap();
    fs::write(at("run.toml"), RUN.replace("\"gy\"", "\"gx\"")).unwrap();
    assert_says(
        &error(),
        "imu.csv",
        "`gx` used for two & Name another column",
    );

    fs::write(at("run.toml"), RUN.replace("imu.csv", "imu.mat")).unwrap();
    assert_says(&error(), "imu.mat", "cannot open & relative to run.toml");
    fs::write(at("imu.mat"), b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR").unwrap();
    assert_says(&error(), "imu.mat", "binary data & a text log");
    // What a file holds counts, not how it is called.
    fs::write(at("imu.mat"), imu()).unwrap();
    assert!(turncal_files::read_run(&at("run.toml")).is_ok());
    fs::write(at("run.toml"), [0xff, 0xfe]).unwrap();
    assert_says(&error(), "run.toml", "cannot read");
    fs::remove_file(at("run.toml")).unwrap();
    assert_says(&error(), "run.toml", "cannot read & Give the path");
    let error = turncal_files::read_run(directory.path())
        .unwrap_err()
        .to_string();
    assert_says(&error, "", "cannot read & Give the path");
}

#[test]
fn each_wrong_calibration_has_its_message() {
    let triad = r#"{"scale":[1,1,1],"installation":[[1,0,0],[0,1,0],[0,0,1]],"bias":[0,0,0]}"#;
    let good = format!(
        r#"{{"format":"turncal-calibration/1","gyro":{triad},
"accel":{triad},"parameters":["gyro.scale.x","accel.bias.z"],"covariance":[[1,0],[0,2]],"source":"any"}}"#
    );
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("calibration.json");
    fs::write(&path, &good).unwrap();
    assert!(turncal_files::read_calibration(&path).is_ok());
    for (from, to, words) in [
        ("tion/1", "tion/3", "calibration/3"),
        ("\"accel\":", "\"axel\":", "missing field `accel` & line"),
        (
            "\"gyro\":{\"scale\":[1,1,1]",
            "\"gyro\":{\"scale\":[1,1]",
            "line 1 & array of length 3",
        ),
        (
            "\"gyro\":{\"scale\":[1,1,1]",
            "\"gyro\":{\"scale\":[1,1,0]",
            "gyro.scale & zero",
        ),
        (
            "\"gyro\":{\"scale\":[1,1,1]",
            "\"gyro\":{\"scale\":[1,1,1e999]",
            "out of range",
        ),
        ("[[1,0],[0,2]]", "[[1,0]]", "1 row in covariance & 2"),
        ("[[1,0],[0,2]]", "[[1,0],[2]]", "1 value in row 2 & square"),
        ("[[1,0],[0,2]]", "[[1,0],[0,-2]]", "row 2 & below zero"),
        (
            "gyro.scale.x",
            "gyro.scal.x",
            "gyro.scal.x & mean `gyro.scale.x`",
        ),
        ("gyro.scale.x", "accel.bias.z", "`accel.bias.z` twice"),
        ("\"any\"}", "\"any\"", "line 2"),
        (
            "[[1,0],[0,2]]",
            "[[1,0.1],[0.2,2]]",
            "gyro.scale.x & accel.bias.z & 1e-1 & 2e-1 & symmetric",
        ),
        (
            "[[1,0],[0,2]]",
            "[[1,14],[14,2]]",
            "gyro.scale.x & accel.bias.z & 1.4e1 & from −1 to 1",
        ),
        ("[[1,0],[0,2]]", "[[0,1],[1,2]]", "from −1 to 1"),
        (
            "\"covariance\":[[1,0],[0,2]]",
            "\"sigma\":{\"gyro\":TRIAD,\"accel\":TRIAD},\"covariance\":[[1,0],[0,2]]",
            "-1 in sigma.gyro & at least zero",
        ),
        (
            "\"gyro\":{\"scale\":[1,1,1]",
            "\"gyro\":{\"scale\":[1,1,1e300]",
            "gyro.scale.z = 1e300 & 1e15",
        ),
        (
            "[[1,0,0],[0,1,0],[0,0,1]],\"bias\":[0,0,0]",
            "[[1,0,0],[0,1,1e300],[0,0,1]],\"bias\":[0,0,0]",
            "gyro.installation.yz = 1e300 & -100.0 to 100.0",
        ),
        (
            "\"bias\":[0,0,0]",
            "\"bias\":[0,1e300,0]",
            "gyro.bias.y = 1e300 & 1e6",
        ),
        (
            "\"source\"",
            "\"terms\":{\"accel.time_offset\":{\"value\":1e9}},\"source\"",
            "terms.accel.time_offset.value = 1e9 & 0.573",
        ),
        (
            "\"source\"",
            "\"terms\":{\"accel.second_order.x\":{\"value\":1e300}},\"source\"",
            "terms.accel.second_order.x.value = 1e300 & 0.102",
        ),
        (
            "\"source\"",
            "\"terms\":{\"gyro.asymmetry.x\":{\"value\":0,\"sigma\":-1}},\"source\"",
            "terms.gyro.asymmetry.x.sigma = -1.0 & 0.0 to 1.0",
        ),
        (
            "\"source\"",
            "\"gravity\":{\"m_s2\":98.0,\"sigma_m_s2\":0},\"source\"",
            "gravity.m_s2 = 98 & 9.7 to 9.9",
        ),
    ] {
        let to = to.replace("TRIAD", &triad.replace("[1,1,1]", "[1,-1,1]"));
        let spoilt = good.replacen(from, &to, 1);
        assert_ne!(spoilt, good, "{from}");
        fs::write(&path, spoilt).unwrap();
        let error = turncal_files::read_calibration(&path).expect_err(words);
        assert_says(&error.to_string(), "calibration.json", words);
    }
}

/// Three correlations of −0.9 are each possible, and not together.
#[test]
fn a_covariance_that_gives_a_combination_a_negative_variance_is_refused_by_every_command() {
    let triad = r#"{"scale":[1,1,1],"installation":[[1,0,0],[0,1,0],[0,0,1]],"bias":[0,0,0]}"#;
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("calibration.json");
    let file = |r: f64| {
        let text = format!(
            r#"{{"format":"turncal-calibration/1","gyro":{triad},"accel":{triad},
"parameters":["gyro.scale.x","gyro.scale.y","gyro.scale.z"],"covariance":[[4,{0},{0}],[{0},4,{0}],[{0},{0},4]]}}"#,
            4.0 * r
        );
        fs::write(&path, text).unwrap();
        turncal_files::read_calibration(&path)
    };
    assert!(file(-0.499).is_ok() && file(0.999).is_ok() && file(1.0).is_ok());
    let error = file(-0.9).unwrap_err().to_string();
    assert_says(
        &error,
        "calibration.json",
        "smallest eigenvalue & -0.800 & semidefinite",
    );
    good_run(directory.path());
    for arguments in [
        "apply calibration.json run.toml",
        "export calibration.json --format kalibr",
        "compare calibration.json calibration.json",
        "navigate calibration.json --truth calibration.json --latitude-deg 30",
        "calibrate run.toml --json --truth calibration.json",
    ] {
        assert_cmd::Command::new(env!("CARGO_BIN_EXE_turncal"))
            .current_dir(directory.path())
            .args(arguments.split(' '))
            .assert()
            .code(1)
            .stdout("")
            .stderr(format!(
                "turncal: {}\n",
                error.replace(&path.display().to_string(), "calibration.json")
            ));
    }
}

#[test]
fn byte_order_mark_spaces_and_other_line_ends_are_not_wrong() {
    let directory = tempfile::tempdir().unwrap();
    good_run(directory.path());
    let good = turncal_files::read_run(&directory.path().join("run.toml")).unwrap();
    let spaced = "\u{feff}".to_owned() + &imu().replace(',', ", ").replace('\n', "\r\n");
    fs::write(directory.path().join("imu.csv"), spaced).unwrap();
    assert_eq!(
        turncal_files::read_run(&directory.path().join("run.toml")),
        Ok(good)
    );
}
