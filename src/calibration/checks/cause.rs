//! Causes of what a record shows beyond its model: what happened once (a wrong position of the table, a turn that the gyros
//! did not sense, a step of biases), and error terms.
//!
//! They are looked for before noise is estimated, which would become large to explain them. What each one would do to the
//! estimate follows from its score and information beside the constants, without another pass (Rao 1948, "Large sample
//! tests of statistical hypotheses", Mathematical Proceedings of the Cambridge Philosophical Society 44(1)).

use nalgebra::{DMatrix, DVector, Vector3};
use serde_json::json;

use super::evidence::Evidence;
use super::finding::Finding;
use super::innovation::{Innovation, Observation};
use crate::calibration::constants::{Constant, Disturbance, DisturbanceKind, Prior};
use crate::calibration::error::CalibrationError;
use crate::calibration::gauss_newton::Iterated;
use crate::calibration::linearisation::AttitudePrior;
use crate::calibration::parameters::error_term::ErrorTerm;
use crate::calibration::problem::Problem;
use crate::calibration::reduction::{Reduction, Script};
use crate::imu::Sensor;
use crate::run::{Aiding, Dwell};
use crate::statistics::{FALSE_ALARM, chi_square_limit, ln_survival, median};
use crate::units::{ARCSEC, DEG_PER_H, MICRO_G};

/// Components of a disturbance.
const COMPONENTS: usize = 3;

/// What explains a record better than its model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    /// Something happened once.
    Disturbance(Disturbance),
    /// An error term is there.
    Term(ErrorTerm),
}

impl Cause {
    fn is(self, kind: DisturbanceKind) -> bool {
        matches!(self, Self::Disturbance(disturbance) if disturbance.kind == kind)
    }
}

/// A cause that is beyond chance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoundCause {
    /// Which.
    pub cause: Cause,
    /// When it began, s; of an error term zero.
    time: f64,
    /// Its components; of an error term zero.
    value: Vector3<f64>,
    /// −2 ln of the probability that as much is chance …
    significance: f64,
    /// … and what that stays below.
    limit: f64,
}

/// Something that may be a cause, with what shows it.
#[derive(Clone, Copy)]
struct Candidate {
    cause: Cause,
    time: f64,
    value: Vector3<f64>,
    /// χ² if it is none, of so many degrees of freedom.
    square: f64,
    degrees: f64,
}

/// The cause in what was solved that explains most; none where none is beyond chance.
///
/// Chance is as wide as half of all positions and half of all slips show, or as the noise says if that is wider.
///
/// # Errors
/// As of a pass.
pub fn likeliest(
    problem: &Problem,
    priors: &[AttitudePrior],
    iterated: &Iterated,
) -> Result<Option<FoundCause>, CalibrationError> {
    let of_readings = of_readings(&iterated.held.innovations);
    let [once, terms] = by_score(problem, priors, iterated)?;
    let count = of_readings.len() + once.len() + terms.len();
    let limit = -2.0 * (FALSE_ALARM / count.max(1) as f64).ln();
    let chance = |of_kind: &[Candidate]| {
        let ratios = of_kind.iter().map(|of| of.square / of.degrees);
        let median = median(&mut ratios.collect::<Vec<_>>());
        median.unwrap_or(1.0).max(1.0)
    };
    let of_kind = |kind: DisturbanceKind| {
        let of_kind = once.iter().copied().filter(|of| of.cause.is(kind));
        chance(&of_kind.collect::<Vec<_>>())
    };
    let of_read = chance(&of_readings);
    let of_positions = of_kind(DisturbanceKind::Position);
    let of_slips = of_kind(DisturbanceKind::Slip);
    let of_all = of_positions.max(of_slips);
    let read = of_readings.into_iter().map(|of| (of, of_read));
    // By hand every move is another; that one is worst only tells how wide chance is.
    let table = problem.model.aiding == Aiding::Table;
    let taken = once.iter().copied().filter(|_| table);
    let others = taken.chain(terms).map(|of| match of.cause {
        cause if cause.is(DisturbanceKind::Position) => (of, of_positions),
        cause if cause.is(DisturbanceKind::Slip) => (of, of_slips),
        _ => (of, of_all),
    });
    let each = read.chain(others).map(|(of, chance)| {
        let found = FoundCause {
            cause: of.cause,
            time: of.time,
            value: of.value,
            significance: -2.0 * ln_survival(of.degrees, of.square / chance),
            limit,
        };
        (of.square - chance * of.degrees, found)
    });
    let beyond = each.filter(|(_, found)| found.significance > limit);
    let most = beyond.max_by(|a, b| a.0.total_cmp(&b.0));
    Ok(most.map(|(_, found)| found))
}

