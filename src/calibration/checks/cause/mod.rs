//! Causes of deviations of a recording from its model: single events (a wrong table position, a rotation that the gyros
//! did not sense, a bias step) and error terms.
//!
//! They are searched before noise is estimated, because noise would grow to explain them. The effect of each on the
//! estimate follows from its score and information, without another pass (Rao 1948, "Large sample tests of statistical
//! hypotheses", Mathematical Proceedings of the Cambridge Philosophical Society 44(1)).

mod score;
pub mod settling;
mod tried;

use nalgebra::Vector3;
use serde_json::json;

use crate::calibration::{
    AttitudePrior, CalibrationError, Constant, Disturbance, DisturbanceKind, ErrorTerm, Finding,
    FindingKind as Kind, Innovation, Iterated, Observation, Prior, Problem, Script,
};
use crate::imu::Sensor;
use crate::number::three_digits;
use crate::run::{Aiding, Dwell};
use crate::statistics::{FALSE_ALARM, chi_square_limit, ln_survival, median};
use crate::units::{ARCSEC, DEG_PER_H, MICRO_G};
pub use score::Cause;
use score::Scores;
use tried::Tried;

/// Components of a disturbance.
const COMPONENTS: usize = 3;

/// A cause with its evidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoundCause {
    /// The cause.
    pub cause: Cause,
    /// Start time, s; zero for an error term.
    time: f64,
    /// Its components; zero for an error term.
    value: Vector3<f64>,
    /// χ² under the null hypothesis, and its degrees of freedom …
    square: f64,
    degrees: f64,
    /// … scale of χ² by chance, relative to the noise …
    chance: f64,
    /// … and the limit of its significance under the null hypothesis.
    limit: f64,
}

/// Possible causes in a solved problem.
pub struct Causes {
    /// The significant causes, the one that explains most first. Earth rate, which widens the scatter of all positions,
    /// precedes it if it explains more with the scale of the noise.
    pub likeliest: Vec<FoundCause>,
    /// Scale of chance relative to the noise, from the medians over all positions and all slips; at least one.
    pub chance: f64,
}

impl Causes {
    /// Finds the possible causes in a solved problem.
    ///
    /// # Errors
    /// As of a pass.
    pub fn of(
        problem: &Problem,
        priors: &[AttitudePrior],
        iterated: &Iterated,
    ) -> Result<Self, CalibrationError> {
        let innovations = &iterated.held.innovations;
        let read = of_readings(innovations);
        let tried = Tried::of(problem.dwells().count(), innovations);
        let (all, scored) = by_score(problem, (priors, iterated), &tried)?;
        let limit = -2.0 * (FALSE_ALARM / (read.len() + all).max(1) as f64).ln();
        let of_kind = |kind| {
            let is = |of: &&FoundCause| match of.cause {
                Cause::Disturbance(of) => of.kind == kind && tried.evenly(of.dwell),
                Cause::Term(_) => false,
            };
            chance(scored.iter().filter(is))
        };
        let of_read = chance(read.iter());
        let [of_positions, of_slips] =
            [DisturbanceKind::Position, DisturbanceKind::Slip].map(of_kind);
        let of_both = of_positions.max(of_slips);
        // By hand every move is another; that one is worst only tells how wide chance is.
        let table = problem.model.aiding == Aiding::Table;
        let scored = scored.into_iter().filter_map(|of| match of.cause {
            Cause::Disturbance(_) if !table => None,
            Cause::Disturbance(disturbance) => Some(match disturbance.kind {
                DisturbanceKind::Position => of.beside(of_positions, limit),
                DisturbanceKind::Slip => of.beside(of_slips, limit),
                _ => of.beside(of_both, limit),
            }),
            Cause::Term(_) => Some(of.beside(of_both, limit)),
        });
        let read = read.iter().map(|of| of.beside(of_read, limit));
        let all: Vec<FoundCause> = read.chain(scored).collect();
        let most = explains_most(all.iter().copied());
        let lasting = all.iter().filter(|of| of.is_lasting());
        let lasting = explains_most(lasting.map(|of| of.beside(1.0, limit)));
        let before = |of: &FoundCause| most.is_none_or(|most| of.explained() > most.explained());
        Ok(Self {
            likeliest: lasting.filter(before).into_iter().chain(most).collect(),
            chance: of_both,
        })
    }
}

fn explains_most(causes: impl Iterator<Item = FoundCause>) -> Option<FoundCause> {
    let beyond = causes.filter(FoundCause::is_beyond);
    beyond.max_by(|a, b| a.explained().total_cmp(&b.explained()))
}

/// Scale of chance: that of the median of these, if it is larger than the noise.
fn chance<'a>(all: impl Iterator<Item = &'a FoundCause>) -> f64 {
    let mut ratios: Vec<f64> = all.map(|of| of.square / of.degrees).collect();
    median(&mut ratios).unwrap_or(1.0).max(1.0)
}

