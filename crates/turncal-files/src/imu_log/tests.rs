use std::fmt::Write;
use std::fs;

use nalgebra::Vector3;

use super::held::Sizes;
use super::*;
use crate::schema::TimeStamp;
use turncal::imu::{AxisOrder, Nominal, Output, PerSensor, Sensor};
use turncal::recording::{FaultKind, ImuSamples};
use turncal_logs::Source;
use turncal_logs::clock::{Breaks, Clock, TimeUnit};

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

fn of_file(file: &std::path::Path) -> ImuLog<'static> {
    ImuLog {
        source: Source::of_file(file),
        clock: Clock {
            column: Some("t"),
            nanoseconds: None,
            unit: TimeUnit::PerSecond(1.0),
            period: Some(PERIOD),
            breaks: Breaks::Settings,
        },
        accel_from: None,
        instance: None,
        triads: PerSensor {
            gyro: ["a", "-b", "c"],
            accel: ["d", "e", "f"],
        },
        temperature: None,
        output: Output::Increment,
        axes: AxisOrder::FRONT_RIGHT_DOWN,
        stamp: TimeStamp::End,
        continuous: true,
        nominal: PerSensor::from_fn(|_| Nominal(Vector3::new(1.0, 2.0, 1.0))),
        full_scale: PerSensor::default(),
    }
}

fn read(file: &std::path::Path, sizes: Sizes) -> ImuSamples {
    of_file(file).read_by(sizes, &mut Vec::new()).unwrap()
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

/// An angle and a velocity in time, on six axes.
fn course(time: f64, column: usize) -> f64 {
    let rate = [0.3, 0.2, 0.5, 0.4, 0.7, 0.1][column];
    9.8 * time + (rate * time).sin() / rate
}

/// What axes read between these times, the edges of samples.
fn rates_between(edges: &[f64], file: &std::path::Path) {
    let mut text = "t,a,b,c,d,e,f\n".to_owned();
    for edge in edges.windows(2) {
        write!(text, "{:.9}", edge[1]).unwrap();
        for column in 0..6 {
            let integral = course(edge[1], column) - course(edge[0], column);
            write!(text, ",{}", integral / (edge[1] - edge[0])).unwrap();
        }
        text.push('\n');
    }
    fs::write(file, text).unwrap();
}

#[test]
fn samples_of_a_clock_that_wanders_are_those_of_an_even_one() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("imu.csv");
    // The period changes by ± 0.3 %, and is a millionth longer on average.
    let edge = |k: usize| {
        let even = 1e-2 * (1.0 + 1e-6) * k as f64;
        5.0 + even + 0.03 * (even / 10.0).sin()
    };
    let edges: Vec<f64> = (0..=40_000).map(edge).collect();
    rates_between(&edges, &file);
    let rates = |sizes| {
        let mut log = of_file(&file);
        log.output = Output::Rate;
        let mut notes = Vec::new();
        let imu = log.read_by(sizes, &mut notes).unwrap();
        assert!(notes[0].contains("drift by up to 3"), "{notes:?}");
        imu
    };
    let parts = Sizes {
        long: 15_000,
        part: 4_000,
    };
    for imu in [rates(Sizes::default()), rates(parts)] {
        assert_eq!((imu.faults.len(), imu.stretches.len()), (0, 1));
        let lasts = edges[40_000] - edges[0] - imu.len() as f64 * imu.period;
        assert!((0.0..2.0).contains(&(lasts / imu.period)), "{lasts}");
        let mut largest = 0.0f64;
        let mut time = imu.stretches[0].start;
        for sample in imu.of(Sensor::Accel).iter() {
            let integral = course(time + imu.period, 3) - course(time, 3);
            // Right is the file's front, by way of front, right, down.
            largest = largest.max((sample.y - integral / 2.0).abs());
            time += imu.period;
        }
        // Twice the jitter of 64 straight stamps of this course: 0.03 (0.64 / 10)² / 8 s against a sample.
        assert!(largest < 1e-3 * 9.8 * imu.period, "{largest}");
    }
}