/// Positions of the table, by the innovations of those of its readings that are no outliers.
fn of_readings(innovations: &[Innovation]) -> Vec<Candidate> {
    let dwells = innovations.chunk_by(|one, other| one.dwell == other.dwell);
    let sound = chi_square_limit(COMPONENTS as f64, FALSE_ALARM);
    let of_dwell = |dwell: &[Innovation]| {
        let read = dwell
            .iter()
            .filter(|of| of.observation == Observation::Table && of.accepted);
        // The first ones may show the move.
        let read = read.skip_while(|of| of.distance() > sound);
        let read: Vec<&Innovation> = read.collect();
        let largest = read
            .iter()
            .max_by(|a, b| a.distance().total_cmp(&b.distance()))?;
        Some(Candidate {
            cause: Cause::Disturbance(Disturbance {
                kind: DisturbanceKind::Position,
                dwell: largest.dwell,
            }),
            time: largest.time,
            value: Vector3::zeros(),
            square: read.iter().map(|of| of.distance()).sum(),
            degrees: (COMPONENTS * read.len()) as f64,
        })
    };
    dwells.filter_map(of_dwell).collect()
}

/// All that may have happened once, and all error terms that are off, by their scores.
fn by_score(
    problem: &Problem,
    priors: &[AttitudePrior],
    iterated: &Iterated,
) -> Result<[Vec<Candidate>; 2], CalibrationError> {
    let disturbances = disturbances(problem);
    let terms = terms(problem);
    let mut model = problem.model.clone();
    model.disturbances.extend(&disturbances);
    terms.iter().for_each(|&term| model.switch_on(term));
    let with = problem.with_model(model);
    let script = Script::new(&with, priors, &iterated.estimate)?;
    let reduction = script.reduce(&with, &iterated.held.accepted())?;
    let prior = Prior::new(&reduction.constants, &with.model, &iterated.estimate);
    let is_off = |constant: &Constant| match *constant {
        Constant::Disturbance(of, _) => disturbances.contains(&of),
        constant => constant
            .error_term()
            .is_some_and(|term| terms.contains(&term)),
    };
    let Some(scores) = Scores::new(&reduction, &prior, is_off) else {
        return Ok([Vec::new(), Vec::new()]);
    };
    let once = disturbances.into_iter().filter_map(|of| {
        let (square, value) = scores.of_disturbance(of)?;
        Some(Candidate {
            cause: Cause::Disturbance(of),
            time: time_of(problem, of),
            value,
            square,
            degrees: COMPONENTS as f64,
        })
    });
    let of_terms = terms.into_iter().filter_map(|term| {
        let (square, degrees) = scores.of_term(term)?;
        Some(Candidate {
            cause: Cause::Term(term),
            time: 0.0,
            value: Vector3::zeros(),
            square,
            degrees,
        })
    });
    Ok([once.collect(), of_terms.collect()])
}

/// The constant error terms that are off and that the record can hold.
fn terms(problem: &Problem) -> Vec<ErrorTerm> {
    let model = &problem.model;
    let off = ErrorTerm::constant().filter(|&term| !model.has(term) && model.can_have(term));
    off.collect()
}

