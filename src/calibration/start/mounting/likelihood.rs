//! Likelihood of each axis order of a triad, given the motion of a recording.
//!
//! All vectors are in the axes of the columns. An axis order rotates the known quantities and not the measurements, so
//! the errors of the triads have the same meaning for every order.

use nalgebra::{Matrix3, Vector1, Vector3};

use super::motion::{Motion, Move, Sensed, Turned};
use crate::attitude::{log, skew};
use crate::calibration::parameters::{ParameterVector, parameter};
use crate::calibration::start::equations::{Equations, OfTriad, Rows, of, of_sensitivity};
use crate::imu::{AxisOrder, PerSensor, Sensor};

/// Factors by which stated noise and prior may be too small. All factors are equally likely, so neither an inaccurate
/// prior nor non-white motion favours a wrong axis order.
#[derive(Debug, Clone, Copy)]
pub struct TooSmall {
    pub noise: &'static [f64],
    pub prior: &'static [f64],
}

const FACTORS: [f64; 7] = [1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0];

impl TooSmall {
    /// Noise and prior may be too small by any factor.
    pub const ANY: Self = Self {
        noise: &FACTORS,
        prior: &FACTORS,
    };

    /// The noise may be too small by a factor of up to ten, the prior by a factor of up to three.
    pub const CARELESS: Self = Self {
        noise: FACTORS.split_at(3).0,
        prior: FACTORS.split_at(2).0,
    };
}

/// 1σ of the triad errors, and the factors by which this 1σ may be too small.
#[derive(Debug, Clone)]
pub struct Errors {
    pub sigma: ParameterVector,
    pub too_small: TooSmall,
}

/// Log-likelihood of each order, and of the hypothesis that no order fits.
#[derive(Debug, Clone)]
pub struct Likelihoods {
    pub of: Vec<f64>,
    pub none: f64,
}

