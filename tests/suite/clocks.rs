//! Stamps that no uniform clock gave.

use std::fmt::Write;
use std::fs;

use nalgebra::{Vector3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use turncal::imu::Sensor;
use turncal::run::Run;
use turncal::simulation::{Scenario, Simulated};
use turncal_files::write_run;

use crate::simulated::{Trial, accurate_as_claimed};

/// Fixed before the first run was made.
const SEED: u64 = 64;

/// What a logger makes of samples.
#[derive(Debug, Clone, Copy)]
enum Clock {
    /// The oscillator changes its rate by ± 0.3 % within a minute.
    Wanders,
    /// Ten rows are passed on at a time.
    Bursts,
    /// A row in a hundred is late, by 30 ms on average, and one in a hundred is lost.
    Late,
}

/// Begin and rates of a row.
pub type Row = (f64, Vector6<f64>);

pub fn rows(run: &Run) -> Vec<Row> {
    let imu = &run.recording.imu;
    let (gyro, accel) = (imu.of(Sensor::Gyro), imu.of(Sensor::Accel));
    let pairs = gyro.iter().zip(accel.iter()).enumerate();
    let row = |(k, (w, f)): (usize, (Vector3<f64>, Vector3<f64>))| {
        let both = Vector6::new(w.x, w.y, w.z, f.x, f.y, f.z);
        (imu.time(k), both / imu.period)
    };
    pairs.map(row).collect()
}

/// Mean rates between the edges of samples of a clock that wanders.
fn wandering(rows: &[Row], period: f64) -> Vec<Row> {
    let mut sums = vec![Vector6::zeros()];
    for (_, rates) in rows {
        sums.push(sums[sums.len() - 1] + rates * period);
    }
    let integral = |time: f64| {
        let place = time / period;
        let edge = place as usize;
        sums[edge] + (sums[edge + 1] - sums[edge]) * (place - edge as f64)
    };
    let edge = |k: usize| {
        let even = k as f64 * period;
        even + 0.028 * (1.0 - (even / 9.5).cos())
    };
    let pairs = (0..rows.len() - 10).map(|k| (edge(k), edge(k + 1)));
    pairs
        .map(|(begin, end)| {
            let rates = (integral(end) - integral(begin)) / (end - begin);
            (rows[0].0 + begin, rates)
        })
        .collect()
}

fn stamped(rows: Vec<Row>, period: f64, clock: Clock, stream: u64) -> Vec<Row> {
    let mut random = ChaCha8Rng::seed_from_u64(stream);
    match clock {
        Clock::Wanders => wandering(&rows, period),
        Clock::Bursts => {
            let last = |k: usize| rows[(k - k % 10 + 9).min(rows.len() - 1)].0;
            let passed_on = |(k, &(_, rates)): (usize, &Row)| (last(k), rates);
            rows.iter().enumerate().map(passed_on).collect()
        }
        Clock::Late => {
            let mut latest = f64::NEG_INFINITY;
            let mut rows = rows;
            rows.retain(|_| random.random::<f64>() > 0.01);
            for (time, _) in &mut rows {
                let busy = if random.random::<f64>() < 0.01 {
                    -0.03 * random.random::<f64>().ln()
                } else {
                    0.0
                };
                latest = latest.max(*time + 0.3 * period * random.random::<f64>() + busy);
                *time = latest;
            }
            rows
        }
    }
}

/// The run as it is read where a logger wrote these rows.
pub fn as_logged(made: Simulated, rows: &[Row]) -> Simulated {
    let directory = tempfile::tempdir().unwrap();
    write_run(directory.path(), &made.run, made.output, None).unwrap();
    let mut text = "t,gx,gy,gz,ax,ay,az\n".to_owned();
    for (time, rates) in rows {
        write!(text, "{time:.6}").unwrap();
        rates
            .iter()
            .for_each(|rate| write!(text, ",{rate:e}").unwrap());
        text.push('\n');
    }
    fs::write(directory.path().join("imu.csv"), text).unwrap();
    let path = directory.path().join("run.toml");
    let toml = fs::read_to_string(&path).unwrap();
    let period = toml
        .lines()
        .find(|line| line.starts_with("sample_period_s"));
    let toml = toml.replace("imu.csv.gz", "imu.csv");
    fs::write(&path, toml.replace(period.unwrap(), "")).unwrap();
    let run = turncal_files::read_run(&path).unwrap_or_else(|error| panic!("{error}"));
    Simulated { run, ..made }
}

fn trial(clock: Clock, stream: u64) -> Trial {
    let scenario = Scenario::load("mems").unwrap();
    let made = scenario.simulate(SEED, stream).unwrap();
    let period = made.run.recording.imu.period;
    let rows = stamped(rows(&made.run), period, clock, stream);
    Trial::new(&as_logged(made, &rows))
}

#[test]
fn a_clock_that_wanders_costs_no_accuracy() {
    accurate_as_claimed(2, |stream| trial(Clock::Wanders, stream));
}

#[test]
#[ignore = "statistical: 36 runs"]
fn clocks_that_wander_come_late_or_in_bursts_cost_no_accuracy() {
    for clock in [Clock::Wanders, Clock::Bursts, Clock::Late] {
        println!("{clock:?}");
        accurate_as_claimed(12, |stream| trial(clock, stream));
    }
}
