//! Identification of triads by their values: the gyros predict the rotation of the vector that the accelerometers
//! measure.
//!
//! From one window of rows to the next, the specific force f changes by Δf = −s (w − w₀) × (f − c), where w is the gyro
//! output, w₀ its zero, and c the zero of the accelerometers. Every pair of triads, in every order and with every sign
//! of the gyro axes, is a hypothesis; they are compared by their likelihoods on the same rows.

mod fit;
mod magnetometer;

pub use fit::Triad;
use fit::{Moments, Order};
pub use magnetometer::MagnetometerColumns;
use nalgebra::{Matrix3, Vector3};

use turncal::imu::{Output, PerSensor, Sensor};
use turncal::statistics::{FALSE_ALARM, median};
use turncal::units::STANDARD_GRAVITY;

use super::raw_samples::offset;
use super::turns::GOOD;
use crate::quantity::units;

/// Number of windows compared, those with the largest changes.
const MOST_WINDOWS: usize = 512;
/// A record is divided into at least this many windows.
const FEWEST_WINDOWS: usize = 64;
/// Scatter of the logarithm of the magnitude of a triad, above which it does not measure gravity.
const UNEVEN: f64 = 0.2;
/// cos² of the largest inclination of a field that differs from gravity, 80°.
const NEAR_GRAVITY: f64 = 0.03;
/// Raw accelerometers measure gravity within this factor.
const TOLERANCE: f64 = 1.25;

/// The identified triads, the most likely ones first, and the reasons why they are only a guess.
#[derive(Default)]
pub struct Identified {
    pub triads: PerSensor<Vec<Triad>>,
    pub doubt: Option<Doubt>,
}

/// Reason why triads are only a guess.
#[derive(Debug, Clone, PartialEq)]
pub enum Doubt {
    /// The gyro columns in the order of the accelerometer axes, with their signs.
    Order([(usize, f64); 3]),
    /// Other triads that fit equally well.
    Rival(PerSensor<Triad>),
    /// The log contains no turns with which to compare the triads.
    NoTurns,
}

/// Means over windows.
struct Windows {
    means: Vec<Vec<f64>>,
    /// The windows before the largest changes, and the effective number of turns that they are of.
    moving: Vec<usize>,
    count: f64,
}

/// A pair of triads, with the order of the gyro axes.
struct Hypothesis {
    of: PerSensor<Triad>,
    order: Order,
    /// Logarithm of the likelihood relative to triads that are not related.
    likelihood: f64,
}

pub fn overlap(a: &Triad, b: &Triad) -> bool {
    a.iter().any(|k| b.contains(k))
}

impl Identified {
    /// Identifies the triads among these candidates.
    pub fn find(columns: &[Vec<f64>], candidates: &PerSensor<Vec<Triad>>) -> Self {
        let all = lengths(columns)
            .map(|length| hypotheses(&Windows::new(columns, candidates, length), candidates));
        let all = all.max_by(|a, b| likeliest(a).total_cmp(&likeliest(b)));
        let by_turns = Self::by_turns(columns, &all.unwrap_or_default());
        by_turns.unwrap_or_else(|| Self::by_magnitude(columns, candidates))
    }

