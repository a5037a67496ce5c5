//! What small files of every format give, whole, cut and damaged.

mod ulog;
mod write;

use std::io::Cursor;
use std::path::PathBuf;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::bytes::{Broken, Input};
use super::{FORMATS, Log};
use write::{Messages, SAMPLES, sample};

/// Columns of time, gyros and accelerometers; what a program's corrections, undone, add to the first gyro and the
/// first accelerometer, and divide the second accelerometer by.
type Fixture = (&'static str, Vec<u8>, [&'static str; 7], [f64; 2]);

fn fixtures() -> Vec<Fixture> {
    let ros = |time| {
        let [gx, gy, gz] = [
            "angular_velocity.x",
            "angular_velocity.y",
            "angular_velocity.z",
        ];
        let [ax, ay, az] = [
            "linear_acceleration.x",
            "linear_acceleration.y",
            "linear_acceleration.z",
        ];
        [time, gx, gy, gz, ax, ay, az]
    };
    let arrays = [
        "t", "gyro[0]", "gyro[1]", "gyro[2]", "acc[0]", "acc[1]", "acc[2]",
    ];
    let of_struct = [
        "imu.t",
        "imu.gyro[0]",
        "imu.gyro[1]",
        "imu.gyro[2]",
        "imu.acc[0]",
        "imu.acc[1]",
        "imu.acc[2]",
    ];
    let of_group = [
        "imu/t",
        "imu/gyro[0]",
        "imu/gyro[1]",
        "imu/gyro[2]",
        "imu/acc[0]",
        "imu/acc[1]",
        "imu/acc[2]",
    ];
    let mut json = ros("stamp");
    json[4..].copy_from_slice(&[
        "linear_acceleration[0]",
        "linear_acceleration[1]",
        "linear_acceleration[2]",
    ]);
    let none = [0.0, 1.0];
    vec![
        (
            "vehicle_imu[0]",
            ulog::ulog(),
            [
                "timestamp",
                "delta_angle[0]",
                "delta_angle[1]",
                "delta_angle[2]",
                "delta_velocity[0]",
                "delta_velocity[1]",
                "delta_velocity[2]",
            ],
            [0.5 * 7812e-6, 2.0],
        ),
        (
            "IMU[0]",
            write::dataflash(),
            ["TimeUS", "GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ"],
            [0.5, 2.0],
        ),
        ("t", write::npy_of_fields(), arrays, none),
        ("t", write::npz(false), arrays, none),
        ("t", write::npz(true), arrays, none),
        ("imu.t", write::mat(false), of_struct, none),
        ("imu.t", write::mat(true), of_struct, none),
        ("imu.t", write::mat_of_hdf5(), of_struct, none),
        ("imu/t", write::hdf5(), of_group, none),
        (
            "imu/acc",
            include_bytes!("h5py.h5").to_vec(),
            of_group,
            none,
        ),
        ("/imu", write::bag(false), ros("header.stamp"), none),
        ("/imu", write::bag(true), ros("header.stamp"), none),
        (
            "/imu",
            include_bytes!("bag.db3").to_vec(),
            ros("header.stamp"),
            none,
        ),
        (
            "/imu",
            write::mcap(Messages::Ros1, false),
            ros("header.stamp"),
            none,
        ),
        (
            "/imu",
            write::mcap(Messages::Cdr, true),
            ros("header.stamp"),
            none,
        ),
        (
            "/imu",
            write::mcap(Messages::Protobuf, true),
            ros("time"),
            none,
        ),
        ("/imu", write::mcap(Messages::Json, false), json, none),
    ]
}

fn open(bytes: Vec<u8>) -> Result<Option<Box<dyn Log>>, Broken> {
    let format = FORMATS.iter().find(|format| format.is_of(&bytes));
    let Some(format) = format else {
        return Ok(None);
    };
    let input = Input::new(Box::new(Cursor::new(bytes))).unwrap();
    (format.open)(input).map(Some)
}

/// All samples, and why there are no more.
fn read(bytes: Vec<u8>) -> (Vec<(String, Vec<f64>)>, Option<Broken>) {
    let mut samples = Vec::new();
    let mut row = Vec::new();
    let mut log = match open(bytes) {
        Ok(Some(log)) => log,
        Ok(None) => return (samples, None),
        Err(broken) => return (samples, Some(broken)),
    };
    loop {
        match log.advance() {
            Ok(None) => return (samples, None),
            Err(broken) => return (samples, Some(broken)),
            Ok(Some(stream)) => {
                if let Err(broken) = log.values(&mut row) {
                    return (samples, Some(broken));
                }
                let stream = &log.streams()[stream];
                assert_eq!(stream.columns.len(), row.len(), "{}", stream.name);
                samples.push((stream.name.clone(), row.clone()));
            }
        }
    }
}

