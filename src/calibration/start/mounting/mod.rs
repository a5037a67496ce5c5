//! Detection of axes that are swapped, reversed or left-handed, in either triad or between instrument and table.
//! turncal finds such axes before the first pass and reports the corrected line for `run.toml`.
//!
//! Each of the 48 signed permutations of each triad is a hypothesis, weighted by its marginal likelihood. The prior
//! errors of the triads, and factors by which the stated prior and noise may be too small, are integrated out. The
//! decision thus depends only on likelihood ratios, not on the size of residuals. A likelihood ratio of X in favour of
//! a wrong hypothesis occurs at most once in X recordings.

mod contradiction;
mod likelihood;
mod motion;
mod rivals;
mod sensitivity;
mod statement;

use crate::calibration::parameters::{ParameterVector, parameter};
use crate::calibration::problem::Problem;
use crate::imu::{AxisOrder, PerSensor, Sensor};
use crate::run::{Aiding, Run};
pub use contradiction::Contradiction;
use likelihood::{Errors, Likelihoods, TooSmall, by_gravity, by_labels, by_table};
use motion::{Motion, unit};
pub use rivals::is_beyond_tolerance;
pub use sensitivity::Sensitivity;
pub use statement::Mounting;
use statement::{line, prior_differs};

/// False-alarm rate: fraction of correct recordings for which a different axis order is found.
const FALSE_ALARMS: f64 = 1e-6;
/// Axis orders that are this many times less likely than the best are not considered.
const TOLD_APART: f64 = 1e3;
/// Maximum number of alternatives that are reported.
const OTHERS: usize = 2;

impl Mounting {
    /// The most likely axis order, if it differs from the stated one.
    fn likeliest(problem: &Problem, run: &Run, motion: &Motion) -> Option<Self> {
        let hypotheses = Hypotheses::of(problem, run, motion);
        let (likely, log_ratio) = hypotheses.likely()?;
        let orders = *likely.first()?;
        let is = |sensor| *orders.get(sensor) == AxisOrder::IDENTITY;
        let of_one_triad = |orders: &&PerSensor<AxisOrder>| {
            orders.gyro == AxisOrder::IDENTITY || orders.accel == AxisOrder::IDENTITY
        };
        let others = likely[1..].iter().filter(of_one_triad).take(OTHERS);
        Some(Self {
            known_from: known_from(problem, motion),
            line: line(run, &orders),
            others: others.map(|orders| line(run, orders)).collect(),
            log_ratio,
            or_latitude: is(Sensor::Gyro)
                && orders.accel == AxisOrder::IDENTITY.opposite()
                && motion.labels.is_empty(),
            prior_differs: prior_differs(run, &orders),
            orders,
        })
    }
}

/// Source of the known motion.
fn known_from(problem: &Problem, motion: &Motion) -> &'static str {
    match problem.model.aiding {
        Aiding::Table => "the table attitudes",
        Aiding::Velocity if motion.labels.is_empty() => {
            "gravity directions before and after moves, and Earth rate"
        }
        Aiding::Velocity => "the labels and the gravity direction before and after moves",
    }
}

/// 1σ of the errors of both triads, equal for all axes. It is unknown whether a prior value belongs to the column or to
/// the axis, so differences between axes, and biases that a reversed column may not have, count as errors. Biases are
/// divided by gravity or Earth rate.
fn prior_sigma(run: &Run, is_order_known: bool) -> ParameterVector {
    let mut sigma = ParameterVector::zeros();
    let unknown = f64::from(u8::from(!is_order_known));
    for sensor in Sensor::ALL {
        let prior = run.instrument.prior.get(sensor);
        let nominal = run.instrument.nominal.get(sensor).0.abs();
        let spread = unknown * (nominal.max() / nominal.min() - 1.0);
        for axis in 0..3 {
            for column in 0..4 {
                sigma[parameter(sensor, 4 * axis + column)] = match column {
                    3 => {
                        let reversed = unknown * 2.0 * prior.bias.amax();
                        prior.bias_sigma.max().hypot(reversed) / unit(run, sensor)
                    }
                    _ if column == axis => prior.scale_sigma.max().hypot(spread),
                    _ => prior.installation_sigma.max(),
                };
            }
        }
    }
    sigma
}

/// Likelihood of each axis order.
struct Hypotheses {
    /// Likelihood for each triad separately, relative to known body axes.
    each: PerSensor<Likelihoods>,
    /// Likelihood for one triad relative to the other, unchanged and with the gyros reversed.
    together: Option<[Likelihoods; 2]>,
}

