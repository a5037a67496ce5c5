//! Heading and gyro biases from the rates at rest.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::attitude::exp;
use crate::earth::{ROTATION_RATE, Site};

/// What the gyros say at rest.
pub(super) struct Rest {
    /// Attitude up to a heading common to all, body to level.
    pub attitude: Matrix3<f64>,
    /// Corrected rate along body axes, rad/s.
    pub rate: Vector3<f64>,
    /// Variance of the rate per axis.
    pub variance: f64,
}

/// The heading common to all attitudes, and what the rates are wrong by.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gyrocompass {
    /// Turn about Up that brings the attitudes to East-North-Up, rad.
    pub turn: Matrix3<f64>,
    /// 1σ of its angle, rad; above one nothing is known of it.
    pub sigma: f64,
    /// Error of the rate along body axes, rad/s.
    pub bias: Vector3<f64>,
}

/// Fits Earth rate, whose part along Up is known, and a constant along body axes: at rest
/// `C ω = ω_ie + C b`. Attitudes that differ tell one from the other.
pub(super) fn gyrocompass(rests: &[Rest], site: &Site) -> Gyrocompass {
    let earth_rate = site.earth_rate_n();
    // Unknown: Earth rate along the two level axes, and b. Before any rate is seen neither exceeds
    // Earth rate by much: b is what is left of a bias taken from these very rates.
    let mut information = SMatrix::<f64, 5, 5>::identity() / ROTATION_RATE.powi(2);
    let mut vector = SVector::<f64, 5>::zeros();
    for rest in rests {
        let mut rows = SMatrix::<f64, 3, 5>::zeros();
        rows[(0, 0)] = 1.0;
        rows[(1, 1)] = 1.0;
        rows.fixed_columns_mut::<3>(2).copy_from(&rest.attitude);
        let seen = rest.attitude * rest.rate - Vector3::z() * earth_rate.z;
        // Tilts of a milliradian turn that much of Earth rate.
        let weight = 1.0 / (rest.variance + (1e-3 * ROTATION_RATE).powi(2));
        information += rows.transpose() * rows * weight;
        vector += rows.transpose() * seen * weight;
    }
    // Positive definite by its first summand.
    let covariance = information.try_inverse().unwrap_or_default();
    let found = covariance * vector;
    let angle = found[1].atan2(found[0]) - std::f64::consts::FRAC_PI_2;
    let level = covariance.fixed_view::<2, 2>(0, 0).into_owned();
    Gyrocompass {
        turn: exp(Vector3::z() * -angle),
        sigma: level.symmetric_eigenvalues().max().sqrt() / earth_rate.y.abs(),
        bias: found.fixed_rows::<3>(2).into_owned(),
    }
}
