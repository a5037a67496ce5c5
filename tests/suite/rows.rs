//! What loggers and registers make of rows: fewer digits than their noise has, no more than a range holds.

use turncal::calibration::Options;
use turncal::simulation::Scenario;

use crate::clocks::{as_logged, rows};
use crate::simulated::{Trial, accurate_as_claimed, says, stated};

/// Fixed before the first run was made.
const SEED: u64 = 65;
/// Three times the noise of a row, more or less: rad/s, m/s².
const STEPS: [f64; 2] = [2.5e-3, 0.02];
/// Below gravity, m/s².
const RANGE: f64 = 9.7;

fn trial(stream: u64, options: &Options, logged: impl Fn(usize, f64) -> f64, said: &str) -> Trial {
    let scenario = Scenario::load("mems").unwrap();
    let made = scenario.simulate(SEED, stream).unwrap();
    let mut rows = rows(&made.run);
    for (_, rates) in &mut rows {
        for (column, rate) in rates.iter_mut().enumerate() {
            *rate = logged(column, *rate);
        }
    }
    let trial = Trial::with(&as_logged(made, &rows), options);
    assert!(says(&trial.outcome, said));
    trial
}

fn rounded(column: usize, rate: f64) -> f64 {
    let step = STEPS[column / 3];
    (rate / step).round() * step
}

fn clipped(column: usize, rate: f64) -> f64 {
    match column {
        0..3 => rate,
        _ => rate.clamp(-RANGE, RANGE),
    }
}

#[test]
#[ignore = "statistical: 12 runs"]
fn claimed_accuracy_is_true_of_rows_rounded_to_steps_wider_than_their_noise() {
    // What rounding leaves is noise of a dwell, which no figure states.
    let options = Options::default().no_auto_terms();
    let said = "values are rounded to";
    accurate_as_claimed(12, |stream| trial(stream, &options, rounded, said));
}

#[test]
fn claimed_accuracy_is_true_where_accelerometers_are_clipped_over_whole_dwells() {
    accurate_as_claimed(2, |stream| {
        trial(stream, &stated(), clipped, "are saturated")
    });
}

#[test]
#[ignore = "statistical: 12 runs"]
fn claimed_accuracy_is_true_where_accelerometers_are_clipped_over_whole_dwells_in_many_runs() {
    accurate_as_claimed(12, |stream| {
        trial(stream, &stated(), clipped, "are saturated")
    });
}