#[test]
fn rows_that_come_late_or_in_bursts_are_counted() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("imu.csv");
    let scatter = |k: usize| (k as f64 * 0.618_033_988_749_895).fract();
    let bursts = |k: usize| 1e-2 * (k - k % 10 + 10) as f64;
    let late = |k: usize| {
        let busy = if k % 53 == 7 { 0.07 * scatter(k) } else { 0.0 };
        1e-2 * k as f64 + 2e-3 * scatter(3 * k) + busy
    };
    let missing = |k: usize| k % 211 == 20 || (3000..3040).contains(&k);
    let all: Vec<usize> = (0..20_000).collect();
    let most: Vec<usize> = (0..20_000).filter(|&k| !missing(k)).collect();
    for (kept, stamp) in [
        (&all, &bursts as &dyn Fn(usize) -> f64),
        (&all, &late),
        (&most, &late),
    ] {
        let mut text = "t,a,b,c,d,e,f\n".to_owned();
        let mut latest = 0.0f64;
        for &k in kept {
            latest = latest.max(stamp(k));
            let of = |column| course(1e-2 * k as f64, column);
            let [a, b, c, d, e, f] = [0, 1, 2, 3, 4, 5].map(of);
            writeln!(text, "{latest:.6},{a},{b},{c},{d},{e},{f}").unwrap();
        }
        fs::write(&file, text).unwrap();
        let mut log = of_file(&file);
        log.clock.period = None;
        let imu = log.read(&mut Vec::new()).unwrap();
        assert_eq!(imu.len(), 20_000);
        assert!((imu.period / 1e-2 - 1.0).abs() < 1e-5, "{}", imu.period);
        let lost = imu
            .faults
            .iter()
            .filter(|fault| fault.kind == FaultKind::Missing);
        let lost: Vec<usize> = lost.flat_map(|fault| fault.samples.clone()).collect();
        let wrong = |k: &usize| lost.contains(k) == kept.binary_search(k).is_ok();
        // A row late by less than a sample just before one that is missing may as well be behind it.
        let open = |k: &&usize| missing(**k) && (1..9).any(|before| (**k - before) % 53 == 7);
        let open = all.iter().filter(open).count();
        let wrong = all.iter().filter(|k| wrong(k)).count();
        assert_eq!(lost.len(), all.len() - kept.len());
        assert!(wrong <= 2 * open, "{wrong} of {}", lost.len());
    }
}