impl Hypotheses {
    /// All axis orders of one run of a problem.
    fn of(problem: &Problem, run: &Run, motion: &Motion) -> Self {
        let orders: Vec<AxisOrder> = AxisOrder::all().collect();
        Self::among(problem, run, motion, &orders, TooSmall::ANY)
    }

    /// The result for these orders.
    fn among(
        problem: &Problem,
        run: &Run,
        motion: &Motion,
        orders: &[AxisOrder],
        too_small: TooSmall,
    ) -> Self {
        let model = &problem.model;
        let errors = Errors {
            sigma: prior_sigma(run, orders.len() == 1),
            too_small,
        };
        let (each, together) = match run.observed_table(model.aiding) {
            Some(_) => {
                let base = model.geometry.base.xy().norm();
                let position_sigma = model.position_sigma.hypot(base);
                (by_table(motion, &errors, position_sigma, orders), None)
            }
            None => (
                by_labels(motion, &errors, orders),
                Some(by_gravity(motion, &errors, orders)),
            ),
        };
        Self { each, together }
    }

    /// The axis orders that are hardly less likely than the best, the simplest first, if the stated order is too
    /// unlikely; and the log of that ratio.
    fn likely(&self) -> Option<(Vec<PerSensor<AxisOrder>>, f64)> {
        let pairs = AxisOrder::all()
            .flat_map(|accel| AxisOrder::all().map(move |gyro| PerSensor { gyro, accel }));
        let pairs: Vec<_> = pairs
            .map(|pair| {
                (
                    pair,
                    self.parts(&pair).iter().map(|part| part.of).sum::<f64>(),
                )
            })
            .collect();
        let (best, largest) = pairs.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        // The first pair is the stated one.
        let log_ratio = largest - pairs.first()?.1;
        let limit = (pairs.len() as f64 / FALSE_ALARMS).ln();
        if log_ratio.is_nan() || log_ratio <= limit {
            return None;
        }
        // If no axis order explains the motion, or if the sources of known motion disagree, something else is wrong.
        let explains = |part: &Part| part.of >= part.none && part.largest - part.of < limit;
        if !self.parts(best).iter().all(explains) {
            return None;
        }
        let likely = pairs
            .iter()
            .filter(|(_, of)| largest - of < TOLD_APART.ln());
        let mut likely: Vec<_> = likely.map(|(pair, _)| *pair).collect();
        likely.sort_by_key(|orders| {
            let changed = Sensor::ALL.map(|sensor| orders.get(sensor).changed().count());
            let triads = changed.iter().filter(|&&changed| changed > 0).count();
            (triads, changed[0] + changed[1])
        });
        Some((likely, log_ratio))
    }

    /// The likelihood of a pair of orders for each source of known motion.
    fn parts(&self, pair: &PerSensor<AxisOrder>) -> Vec<Part> {
        let each = Sensor::ALL.map(|sensor| {
            Part::of(
                std::slice::from_ref(self.each.get(sensor)),
                0,
                pair.get(sensor),
            )
        });
        let together = self.together.as_ref().map(|together| {
            let reversed = usize::from(!pair.gyro.is_rotation());
            let rotation = [pair.gyro, pair.gyro.opposite()][reversed];
            Part::of(together, reversed, &rotation.inverse().after(&pair.accel))
        });
        each.into_iter().chain(together).collect()
    }
}

/// Log-likelihoods for one source of known motion.
struct Part {
    of: f64,
    /// Likelihood of no explanation.
    none: f64,
    /// The largest likelihood.
    largest: f64,
}

impl Part {
    /// Likelihood of an order.
    fn of(all: &[Likelihoods], which: usize, order: &AxisOrder) -> Self {
        let place = AxisOrder::all().position(|other| other == *order);
        let largest =
            |of: fn(&Likelihoods) -> f64| all.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
        Self {
            of: place.map_or(f64::NEG_INFINITY, |place| all[which].of[place]),
            none: largest(|likelihoods| likelihoods.none),
            largest: largest(Likelihoods::largest),
        }
    }
}

/// The log-likelihood of each gyro axis order, and of the hypothesis that no order fits, given the motion of a run with
/// the dwells of a problem. The accelerometer axes are assumed to be as stated.
pub fn orders_of_gyros(problem: &Problem, run: &Run) -> Vec<(AxisOrder, f64, f64)> {
    let hypotheses = Hypotheses::of(problem, run, &Motion::of(problem, 0, run));
    let weighed = |gyro| {
        let accel = AxisOrder::IDENTITY;
        let parts = hypotheses.parts(&PerSensor { gyro, accel });
        let sum = |of: fn(&Part) -> f64| parts.iter().map(of).sum();
        (gyro, sum(|part| part.of), sum(|part| part.none))
    };
    AxisOrder::all().map(weighed).collect()
}

#[cfg(test)]
mod tests;
