//! How long the attitude settles after a stop, from the mean over all stops.

use nalgebra::Vector3;
use serde_json::json;

use crate::calibration::record::Rest;
use crate::calibration::{
    CalibrationError, Finding, Observation, Problem, Script, Solved, Stretch,
};
use crate::run::Aiding;
use crate::statistics::{FALSE_ALARM, chi_square_limit, median};

/// A table settles within this time, s: what lasts longer is something else.
const LONGEST: f64 = 3.0;

/// Steps of a dwell in which the attitude of a table settles after a stop: so many of its readings are off those in the
/// time after them beyond chance, which is as wide as half of all show. What the gyros sensed is taken off; whether a
/// gate let the readings in does not count. A hand never settles.
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
        for (step, square) in stops.flat_map(|part| off_the_later_ones(problem, stretch, part)) {
            squares.resize(squares.len().max(step + 1), (0.0, 0));
            squares[step].0 += square;
            squares[step].1 += 3;
        }
    }
    let read = squares.iter().filter(|of| of.1 > 0);
    let mut means: Vec<f64> = read.map(|of| of.0 / of.1 as f64).collect();
    let of_each = FALSE_ALARM / means.len().max(1) as f64;
    let chance = median(&mut means).unwrap_or(1.0).max(1.0);
    let is_beyond = |&&(square, count): &&(f64, usize)| {
        count == 0 || square > chance * chi_square_limit(count as f64, of_each)
    };
    Ok(squares.iter().take_while(is_beyond).count())
}

/// The squares, over their variance, of what a table's readings at the begin of a dwell are off the mean of those in a
/// time after them that is the same for all, with the steps before each.
fn off_the_later_ones(problem: &Problem, stretch: &Stretch, part: &Rest) -> Vec<(usize, f64)> {
    let mut moved = Vector3::zeros();
    let mut read: Vec<(usize, f64, Vector3<f64>, f64)> = Vec::new();
    for (number, step) in part.steps.iter().enumerate() {
        moved += step.referred[0];
        let of_step = part.seen[step.seen.clone()].iter();
        let table = of_step.filter(|seen| seen.kind == Observation::Table);
        read.extend(table.map(|seen| {
            // As of one: what the gyros add is the same for a mean of several.
            let variance = stretch.observation_variance(&problem.model, seen.kind, 1);
            (number, step.time, seen.residual - moved, variance)
        }));
    }
    let (Some(first), Some(last)) = (read.first(), read.last()) else {
        return Vec::new();
    };
    let (end, after) = (last.1, LONGEST.min(0.5 * (last.1 - first.1)));
    let with_all = read
        .iter()
        .enumerate()
        .take_while(|(_, of)| of.1 + after <= end);
    let square = |(place, &(number, time, residual, variance)): (
        usize,
        &(usize, f64, Vector3<f64>, f64),
    )| {
        let later = read[place + 1..]
            .iter()
            .take_while(|of| of.1 <= time + after);
        let count = later.clone().count() as f64;
        let mean = later.map(|of| of.2).sum::<Vector3<f64>>() / count;
        let variance = variance * (1.0 + 1.0 / count);
        (count > 0.0 && variance > 0.0)
            .then(|| (number, (residual - mean).norm_squared() / variance))
    };
    with_all.filter_map(square).collect()
}

/// Whether this many steps are longer than a table settles.
pub fn is_longer(problem: &Problem, steps: usize) -> bool {
    problem.duration_of_steps(steps) > LONGEST
}

/// The finding that says so.
pub fn finding(problem: &Problem, steps: usize) -> Option<Finding> {
    let seconds = problem.duration_of_steps(steps);
    let text = format!(
        "The attitude settles for {seconds:.1} s after each stop. turncal skips that time after each move. Wait longer \
         after each stop, or stiffen the mount."
    );
    (steps > 0).then(|| Finding::new("settling", text, json!({ "skipped_s": seconds })))
}
