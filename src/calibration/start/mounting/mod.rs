//! Axes that are swapped, reversed or left-handed, in either triad or between instrument and table: found
//! before the first pass, and named with the line of `run.toml` that puts them right.
//!
//! Each of the 48 signed permutations of each triad is a hypothesis, and the marginal likelihood of what
//! the record shows is its weight: prior errors of the triads are integrated out, and so are factors by
//! which prior and noise may be stated too small. So nothing is decided by a residual's size, only by one
//! mounting being likelier than another. A likelihood ratio of X in favour of a wrong hypothesis comes up
//! at most once in X records.

mod likelihood;
mod motion;
mod reference;
mod statement;

use nalgebra::Vector3;

use crate::calibration::problem::Problem;
use crate::earth::ROTATION_RATE;
use crate::imu::{AxisOrder, PerSensor, Sensor};
use crate::run::{Aiding, Run};
use likelihood::{BIAS, OF_ACCEL, Row};
use motion::Motion;
use reference::{Likelihoods, by_gravity, by_labels, by_table};
pub use statement::Mounting;
use statement::{line, prior_differs};

/// Part of sound records for which another mounting is found.
const FALSE_ALARMS: f64 = 1e-6;
/// Mountings that are this many times less likely than the likeliest are no longer considered beside it.
const TOLD_APART: f64 = 1e3;
/// So many others are named.
const OTHERS: usize = 2;

impl Mounting {
    /// The first run of a problem whose mounting contradicts what it shows, if there is one.
    pub fn contradicted(problem: &Problem) -> Option<Self> {
        let mut runs = problem.runs().enumerate();
        runs.find_map(|(recording, run)| Self::of(problem, recording, run))
    }

    fn of(problem: &Problem, recording: usize, run: &Run) -> Option<Self> {
        let motion = Motion::of(problem, recording, run);
        let prior_sigma = prior_sigma(run);
        let by_table_or_labels = match run.observed_table(problem.model.aiding) {
            Some(_) => by_table(
                &motion,
                &prior_sigma,
                problem
                    .model
                    .position_sigma
                    .hypot(problem.model.geometry.base.xy().norm()),
                &orders(),
            ),
            None => by_labels(&motion, &prior_sigma, &orders()),
        };
        let by_gravity = match run.observed_table(problem.model.aiding) {
            Some(_) => None,
            None => Some(by_gravity(&motion, &prior_sigma, &orders())),
        };
        let hypotheses = Hypotheses {
            orders: orders(),
            each: by_table_or_labels,
            together: by_gravity,
        };
        let Found {
            orders,
            others,
            log_ratio,
        } = hypotheses.likeliest()?;
        Some(Self {
            recording: run.recording.name.clone(),
            known_from: known_from(problem, &motion),
            line: line(run, &orders),
            others: others.iter().map(|orders| line(run, orders)).collect(),
            log_ratio,
            or_latitude: orders.gyro == AxisOrder::IDENTITY
                && orders.accel == AxisOrder::IDENTITY.opposite()
                && motion.labels.is_empty(),
            prior_differs: prior_differs(run, &orders),
            orders,
        })
    }
}

/// What the motion is known from.
fn known_from(problem: &Problem, motion: &Motion) -> &'static str {
    match problem.model.aiding {
        Aiding::Table => "the table's attitudes",
        Aiding::Velocity if motion.labels.is_empty() => {
            "gravity's direction before and after moves, and Earth rate"
        }
        Aiding::Velocity => "labels, and gravity's direction before and after moves",
    }
}

fn orders() -> Vec<AxisOrder> {
    AxisOrder::all().collect()
}

/// 1σ of the errors of both triads, alike on all axes. Whether a value of the prior goes with the column or
/// with the place where it is put is not known, so differences between axes and biases that a reversed
/// column may not have count as errors. Biases are over gravity and Earth rate.
fn prior_sigma(run: &Run) -> Row {
    let mut sigma = Row::zeros();
    for (sensor, first, unit) in [
        (Sensor::Gyro, 0, ROTATION_RATE),
        (Sensor::Accel, OF_ACCEL, run.site.gravity),
    ] {
        let prior = run.instrument.prior.get(sensor);
        let nominal = run.instrument.nominal.get(sensor).0.abs();
        let spread = nominal.max() / nominal.min() - 1.0;
        for entry in 0..BIAS {
            sigma[first + entry] = match entry % 4 {
                0 => prior.scale_sigma.max().hypot(spread),
                _ => prior.installation_sigma.max(),
            };
        }
        let bias = prior.bias_sigma.max().hypot(2.0 * prior.bias.amax()) / unit;
        let biases = Vector3::repeat(bias);
        sigma.fixed_rows_mut::<3>(first + BIAS).copy_from(&biases);
    }
    sigma
}

