//! Settling time of the attitude after a stop, from the mean over all stops.

use nalgebra::Vector3;
use serde_json::json;

use crate::calibration::record::Rest;
use crate::calibration::{
    CalibrationError, Finding, FindingKind as Kind, Observation, Problem, Script, Solved, Stretch,
};
use crate::run::Aiding;
use crate::statistics::{FALSE_ALARM, chi_square_limit, median};

/// Longest settling time of a table, s: a longer effect has another cause.
const LONGEST: f64 = 3.0;

/// Number of steps at the start of a dwell in which a table settles: its readings there differ significantly from the
/// later ones. The median over all steps gives the chance level. The rotation that the gyros sensed is subtracted;
/// readings count whether or not a gate accepted them. Zero without a table.
///
/// # Errors
/// As of navigation.
pub fn settling(solved: &Solved) -> Result<usize, CalibrationError> {
    let problem = &solved.problem;
    if problem.model.aiding == Aiding::Velocity {
        return Ok(0);
    }
    let script = Script::new(problem, &solved.priors, &solved.iterated.estimate)?;
    // Squares and number of all by the steps of a dwell before them.
    let mut squares: Vec<(f64, usize)> = Vec::new();
    for (number, stretch) in problem.stretches().iter().enumerate() {
        let stops = script
            .parts(number)
            .filter(|part| part.first && part.new_position);
        for (step, square) in
            stops.flat_map(|part| off_the_later_ones(&readings(problem, stretch, part)))
        {
            squares.resize(squares.len().max(step + 1), (0.0, 0));
            squares[step].0 += square;
            squares[step].1 += 3;
        }
    }
    let read = squares.iter().filter(|of| of.1 > 0);
    let mut means: Vec<f64> = read.map(|of| of.0 / of.1 as f64).collect();
    let of_each = FALSE_ALARM / means.len().max(1) as f64;
    let chance = median(&mut means).unwrap_or(1.0).max(1.0);
    // Not every step has a reading.
    let read = squares.iter().enumerate().filter(|(_, of)| of.1 > 0);
    let beyond = read.take_while(|(_, (square, count))| {
        *square > chance * chi_square_limit(*count as f64, of_each)
    });
    Ok(beyond.last().map_or(0, |(step, _)| step + 1))
}

/// A reading of the table minus the rotation that the gyros sensed since the start of the dwell.
struct Reading {
    /// Number of steps of the dwell before it.
    step: usize,
    time: f64,
    residual: Vector3<f64>,
    variance: f64,
}

fn readings(problem: &Problem, stretch: &Stretch, part: &Rest) -> Vec<Reading> {
    let mut sensed = Vector3::zeros();
    let mut readings = Vec::new();
    for (number, step) in part.steps.iter().enumerate() {
        sensed += step.referred[0];
        let of_step = part.seen[step.seen.clone()].iter();
        let table = of_step.filter(|seen| seen.kind == Observation::Table);
        readings.extend(table.map(|seen| Reading {
            step: number,
            time: step.time,
            residual: seen.residual - sensed,
            // As of one: what the gyros add is the same for a mean of several.
            variance: stretch.observation_variance(&problem.model, seen.kind, 1),
        }));
    }
    readings
}

/// Normalised squared deviations of readings at the start of a dwell from the mean of later readings, which cover the
/// same time for all; each with the number of steps before it.
fn off_the_later_ones(readings: &[Reading]) -> Vec<(usize, f64)> {
    let (Some(first), Some(last)) = (readings.first(), readings.last()) else {
        return Vec::new();
    };
    let after = LONGEST.min(0.5 * (last.time - first.time));
    let with_all = readings.iter().enumerate();
    let with_all = with_all.take_while(|(_, of)| of.time + after <= last.time);
    let square = |(place, of): (usize, &Reading)| {
        let later = readings[place + 1..].iter();
        let later = later.take_while(|other| other.time <= of.time + after);
        let count = later.clone().count() as f64;
        let mean = later.map(|other| other.residual).sum::<Vector3<f64>>() / count;
        let variance = of.variance * (1.0 + 1.0 / count);
        let is_known = count > 0.0 && variance > 0.0;
        is_known.then(|| (of.step, (of.residual - mean).norm_squared() / variance))
    };
    with_all.filter_map(square).collect()
}

/// Whether this many steps exceed the settling time of a table.
pub fn is_longer(problem: &Problem, steps: usize) -> bool {
    problem.duration_of_steps(steps) > LONGEST
}

/// The finding on settling.
pub fn finding(problem: &Problem, steps: usize) -> Option<Finding> {
    let seconds = problem.duration_of_steps(steps);
    let text = format!(
        "The attitude takes {seconds:.1} s to settle after each stop. turncal skipped that time after each move. \
         Wait longer after each stop, or stiffen the mount."
    );
    (steps > 0).then(|| Finding::new(Kind::Settling, text, json!({ "skipped_s": seconds })))
}
