//! The ellipsoid of the values of a magnetometer, with a symmetric matrix: the convention of most programs, because no
//! value shows a rotation of the axes.

use std::collections::BTreeSet;

use nalgebra::{Matrix3, Vector3};

use super::{Alone, AtRest, USUAL_NOISE};
use crate::calibration::magnetometer::estimate::MagneticMatrix;
use crate::calibration::{MagneticEstimate, MagneticPrior};
use crate::magnetic::MagneticTriad;
use crate::recording::{MagneticMean, Magnetometer};
use crate::statistics::{FALSE_ALARM, chi_square_limit, correlation_factor};

/// Number of equal parts of the sphere.
pub const PARTS: usize = 20;
/// Golden ratio.
const GOLDEN: f64 = 1.618_033_988_749_895;
/// Variance of |u|² in a filled ellipsoid whose u have unit variance along each axis.
const FILLED: f64 = 12.0 / 7.0;
/// Number of constants of an ellipsoid.
const CONSTANTS: f64 = 9.0;
/// Entries of the matrix among the constants of a magnetometer.
const ENTRIES: usize = 9;

/// A magnetometer from its own values.
#[derive(Debug, Clone, PartialEq)]
pub struct Ellipsoid {
    /// The estimate, with a symmetric matrix.
    pub estimate: MagneticEstimate,
    /// RMS of the magnitudes of the corrected values around one.
    pub residual: f64,
    /// Number of values.
    pub count: usize,
    /// Parts of the sphere in which no corrected value lies, out of twenty equal parts: the direction of each.
    pub unseen: Vec<Vector3<f64>>,
    /// Variance of the squared magnitudes of the values, in units of the variance along each axis.
    pub spread: f64,
    contains_zero: bool,
}

/// A magnetometer from its own values alone, whatever the motion: each span of the log is one value. The noise is that
/// of the residuals with their correlation. `None` if the values do not cover the sphere.
pub fn ellipsoid(log: &Magnetometer) -> Option<Ellipsoid> {
    let prior = MagneticPrior::of_log(log);
    let rest = |(_, value): (f64, Vector3<f64>)| AtRest {
        mean: MagneticMean {
            output: value / log.nominal,
            sigma: Vector3::repeat(USUAL_NOISE),
        },
        up: None,
    };
    let rests: Vec<AtRest> = log.values().map(rest).collect();
    let Alone { estimate, squares } = Alone::new(&rests, &prior)?;
    let mut estimate = symmetric(estimate);
    let birge = squares.0 / squares.1;
    let MagneticTriad { matrix, bias, .. } = estimate.triad;
    let inverse = matrix.try_inverse()?;
    let fields = rests.iter().map(|of| inverse * (of.mean.output - bias));
    let fields: Vec<Vector3<f64>> = fields.collect();
    let residuals: Vec<f64> = fields.iter().map(|field| field.norm() - 1.0).collect();
    estimate.covariance *= birge / birge.max(1.0) * correlation(&residuals);
    // No value shows the direction of the field at the site.
    estimate.triad.angles = prior.angles();
    for k in ENTRIES + 3..prior.sigma.len() {
        estimate.covariance[(k, k)] = prior.sigma[k].powi(2);
    }
    let count = fields.len();
    let mean =
        |of: &dyn Fn(&Vector3<f64>) -> f64| fields.iter().map(of).sum::<f64>() / count as f64;
    let square = mean(&|field| field.norm_squared());
    let all = parts();
    let nearest = |field: &Vector3<f64>| {
        (0..all.len()).max_by(|&a, &b| all[a].dot(field).total_cmp(&all[b].dot(field)))
    };
    let seen: BTreeSet<usize> = fields.iter().filter_map(nearest).collect();
    let unseen = (0..all.len()).filter(|part| !seen.contains(part));
    Some(Ellipsoid {
        residual: mean(&|field| (field.norm() - 1.0).powi(2)).sqrt(),
        unseen: unseen.map(|part| all[part]).collect(),
        spread: mean(&|field| (3.0 * (field.norm_squared() / square - 1.0)).powi(2)),
        contains_zero: (inverse * bias).norm() < 1.0,
        estimate,
        count,
    })
}

impl Ellipsoid {
    /// Whether the values lie about the surface of an ellipsoid around zero, and do not fill an ellipsoid: χ² with the
    /// false-alarm rate [`FALSE_ALARM`]. Values in one direction have their errors in common, so the test counts
    /// directions.
    pub fn is_surface(&self) -> bool {
        let freedom = (PARTS - self.unseen.len()) as f64 - CONSTANTS;
        self.contains_zero
            && freedom > 0.0
            && freedom * self.spread < FILLED * chi_square_limit(freedom, 1.0 - FALSE_ALARM)
    }
}

/// Directions in the middle of [`PARTS`] equal parts of the sphere: the corners of a dodecahedron.
fn parts() -> [Vector3<f64>; PARTS] {
    std::array::from_fn(|k| {
        let sign = |bit: usize| if k >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let corner = match k {
            0..8 => Vector3::new(sign(0), sign(1), sign(2)),
            _ => {
                let mut corner = Vector3::zeros();
                let axis = (k - 8) / 4;
                corner[(axis + 1) % 3] = sign(0) / GOLDEN;
                corner[(axis + 2) % 3] = sign(1) * GOLDEN;
                corner
            }
        };
        corner.normalize()
    })
}

/// The same ellipsoid with S = (L Lᵀ)^½ in place of L; the change of S solves S dS + dS S = dL Lᵀ + L dLᵀ.
fn symmetric(of: MagneticEstimate) -> MagneticEstimate {
    let lower = of.triad.matrix;
    let eigen = (lower * lower.transpose()).symmetric_eigen();
    let (roots, turn) = (eigen.eigenvalues.map(f64::sqrt), eigen.eigenvectors);
    let mut by_lower = MagneticMatrix::identity();
    for k in 0..ENTRIES {
        let mut change = Matrix3::zeros();
        change.set_row(k / 3, &lower.column(k % 3).transpose());
        let change = turn.transpose() * (change + change.transpose()) * turn;
        let change = Matrix3::from_fn(|i, j| change[(i, j)] / (roots[i] + roots[j]));
        let change = turn * change * turn.transpose();
        for row in 0..ENTRIES {
            by_lower[(row, k)] = change[(row / 3, row % 3)];
        }
    }
    let matrix = turn * Matrix3::from_diagonal(&roots) * turn.transpose();
    MagneticEstimate {
        triad: MagneticTriad { matrix, ..of.triad },
        covariance: by_lower * of.covariance * by_lower.transpose(),
        ..of
    }
}

/// Factor by which the correlation of successive residuals increases the variance of what they determine.
fn correlation(residuals: &[f64]) -> f64 {
    let product = |lag: usize| {
        residuals
            .iter()
            .zip(&residuals[lag..])
            .map(|(a, b)| a * b)
            .sum::<f64>()
    };
    let lags = 1..residuals.len() / 4;
    correlation_factor(lags.map(|lag| product(lag) / product(0)), residuals.len())
}