    /// The likeliest triads, in the order of the columns unless another is likelier beyond doubt.
    fn by_turns(columns: &[Vec<f64>], all: &[Hypothesis]) -> Option<Self> {
        let limit = FALSE_ALARM.recip().ln();
        let likeliest = |is: &dyn Fn(&&Hypothesis) -> bool| {
            // Of equal ones the first.
            let all = all.iter().rev().filter(is);
            all.max_by(|a, b| a.likelihood.total_cmp(&b.likelihood))
        };
        let best = likeliest(&|_| true).filter(|of| of.likelihood > limit)?;
        let plain = likeliest(&|of| of.order.is_plain());
        let best = plain
            .filter(|of| of.likelihood > limit.max(best.likelihood - limit))
            .unwrap_or(best);
        let same = |a: &Triad, b: &Triad| a == b || are_copies(columns, a, b);
        let with = |sensor: Sensor| {
            let all = all
                .iter()
                .filter(|of| of.order == best.order && of.likelihood > limit);
            let mut triads: Vec<Triad> = all.map(|of| *of.of.get(sensor)).collect();
            triads.sort_unstable();
            triads.dedup();
            triads
        };
        let (mut gyro, mut accel) = (with(Sensor::Gyro), with(Sensor::Accel));
        gyro.retain(|of| same(of, &best.of.gyro));
        // A compass turns as gravity does.
        accel.retain(|of| same(of, &best.of.accel) || !overlap(of, &best.of.accel));
        accel.sort_by_cached_key(|of| !is_gravity(columns, of));
        let is_field = |of: &&Triad| {
            !same(of, &accel[0]) && is_gravity(columns, of) == is_gravity(columns, &accel[0])
        };
        let compass = accel.iter().find(is_field);
        let compass = compass.map(|&accel| PerSensor {
            gyro: gyro[0],
            accel,
        });
        let is_best = |of: &&Hypothesis| of.order == best.order && same(&of.of.accel, &accel[0]);
        let chosen = likeliest(&is_best).unwrap_or(best);
        let is_rival = |of: &&Hypothesis| {
            let is_other = of.order != best.order
                || !same(&of.of.gyro, &gyro[0])
                || !same(&of.of.accel, &accel[0]);
            let is_near = of.likelihood > chosen.likelihood - limit;
            is_near && is_other && (of.of.accel == accel[0] || overlap(&of.of.accel, &accel[0]))
        };
        let rival = all.iter().find(is_rival).map(|of| of.of);
        let order = (!best.order.is_plain()).then(|| Doubt::Order(best.order.of(&gyro[0])));
        let doubt = order.or(rival.or(compass).map(Doubt::Rival));
        Some(Self {
            triads: PerSensor { gyro, accel },
            doubt,
        })
    }

    /// The triads of a record without turns: of accelerometers the magnitude is most constant, of gyros least.
    fn by_magnitude(columns: &[Vec<f64>], candidates: &PerSensor<Vec<Triad>>) -> Self {
        let sorted = |sensor: Sensor| {
            let mut apart: Vec<Triad> = Vec::new();
            for triad in candidates.get(sensor) {
                let is_apart = apart.iter().all(|other| !overlap(triad, other));
                apart.extend(is_apart.then_some(triad));
            }
            apart.sort_by(|a, b| uneven(columns, a).total_cmp(&uneven(columns, b)));
            apart
        };
        let (mut gyro, mut accel) = (sorted(Sensor::Gyro), sorted(Sensor::Accel));
        let is_lone = gyro.len() == 1 && accel == gyro;
        accel.retain(|triad| !is_lone || !is_uneven(columns, triad));
        accel.truncate(1);
        gyro.retain(|triad| accel.iter().all(|accel| !overlap(triad, accel)));
        gyro.reverse();
        let doubt = Some(Doubt::NoTurns);
        Self {
            triads: PerSensor { gyro, accel },
            doubt,
        }
    }
}

/// Lengths of windows that are compared, in rows.
fn lengths(columns: &[Vec<f64>]) -> impl Iterator<Item = usize> {
    let rows = columns.first().map_or(0, Vec::len);
    let all = (0..).map(|power| 1 << power);
    all.take_while(move |length| length * FEWEST_WINDOWS <= rows)
}

fn likeliest(all: &[Hypothesis]) -> f64 {
    let all = all.iter().map(|of| of.likelihood);
    all.fold(f64::NEG_INFINITY, f64::max)
}

/// Whether the last triad turns with the gyros and is not a copy of gravity; the false-alarm rate is that of this many
/// triads with all orders and lengths of windows.
fn turns_as_a_field(columns: &[Vec<f64>], [gyro, accel, field]: [Triad; 3], tried: usize) -> bool {
    let candidates = PerSensor {
        gyro: vec![gyro],
        accel: vec![field],
    };
    let all = lengths(columns).map(|length| {
        let windows = Windows::new(columns, &candidates, length);
        likeliest(&hypotheses(&windows, &candidates))
    });
    let all: Vec<f64> = all.collect();
    let tried = all.len() * Order::all().count() * tried;
    let found = all.into_iter().fold(f64::NEG_INFINITY, f64::max);
    found > (tried as f64 / FALSE_ALARM).ln() && unlike(columns, &field, &accel) > NEAR_GRAVITY
}

