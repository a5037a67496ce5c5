//! A magnetometer without gyros: from the magnitude of the field and, with accelerometers, its angle to gravity at rest.
//!
//! In each dwell the field has an unknown direction. With gravity, only its rotation about the vertical is unknown,
//! because all dwells have one inclination; without gravity, the matrix is lower triangular by convention.

mod at_rest;
mod ellipsoid;
mod rows;
mod start;

use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use super::{MagneticEstimate, MagneticPrior};
use crate::calibration::constants::inverse;
use crate::magnetic::{MAGNETIC, MagneticTriad, MagneticVector};
pub use at_rest::{AtRest, Up};
pub use ellipsoid::{Ellipsoid, PARTS, ellipsoid};
use rows::Rows;

/// Maximum number of iterations.
const STEPS: usize = 50;
/// A smaller step, in σ, ends the iterations.
const SETTLED: f64 = 0.01;
/// Usual 1σ of a value, T, before the residuals show it.
const USUAL_NOISE: f64 = 1e-7;
/// 1σ of the inclination, rad, below which its sign is known.
const HEMISPHERE: f64 = 0.5;
/// Constants that are estimated with gravity: all but the declination; and without: six of the matrix, and the bias.
const WITH_GRAVITY: [usize; 13] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 13];
const WITHOUT: [usize; 9] = [0, 3, 4, 6, 7, 8, 9, 10, 11];

/// A magnetometer from means at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Alone {
    /// The estimate; its σ are multiplied by the Birge ratio if it exceeds one.
    pub estimate: MagneticEstimate,
    /// Sum of squared normalised residuals, and its degrees of freedom.
    pub squares: (f64, f64),
}

impl Alone {
    /// The magnetometer, from an ellipsoid and Gauss–Newton steps; `None` if the means do not determine it.
    pub fn new(rests: &[AtRest], prior: &MagneticPrior) -> Option<Self> {
        let with_gravity = rests.iter().all(|rest| rest.up.is_some());
        let free: &[usize] = if with_gravity {
            &WITH_GRAVITY
        } else {
            &WITHOUT
        };
        let mut triad = start::ellipsoid(rests, with_gravity)?;
        triad.angles.x = prior.angles().x;
        // A field and a matrix of opposite signs explain the same output.
        if prior.sigma[MAGNETIC - 1] < HEMISPHERE && prior.angles().y * triad.angles.y < 0.0 {
            triad.matrix = -triad.matrix;
            triad.angles.y = -triad.angles.y;
        }
        for _ in 0..STEPS {
            let Solved {
                step,
                covariance,
                squares,
            } = solved(rests, &triad, (prior, free))?;
            triad = MagneticTriad::from_vector(&(triad.vector() + step));
            let sigma = covariance.diagonal().map(f64::sqrt);
            let moved = free.iter().map(|&k| (step[k] / sigma[k]).abs());
            if moved.fold(0.0, f64::max) < SETTLED {
                let birge = (squares.0 / squares.1).max(1.0);
                let estimate = MagneticEstimate {
                    triad,
                    magnitude: prior.magnitude,
                    covariance: covariance * birge,
                    cross: SMatrix::zeros(),
                };
                return Some(Self { estimate, squares });
            }
        }
        None
    }
}

/// A Gauss–Newton step.
struct Solved {
    step: MagneticVector,
    covariance: SMatrix<f64, MAGNETIC, MAGNETIC>,
    squares: (f64, f64),
}

fn solved(
    rests: &[AtRest],
    triad: &MagneticTriad,
    (prior, free): (&MagneticPrior, &[usize]),
) -> Option<Solved> {
    let commons = rests
        .first()?
        .up
        .as_ref()
        .map_or(0, |up| up.by_common.ncols());
    let n = free.len() + commons;
    let (mut normal, mut right) = (DMatrix::identity(n, n), DVector::zeros(n));
    let now = triad.vector();
    for (place, &k) in free.iter().enumerate() {
        let weight = prior.sigma[k].powi(-2);
        normal[(place, place)] = weight;
        right[place] = weight * (prior.mean[k] - now[k]);
    }
    let (mut squares, mut count) = (0.0, 0);
    for rest in rests {
        let rows = Rows::new(rest, triad, commons)?;
        let places = free.iter().copied().chain(MAGNETIC..MAGNETIC + commons);
        let columns = rows
            .columns
            .select_columns(places.collect::<Vec<_>>().iter());
        normal += columns.tr_mul(&columns);
        right += columns.tr_mul(&rows.values);
        squares += rows.values.norm_squared();
        count += rows.freedom;
    }
    let (of_all, _) = inverse(&normal)?;
    let solution = &of_all * &right;
    let mut step = SVector::zeros();
    let mut covariance = SMatrix::zeros();
    for (place, &k) in free.iter().enumerate() {
        step[k] = solution[place];
        for (other, &j) in free.iter().enumerate() {
            covariance[(k, j)] = of_all[(place, other)];
        }
    }
    Some(Solved {
        step,
        covariance,
        squares: (squares, (count as f64 - free.len() as f64).max(1.0)),
    })
}