/// Positions of the table, tested by the innovations of its readings without outliers.
fn of_readings(innovations: &[Innovation]) -> Vec<FoundCause> {
    let dwells = innovations.chunk_by(|one, other| one.dwell == other.dwell);
    let sound = chi_square_limit(COMPONENTS as f64, FALSE_ALARM);
    let of_dwell = |dwell: &[Innovation]| {
        let is_read = |of: &&Innovation| of.observation == Observation::Table && of.accepted;
        // The first ones may show the move.
        let read = dwell
            .iter()
            .filter(is_read)
            .skip_while(|of| of.distance() > sound);
        let read: Vec<&Innovation> = read.collect();
        let largest = read
            .iter()
            .max_by(|a, b| a.distance().total_cmp(&b.distance()))?;
        let cause = Cause::Disturbance(Disturbance {
            kind: DisturbanceKind::Position,
            dwell: largest.dwell,
        });
        let square = read.iter().map(|of| of.distance()).sum();
        let degrees = (COMPONENTS * read.len()) as f64;
        let explained = (square, degrees, Vector3::zeros());
        Some(FoundCause::new(cause, largest.time, explained))
    };
    dwells.filter_map(of_dwell).collect()
}

/// All possible single events in the tested dwells, then all disabled error terms that the recording can show, with
/// their scores; and the number of causes if all dwells were tested.
fn by_score(
    problem: &Problem,
    (priors, iterated): (&[AttitudePrior], &Iterated),
    tried: &Tried,
) -> Result<(usize, Vec<FoundCause>), CalibrationError> {
    let (mut disturbances, mut model) = (disturbances(problem), problem.model.clone());
    let everywhere = disturbances.len();
    disturbances.retain(|of| tried.contains(of.dwell));
    let terms = ErrorTerm::constant().filter(|&term| !model.has(term) && model.can_have(term));
    let terms: Vec<ErrorTerm> = terms.collect();
    model.disturbances.extend(&disturbances);
    terms.iter().for_each(|&term| model.switch_on(term));
    let all = everywhere + terms.len();
    let (with, at) = (problem.with_model(model), &iterated.estimate);
    let reduction = Script::new(&with, priors, at)?.fold(&with, &iterated.held.accepted())?;
    let prior = Prior::new(&reduction.constants, &with.model, at);
    let once = disturbances.into_iter().map(Cause::Disturbance);
    let causes: Vec<Cause> = once.chain(terms.into_iter().map(Cause::Term)).collect();
    let is_off = |constant: &Constant| Cause::of(constant).is_some_and(|of| causes.contains(&of));
    let Some(scores) = Scores::new(&reduction, &prior, is_off) else {
        return Ok((all, Vec::new()));
    };
    let candidates = causes.iter().filter_map(|&cause| {
        let explained = scores.explained_by(cause)?;
        let time = match cause {
            Cause::Disturbance(of) => time_of(problem, of),
            Cause::Term(_) => 0.0,
        };
        Some(FoundCause::new(cause, time, explained))
    });
    Ok((all, candidates.collect()))
}

/// All possible single events that are not estimated already.
fn disturbances(problem: &Problem) -> Vec<Disturbance> {
    let table = problem.model.aiding == Aiding::Table;
    let all = problem.dwells().enumerate().flat_map(|(dwell, of)| {
        let kinds = [
            (DisturbanceKind::Position, table && of.position.is_some()),
            (DisturbanceKind::Slip, dwell > 0),
            (DisturbanceKind::BiasStep(Sensor::Gyro), table && dwell > 0),
            (DisturbanceKind::BiasStep(Sensor::Accel), table && dwell > 0),
            (DisturbanceKind::EarthRate, table && dwell == 0),
        ];
        let may_be = kinds.into_iter().filter(|(_, may_be)| *may_be);
        may_be.map(move |(kind, _)| Disturbance { kind, dwell })
    });
    let estimated = &problem.model.disturbances;
    all.filter(|of| !estimated.contains(of)).collect()
}

/// Time of a disturbance, s: the middle of the move before its dwell or, for a position, the start of the dwell.
fn time_of(problem: &Problem, disturbance: Disturbance) -> f64 {
    let times = problem.stretches().iter().flat_map(|stretch| {
        let imu = &stretch.run.recording.imu;
        let ends = |dwell: &Dwell| [dwell.samples.start, dwell.samples.end];
        let dwells = stretch.dwells.iter();
        dwells.map(move |dwell| ends(dwell).map(|end| imu.time(end)))
    });
    let times: Vec<[f64; 2]> = times.collect();
    let begin = times[disturbance.dwell][0];
    match (disturbance.kind, disturbance.dwell.checked_sub(1)) {
        (DisturbanceKind::Slip | DisturbanceKind::BiasStep(_), Some(before)) => {
            0.5 * (times[before][1] + begin)
        }
        _ => begin,
    }
}

impl FoundCause {
    fn new(cause: Cause, time: f64, explained: (f64, f64, Vector3<f64>)) -> Self {
        let (square, degrees, value) = explained;
        Self {
            cause,
            time,
            value,
            square,
            degrees,
            chance: 1.0,
            limit: f64::INFINITY,
        }
    }