/// How likely each mounting is.
struct Hypotheses {
    orders: Vec<AxisOrder>,
    /// Of each triad by itself, against what is known of body axes.
    each: PerSensor<Likelihoods>,
    /// Of one triad against the other.
    together: Option<[Likelihoods; 2]>,
}

struct Found {
    orders: PerSensor<AxisOrder>,
    others: Vec<PerSensor<AxisOrder>>,
    log_ratio: f64,
}

impl Hypotheses {
    /// The simplest mounting of those that are hardly less likely than the likeliest, if what is stated is
    /// not likely enough beside that.
    fn likeliest(&self) -> Option<Found> {
        let places = 0..self.orders.len();
        let pairs: Vec<(PerSensor<usize>, f64)> = places
            .clone()
            .flat_map(|accel| places.clone().map(move |gyro| PerSensor { gyro, accel }))
            .map(|pair| (pair, self.parts(&pair).iter().map(|(of, _)| of).sum()))
            .collect();
        let (best, largest) = pairs.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let stated: f64 = self
            .parts(&PerSensor { gyro: 0, accel: 0 })
            .iter()
            .map(|(of, _)| of)
            .sum();
        let log_ratio = largest - stated;
        let limit = (pairs.len() as f64 / FALSE_ALARMS).ln();
        if log_ratio.is_nan() || log_ratio <= limit {
            return None;
        }
        // Where no mounting explains the motion, or what it is known from does not agree, something else
        // is wrong.
        let explains =
            |&(of, Bounds { none, largest }): &(f64, Bounds)| of >= none && largest - of < limit;
        if !self.parts(best).iter().all(explains) {
            return None;
        }
        let mut as_likely: Vec<PerSensor<AxisOrder>> = pairs
            .iter()
            .filter(|(_, of)| largest - of < TOLD_APART.ln())
            .map(|(pair, _)| PerSensor::from_fn(|sensor| self.orders[*pair.get(sensor)]))
            .collect();
        as_likely.sort_by_key(|orders| {
            let changed = Sensor::ALL.map(|sensor| orders.get(sensor).changed());
            let triads = changed.iter().filter(|&&changed| changed > 0).count();
            (triads, changed[0] + changed[1])
        });
        let mut as_likely = as_likely.into_iter();
        let orders = as_likely.next()?;
        let of_one_triad = |orders: &PerSensor<AxisOrder>| {
            Sensor::ALL
                .iter()
                .any(|&sensor| *orders.get(sensor) == AxisOrder::IDENTITY)
        };
        Some(Found {
            orders,
            others: as_likely.filter(of_one_triad).take(OTHERS).collect(),
            log_ratio,
        })
    }

    /// The logarithm of the likelihood of a pair of orders by each thing that motion is known from.
    fn parts(&self, pair: &PerSensor<usize>) -> Vec<(f64, Bounds)> {
        let each = Sensor::ALL.map(|sensor| {
            let likelihoods = self.each.get(sensor);
            (
                likelihoods.of[*pair.get(sensor)],
                Bounds::of(&[likelihoods]),
            )
        });
        let mut parts = each.to_vec();
        if let Some(together) = &self.together {
            let gyro = self.orders[pair.gyro];
            let reversed = usize::from(!gyro.is_rotation());
            let rotation = if reversed == 1 { gyro.opposite() } else { gyro };
            let seen = rotation.inverse().after(&self.orders[pair.accel]);
            let place = self.orders.iter().position(|&order| order == seen);
            let of = place.map_or(f64::NEG_INFINITY, |place| together[reversed].of[place]);
            parts.push((of, Bounds::of(&[&together[0], &together[1]])));
        }
        parts
    }
}

/// The likelihood of nothing being explained, and the largest there is.
#[derive(Clone, Copy)]
struct Bounds {
    none: f64,
    largest: f64,
}

impl Bounds {
    fn of(likelihoods: &[&Likelihoods]) -> Self {
        let largest = |of: fn(&Likelihoods) -> f64| {
            likelihoods
                .iter()
                .map(|&l| of(l))
                .fold(f64::NEG_INFINITY, f64::max)
        };
        Self {
            none: largest(|likelihoods| likelihoods.none),
            largest: largest(Likelihoods::largest),
        }
    }
}

#[cfg(test)]
mod tests;
