//! How long the attitude settles after a stop, from the mean over all stops.

use serde_json::json;

use crate::calibration::{Finding, Innovation, Observation, Problem};
use crate::run::Aiding;
use crate::statistics::{FALSE_ALARM, chi_square_limit, median};

/// A table settles within this time, s: what lasts longer is something else.
const LONGEST: f64 = 3.0;

/// Steps of a dwell in which the attitude of a table settles after a stop: how many observations after it are beyond
/// chance, one after the other; as wide as half of all show. The first shows the move before it, too, and does not count
/// alone. A hand never settles.
pub fn settling(problem: &Problem, innovations: &[Innovation]) -> usize {
    if problem.model.aiding == Aiding::Velocity {
        return 0;
    }
    // Squares and number of all by their place in the dwell.
    let mut squares: Vec<(f64, usize)> = Vec::new();
    for dwell in innovations.chunk_by(|one, other| one.dwell == other.dwell) {
        let of_table = |of: &&Innovation| of.observation == Observation::Table && of.after_move;
        for (place, of) in dwell.iter().filter(of_table).enumerate() {
            squares.resize(squares.len().max(place + 1), (0.0, 0));
            squares[place].0 += of.distance();
            squares[place].1 += 3;
        }
    }
    let mut means: Vec<f64> = squares.iter().map(|of| of.0 / of.1 as f64).collect();
    let chance = median(&mut means).unwrap_or(1.0).max(1.0);
    let of_each = FALSE_ALARM / squares.len().max(1) as f64;
    let limit = |count: usize| chi_square_limit(count as f64, of_each);
    let beyond = |&&(square, count): &&(f64, usize)| square > chance * limit(count);
    match squares.iter().skip(1).take_while(beyond).count() {
        0 => 0,
        beyond => beyond + 1,
    }
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
