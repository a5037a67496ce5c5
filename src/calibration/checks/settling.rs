//! How long the attitude settles after a stop, from the mean over all stops.

use serde_json::json;

use super::finding::Finding;
use super::innovation::{Innovation, Observation};
use crate::calibration::problem::Problem;
use crate::run::Aiding;
use crate::statistics::{FALSE_ALARM, chi_square_limit, median};

/// A table settles within this time, s: what lasts longer is something else.
const LONGEST: f64 = 3.0;

/// Innovations of a table's readings after stops: squares and number of all by their place in the dwell.
struct AfterStops(Vec<(f64, usize)>);

impl AfterStops {
    fn new(innovations: &[Innovation]) -> Self {
        let mut squares: Vec<(f64, usize)> = Vec::new();
        for dwell in innovations.chunk_by(|one, other| one.dwell == other.dwell) {
            let of_table = dwell
                .iter()
                .filter(|of| of.observation == Observation::Table && of.after_move);
            for (place, of) in of_table.enumerate() {
                if squares.len() == place {
                    squares.push((0.0, 0));
                }
                squares[place].0 += of.distance();
                squares[place].1 += 3;
            }
        }
        Self(squares)
    }

    /// How many observations after a stop are beyond chance, one after the other; as wide as half of all show. The
    /// first shows the move before it, too, and does not count alone.
    fn settling(&self) -> usize {
        let mean = |&(square, count): &(f64, usize)| square / count as f64;
        let mut means: Vec<f64> = self.0.iter().map(mean).collect();
        let chance = median(&mut means).unwrap_or(1.0).max(1.0);
        let of_each = FALSE_ALARM / self.0.len().max(1) as f64;
        let limit = |count: usize| chi_square_limit(count as f64, of_each);
        let beyond = |&&(square, count): &&(f64, usize)| square > chance * limit(count);
        match self.0.iter().skip(1).take_while(beyond).count() {
            0 => 0,
            beyond => beyond + 1,
        }
    }
}

/// Steps of a dwell in which the attitude of a table settles after a stop.
pub fn settling(problem: &Problem, innovations: &[Innovation]) -> usize {
    match problem.model.aiding {
        Aiding::Table => AfterStops::new(innovations).settling(),
        // A hand never settles.
        Aiding::Velocity => 0,
    }
}

/// Whether so many steps are longer than a table settles.
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