/// Fraction of the variance of a triad that is not linear in another triad.
fn unlike(columns: &[Vec<f64>], triad: &Triad, other: &Triad) -> f64 {
    let [own, of_other] = [triad, other].map(|of| of.map(|k| centred(columns[k].clone())));
    let row = |of: &[Vec<f64>; 3], row: usize| Vector3::from([0, 1, 2].map(|k| of[k][row]));
    let (mut square, mut normal, mut product) = (0.0, Matrix3::zeros(), Matrix3::zeros());
    for k in 0..own[0].len() {
        let (value, by) = (row(&own, k), row(&of_other, k));
        if (value + by).sum().is_finite() {
            square += value.norm_squared();
            normal += by * by.transpose();
            product += by * value.transpose();
        }
    }
    let solved = normal.try_inverse().unwrap_or_default() * product;
    1.0 - solved.dot(&product) / square
}

/// Pairs of candidates with all orders of the gyro axes whose turns explain most of the changes.
fn hypotheses(windows: &Windows, candidates: &PerSensor<Vec<Triad>>) -> Vec<Hypothesis> {
    let mut all = Vec::new();
    for &accel in &candidates.accel {
        for &gyro in candidates.gyro.iter().filter(|gyro| !overlap(gyro, &accel)) {
            let moments = Moments::new(&windows.means, &windows.moving, gyro, accel);
            let ratios = |order: Order| Some((order, moments.as_ref()?.ratios(&order)?));
            let shown = Order::all()
                .filter_map(ratios)
                .filter(|(_, ratios)| ratios.of_all < GOOD);
            all.extend(shown.map(|(order, ratios)| Hypothesis {
                of: PerSensor { gyro, accel },
                order,
                likelihood: -0.5 * windows.count * ratios.of_axes.map(f64::ln).iter().sum::<f64>(),
            }));
        }
    }
    all
}

fn magnitudes(columns: &[Vec<f64>], triad: &Triad) -> Vec<f64> {
    let rows = 0..columns.first().map_or(0, Vec::len);
    let samples = rows.map(|row| Vector3::from(triad.map(|k| columns[k][row])));
    let samples: Vec<Vector3<f64>> = samples.filter(|of| of.sum().is_finite()).collect();
    let zero = offset(&samples).unwrap_or(0.0);
    samples
        .iter()
        .map(|of| of.add_scalar(-zero).norm())
        .collect()
}

/// Whether the usual magnitude is that of gravity in a unit of accelerometers.
fn is_gravity(columns: &[Vec<f64>], triad: &Triad) -> bool {
    let Some(size) = median(&mut magnitudes(columns, triad)) else {
        return false;
    };
    let factors = units(Sensor::Accel, Output::Rate)
        .filter_map(|(_, per_si)| Some(size / per_si? / STANDARD_GRAVITY));
    let is_near = |factor: f64| factor < TOLERANCE && factor > TOLERANCE.recip();
    factors.into_iter().any(is_near)
}

/// Standard deviation of the logarithm of the magnitude of a triad.
pub fn uneven(columns: &[Vec<f64>], triad: &Triad) -> f64 {
    let sizes = magnitudes(columns, triad);
    let logarithms: Vec<f64> = sizes
        .iter()
        .map(|size| size.max(f64::MIN_POSITIVE).ln())
        .collect();
    let count = logarithms.len().max(1) as f64;
    let mean = logarithms.iter().sum::<f64>() / count;
    let square = logarithms.iter().map(|of| (of - mean).powi(2)).sum::<f64>();
    (square / count).sqrt()
}

/// Whether a triad does not measure gravity.
pub fn is_uneven(columns: &[Vec<f64>], triad: &Triad) -> bool {
    uneven(columns, triad) >= UNEVEN
}