/// All that may have happened once and is not estimated already.
fn disturbances(problem: &Problem) -> Vec<Disturbance> {
    let table = problem.model.aiding == Aiding::Table;
    let all = problem.dwells().enumerate().flat_map(|(dwell, of)| {
        let position = (table && of.position.is_some()).then_some(DisturbanceKind::Position);
        let slip = (dwell > 0).then_some(DisturbanceKind::Slip);
        let steps = Sensor::ALL.map(DisturbanceKind::BiasStep);
        let steps = steps.into_iter().filter(move |_| table && dwell > 0);
        let earth_rate = (table && dwell == 0).then_some(DisturbanceKind::EarthRate);
        let kinds = position
            .into_iter()
            .chain(slip)
            .chain(steps)
            .chain(earth_rate);
        kinds.map(move |kind| Disturbance { kind, dwell })
    });
    all.filter(|of| !problem.model.disturbances.contains(of))
        .collect()
}

/// When a disturbance happened, s: in the middle of the move before its dwell or, of a position, as the dwell begins.
fn time_of(problem: &Problem, disturbance: Disturbance) -> f64 {
    let stretches = problem.stretches().iter();
    let times = stretches.flat_map(|stretch| {
        let imu = &stretch.run.recording.imu;
        let dwells = stretch.dwells.iter();
        dwells.map(|dwell| (imu.time(dwell.samples.start), imu.time(dwell.samples.end)))
    });
    let times: Vec<(f64, f64)> = times.collect();
    let begin = times[disturbance.dwell].0;
    match (disturbance.kind, disturbance.dwell.checked_sub(1)) {
        (DisturbanceKind::Slip | DisturbanceKind::BiasStep(_), Some(before)) => {
            0.5 * (times[before].1 + begin)
        }
        _ => begin,
    }
}

/// Scores of the constants that are not estimated, beside those that are.
struct Scores {
    constants: Vec<Constant>,
    /// 1σ of each before the data.
    sigma: DVector<f64>,
    score: DVector<f64>,
    information: DMatrix<f64>,
}

impl Scores {
    /// Of those that are off; none where rounding has the last word.
    fn new(
        reduction: &Reduction,
        prior: &Prior,
        is_off: impl Fn(&Constant) -> bool,
    ) -> Option<Self> {
        let constants = &reduction.constants;
        let n = constants.len();
        let (off, on): (Vec<usize>, Vec<usize>) = (0..n).partition(|&k| is_off(&constants[k]));
        let mut squares = DMatrix::zeros(n + 1, n + 1);
        for part in &reduction.parts {
            squares.gemm_tr(1.0, &part.rows, &part.rows, 1.0);
        }
        let within =
            |rows: &[usize], columns: &[usize]| squares.select_rows(rows).select_columns(columns);
        let mut among = within(&on, &on);
        let mut right = within(&on, &[n]);
        for (i, &k) in on.iter().enumerate() {
            among[(i, i)] += prior.sigma[k].powi(-2);
            right[i] += prior.mean[k] / prior.sigma[k].powi(2);
        }
        // Each over its own σ, lest different units spoil the digits.
        let scale = DMatrix::from_diagonal(&among.map_diagonal(|own| own.powf(-0.5)));
        let root = (&scale * among * &scale).cholesky()?;
        let across = &scale * within(&on, &off);
        let explained = root.solve(&across);
        let score = within(&off, &[n]) - explained.tr_mul(&(&scale * right));
        Some(Self {
            constants: off.iter().map(|&k| constants[k]).collect(),
            sigma: prior.sigma.select_rows(&off),
            score: score.column(0).into_owned(),
            information: within(&off, &off) - explained.tr_mul(&across),
        })
    }

    /// By how much the cost falls with a disturbance, and its components; none where the data do not show all of them.
    fn of_disturbance(&self, disturbance: Disturbance) -> Option<(f64, Vector3<f64>)> {
        let mut constants = self.constants.iter();
        let first = constants.position(|of| *of == Constant::Disturbance(disturbance, 0))?;
        let score = self.score.fixed_rows::<3>(first);
        let value = self.information.fixed_view::<3, 3>(first, first);
        let value = value.into_owned().cholesky()?.solve(&score);
        Some((score.dot(&value), value))
    }

