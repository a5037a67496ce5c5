//! A MAT file of version 7.3 beside rows of text.

use std::f64::consts::FRAC_PI_2;
use std::fs;
use std::path::Path;

use hdf5_pure::LibVer;
use hdf5_pure::mat::{Compression, MatBuilder, MatError, Options, StructWriter};
use nalgebra::Vector3;
use turncal::attitude;
use turncal_files::Opened;
use turncal_files::draft::{Draft, Stated};

/// A quarter turn about each axis in turn, with rests between, at 100 Hz: time, angular rate, specific force.
fn rows() -> Vec<[f64; 7]> {
    let mut up = Vector3::new(0.1, 0.2, 1.0).normalize();
    let row = |k: usize| {
        let is_turn = k % 300 >= 200;
        let rate = Vector3::ith(k / 300 % 3, if is_turn { FRAC_PI_2 } else { 0.0 });
        up = attitude::exp(-rate * 0.01) * up;
        // Noise of a sort, which no unit hides.
        let rate = rate.add_scalar(1e-3 * (k as f64 * 12.9898).sin());
        let force = (up * 9.8).add_scalar(1e-2 * (k as f64 * 78.233).sin());
        [
            k as f64 * 0.01,
            rate.x,
            rate.y,
            rate.z,
            force.x,
            force.y,
            force.z,
        ]
    };
    (0..2700).map(row).collect()
}

fn text(rows: &[[f64; 7]]) -> String {
    let names = "imu.t,imu.gyro[0],imu.gyro[1],imu.gyro[2],imu.acc[0],imu.acc[1],imu.acc[2]\n";
    let line = |row: &[f64; 7]| row.map(|value| value.to_string()).join(",") + "\n";
    rows.iter()
        .map(line)
        .fold(names.to_owned(), |text, line| text + &line)
}

fn mat(rows: &[[f64; 7]], options: Options) -> Vec<u8> {
    let of = |from: usize, to: usize| -> Vec<f64> {
        let column = |k: usize| rows.iter().map(move |row| row[k]);
        (from..to).flat_map(column).collect()
    };
    let fill = |imu: &mut StructWriter| -> Result<(), MatError> {
        imu.write_f64("t", &[rows.len(), 1], &of(0, 1))?;
        imu.write_f64("gyro", &[rows.len(), 3], &of(1, 4))?;
        imu.write_f64("acc", &[rows.len(), 3], &of(4, 7))?;
        Ok(())
    };
    let mut file = MatBuilder::new(options);
    file.struct_("imu", fill).unwrap();
    file.finish().unwrap()
}

/// The draft without the names of the file and its stream.
fn drafted(file: &Path) -> Vec<String> {
    let text = Draft::of_file(file).unwrap().to_toml("log");
    let lines = text
        .lines()
        .filter(|line| !line.contains("stream") && !line.contains("samples of"));
    lines.map(str::to_owned).collect()
}

#[test]
fn a_mat_file_of_version_7_3_gives_the_draft_and_the_samples_of_the_text() {
    let directory = tempfile::tempdir().unwrap();
    let rows = rows();
    let log = directory.path().join("log.csv");
    fs::write(&log, text(&rows)).unwrap();
    let samples = |file: &Path| {
        Opened::new(file, None, &Stated::default(), |_| {})
            .unwrap()
            .run
            .recording
            .imu
    };
    let plain = Options::default();
    let mut deflated = Options::default();
    deflated.libver = LibVer::V110;
    deflated.compression = Compression::Deflate {
        level: 6,
        shuffle: true,
    };
    for options in [plain, deflated] {
        let file = directory.path().join("log.mat");
        fs::write(&file, mat(&rows, options)).unwrap();
        assert_eq!(drafted(&file), drafted(&log));
        assert_eq!(samples(&file), samples(&log));
    }
}
