//! Measurements, one scalar after the other.

use super::super::measurement::{Measurement, ScalarInnovation};
use super::Filter;
use super::operation::Operation;

impl Filter {
    /// Takes in a measurement, one scalar after the other.
    pub fn update(&mut self, measurement: &Measurement) {
        let rows = measurement.rows.iter().zip(&measurement.residual);
        for (row, &z) in rows {
            let mut h = vec![0.0; self.x.len()];
            row.iter().for_each(|&(state, weight)| h[state] = weight);
            self.take_scalar([&h, &[]], z, measurement.variance);
        }
        self.mirror();
    }

    /// Takes in a scalar by what it is of states and of parameters that are tried, in Joseph's form, which
    /// keeps the covariance symmetric and positive whatever the rounding of the gain (Bar-Shalom, Li,
    /// Kirubarajan, *Estimation with Applications to Tracking and Navigation*, Eq. 5.2.3-18). Only the upper
    /// half of the covariance is right after it, and is all that it needs.
    pub(super) fn take_scalar(
        &mut self,
        [row, tried]: [&[f64]; 2],
        z: f64,
        variance_of_noise: f64,
    ) {
        let n = self.x.len();
        let (mut ph, mut gain, mut rest) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        self.times_upper(row, &mut ph);
        let variance = times(row, &ph) + variance_of_noise;
        let scale = 1.0 / variance;
        let scalar = ScalarInnovation {
            innovation: z - times(row, self.x.as_slice()),
            variance,
        };
        for ((x, gain), ph) in self.x.iter_mut().zip(&mut gain).zip(&ph) {
            *gain = ph * scale;
            *x += *gain * scalar.innovation;
        }
        if let Some(sensitivity) = &mut self.sensitivity {
            sensitivity.update([row, tried], &gain, scalar);
        }
        if let Some(tape) = &mut self.tape {
            tape.push(Operation::Taken {
                row: row.to_vec(),
                gain: gain.clone(),
                variance: variance_of_noise,
            });
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
            *rest = 0.5 * (gain * variance_of_noise - *rest);
        }
        let columns = self.p.as_mut_slice().chunks_exact_mut(n);
        for (j, column) in columns.enumerate() {
            add_both(&mut column[..=j], (gain[j], &rest), (rest[j], &gain));
        }
    }

    /// The lower half of the covariance from the upper.
    pub(super) fn mirror(&mut self) {
        self.p.fill_lower_triangle_with_upper_triangle();
    }

    /// `P hᵀ` from the upper half of P.
    fn times_upper(&self, h: &[f64], product: &mut [f64]) {
        let n = self.x.len();
        product.fill(0.0);
        for (j, column) in self.p.as_slice().chunks_exact(n).enumerate() {
            let mut sum = h[j] * column[j];
            for ((product, p), h_k) in product[..j].iter_mut().zip(column).zip(h) {
                *product += h[j] * p;
                sum += h_k * p;
            }
            product[j] += sum;
        }
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
pub(super) fn times(h: &[f64], v: &[f64]) -> f64 {
    h.iter().zip(v).map(|(h, v)| h * v).sum()
}
