//! Contribution of the second-order terms of the model to a covariance.
//!
//! A linear filter assumes that `K C` is linear in the parameters. If a path leaves some parameters at their prior σ,
//! the squares and products of the errors of these parameters affect the parameters that the path determines: two
//! angles of 200″ shorten a row of the general form by 1 ppm, while a few turns determine its scale factor to 0.3 ppm.
//! For errors of the order of arc seconds, these terms are negligible.

use nalgebra::{Matrix3, Vector3};

use crate::calibration::{ParameterMatrix, parameter};
use crate::imu::{PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad, TriadVector};

/// Step of the second differences; the third derivatives of the sensitivity matrix are at most of order one.
const STEP: f64 = 1e-3;

/// Mean squares of the second-order terms in the errors of the three parameters of each row, for errors with this
/// covariance; they are added to the covariance (Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking
/// and Navigation*, §10.3.2).
pub fn curvature(triads: &PerSensor<Triad>, covariance: &ParameterMatrix) -> ParameterMatrix {
    let mut added = ParameterMatrix::zeros();
    for sensor in Sensor::ALL {
        let triad = triads.get(sensor);
        let response = triad.response();
        for row in 0..3 {
            let input = |p: usize| response[p].fixed_view::<1, 3>(row, 0).transpose();
            let of_row: Vec<usize> = (0..PER_TRIAD).filter(|&p| input(p).amax() > 0.0).collect();
            let &[a, b, c] = &of_row[..] else { continue };
            let own = [a, b, c];
            let Some(back) = Matrix3::from_columns(&own.map(input)).try_inverse() else {
                continue;
            };
            let index = own.map(|p| parameter(sensor, p));
            let p = Matrix3::from_fn(|i, j| covariance[(index[i], index[j])]);
            let scaled = hessians(triad, row, own).map(|hessian| hessian * p);
            let squares = Matrix3::from_fn(|m, n| {
                0.5 * (scaled[m] * scaled[n]).trace() + 0.25 * scaled[m].trace() * scaled[n].trace()
            });
            let squares = back * squares * back.transpose();
            for (i, &to) in index.iter().enumerate() {
                for (j, &from) in index.iter().enumerate() {
                    if p[(i, i)] > 0.0 && p[(j, j)] > 0.0 {
                        added[(to, from)] += squares[(i, j)];
                    }
                }
            }
        }
    }
    added
}

/// Second derivatives of the entries of a row of `K C` with respect to three parameters.
fn hessians(triad: &Triad, row: usize, own: [usize; 3]) -> [Matrix3<f64>; 3] {
    let entries = |first: (usize, f64), second: (usize, f64)| -> Vector3<f64> {
        let mut v: TriadVector = triad.to_vector();
        v[own[first.0]] += first.1;
        v[own[second.0]] += second.1;
        let shifted = Triad::from_vector(triad.form, &v);
        shifted.sensitivity().row(row).transpose()
    };
    let mut hessians = [Matrix3::zeros(); 3];
    for i in 0..3 {
        for j in 0..3 {
            let at = |first: f64, second: f64| entries((i, first * STEP), (j, second * STEP));
            let second = (at(1.0, 1.0) - at(1.0, -1.0) - at(-1.0, 1.0) + at(-1.0, -1.0))
                / (4.0 * STEP * STEP);
            for (hessian, second) in hessians.iter_mut().zip(&second) {
                hessian[(i, j)] = *second;
            }
        }
    }
    hessians
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imu::InstallationForm;
    use approx::assert_relative_eq;

    #[test]
    fn unknown_angles_of_a_unit_row_are_in_its_scale_factor_by_their_squares() {
        let triads = PerSensor::from_fn(|_| Triad::ideal(InstallationForm::General));
        let mut covariance = ParameterMatrix::zeros();
        let sigma = 1e-3f64;
        // The two angles of gyro z: (a² + b²)/2 has the mean σ² and the variance σ⁴.
        for p in [0, 1, 2, 7, 8] {
            let wide = p > 2;
            covariance[(p, p)] = if wide { sigma.powi(2) } else { 1e-16 };
        }
        let added = curvature(&triads, &covariance);
        assert_relative_eq!(added[(2, 2)], 2.0 * sigma.powi(4), max_relative = 1e-3);
        assert!(added[(0, 0)] < 1e-20 && added[(7, 7)] < 1e-20);
    }

    #[test]
    fn arc_seconds_have_no_curvature() {
        let triads = PerSensor::from_fn(|_| Triad::ideal(InstallationForm::General));
        let covariance = ParameterMatrix::identity() * 1e-12;
        let added = curvature(&triads, &covariance);
        assert!(added.amax() < 1e-20);
    }
}
