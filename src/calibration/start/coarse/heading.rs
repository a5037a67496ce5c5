//! Headings and gyro biases from the rates at rest.

use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, Vector3};

use crate::attitude::exp;
use crate::calibration::problem::Problem;
use crate::earth::{ROTATION_RATE, Site};
use crate::imu::Sensor;

/// What the gyros say at rest.
pub struct Rest {
    /// Attitude up to a heading common to all of a stretch, body to level.
    pub attitude: Matrix3<f64>,
    /// Corrected rate along body axes, rad/s.
    pub rate: Vector3<f64>,
    /// Variance of the rate per axis.
    pub variance: f64,
}

/// The heading common to all attitudes of a stretch.
#[derive(Debug, Clone, Copy)]
pub struct Heading {
    /// Turn about Up that brings the attitudes to East-North-Up, rad.
    pub turn: Matrix3<f64>,
    /// 1σ of its angle, rad; above one nothing is known of it.
    pub sigma: f64,
}

/// The headings of all stretches, and what the rates are wrong by.
#[derive(Debug, Clone)]
pub struct Gyrocompass {
    pub headings: Vec<Heading>,
    /// Error of the rate along body axes, rad/s.
    pub bias: Vector3<f64>,
}

/// Bias of the gyros within Earth rate: what they put out at rest. From a prior that is off by so much that a move turns
/// into another, no step leads back.
pub fn gyro_bias_at_rest(problem: &Problem) -> Vector3<f64> {
    let mut outputs = Vector3::zeros();
    let mut count = 0.0;
    for stretch in problem.stretches() {
        for dwell in &stretch.dwells {
            outputs += dwell.mean(Sensor::Gyro, stretch.run).output;
            count += 1.0;
        }
    }
    outputs / count
}

/// Fits Earth rate, whose part along Up is known, and a constant along body axes: at rest
/// `C ω = ω_ie + C b`. Attitudes that differ tell one from the other.
/// None where a rate is no number.
pub fn gyrocompass(stretches: &[(Site, Vec<Rest>)]) -> Option<Gyrocompass> {
    // Unknown: b, and for each stretch Earth rate along its two level axes. Before any rate is observed
    // none exceeds Earth rate by much: b is what is left of a bias taken from these very rates.
    let n = 3 + 2 * stretches.len();
    let mut information = DMatrix::<f64>::identity(n, n) / ROTATION_RATE.powi(2);
    let mut vector = DVector::<f64>::zeros(n);
    for (number, (site, rests)) in stretches.iter().enumerate() {
        let first = 3 + 2 * number;
        for rest in rests {
            let mut rows = SMatrix::<f64, 3, 5>::zeros();
            rows.fixed_columns_mut::<3>(0).copy_from(&rest.attitude);
            rows[(0, 3)] = 1.0;
            rows[(1, 4)] = 1.0;
            let up = Vector3::z() * site.earth_rate_n().z;
            let observed = rest.attitude * rest.rate - up;
            // Tilts of a milliradian turn that much of Earth rate.
            let weight = 1.0 / (rest.variance + (1e-3 * ROTATION_RATE).powi(2));
            let of_rest = rows.transpose() * rows * weight;
            let of_vector = rows.transpose() * observed * weight;
            let place = [0, 1, 2, first, first + 1];
            for (i, &row) in place.iter().enumerate() {
                for (j, &column) in place.iter().enumerate() {
                    information[(row, column)] += of_rest[(i, j)];
                }
                vector[row] += of_vector[i];
            }
        }
    }
    let covariance = information.cholesky()?.inverse();
    let found = &covariance * vector;
    let heading = |(number, (site, _)): (usize, &(Site, Vec<Rest>))| {
        let first = 3 + 2 * number;
        let angle = found[first + 1].atan2(found[first]) - std::f64::consts::FRAC_PI_2;
        let level = covariance.fixed_view::<2, 2>(first, first).into_owned();
        Heading {
            turn: exp(Vector3::z() * -angle),
            sigma: level.symmetric_eigenvalues().max().sqrt() / site.earth_rate_n().y.abs(),
        }
    };
    Some(Gyrocompass {
        headings: stretches.iter().enumerate().map(heading).collect(),
        bias: found.fixed_rows::<3>(0).into_owned(),
    })
}