#[test]
fn a_clock_that_wraps_goes_on_and_one_that_was_set_begins_a_stretch() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("imu.csv");
    let microseconds = |k: usize| (4_250_000_000 + 10_000 * k as u64) % (1 << 32);
    let of_day = |k: usize| (86_390_000 + 10 * k as u64) % 86_400_000;
    let set_back = |k: usize| 10 * if k < 7000 { k as u64 } else { k as u64 - 6500 };
    let read = |stamp: &dyn Fn(usize) -> u64, second, breaks| {
        let mut text = "t,a,b,c,d,e,f\n".to_owned();
        for k in 0..10_000 {
            let of = |column| course(1e-2 * (k + 1) as f64, column);
            let [a, b, c, d, e, f] = [0, 1, 2, 3, 4, 5].map(of);
            writeln!(text, "{},{a},{b},{c},{d},{e},{f}", stamp(k)).unwrap();
        }
        fs::write(&file, text).unwrap();
        let mut log = of_file(&file);
        log.clock.unit = TimeUnit::PerSecond(second);
        log.clock.breaks = breaks;
        let mut notes = Vec::new();
        log.read(&mut notes).map(|imu| (imu, notes.join("\n")))
    };
    for (stamp, second, said) in [
        (
            &microseconds as &dyn Fn(usize) -> u64,
            1e6,
            "every 4294.967296 s",
        ),
        (&of_day, 1e3, "every 86400 s"),
    ] {
        for breaks in [Breaks::None, Breaks::Settings] {
            let (imu, notes) = read(stamp, second, breaks).unwrap();
            assert_eq!((imu.len(), imu.stretches.len()), (10_000, 1));
            assert!(notes.contains(said), "{notes}");
        }
    }
    let (imu, notes) = read(&set_back, 1e3, Breaks::Settings).unwrap();
    let samples: Vec<_> = imu.stretches.iter().map(|s| s.samples.clone()).collect();
    assert_eq!(samples, [0..7000, 7099..10_099]);
    let said = "imu.csv, line 7002: the time jumps from 69.99 s to 5 s because the clock was set";
    assert!(notes.contains(said), "{notes}");
    // However little it was set back by, in whole samples or not: rows that come late find a place.
    for back in [50, 55, 503, 1000] {
        let a_little = |k: usize| 10 * k as u64 - if k < 7000 { 0 } else { back };
        let (imu, notes) = read(&a_little, 1e3, Breaks::Settings).unwrap();
        assert_eq!(imu.stretches.len(), 2, "{back}: {notes}");
        assert!(
            notes.contains("line 7002: the time jumps from 69.99 s to"),
            "{notes}"
        );
    }
    // However often nothing is recorded for however long, a stretch begins when it does.
    let paused = |k: usize| 10 * k as u64 + 600_000 * (k / 500) as u64;
    for breaks in [Breaks::Pauses, Breaks::Settings] {
        let (imu, notes) = read(&paused, 1e3, breaks).unwrap();
        assert!(notes.contains("paused 19 times"), "{notes}");
        assert_eq!(imu.len(), 10_000 + 19 * 99);
        for (number, stretch) in imu.stretches.iter().enumerate() {
            let begin = 599 * number;
            assert_eq!(stretch.samples, begin..begin + 500);
            assert!((imu.time(begin) - imu.start() - 605.0 * number as f64).abs() < 1e-6);
            assert!(number == 0 || imu.edge(stretch.start - 100.0) == begin as f64 - 1.0);
        }
    }
    // A time of 19 digits is refused, wherever it stands.
    for garbage in [0, 1, 5000, 9999] {
        let damaged = |k: usize| {
            if k == garbage {
                10u64.pow(18)
            } else {
                10 * k as u64
            }
        };
        let refused = read(&damaged, 1e3, Breaks::Settings).unwrap_err();
        let said = format!(
            "line {}, column `t`: found `1000000000000000000`",
            garbage + 2
        );
        assert!(refused.to_string().contains(&said), "{refused}");
    }
    // If the unit is missing, the error names it.
    let in_microseconds = |k: usize| 10_000 * k as u64;
    let refused = read(&in_microseconds, 1.0, Breaks::Settings).unwrap_err();
    let said = "line 4: found a time step of 10000 between rows, expected 0.01 s (sample_period_s in run.toml). Set \
        time_unit = \"us\"";
    assert!(refused.to_string().contains(said), "{refused}");
    // Milliseconds of a second are no time.
    let of_second = |k: usize| 10 * (k % 100) as u64;
    assert!(read(&of_second, 1e3, Breaks::Settings).is_err());
    // Times of a table or of labels would be of nobody knows which part.
    let refused = read(&set_back, 1e3, Breaks::Pauses)
        .unwrap_err()
        .to_string();
    assert!(refused.contains("line 7002: found a time that steps back from 69.99 s to 5 s"));
}

#[test]
fn rows_that_come_behind_later_ones_are_put_in_their_place() {
    let directory = tempfile::tempdir().unwrap();
    let [ordered, mixed] = ["ordered.csv", "mixed.csv"].map(|name| directory.path().join(name));
    // Rows of a network: one in 17 comes up to 90 places late, one in 40 twice, one in 31 never.
    let late = |k: usize| if k % 17 == 3 { 1 + (7 * k) % 90 } else { 0 };
    let mut order: Vec<usize> = (0..ROWS).filter(|k| k % 31 != 5).collect();
    order.extend((1..ROWS).filter(|k| k % 40 == 0 && k % 31 != 5));
    for (file, is_mixed) in [(&ordered, false), (&mixed, true)] {
        order.sort_by_key(|&k| if is_mixed { (k + late(k), k) } else { (k, k) });
        let mut text = "t,a,b,c,d,e,f\n".to_owned();
        for &k in &order {
            let [a, b, c, d, e, f] = [0, 1, 2, 3, 4, 5].map(|column| value(k, column));
            writeln!(text, "{:.2},{a},{b},{c},{d},{e},{f}", k as f64 * PERIOD).unwrap();
        }
        fs::write(file, text).unwrap();
    }
    let long = Sizes {
        long: 20_000,
        part: 15_000,
    };
    for sizes in [Sizes::default(), long] {
        let [ordered, mixed] = [&ordered, &mixed].map(|file| read(file, sizes));
        assert_eq!(mixed.stretches, ordered.stretches);
        assert_eq!(mixed.bridges, ordered.bridges);
        for sensor in Sensor::ALL {
            let pairs = mixed.of(sensor).iter().zip(ordered.of(sensor).iter());
            assert!(pairs.into_iter().all(|(a, b)| a == b));
        }
    }
}