    fn beside(self, chance: f64, limit: f64) -> Self {
        Self {
            chance,
            limit,
            ..self
        }
    }

    /// A permanent cause (Earth rate) gets the chance level found while it is estimated; other causes are unchanged.
    pub fn beside_what_it_leaves(self, left: &Causes) -> Self {
        if self.is_lasting() {
            self.beside(left.chance, self.limit)
        } else {
            self
        }
    }

    /// Explained χ² beyond chance, in squares of noise.
    fn explained(&self) -> f64 {
        self.square - self.chance * self.degrees
    }

    /// −2 ln of the p-value.
    fn significance(&self) -> f64 {
        -2.0 * ln_survival(self.degrees, self.square / self.chance)
    }

    /// Whether it is significant.
    pub fn is_beyond(&self) -> bool {
        self.significance() > self.limit
    }

    /// Whether it affects all positions, with no more components than a single one: Earth rate.
    fn is_lasting(&self) -> bool {
        let is = |of: Disturbance| of.kind == DisturbanceKind::EarthRate;
        matches!(self.cause, Cause::Disturbance(of) if is(of))
    }

    /// The problem with this cause included: readings of a wrong position are dropped, other causes are estimated.
    pub fn taken_into<'a>(&self, problem: &Problem<'a>) -> Problem<'a> {
        let mut model = problem.model.clone();
        match self.cause {
            Cause::Term(term) => model.switch_on(term),
            Cause::Disturbance(of) if of.kind == DisturbanceKind::Position => {
                return problem.with_dwells(|number, _, dwell| {
                    let position = dwell.position.clone().filter(|_| number != of.dwell);
                    let samples = dwell.samples.clone();
                    Some(Dwell { samples, position })
                });
            }
            Cause::Disturbance(of) => model.disturbances.push(of),
        }
        problem.with_model(model)
    }

    /// The finding on it: kind, time and treatment.
    pub fn finding(&self) -> Finding {
        let Self { time, limit, .. } = self;
        let significance = self.significance();
        let tested = format!("(significance {significance:.0}; limit {limit:.0})");
        let mut figures = json!({ "significance": significance, "limit": limit });
        let (kind, text) = match self.cause {
            Cause::Term(term) => {
                let name = term.name();
                figures["term"] = json!(name);
                let text = format!(
                    "The data show an error that scale factors, misalignments and biases cannot explain: {name}. turncal \
                     estimated it with them, as --with {name} does. Use the values only together with this term"
                );
                (Kind::ErrorTermEstimated, text)
            }
            Cause::Disturbance(disturbance) => {
                figures["dwell"] = json!(disturbance.dwell + 1);
                figures["time_s"] = json!(time);
                self.of_disturbance(disturbance)
            }
        };
        Finding::new(kind, format!("{text} {tested}."), figures)
    }

    /// Kind and text of the finding on a disturbance.
    fn of_disturbance(&self, disturbance: Disturbance) -> (Kind, String) {
        let time = self.time;
        let number = disturbance.dwell + 1;
        let seconds = self.value.norm() / ARCSEC;
        let angle = match seconds {
            ..1000.0 => format!("{seconds:.0}″"),
            _ => format!("{:.3}°", seconds / 3600.0),
        };
        match disturbance.kind {
            DisturbanceKind::Position => {
                let by = if seconds > 0.0 {
                    format!(" by {angle}")
                } else {
                    String::new()
                };
                let text = format!(
                    "The table readings in dwell {number} are wrong{by} (at {time:.1} s). turncal excluded them. \
                     Check the log there for a bump or a wrong reading"
                );
                (Kind::PositionWrong, text)
            }
            DisturbanceKind::Slip => {
                let text = format!(
                    "In the move before dwell {number} (at {time:.1} s) the gyros missed a turn of {angle}. turncal \
                     estimated this angle. Check the log there for lost samples, an exceeded range or a loose mount"
                );
                (Kind::MoveWrong, text)
            }
            DisturbanceKind::EarthRate => {
                let value = self.value / DEG_PER_H;
                let text = format!(
                    "The gyros sense an Earth rate that differs from the one at latitude_deg by {:+.4}, {:+.4}, {:+.4} °/h \
                     (East, North, Up). turncal estimated it. Check latitude_deg and the north and level of the table",
                    value.x, value.y, value.z
                );
                (Kind::EarthRateWrong, text)
            }
            DisturbanceKind::BiasStep(sensor) => {
                let (unit, name) = match sensor {
                    Sensor::Gyro => (DEG_PER_H, "°/h"),
                    Sensor::Accel => (MICRO_G, "µg"),
                };
                let text = format!(
                    "The {} bias stepped by {} {name} before dwell {number} (at {time:.1} s). turncal estimated the \
                     step; the calibration contains the mean of both biases. Look for a shock or a change of supply \
                     voltage or temperature at that time; if the log has a temperature column, rerun with --temperature",
                    sensor.name(),
                    three_digits(self.value.norm() / unit),
                );
                (Kind::BiasStep, text)
            }
        }
    }
}
