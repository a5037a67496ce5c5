//! What a record's motion is known from, and how likely it makes each order of a triad's axes.
//!
//! All is written along the axes of the columns as they stand: an order turns what is known, not what was
//! measured. So errors of the triads mean the same under each.

use nalgebra::{Matrix3, Vector3};

use super::likelihood::{BIAS, Equations, OF_ACCEL, Row};
use super::motion::{Labelled, Motion, Move, Rest, Turned};
use crate::attitude::{log, skew};
use crate::imu::{AxisOrder, PerSensor, Sensor};

/// Logarithm of the likelihood of each of some orders, and of none of them.
#[derive(Debug, Clone)]
pub struct Likelihoods {
    pub of: Vec<f64>,
    pub none: f64,
}

impl Likelihoods {
    fn new(equations: impl Iterator<Item = Equations>) -> Self {
        let mut none = f64::NEG_INFINITY;
        let of = equations.map(|equations| {
            none = none.max(equations.log_likelihood_of_none());
            equations.log_likelihood()
        });
        Self {
            of: of.collect(),
            none,
        }
    }

    pub fn largest(&self) -> f64 {
        self.of.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }
}

/// The table holds gravity and turns: each triad by itself against it.
pub fn by_table(
    motion: &Motion,
    prior_sigma: &Row,
    position_sigma: f64,
    orders: &[AxisOrder],
) -> PerSensor<Likelihoods> {
    PerSensor::from_fn(|sensor| {
        Likelihoods::new(orders.iter().map(|order| {
            let mut equations = Equations::new(prior_sigma);
            let moves = motion.moves.iter().filter(|_| sensor == Sensor::Gyro);
            for of in moves {
                if let Some(known) = &of.known {
                    add_turn(&mut equations, of, order, known);
                }
            }
            for rest in &motion.rests {
                if let Some(known) = &rest.known {
                    let (found, variance) = rest.sensed(sensor);
                    let variance = variance + position_sigma.powi(2);
                    let known = known.get(sensor);
                    add_direct(&mut equations, sensor, found, order, known, variance);
                }
            }
            equations
        }))
    })
}

/// Labels say which axis is up and about which it turns: each triad by itself against them.
pub fn by_labels(
    motion: &Motion,
    prior_sigma: &Row,
    orders: &[AxisOrder],
) -> PerSensor<Likelihoods> {
    PerSensor::from_fn(|sensor| {
        Likelihoods::new(orders.iter().map(|order| {
            let mut equations = Equations::new(prior_sigma);
            for Labelled {
                found,
                said,
                variance,
                ..
            } in motion.labels.iter().filter(|label| label.sensor == sensor)
            {
                match sensor {
                    Sensor::Gyro => add_angle(&mut equations, found, order, said, *variance),
                    Sensor::Accel => {
                        add_direct(&mut equations, sensor, found, order, said, *variance);
                    }
                }
            }
            equations
        }))
    })
}

/// Gravity's direction turns against the body as the gyros turn it, and Earth turns upward as the latitude
/// says: one triad against the other. By the accelerometers' order as the gyros' axes see it, with the gyros
/// as they are and with all of them reversed.
pub fn by_gravity(motion: &Motion, prior_sigma: &Row, orders: &[AxisOrder]) -> [Likelihoods; 2] {
    [0, 1].map(|reversed| {
        Likelihoods::new(orders.iter().map(|order| {
            let mut equations = Equations::new(prior_sigma);
            for of in &motion.moves {
                let pair = (motion.rests.get(of.from), motion.rests.get(of.from + 1));
                if let (Some(before), Some(after)) = pair {
                    add_carried(
                        &mut equations,
                        of,
                        &of.turns[reversed],
                        order,
                        before,
                        after,
                    );
                }
            }
            let sign = [1.0, -1.0][reversed];
            for rest in &motion.rests {
                add_earth_rate(&mut equations, motion.upward, rest, order, sign);
            }
            equations
        }))
    })
}

fn first(sensor: Sensor) -> usize {
    match sensor {
        Sensor::Gyro => 0,
        Sensor::Accel => OF_ACCEL,
    }
}