impl Likelihoods {
    /// Likelihood of the residuals of these rows, with the errors of the triads integrated out with this prior.
    fn new(
        errors: &Errors,
        orders: &[AxisOrder],
        rows: impl Fn(&mut Equations, &AxisOrder),
    ) -> Self {
        let mut none = f64::NEG_INFINITY;
        let of = orders.iter().map(|order| {
            let mut equations = Equations::new(&ParameterVector::zeros(), &errors.sigma);
            rows(&mut equations, order);
            none = none.max(log_likelihood_of_none(&equations));
            log_likelihood(&equations, errors.too_small)
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

/// Likelihoods with a table. The table gives gravity and turns, so each triad is tested separately.
pub fn by_table(
    motion: &Motion,
    errors: &Errors,
    position_sigma: f64,
    orders: &[AxisOrder],
) -> PerSensor<Likelihoods> {
    PerSensor::from_fn(|sensor| {
        Likelihoods::new(errors, orders, |equations, order| {
            for of in motion.moves.iter().filter(|_| sensor == Sensor::Gyro) {
                add_turn(equations, of, order);
            }
            let is_told = sensor == Sensor::Accel || motion.upward.is_some();
            for rest in motion.rests.iter().filter(|_| is_told) {
                let mut sensed = rest.get(sensor).clone();
                sensed.variance += position_sigma.powi(2);
                add_sensed(equations, sensor, &sensed, order, 1.0);
            }
        })
    })
}

/// Likelihoods with labels. The labels state the upward axis and the turn axis, so each triad is tested separately.
pub fn by_labels(motion: &Motion, errors: &Errors, orders: &[AxisOrder]) -> PerSensor<Likelihoods> {
    PerSensor::from_fn(|sensor| {
        Likelihoods::new(errors, orders, |equations, order| {
            // Angles are from gyros whose zero is the output at rest.
            let zero = f64::from(u8::from(sensor == Sensor::Accel));
            for (_, sensed) in motion.labels.iter().filter(|(of, _)| *of == sensor) {
                add_sensed(equations, sensor, sensed, order, zero);
            }
        })
    })
}

/// Likelihoods without table and labels: the gravity direction rotates as sensed by the gyros, and the vertical Earth
/// rate follows from the latitude, so one triad is tested against the other. Returns the likelihood of each
/// accelerometer order relative to the gyro axes, with the gyros unchanged and with all of them reversed.
pub fn by_gravity(motion: &Motion, errors: &Errors, orders: &[AxisOrder]) -> [Likelihoods; 2] {
    [0, 1].map(|reversed| {
        Likelihoods::new(errors, orders, |equations, order| {
            for of in &motion.moves {
                if let [before, after] = &motion.rests[of.from..of.from + 2] {
                    let turned = (&of.turns[reversed], of.variance);
                    add_carried(equations, turned, order, [&before.accel, &after.accel]);
                }
            }
            let tilt = |k| errors.sigma[parameter(Sensor::Accel, k)];
            let tilt = tilt(1).hypot(tilt(3));
            for (upward, rest) in motion
                .upward
                .iter()
                .flat_map(|&up| motion.rests.iter().map(move |rest| (up, rest)))
            {
                let sign = [1.0, -1.0][reversed];
                add_earth_rate(equations, upward, rest, (order, sign), tilt);
            }
        })
    })
}

/// `found = (I + δA) u + δD` with the known quantity `u`.
fn add_sensed(
    equations: &mut Equations,
    sensor: Sensor,
    of_triad: &Sensed,
    order: &AxisOrder,
    zero: f64,
) {
    let Some(known) = &of_triad.known else {
        return;
    };
    let input = order.inverse().apply(known);
    let partials = of(sensor, &of_sensitivity(input.push(zero)));
    equations.add(&Rows::new(
        partials,
        of_triad.found - input,
        of_triad.variance,
    ));
}

/// A turn measured by the gyros against a known one.
fn add_turn(equations: &mut Equations, turn: &Move, order: &AxisOrder) {
    let Some(known) = turn.known else {
        return;
    };
    let turned = &turn.turns[usize::from(!order.is_rotation())];
    // An improper order and its opposite have the same effect on a rotation.
    let known = order.matrix().transpose() * known * order.matrix();
    let off = log(&(turned.rotation * known.transpose()));
    let partials = of(Sensor::Gyro, &turned.partials);
    equations.add(&Rows::new(partials, off, turn.variance));
}

/// Up before a move compared with up after it, rotated back by the gyro angles.
fn add_carried(
    equations: &mut Equations,
    (turned, variance): (&Turned, f64),
    order: &AxisOrder,
    [before, after]: [&Sensed; 2],
) {
    let up = |rest: &Sensed| rest.found.try_normalize(f64::MIN_POSITIVE);
    let (Some(up_before), Some(up_after)) = (up(before), up(after)) else {
        return;
    };
    let matrix = order.matrix();
    let carried = turned.rotation * (matrix * up_after);
    // Only the components of a force error across the force change its direction.
    let across = |up: &Vector3<f64>| {
        (Matrix3::identity() - up * up.transpose()) * of_sensitivity(up.push(1.0))
    };
    let of_forces = turned.rotation * matrix * across(&up_after) - matrix * across(&up_before);
    let of_turn = -skew(carried) * turned.partials;
    let partials = of(Sensor::Gyro, &of_turn) + of(Sensor::Accel, &of_forces);
    let variance = variance + before.variance + after.variance;
    equations.add(&Rows::new(partials, carried - matrix * up_before, variance));
}

/// The rate about Up at rest. Its error includes the horizontal Earth rate times the tilt of Up that the accelerometer
/// prior allows.
fn add_earth_rate(
    equations: &mut Equations,
    upward: f64,
    rest: &PerSensor<Sensed>,
    (order, sign): (&AxisOrder, f64),
    tilt: f64,
) {
    let Some(up) = rest.accel.found.try_normalize(f64::MIN_POSITIVE) else {
        return;
    };
    let up = order.apply(&up) * sign;
    let mut partials = OfTriad::<1>::zeros();
    for axis in 0..3 {
        partials[4 * axis + 3] = up[axis];
    }
    let partials = of(Sensor::Gyro, &partials);
    let residual = Vector1::new(up.dot(&rest.gyro.found) - upward);
    let variance = rest.gyro.variance + tilt.powi(2) * (1.0 - upward.powi(2));
    equations.add(&Rows::new(partials, residual, variance));
}

/// Log-likelihood of the residuals, with the unknowns integrated out.
fn log_likelihood(equations: &Equations, too_small: TooSmall) -> f64 {
    if equations.rows.is_empty() {
        return 0.0;
    }
    let (design, residual) = equations.in_sigmas();
    let (information, vector) = (design.tr_mul(&design), design.tr_mul(&residual));
    // Samples of absurd size overflow and give no information.
    if !information.iter().chain(&vector).all(|v| v.is_finite()) {
        return f64::NEG_INFINITY;
    }
    let log_variances: f64 = equations
        .weighted()
        .map(|(_, variance)| variance.ln())
        .sum();
    // One tridiagonal form serves all factors.
    let (basis, diagonal, off_diagonal) = information.symmetric_tridiagonalize().unpack();
    let along = basis.tr_mul(&vector);
    let tridiagonal = (diagonal.as_slice(), off_diagonal.as_slice());
    let mut logarithms = Vec::with_capacity(too_small.noise.len() * too_small.prior.len());
    for noise in too_small.noise {
        for prior in too_small.prior {
            let ratio = (prior / noise).powi(2);
            let (explained, determinant) = explained(tridiagonal, along.as_slice(), ratio);
            let squares = (residual.norm_squared() - explained).max(0.0) / noise.powi(2);
            let noise = log_variances + 2.0 * residual.len() as f64 * noise.ln();
            logarithms.push(-0.5 * (squares + noise + determinant));
        }
    }
    let largest = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = logarithms.iter().map(|l| (l - largest).exp()).sum();
    largest + (sum / logarithms.len() as f64).ln()
}

/// For a tridiagonal T ≥ 0, given by diagonal and off-diagonal, and a vector v: `r vᵀ (I + r T)⁻¹ v` and
/// `ln det(I + r T)`, from the factors L D Lᵀ.
fn explained((diagonal, off_diagonal): (&[f64], &[f64]), v: &[f64], r: f64) -> (f64, f64) {
    let (mut sum, mut log_determinant, mut product) = (0.0, 0.0, 1.0);
    let (mut pivot, mut part) = (1.0, 0.0);
    for (k, (along_diagonal, v)) in diagonal.iter().zip(v).enumerate() {
        let off = if k > 0 { r * off_diagonal[k - 1] } else { 0.0 };
        part = v - off / pivot * part;
        // No pivot is below 1, except by rounding.
        pivot = f64::max(1.0 + r * along_diagonal - off * off / pivot, 1.0);
        sum += part * part / pivot;
        product *= pivot;
        // One logarithm per few factors, before they overflow.
        if k % 4 == 3 || k + 1 == diagonal.len() {
            log_determinant += product.ln();
            product = 1.0;
        }
    }
    (r * sum, log_determinant)
}

/// Likelihood if no measurement is as expected: the residuals are as large as the measurements.
fn log_likelihood_of_none(equations: &Equations) -> f64 {
    let deviance = equations.weighted().map(|(residual, variance)| {
        let any = 1.0 + variance;
        residual.powi(2) / any + any.ln()
    });
    -0.5 * deviance.sum::<f64>()
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    #[test]
    fn the_tridiagonal_form_gives_the_same_as_the_whole_matrix() {
        let design = DMatrix::from_fn(9, 7, |i, j| ((3 * i + 5 * j) as f64).sin() + 0.1 * j as f64);
        let v = DVector::from_fn(7, |k, _| (k as f64).cos());
        let information = design.tr_mul(&design);
        let (basis, diagonal, off) = information.clone().symmetric_tridiagonalize().unpack();
        let along = basis.tr_mul(&v);
        for r in [1e-3, 1.0, 1e3] {
            let whole = DMatrix::identity(7, 7) + &information * r;
            let root = whole.cholesky().unwrap();
            let expected = (
                r * v.dot(&root.solve(&v)),
                2.0 * root.l().diagonal().map(f64::ln).sum(),
            );
            let found = explained((diagonal.as_slice(), off.as_slice()), along.as_slice(), r);
            approx::assert_relative_eq!(found.0, expected.0, max_relative = 1e-9);
            approx::assert_relative_eq!(found.1, expected.1, max_relative = 1e-9);
        }
    }

    #[test]
    fn an_error_beyond_the_prior_is_less_likely_and_one_within_hardly() {
        let prior = ParameterVector::repeat(1e-3);
        let of = |error: f64| {
            let mut equations = Equations::new(&ParameterVector::zeros(), &prior);
            for k in 0..10 {
                let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                let mut partials = OfTriad::<1>::zeros();
                partials[0] = sign;
                let partials = of(Sensor::Gyro, &partials);
                equations.add(&Rows::new(partials, Vector1::new(sign * error), 1e-8));
            }
            log_likelihood(&equations, TooSmall::ANY)
        };
        assert!(of(0.0) - of(1e-3) < 1.0);
        assert!(of(0.0) - of(2.0) > 5.0);
    }
}
