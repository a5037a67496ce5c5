//! Measurements, one scalar after the other.

use nalgebra::{Matrix3, Vector3};

use super::super::measurement::{Measurement, ScalarInnovation};
use super::Filter;

impl Filter {
    /// The innovation in units of its own σ, its components independent: `L⁻¹ (z − H x)` with
    /// `L Lᵀ = H P Hᵀ + R`; and the logarithm of the determinant of that. `None` if it is not positive
    /// definite.
    pub fn whitened(&self, measurement: &Measurement) -> Option<(Vector3<f64>, f64)> {
        let Measurement { residual, rows, .. } = measurement;
        let mut s = Matrix3::from_diagonal_element(measurement.variance);
        for (column, of_column) in rows.iter().enumerate() {
            let ph = self.times_covariance(of_column);
            for (row, of_row) in rows.iter().enumerate() {
                s[(row, column)] += times(of_row, &ph);
            }
        }
        let predicted = Vector3::from_fn(|row, _| times(&rows[row], self.x.as_slice()));
        let l = s.cholesky()?.l();
        let log_determinant = 2.0 * l.diagonal().map(f64::ln).sum();
        Some((
            l.solve_lower_triangular(&(residual - predicted))?,
            log_determinant,
        ))
    }

    /// Takes in a measurement, one scalar after the other, in Joseph's form, which keeps the covariance
    /// symmetric and positive whatever the rounding of the gain (Bar-Shalom, Li, Kirubarajan,
    /// *Estimation with Applications to Tracking and Navigation*, Eq. 5.2.3-18).
    ///
    /// The scalar innovations as they came are independent of each other.
    pub fn update(&mut self, measurement: &Measurement) -> [ScalarInnovation; 3] {
        let mut scalars = [ScalarInnovation::default(); 3];
        let n = self.x.len();
        let (mut ph, mut gain, mut rest) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        for (axis, (row, z)) in measurement
            .rows
            .iter()
            .zip(&measurement.residual)
            .enumerate()
        {
            self.times_upper(row, &mut ph);
            let variance = times(row, &ph) + measurement.variance;
            let scale = 1.0 / variance;
            let innovation = z - times(row, self.x.as_slice());
            scalars[axis] = ScalarInnovation {
                innovation,
                variance,
            };
            for ((x, gain), ph) in self.x.iter_mut().zip(&mut gain).zip(&ph) {
                *gain = ph * scale;
                *x += *gain * innovation;
            }
            if let Some(sensitivity) = &mut self.sensitivity {
                let rows = [row.as_slice(), measurement.tried[axis].as_slice()];
                sensitivity.update(rows, &gain, scalars[axis]);
            }
            // (I − K H) P, then (…) (I − K H)ᵀ + K R Kᵀ: both symmetric, so the upper half will do.
            let columns = self.p.as_mut_slice().chunks_exact_mut(n);
            for (j, column) in columns.enumerate() {
                let (column, gain, factor) = (&mut column[..=j], &gain[..=j], ph[j]);
                for k in 0..=j {
                    column[k] -= gain[k] * factor;
                }
            }
            self.times_upper(row, &mut rest);
            for (rest, gain) in rest.iter_mut().zip(&gain) {
                *rest = 0.5 * (gain * measurement.variance - *rest);
            }
            let columns = self.p.as_mut_slice().chunks_exact_mut(n);
            for (j, column) in columns.enumerate() {
                add_both(&mut column[..=j], (gain[j], &rest), (rest[j], &gain));
            }
        }
        for column in 0..n {
            for row in 0..column {
                self.p[(column, row)] = self.p[(row, column)];
            }
        }
        scalars
    }

    /// `P hᵀ` from the upper half of P.
    fn times_upper(&self, h: &[(usize, f64)], product: &mut [f64]) {
        let n = self.x.len();
        let p = self.p.as_slice();
        product.fill(0.0);
        for &(state, weight) in h {
            let (above, below) = product.split_at_mut(state);
            for (sum, p) in above.iter_mut().zip(&p[n * state..]) {
                *sum += weight * p;
            }
            let of_row = p[state..].iter().step_by(n).skip(state);
            for (sum, p) in below.iter_mut().zip(of_row) {
                *sum += weight * p;
            }
        }
    }

    /// `P hᵀ`
    fn times_covariance(&self, h: &[(usize, f64)]) -> Vec<f64> {
        let mut product = vec![0.0; self.x.len()];
        self.times_upper(h, &mut product);
        product
    }
}

/// `column += a x + b y`, each as long as the column at least.
#[inline]
fn add_both(column: &mut [f64], (a, x): (f64, &[f64]), (b, y): (f64, &[f64])) {
    let (x, y) = (&x[..column.len()], &y[..column.len()]);
    for k in 0..column.len() {
        column[k] += a * x[k] + b * y[k];
    }
}

/// `h v`
fn times(h: &[(usize, f64)], v: &[f64]) -> f64 {
    h.iter().map(|&(state, weight)| weight * v[state]).sum()
}