/// `found = (I + δA) u + δD` with what is known as `u`.
fn add_direct(
    equations: &mut Equations,
    sensor: Sensor,
    found: &Vector3<f64>,
    order: &AxisOrder,
    known: &Vector3<f64>,
    variance: f64,
) {
    let input = order.inverse().apply(known);
    for axis in 0..3 {
        let mut row = Row::zeros();
        let of = first(sensor);
        row.fixed_rows_mut::<3>(of + 3 * axis).copy_from(&input);
        row[of + BIAS + axis] = 1.0;
        equations.add(&row, found[axis] - input[axis], variance);
    }
}

/// The same of an angle about a known axis, the gyros' zero being that at rest.
fn add_angle(
    equations: &mut Equations,
    found: &Vector3<f64>,
    order: &AxisOrder,
    known: &Vector3<f64>,
    variance: f64,
) {
    let input = order.inverse().apply(known);
    for axis in 0..3 {
        let mut row = Row::zeros();
        row.fixed_rows_mut::<3>(3 * axis).copy_from(&input);
        equations.add(&row, found[axis] - input[axis], variance);
    }
}

/// A turn by the gyros against one that is known, `C` from the axes after to those before.
fn add_turn(equations: &mut Equations, of: &Move, order: &AxisOrder, known: &Matrix3<f64>) {
    let turned = &of.turns[usize::from(!order.is_rotation())];
    let order = order.matrix();
    // An improper order and its opposite turn a rotation alike.
    let known = order.transpose() * known * order;
    let off = log(&(turned.rotation * known.transpose()));
    for axis in 0..3 {
        let mut row = Row::zeros();
        for (component, of_component) in turned.by_output.iter().enumerate() {
            for into in 0..3 {
                row[3 * into + component] = of_component[(axis, into)];
            }
        }
        equations.add(&row, off[axis], of.variance);
    }
}

/// Up before a move against up after it, carried back by the gyros.
fn add_carried(
    equations: &mut Equations,
    of: &Move,
    turned: &Turned,
    order: &AxisOrder,
    before: &Rest,
    after: &Rest,
) {
    let (Some(up_before), Some(up_after)) = (
        before.force.try_normalize(f64::MIN_POSITIVE),
        after.force.try_normalize(f64::MIN_POSITIVE),
    ) else {
        return;
    };
    let matrix = order.matrix();
    let carried = turned.rotation * (matrix * up_after);
    let off = carried - matrix * up_before;
    let variance = of.variance + before.force_variance + after.force_variance;
    let by_turn = -skew(carried);
    // Of the error of a force what is across it turns its direction.
    let across = |up: &Vector3<f64>| Matrix3::identity() - up * up.transpose();
    let by_after = turned.rotation * matrix * across(&up_after);
    let by_before = matrix * across(&up_before);
    for axis in 0..3 {
        let mut row = Row::zeros();
        for component in 0..3 {
            let turned = by_turn * turned.by_output[component];
            for into in 0..3 {
                row[3 * into + component] = turned[(axis, into)];
                row[OF_ACCEL + 3 * into + component] = by_after[(axis, into)] * up_after[component]
                    - by_before[(axis, into)] * up_before[component];
            }
            row[OF_ACCEL + BIAS + component] =
                by_after[(axis, component)] - by_before[(axis, component)];
        }
        equations.add(&row, off[axis], variance);
    }
}

/// The rate about up at rest. Up is off by what the prior allows the accelerometers, and of the level part of
/// Earth rate as much comes in.
fn add_earth_rate(
    equations: &mut Equations,
    upward: f64,
    rest: &Rest,
    order: &AxisOrder,
    sign: f64,
) {
    let Some(up) = rest.force.try_normalize(f64::MIN_POSITIVE) else {
        return;
    };
    let up = order.apply(&up) * sign;
    let mut row = Row::zeros();
    row.fixed_rows_mut::<3>(BIAS).copy_from(&up);
    let tilt = equations
        .prior_sigma(OF_ACCEL + 1)
        .hypot(equations.prior_sigma(OF_ACCEL + BIAS));
    let variance = rest.rate_variance + tilt.powi(2) * (1.0 - upward.powi(2));
    equations.add(&row, up.dot(&rest.rate) - upward, variance);
}
