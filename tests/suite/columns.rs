//! Columns in memory give the run that a file of the same numbers gives.

use std::fmt::Write;

use turncal::imu::{PerSensor, Sensor};
use turncal::simulation::Scenario;
use turncal_files::Opened;
use turncal_files::draft::{Stated, StatedColumns, StatedUnit};
use turncal_input::{FileError, Place};
use turncal_logs::Table;

const NAMES: [&str; 6] = ["gx", "gy", "gz", "ax", "ay", "az"];

/// Rates and forces of a MEMS sensor, a column each.
fn columns() -> Vec<Vec<f64>> {
    let run = Scenario::load("mems").unwrap().simulate(1, 0).unwrap().run;
    let imu = run.recording.imu;
    let column = |k: usize| {
        let series = if k < 3 { &imu.gyro } else { &imu.accel };
        let rates = series.iter().map(|sample| sample[k % 3] / imu.period);
        rates.collect()
    };
    (0..6).map(column).collect()
}

fn opened(table: Table, stated: &Stated) -> Result<Opened, FileError> {
    Opened::in_memory(&[table.into()], None, stated, |_| ())
}

fn table(names: [&str; 6], columns: &[Vec<f64>]) -> Table {
    let names = names.map(str::to_owned);
    let columns = names.into_iter().zip(columns.iter().cloned());
    Table::new("data", columns.collect()).unwrap()
}

fn stated() -> Stated {
    Stated {
        rate_hz: Some(100.0),
        ..Stated::default()
    }
}

#[test]
fn a_table_is_read_as_a_file_of_its_numbers() {
    let columns = columns();
    let mut text = NAMES.join(",") + "\n";
    for row in 0..columns[0].len() {
        let row: Vec<String> = columns.iter().map(|of| of[row].to_string()).collect();
        writeln!(text, "{}", row.join(",")).unwrap();
    }
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("data.csv");
    std::fs::write(&path, text).unwrap();
    let file = Opened::new(&path, None, &stated(), |_| ()).unwrap().run;
    let run = opened(table(NAMES, &columns), &stated()).unwrap().run;
    assert_eq!(run.recording.imu, file.recording.imu);
    assert_eq!(run.instrument, file.instrument);
    assert!(run.recording.files.is_empty());
}

#[test]
fn stated_columns_prevail_over_names_and_missing_ones_are_refused() {
    let columns = columns();
    let names = ["a", "b", "c", "gx", "gy", "gz"];
    let triads = |gyro: [&str; 3], accel: [&str; 3]| Stated {
        columns: StatedColumns {
            triads: PerSensor {
                gyro: Some(gyro.map(str::to_owned)),
                accel: Some(accel.map(str::to_owned)),
            },
            ..StatedColumns::default()
        },
        ..stated()
    };
    let swapped = triads(["a", "b", "c"], ["gx", "gy", "gz"]);
    let run = opened(table(names, &columns), &swapped).unwrap().run;
    let plain = opened(table(NAMES, &columns), &stated()).unwrap().run;
    assert_eq!(run.recording.imu.accel, plain.recording.imu.accel);
    let error = opened(
        table(names, &columns),
        &triads(["a", "b", "x"], ["gx", "gy", "gz"]),
    );
    assert!(
        error
            .unwrap_err()
            .to_string()
            .contains("expected a column `x`")
    );
}

#[test]
fn an_error_names_row_and_column() {
    let mut columns = columns();
    columns[4][7] = f64::INFINITY;
    let error = opened(table(NAMES, &columns), &stated()).unwrap_err();
    let column = Some("ay".to_owned());
    assert_eq!(error.place, Place::Row { row: 7, column });
    let unequal = Table::new("data", vec![("a".into(), vec![1.0]), ("b".into(), vec![])]);
    assert!(
        unequal
            .unwrap_err()
            .to_string()
            .contains("1 values in `a` and 0 in `b`")
    );
}

#[test]
fn a_statement_that_rows_contradict_is_refused_and_a_right_one_is_not() {
    let mut columns = columns();
    let times = (0..columns[0].len()).map(|k| k as f64 * 0.01);
    columns.push(times.collect());
    let named = || NAMES.iter().copied().chain(["t"]).map(str::to_owned);
    let table = || Table::new("data", named().zip(columns.iter().cloned()).collect()).unwrap();
    let with = |rate: f64, unit: &str| Stated {
        rate_hz: Some(rate),
        gyro_unit: Some(StatedUnit::parse(Sensor::Gyro, unit).unwrap()),
        ..Stated::default()
    };
    let refused = |stated: &Stated| opened(table(), stated).unwrap_err().to_string();
    // A nominal rate tells the unit of time only.
    let run = opened(table(), &with(98.0, "rad/s")).unwrap().run;
    assert!((run.recording.imu.period - 0.01).abs() < 1e-6);
    for rate in [50.0, 200.0, 1000.0] {
        let text = refused(&with(rate, "rad/s"));
        assert!(
            text.contains("100") && text.contains(&format!("{rate} Hz, as stated")),
            "{text}"
        );
    }
    let text = refused(&with(100.0, "deg/s"));
    assert!(
        text.contains("gyro rows in rad/s") && text.contains("--gyro-unit"),
        "{text}"
    );
}

#[test]
fn a_rate_at_which_no_unit_fits_is_refused_with_the_rate_at_which_one_does() {
    let columns = columns();
    let at = |rate: f64| {
        let stated = Stated {
            rate_hz: Some(rate),
            ..Stated::default()
        };
        opened(table(NAMES, &columns), &stated)
    };
    assert_eq!(at(100.0).unwrap().run.recording.doubts, [""; 0]);
    let text = at(50.0).unwrap_err().to_string();
    assert!(
        text.contains("at 50 Hz") && text.contains("Check the rate"),
        "{text}"
    );
}

#[test]
fn a_temperature_that_rises_is_not_a_time() {
    let mut columns = columns();
    let temperatures = (0..columns[0].len()).map(|k| 20.0 + k as f64 * 1e-4);
    columns.push(temperatures.collect());
    for (name, temperature) in [("T", Some("T".to_owned())), ("imu_temp", None)] {
        let named = NAMES.iter().copied().chain([name]).map(str::to_owned);
        let table = Table::new("data", named.zip(columns.iter().cloned()).collect()).unwrap();
        let mut stated = stated();
        stated.columns.temperature = temperature;
        let imu = opened(table, &stated).unwrap().run.recording.imu;
        assert!(
            imu.temperature.is_some() && (imu.period - 0.01).abs() < 1e-12,
            "{name}"
        );
    }
}
