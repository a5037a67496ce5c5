//! Innovations: observation minus prediction, and their consistency with their covariance.

use serde::{Deserialize, Serialize};
use serde_json::json;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::calibration::{Finding, FindingKind as Kind};
use crate::imu::Sensor;
use crate::number::three_digits;
use crate::statistics::FALSE_ALARM;

/// Kind of observation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Observation {
    /// Zero velocity.
    Velocity,
    /// Attitude of the table.
    Table,
    /// Constant attitude at standstill, without a table.
    Attitude,
}

impl Observation {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Velocity, Self::Table, Self::Attitude];

    /// Name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Velocity => "velocity",
            Self::Table => "table attitude",
            Self::Attitude => "attitude at standstill",
        }
    }

    /// The triad whose integral is observed.
    pub fn sensor(self) -> Sensor {
        match self {
            Self::Velocity => Sensor::Accel,
            Self::Table | Self::Attitude => Sensor::Gyro,
        }
    }
}

/// The innovation of one observation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation {
    /// Time, s.
    pub time: f64,
    /// Kind of observation.
    pub observation: Observation,
    /// East, North and Up components, each divided by its own σ; the three are independent.
    pub whitened: [f64; 3],
    /// σ of the three components, rad or m/s.
    pub sigma: [f64; 3],
    /// Number of the dwell that contains the observation.
    pub dwell: usize,
    /// Whether the innovation shows the errors of the move before its dwell; false if rows are missing between move and
    /// dwell.
    pub after_move: bool,
}

impl Innovation {
    /// Squared Mahalanobis distance, χ² with three degrees of freedom.
    pub fn distance(&self) -> f64 {
        self.whitened.iter().map(|w| w * w).sum()
    }
}

/// Normalised innovation squared, separately for each kind of observation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Consistency {
    /// All observations.
    pub all: Nis,
    /// Zero velocity.
    pub velocity: Nis,
    /// Attitude of the table.
    pub table: Nis,
    /// Constant attitude at standstill, without a table.
    pub attitude: Nis,
}

impl Consistency {
    /// The kinds of observation that occurred.
    pub fn kinds(&self) -> impl Iterator<Item = (Observation, Nis)> {
        let each = [self.velocity, self.table, self.attitude];
        let all = Observation::ALL.into_iter().zip(each);
        all.filter(|(_, nis)| nis.count > 0)
    }
}

/// Mean normalised innovation squared.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Nis {
    /// Mean per scalar observation; one if the σ are correct, NaN without observations.
    pub mean: f64,
    /// Number of scalar observations.
    pub count: usize,
    /// 95 % interval of the mean for consistent σ (χ²).
    pub interval: (f64, f64),
    /// Correlation of neighbouring innovations, zero if they are white.
    pub lag_one: f64,
}

/// Selects the innovations that show a model error; returns their squares, with mean one if the σ are correct.
type Squares = fn(&[&Innovation]) -> Vec<f64>;

/// Innovations that are tested separately: text that follows the kind of observation, the causes to check if the
/// innovations are large, and their squares.
const LOOKS: [(&str, &str, &str, Squares); 3] = [
    ("all", "", "the white noise figures in [imu.noise]", of_all),
    (
        AFTER_MOVES,
        " first after each move",
        "the noise of moves, the table position, the time stamps and --with time-offset",
        after_moves,
    ),
    (
        "over-dwells",
        " summed over each dwell",
        "the bias variation in [imu.noise]; if the biases follow the temperature, add --temperature",
        over_dwells,
    ),
];
const AFTER_MOVES: &str = "after-moves";

fn of_all(innovations: &[&Innovation]) -> Vec<f64> {
    let each = innovations.iter();
    each.flat_map(|i| i.whitened.map(|w| w * w)).collect()
}

/// The first innovation of each dwell after a move: it shows the errors of the move.
fn after_moves(innovations: &[&Innovation]) -> Vec<f64> {
    let dwells = innovations.chunk_by(|a, b| a.dwell == b.dwell);
    let first = dwells.filter_map(|dwell| dwell.first().filter(|i| i.after_move));
    first.flat_map(|i| i.whitened.map(|w| w * w)).collect()
}

/// Normalised sums of the innovations over each dwell: they show lasting errors.
fn over_dwells(innovations: &[&Innovation]) -> Vec<f64> {
    let dwells = innovations.chunk_by(|a, b| a.dwell == b.dwell);
    let summed = dwells.flat_map(|dwell| {
        (0..3).map(move |axis| {
            let sum: f64 = dwell.iter().map(|i| i.whitened[axis]).sum();
            sum.powi(2) / dwell.len() as f64
        })
    });
    summed.collect()
}