/// Square of the correlation of two columns.
fn likeness(a: &[f64], b: &[f64]) -> f64 {
    let pairs = || a.iter().zip(b).filter(|(a, b)| (*a + *b).is_finite());
    let count = pairs().count().max(1) as f64;
    let (mean_a, mean_b) =
        pairs().fold((0.0, 0.0), |(x, y), (a, b)| (x + a / count, y + b / count));
    let sum = |of: fn(f64, f64) -> f64| {
        pairs()
            .map(|(a, b)| of(a - mean_a, b - mean_b))
            .sum::<f64>()
    };
    let (aa, ab, bb) = (sum(|a, _| a * a), sum(|a, b| a * b), sum(|_, b| b * b));
    if ab > 0.0 { ab * ab / (aa * bb) } else { 0.0 }
}

/// Whether two triads measure the same, raw and filtered: each axis has more in common with its copy than not.
fn are_copies(columns: &[Vec<f64>], a: &Triad, b: &Triad) -> bool {
    let pairs = a.iter().zip(b);
    !overlap(a, b) && { pairs }.all(|(&a, &b)| likeness(&columns[a], &columns[b]) > 0.5)
}

/// Candidate triads of adjacent columns, except those that extend over two successive copies of a triad.
pub fn consecutive(columns: &[Vec<f64>], places: &[usize]) -> Vec<Triad> {
    let mut all: Vec<Triad> = places.windows(3).map(|of| [of[0], of[1], of[2]]).collect();
    let mut copies: Vec<Triad> = Vec::new();
    for pair in all.windows(4) {
        let is_apart = |other: &Triad| other == &pair[0] || !overlap(other, &pair[0]);
        if copies.iter().all(is_apart) && are_copies(columns, &pair[0], &pair[3]) {
            copies.extend([pair[0], pair[3]]);
        }
    }
    all.retain(|of| copies.iter().all(|copy| copy == of || !overlap(copy, of)));
    all
}

impl Windows {
    fn new(columns: &[Vec<f64>], candidates: &PerSensor<Vec<Triad>>, length: usize) -> Self {
        let mean = |rows: &[f64]| {
            let rows = rows.iter().filter(|value| value.is_finite());
            let (sum, count) =
                rows.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
            sum / count
        };
        let mut used = vec![false; columns.len()];
        let all = candidates.gyro.iter().chain(&candidates.accel);
        all.flatten().for_each(|&k| used[k] = true);
        let means = columns.iter().zip(&used).map(|(column, used)| {
            let windows = column.chunks_exact(length).filter(|_| *used);
            centred(windows.map(mean).collect())
        });
        let means: Vec<Vec<f64>> = means.collect();
        let count = means.iter().map(Vec::len).max().unwrap_or(0);
        let change = |column: &[f64], at: usize| (column[at + 1] - column[at]).powi(2);
        let whole = |column: &Vec<f64>| {
            let changes = (0..column.len().saturating_sub(1)).map(|at| change(column, at));
            changes.filter(|of| of.is_finite()).sum::<f64>()
        };
        let wholes: Vec<f64> = means.iter().map(whole).collect();
        let size = |at: usize| {
            let known = means.iter().zip(&wholes).filter(|(_, whole)| **whole > 0.0);
            let parts = known.map(|(column, whole)| change(column, at) / whole);
            (parts.filter(|part| part.is_finite()).sum::<f64>(), at)
        };
        let mut sizes: Vec<(f64, usize)> = (0..count.saturating_sub(1)).map(size).collect();
        sizes.sort_by(|a, b| b.0.total_cmp(&a.0));
        sizes.truncate(MOST_WINDOWS);
        // Windows of one turn have their errors in common.
        sizes.sort_by_key(|of| of.1);
        let turns = sizes.chunk_by(|one, next| one.1 + 1 == next.1);
        let turns = turns.map(|turn| turn.iter().map(|of| of.0).sum::<f64>());
        let (sum, square) =
            turns.fold((0.0, 0.0), |(sum, square), of| (sum + of, square + of * of));
        Self {
            means,
            moving: sizes.into_iter().map(|of| of.1).collect(),
            count: if square > 0.0 {
                sum * sum / square
            } else {
                0.0
            },
        }
    }
}

/// A column minus its mean.
fn centred(mut column: Vec<f64>) -> Vec<f64> {
    let known = || column.iter().filter(|value| value.is_finite());
    let mean = known().sum::<f64>() / known().count().max(1) as f64;
    column.iter_mut().for_each(|value| *value -= mean);
    column
}