#[test]
fn every_format_gives_all_samples_and_what_the_sensor_gave() {
    for (name, bytes, columns, [added, divided]) in fixtures() {
        let mut log = open(bytes).unwrap().unwrap();
        let (mut row, mut k) = (Vec::new(), 0);
        while let Some(stream) = log.advance().unwrap() {
            log.values(&mut row).unwrap();
            let stream = &log.streams()[stream];
            assert_eq!(stream.name, name);
            let value = |column: &str| {
                let place = stream.columns.iter().position(|known| known.name == column);
                row[place.unwrap_or_else(|| panic!("{name}: {column} in {:?}", stream.columns))]
            };
            let unit = if columns[0].ends_with("US") || columns[0] == "timestamp" {
                1e6
            } else {
                1.0
            };
            let mut expected = sample(k);
            expected[1] += added;
            expected[4] += added;
            expected[5] /= divided;
            let found = columns.map(value);
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs().max(1.0);
            assert!(
                (found[0] / unit - expected[0]).abs() < 1e-6,
                "{name}: {found:?}"
            );
            let off = found[1..]
                .iter()
                .zip(&expected[1..])
                .position(|(&a, &b)| !near(a, b));
            assert_eq!(off, None, "{name}, sample {k}: {found:?} {expected:?}");
            let corrected = added != 0.0;
            assert_eq!(
                stream.remarks.iter().any(|remark| remark.contains("undid")),
                corrected
            );
            k += 1;
        }
        assert_eq!(k, SAMPLES, "{name}");
    }
}

#[test]
fn a_cut_file_gives_what_is_whole_and_says_where_it_ends() {
    for (name, bytes, ..) in fixtures() {
        let (whole, _) = read(bytes.clone());
        for length in (0..bytes.len()).step_by(7) {
            let (samples, broken) = read(bytes[..length].to_vec());
            assert!(
                samples.len() <= whole.len() && samples == whole[..samples.len()],
                "{name}, {length}"
            );
            if let Some(broken) = broken {
                assert!(
                    broken.offset <= length as u64,
                    "{name}, {length}: {broken:?}"
                );
            } else {
                // A file of messages may end behind any of them; below its first bytes it is no log.
                let is_possible =
                    length < 16 || ["vehicle_imu[0]", "IMU[0]", "/imu"].contains(&name);
                assert!(is_possible, "{name}, {length}");
            }
        }
    }
}

#[test]
fn a_chunk_whose_sum_is_wrong_is_refused() {
    let mut bytes = write::mcap(Messages::Cdr, false);
    let (whole, _) = read(bytes.clone());
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    let (samples, broken) = read(bytes);
    assert!(samples.is_empty() && whole.len() == SAMPLES);
    assert!(broken.unwrap().found.contains("checksum"));
}

/// Changes a few bytes, or takes, doubles or cuts off some.
fn mutated(bytes: &[u8], rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..rng.random_range(1..6) {
        let length = bytes.len();
        if length < 2 {
            break;
        }
        // Heads are where numbers count something.
        let place = match rng.random_range(0..3) {
            0 => rng.random_range(0..length.min(256)),
            _ => rng.random_range(0..length),
        };
        let end = (place + rng.random_range(1..32)).min(length);
        match rng.random_range(0..8) {
            0 => bytes.truncate(place),
            1 => {
                bytes.drain(place..end);
            }
            2 => {
                let part = bytes[place..end].to_vec();
                bytes.splice(place..place, part);
            }
            3 => bytes[place..end].fill(0xff),
            4 => bytes[place..end].fill(0),
            5 => bytes[place] ^= 1 << rng.random_range(0..8),
            _ => bytes[place] = rng.random(),
        }
    }
    bytes
}

/// Reads `count` mutated files; each read must terminate.
fn endure(seeds: &[Vec<u8>], count: u64, seed: u64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut slowest = 0.0f64;
    for k in 0..count {
        let bytes = mutated(&seeds[k as usize % seeds.len()], &mut rng);
        let length = bytes.len();
        let begin = std::time::Instant::now();
        let (samples, broken) = read(bytes);
        slowest = slowest.max(begin.elapsed().as_secs_f64());
        if let Some(broken) = broken {
            assert!(
                broken.offset <= length as u64 + 64,
                "{broken:?} in {length} bytes, file {k}"
            );
        }
        drop(samples);
    }
    println!("{count} files, the slowest took {slowest:.3} s");
    assert!(slowest < 5.0, "{slowest} s");
}

#[test]
fn damaged_files_of_every_format_end_without_a_panic() {
    let seeds: Vec<Vec<u8>> = fixtures().into_iter().map(|fixture| fixture.1).collect();
    endure(&seeds, 2_000, 1);
}

/// The format is read by a crate, whose word is not enough.
#[test]
fn damaged_hdf5_files_end_without_a_panic() {
    let h5py = include_bytes!("h5py.h5").to_vec();
    endure(&[write::hdf5(), write::mat_of_hdf5(), h5py], 5_000, 3);
}

#[test]
#[ignore = "a million files; TURNCAL_LOGS may name a directory of further ones to damage"]
fn a_million_damaged_files_end_without_a_panic() {
    let mut seeds: Vec<Vec<u8>> = fixtures().into_iter().map(|fixture| fixture.1).collect();
    if let Some(directory) = std::env::var_os("TURNCAL_LOGS") {
        let mut paths: Vec<PathBuf> = std::fs::read_dir(directory)
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .collect();
        paths.sort();
        seeds.extend(paths.into_iter().map(|path| std::fs::read(path).unwrap()));
    }
    let count = std::env::var("TURNCAL_FILES").map_or(1_000_000, |count| count.parse().unwrap());
    let seed = std::env::var("TURNCAL_SEED").map_or(2, |seed| seed.parse().unwrap());
    endure(&seeds, count, seed);
}