/// The finding on innovations that do not agree with their covariance, if there is one. `pulses` are the kinds of
/// observation that contain remainders of pulses.
pub fn inconsistent(innovations: &[Innovation], pulses: &[Observation]) -> Option<Finding> {
    let of = |kind| innovations.iter().filter(move |i| i.observation == kind);
    let kinds = Observation::ALL.map(|kind| (kind, of(kind).collect::<Vec<_>>()));
    let kinds = kinds.iter().filter(|(_, of_kind)| !of_kind.is_empty());
    let chance = FALSE_ALARM / (kinds.clone().count() * LOOKS.len()) as f64;
    let (mut each, mut looks, mut largest) = (Vec::new(), Vec::new(), 0f64);
    let mut causes = Vec::new();
    for (observation, of_kind) in kinds {
        for (look, which, cause, squares) in LOOKS {
            let squares = squares(of_kind);
            let count = squares.len();
            let nis = squares.iter().sum::<f64>() / count as f64;
            // The distance of the IMU from the table centre is stated as a bound, so the velocity after a move is
            // uncertain. A pulse bounds its remainder, which may hardly vary. Smaller innovations therefore do not
            // contradict the model.
            let one_sided = (look, *observation) == (AFTER_MOVES, Observation::Velocity)
                || pulses.contains(observation);
            let (low, high) = if one_sided {
                (0.0, mean_square_interval(count, 2.0 * chance).1)
            } else {
                mean_square_interval(count, chance)
            };
            if nis < low || nis > high {
                largest = largest.max(nis);
                let (name, root) = (observation.name(), three_digits(nis.sqrt()));
                each.push(format!(
                    "{name}{which} {root} (NIS {nis:.2}; {low:.2} to {high:.2})"
                ));
                if !causes.contains(&cause) {
                    causes.push(cause);
                }
                looks.push(json!({
                    "observation": observation, "look": look, "nis": nis, "count": count, "limits": [low, high]
                }));
            }
        }
    }
    let text = format!(
        "The size of the residuals does not agree with their predicted σ. Relative to the predicted size, the \
         residuals are: {}. Check \
         {}.",
        each.join("; "),
        causes.join("; ")
    );
    let any = !looks.is_empty();
    any.then(|| {
        let finding = Finding::new(Kind::Inconsistent, text, json!({ "looks": looks }));
        finding.of_growth(largest.sqrt())
    })
}

/// Two-sided probability outside the intervals.
const OUTSIDE: f64 = 0.05;

/// Consistency of a pass, separately for each kind of observation.
pub fn consistency(innovations: &[Innovation]) -> Consistency {
    let of = |kind| nis(innovations.iter().filter(move |i| i.observation == kind));
    Consistency {
        all: nis(innovations.iter()),
        velocity: of(Observation::Velocity),
        table: of(Observation::Table),
        attitude: of(Observation::Attitude),
    }
}

fn nis<'a>(innovations: impl Iterator<Item = &'a Innovation>) -> Nis {
    let (mut squares, mut products, mut count) = (0.0, 0.0, 0usize);
    let mut last = [0.0; 3];
    for innovation in innovations {
        for (w, last) in innovation.whitened.iter().zip(&mut last) {
            squares += w * w;
            products += w * *last;
            *last = *w;
        }
        count += 3;
    }
    Nis {
        mean: squares / count as f64,
        count,
        interval: mean_square_interval(count, OUTSIDE),
        lag_one: products / squares,
    }
}

/// The interval outside which the mean of `count` squared standard normal numbers lies with probability `outside`, half
/// on each side (Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and Navigation*, §5.4.2). NaN
/// if there are no numbers.
pub fn mean_square_interval(count: usize, outside: f64) -> (f64, f64) {
    let n = count as f64;
    ChiSquared::new(n).map_or((f64::NAN, f64::NAN), |chi2| {
        (
            chi2.inverse_cdf(outside / 2.0) / n,
            chi2.inverse_cdf(1.0 - outside / 2.0) / n,
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn interval_meets_tabulated_chi_square_quantiles() {
        // Abramowitz and Stegun, table 26.8: χ²(30) at 0.975 and 0.025 is 16.791 and 46.979.
        let (low, high) = mean_square_interval(30, 0.05);
        assert_abs_diff_eq!(low, 16.791 / 30.0, epsilon = 1e-4);
        assert_abs_diff_eq!(high, 46.979 / 30.0, epsilon = 1e-4);
    }

    #[test]
    fn velocity_after_a_move_may_stay_well_within_what_the_mounting_leaves_open() {
        // Squares of all and of sums are one in the mean, those of the first after a move 0.16.
        let dwell = [0.4, 1.6, 0.8, -0.8];
        let of = |observation| -> Vec<Innovation> {
            let of_dwell = |dwell: usize, whitened: f64| Innovation {
                time: 0.0,
                observation,
                whitened: [whitened; 3],
                sigma: [1.0; 3],
                dwell,
                after_move: dwell > 0,
            };
            let dwells = (0..20).flat_map(|k| dwell.map(|whitened| of_dwell(k, whitened)));
            dwells.collect()
        };
        assert_eq!(inconsistent(&of(Observation::Velocity), &[]), None);
        let found = inconsistent(&of(Observation::Table), &[]).unwrap();
        let looks = found.figures["looks"].as_array().unwrap();
        assert_eq!(looks.len(), 1, "{found:?}");
        assert_eq!(looks[0]["look"], AFTER_MOVES);
        let pulses = [Observation::Table];
        assert_eq!(inconsistent(&of(Observation::Table), &pulses), None);
    }

    #[test]
    fn interval_of_many_observations_is_that_of_the_normal_limit() {
        let n = 36_000.0;
        let (low, high) = mean_square_interval(n as usize, 0.05);
        let half = 1.959964 * (2f64 / n).sqrt();
        assert_abs_diff_eq!(low, 1.0 - half, epsilon = 1e-4);
        assert_abs_diff_eq!(high, 1.0 + half, epsilon = 1e-4);
    }
}