    /// χ² and degrees of freedom of what an error term of its usual size explains.
    fn of_term(&self, term: ErrorTerm) -> Option<(f64, f64)> {
        let constants = self.constants.iter().enumerate();
        let of = constants.filter(|(_, constant)| constant.error_term() == Some(term));
        let of: Vec<usize> = of.map(|(place, _)| place).collect();
        let sigma = DMatrix::from_diagonal(&self.sigma.select_rows(&of));
        let information = self.information.select_rows(&of).select_columns(&of);
        let information = &sigma * information * &sigma + DMatrix::identity(of.len(), of.len());
        let covariance = information.cholesky()?.inverse();
        let score = &sigma * self.score.select_rows(&of);
        let gain = score.dot(&(&covariance * &score));
        Evidence::new(gain, &covariance).chi_square()
    }
}

impl FoundCause {
    /// The problem with it: readings of a wrong position are left out, all else is estimated.
    pub fn taken_into<'a>(&self, problem: &Problem<'a>) -> Problem<'a> {
        let mut model = problem.model.clone();
        let disturbance = match self.cause {
            Cause::Term(term) => {
                model.switch_on(term);
                return problem.with_model(model);
            }
            Cause::Disturbance(disturbance) => disturbance,
        };
        let Disturbance { kind, dwell } = disturbance;
        if kind == DisturbanceKind::Position {
            return problem.with_dwells(|number, _, of| {
                let position = of.position.clone().filter(|_| number != dwell);
                let samples = of.samples.clone();
                Some(Dwell { samples, position })
            });
        }
        model.disturbances.push(disturbance);
        problem.with_model(model)
    }

    /// What it is, when, and what became of it.
    pub fn finding(&self) -> Finding {
        let Self {
            time,
            significance,
            limit,
            ..
        } = self;
        let tested = format!("(significance {significance:.0}; limit {limit:.0})");
        let mut figures = json!({ "significance": significance, "limit": limit });
        let (kind, text) = match self.cause {
            Cause::Term(term) => {
                let name = term.name();
                figures["term"] = json!(name);
                let text = format!(
                    "The data show an error that scale factors, misalignments and biases cannot explain: {name}. turncal \
                     estimated it with them, as --with {name} does. Apply the values together with this term"
                );
                ("error-term-estimated", text)
            }
            Cause::Disturbance(disturbance) => {
                figures["dwell"] = json!(disturbance.dwell + 1);
                figures["time_s"] = json!(time);
                self.of_disturbance(disturbance)
            }
        };
        Finding::new(kind, format!("{text} {tested}."), figures)
    }

    /// Kind and words of the finding of a disturbance.
    fn of_disturbance(&self, disturbance: Disturbance) -> (&'static str, String) {
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
                    "The table's readings in dwell {number} are wrong{by} (at {time:.1} s). turncal left them out. Look \
                     there for a bump or a wrong reading"
                );
                ("position-wrong", text)
            }
            DisturbanceKind::Slip => {
                let text = format!(
                    "In the move before dwell {number} (at {time:.1} s) the gyros missed a turn of {angle}. turncal \
                     estimated it. Look there for lost samples, an exceeded range or a loose mount"
                );
                ("move-wrong", text)
            }
            DisturbanceKind::EarthRate => {
                let value = self.value / DEG_PER_H;
                let text = format!(
                    "The gyros sense an Earth rate that differs from the one at latitude_deg by {:+.4}, {:+.4}, {:+.4} °/h \
                     (East, North, Up). turncal estimated it. Check latitude_deg, and the table's north and level",
                    value.x, value.y, value.z
                );
                ("earth-rate-wrong", text)
            }
            DisturbanceKind::BiasStep(sensor) => {
                let (unit, name) = match sensor {
                    Sensor::Gyro => (DEG_PER_H, "°/h"),
                    Sensor::Accel => (MICRO_G, "µg"),
                };
                let text = format!(
                    "The {} bias stepped by {:.3} {name} before dwell {number} (at {time:.1} s). turncal estimated the \
                     step; the calibration has the mean of both biases. Look there for a shock, or a change of supply \
                     or temperature",
                    sensor.name(),
                    self.value.norm() / unit,
                );
                ("bias-step", text)
            }
        }
    }
}
