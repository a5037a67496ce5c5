use std::fmt::Write;
use std::fs;

use super::*;
use crate::formats::clock::TimeUnit;
use crate::recording::FaultKind;

const ROWS: usize = 50_000;
const PERIOD: f64 = 0.01;

/// A noisy swing of six axes about different levels, on no grid.
fn value(row: usize, column: usize) -> f64 {
    let scatter =
        |k: usize| (k as f64 * 0.618_033_988_749_895).fract() + (k as f64 * 0.754_877_666).fract();
    let level = [0.01, -0.02, 0.005, 0.1, -0.2, 9.8][column] * PERIOD;
    let swing = 1e-3 * (row as f64 / 900.0).sin() * (column + 1) as f64;
    level + swing + 1e-6 * (scatter(7 * row + column) - 1.0)
}

/// Rows of a log of which some are missing, one is there twice, and a spike is where parts may meet.
fn log(file: &std::path::Path) {
    let mut text = "t,a,b,c,d,e,f\n".to_owned();
    for row in (0..ROWS).filter(|row| row % 97 != 13 && !(40_000..40_300).contains(row)) {
        let line = |text: &mut String| {
            write!(text, "{:.2}", 5.0 + row as f64 * PERIOD).unwrap();
            for column in 0..6 {
                let spike = if (row, column) == (23_433, 2) {
                    0.1
                } else {
                    0.0
                };
                write!(text, ",{:e}", value(row, column) + spike).unwrap();
            }
            text.push('\n');
        };
        line(&mut text);
        if row == 1234 {
            line(&mut text);
        }
    }
    fs::write(file, text).unwrap();
}

fn read(file: &std::path::Path, sizes: Sizes) -> ImuSamples {
    let log = ImuLog {
        source: Source::of_file(file),
        clock: Clock {
            column: Some("t"),
            nanoseconds: None,
            unit: TimeUnit::PerSecond(1.0),
            period: Some(PERIOD),
        },
        accel_from: None,
        instance: None,
        triads: PerSensor {
            gyro: ["a", "-b", "c"],
            accel: ["d", "e", "f"],
        },
        temperature: None,
        output: Output::Increment,
        axes: BodyAxes::Frd,
        stamp: TimeStamp::End,
        continuous: true,
        nominal: PerSensor::from_fn(|_| Nominal(Vector3::new(1.0, 2.0, 1.0))),
        full_scale: PerSensor::default(),
    };
    log.read_by(sizes, &mut Vec::new()).unwrap()
}

#[test]
fn a_log_read_in_parts_is_the_one_read_at_once() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("imu.csv");
    log(&file);
    let whole = read(&file, Sizes::default());
    let packed = read(
        &file,
        Sizes {
            long: 20_000,
            part: 15_000,
        },
    );
    assert!(packed.is_packed() && !whole.is_packed());
    assert_eq!(packed.len(), whole.len());
    assert_eq!(packed.faults, whole.faults);
    let count = |kind| {
        whole
            .faults
            .iter()
            .filter(|fault| fault.kind == kind)
            .count()
    };
    assert_eq!(count(FaultKind::Spike), 1);
    assert_eq!(count(FaultKind::Duplicate), 1);
    assert!(count(FaultKind::Missing) > 500);
    let bridged = |imu: &ImuSamples| {
        let each = imu.bridges.iter().flat_map(|bridge| {
            let axes: Vec<_> = bridge.each().collect();
            let of = axes.into_iter();
            of.map(|(sensor, axis, _)| (sensor as usize, axis, bridge.samples.clone()))
        });
        let mut each: Vec<_> = each.collect();
        each.sort_by_key(|(sensor, axis, samples)| (*sensor, *axis, samples.start));
        each
    };
    assert_eq!(bridged(&packed), bridged(&whole));
    assert_eq!(packed.stretches.len(), 2);
    for (a, b) in packed.stretches.iter().zip(&whole.stretches) {
        assert_eq!(a.samples, b.samples);
        assert!((a.start - b.start).abs() < 1e-9);
    }
    // Steps are a quarter of the noise, and sums stay within half of one.
    let noise = 1e-6 / 6f64.sqrt();
    for (sensor, step) in Sensor::ALL
        .map(|sensor| (sensor, *packed.pulse.get(sensor)))
        .into_iter()
    {
        assert!((0.05..0.5).contains(&(step / noise)), "{}", step / noise);
        let mut off = Vector3::zeros();
        for (a, b) in packed.of(sensor).iter().zip(whole.of(sensor).iter()) {
            off += a - b;
            assert!(off.amax() < step, "{off}");
        }
    }
    let facts = |imu: &ImuSamples| imu.log.clone().unwrap();
    let (packed, whole) = (facts(&packed), facts(&whole));
    assert_eq!((packed.rows, &packed.columns), (whole.rows, &whole.columns));
}
