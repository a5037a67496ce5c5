//! Equations from Earth rate without a table: gyro output at rest, and heading.

use nalgebra::{DMatrix, DVector, Vector3};

use super::equations::{Equations, Rows, of};
use super::gravity::{AtRest, Chain, Heading, ROUNDING, input_errors, of_noise};
use crate::attitude::exp;
use crate::calibration::linearisation::singular;
use crate::calibration::noise::BY_HAND;
use crate::calibration::problem::Stretch;
use crate::calibration::{CalibrationError, Model, Source};
use crate::earth::ROTATION_RATE;
use crate::imu::{PerSensor, Sensor, Triad};

/// The gyro bias, accurate to Earth rate, from the mean output at rest. If the prior were so wrong that one move was
/// mistaken for another, the iterations could not recover.
pub fn gyro_bias_at_rest(dwells: &[Vec<AtRest>]) -> Vector3<f64> {
    let dwells = || dwells.iter().flatten();
    let outputs: Vector3<f64> = dwells().map(|dwell| dwell.mean.gyro.output).sum();
    outputs / dwells().count() as f64
}

/// Fits Earth rate, whose Up component is known, and a constant b along the body axes; at rest, `C ω = ω_ie + C b`.
/// Different attitudes separate the bias from Earth rate. Returns the headings of all stretches and b, rad/s, or an
/// error if a rate is not a number.
pub fn gyrocompass(
    model: &Model,
    stretches: &[Stretch],
    dwells: &[Vec<AtRest>],
    chains: &[Chain],
    triads: &PerSensor<Triad>,
) -> Result<(Vec<Heading>, Vector3<f64>), CalibrationError> {
    let triad = &triads.gyro;
    let correction = triad.correction().ok_or_else(|| singular(triads))?;
    // Unknown: b, and for each stretch Earth rate along its two level axes. The prior of each is about Earth rate,
    // because b is the remainder of a bias taken from these same rates.
    let n = 3 + 2 * stretches.len();
    let first = |stretch: usize| 3 + 2 * stretch;
    let mut information = DMatrix::<f64>::identity(n, n) / ROTATION_RATE.powi(2);
    let mut vector = DVector::<f64>::zeros(n);
    for (stretch, (of_stretch, dwells)) in stretches.iter().zip(dwells).enumerate() {
        let up = Vector3::z() * of_stretch.run.site.earth_rate_n().z;
        for (attitude, dwell) in chains[stretch].attitudes.iter().zip(dwells) {
            let rate = correction * (dwell.mean.gyro.output - triad.bias);
            let mut rows = DMatrix::zeros(3, n);
            rows.fixed_columns_mut::<3>(0).copy_from(attitude);
            rows[(0, first(stretch))] = 1.0;
            rows[(1, first(stretch) + 1)] = 1.0;
            // A tilt of one milliradian turns this part of Earth rate.
            let by_tilt = (1e-3 * ROTATION_RATE).powi(2);
            let turning = model.turning_at_rest.powi(2) / dwell.duration();
            let weight = 1.0 / (dwell.mean.gyro.variance + turning + by_tilt);
            vector += rows.tr_mul(&(attitude * rate - up)) * weight;
            information += rows.tr_mul(&rows) * weight;
        }
    }
    let covariance = information
        .cholesky()
        .ok_or_else(|| singular(triads))?
        .inverse();
    let found = &covariance * vector;
    let heading = |(stretch, of_stretch): (usize, &Stretch)| {
        let first = first(stretch);
        let (east, north) = (found[first], found[first + 1]);
        // If the result is only rounding, as for a single dwell, the heading remains unchanged.
        let angle = if east.hypot(north) > ROUNDING * ROTATION_RATE {
            north.atan2(east) - std::f64::consts::FRAC_PI_2
        } else {
            0.0
        };
        let level = covariance.fixed_view::<2, 2>(first, first).into_owned();
        let level = level.symmetric_eigenvalues().max().sqrt();
        Heading {
            stretch,
            turn: exp(Vector3::z() * -angle),
            sigma: level / of_stretch.run.site.earth_rate_n().y.abs(),
        }
    };
    let headings = stretches.iter().enumerate().map(heading).collect();
    Ok((headings, found.fixed_rows::<3>(0).into_owned()))
}

/// Adds the rates in the dwells of a stretch, with its attitudes rotated to its heading.
pub fn add_rates(
    equations: &mut Equations,
    model: &Model,
    (stretch, dwells): (&Stretch, &[AtRest]),
    chain: &Chain,
    triads: &PerSensor<Triad>,
    heading: &Heading,
) -> Result<(), CalibrationError> {
    let triad = &triads.gyro;
    let correction = triad.correction().ok_or_else(|| singular(triads))?;
    let earth_rate = stretch.run.site.earth_rate_n();
    // Change of Earth rate per radian of heading error.
    let turned = Vector3::z().cross(&earth_rate);
    let of_heading = (ROTATION_RATE * heading.known()).powi(2);
    for (attitude, dwell) in chain.attitudes.iter().zip(dwells) {
        let attitude = heading.turn * attitude;
        let rate = correction * (dwell.mean.gyro.output - triad.bias);
        let partials = input_errors(triad, &correction, &rate);
        let by_turning = 1.0 / dwell.duration();
        let own = model.turning_at_rest.powi(2) * by_turning + ROUNDING.powi(2);
        let residual = rate - attitude.tr_mul(&earth_rate);
        equations.add(&Rows {
            event: dwell.event(),
            weighted: Vector3::repeat(dwell.mean.gyro.variance + own + of_heading),
            common: vec![
                of_noise(Sensor::Gyro, dwell.event(), &partials),
                heading.error(&attitude.tr_mul(&turned)),
            ],
            by_hand: BY_HAND.map(|source| match source {
                Source::RotationAtRest => by_turning,
                _ => 0.0,
            }),
            ..Rows::new(of(Sensor::Gyro, &partials), residual, own)
        });
    }
    Ok(())
}
