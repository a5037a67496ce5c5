//! Residuals of a triad's outputs after the best-fit linear triad.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use serde_json::json;

use super::finding::widened_by;
use crate::calibration::{Finding, FindingKind as Kind};
use crate::statistics::{FALSE_ALARM, chi_square_limit};
use crate::units::ARCSEC;

/// Number of triads with tested residuals.
const TRIADS: f64 = 2.0;
/// Directions of unit columns with a remaining length below this are rounding.
const ROUNDING: f64 = 1e-9;

/// Residuals of linear equations, projected orthogonally to their unknowns.
#[derive(Debug, Clone, PartialEq)]
pub struct Residuals {
    /// Errors of the equations, whitened to unit covariance.
    whitened: DVector<f64>,
    /// Orthonormal basis of the space that the unknowns explain.
    explained: DMatrix<f64>,
    /// Columns of the whitening's inverse factor: one for each equation.
    whitening: DMatrix<f64>,
}

/// Improvement by additional unknowns.
#[derive(Debug, Clone, PartialEq)]
pub struct Explained {
    /// Decrease of χ².
    pub fall: f64,
    /// Number of additional unknowns.
    pub degrees: usize,
    /// Their values.
    pub coefficients: Vec<f64>,
}

/// The equations that fit the others worst.
#[derive(Debug, Clone, PartialEq)]
pub struct Worst {
    /// The groups of equations; several if the data cannot distinguish them.
    pub groups: Vec<usize>,
    /// χ² of all others alone.
    pub without: f64,
}

impl Residuals {
    /// Residuals of `errors = design · unknowns + noise` with this covariance of the noise; `None` if it is singular.
    pub fn new(
        design: &DMatrix<f64>,
        errors: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) -> Option<Self> {
        let factor = covariance.clone().cholesky()?.l();
        let mut design = factor.solve_lower_triangular(design)?;
        for mut column in design.column_iter_mut() {
            column.try_normalize_mut(0.0);
        }
        let explained = if design.is_empty() {
            DMatrix::zeros(errors.len(), 0)
        } else {
            // Unlike singular values, which are iterated for, it comes to an end whatever the design is.
            let qr = design.col_piv_qr();
            let r = qr.r();
            let left: Vec<f64> = (0..r.nrows()).map(|k| r[(k, k)].abs()).collect();
            let largest = left.iter().copied().fold(0.0, f64::max);
            let explains = |&k: &usize| left[k] > ROUNDING * largest;
            let columns: Vec<usize> = (0..left.len()).filter(explains).collect();
            qr.q().select_columns(&columns)
        };
        let whitened = factor.solve_lower_triangular(errors)?;
        let whitened = &whitened - &explained * explained.tr_mul(&whitened);
        let count = errors.len();
        let whitening = factor.solve_lower_triangular(&DMatrix::identity(count, count))?;
        Some(Self {
            whitened,
            explained,
            whitening,
        })
    }

    /// Sum of normalised squares.
    pub fn chi_square(&self) -> f64 {
        self.whitened.norm_squared()
    }

    /// Degrees of freedom.
    pub fn degrees(&self) -> usize {
        self.explained.nrows() - self.explained.ncols()
    }

    /// Limit of χ² for correct model and σ, at a triad's share of the false-alarm rate.
    pub fn limit(&self) -> f64 {
        limit(self.degrees())
    }

    /// Whether this χ² would be within its limit with this many equations dropped.
    pub fn would_hold(&self, chi_square: f64, left_out: usize) -> bool {
        let degrees = self.degrees().saturating_sub(left_out);
        degrees > 0 && chi_square <= limit(degrees)
    }

    /// Factor by which all σ have to be widened (Birge ratio); `None` if χ² is within its limit.
    pub fn growth(&self) -> Option<f64> {
        let (chi_square, degrees) = (self.chi_square(), self.degrees());
        (chi_square > self.limit()).then(|| (chi_square / degrees as f64).sqrt())
    }

    /// The group of equations that contradicts the others most: without it, χ² falls most.
    pub fn worst(&self, groups: &[Vec<usize>]) -> Worst {
        let falls: Vec<f64> = groups
            .iter()
            .map(|group| self.falls_without(group))
            .collect();
        let largest = falls.iter().copied().fold(0.0, f64::max);
        let alike = |&k: &usize| largest - falls[k] <= 1e-6 * largest;
        Worst {
            groups: (0..groups.len()).filter(alike).collect(),
            without: self.chi_square() - largest,
        }
    }

    /// The finding on large residuals of `gyro`, `accel` or `both triads`, with the growth of the σ that grew most. The
    /// worst equations are those of dwells or moves at these times, s; an error of the base's level and north of this
    /// σ, rad, may explain all.
    pub fn large(
        &self,
        of: &str,
        growth: f64,
        (worst, without): (Vec<[f64; 2]>, f64),
        base: Option<f64>,
    ) -> Finding {
        let (chi_square, degrees, limit) = (self.chi_square(), self.degrees(), self.limit());
        let times = worst
            .iter()
            .map(|[begin, end]| format!("{begin:.1}–{end:.1} s"));
        let times: Vec<String> = times.collect();
        let cause = match base {
            Some(base) => format!(
                "A table base misaligned from level and north by {:.1}″ (1σ) explains it fully, and σ include this. \
                 State level_sigma_arcsec and north_sigma_arcsec in [turntable].",
                base / ARCSEC
            ),
            None => "Look there for a bump, a wrong label or a wrong attitude. Check the noise figures in \
                [imu.noise], the level and north of the table, the direction of gravity, and whether the sensor was \
                really still."
                .to_owned(),
        };
        let place = match times.len() {
            // Several that are alike, and none of them stands out.
            3.. => "No single interval stands out".to_owned(),
            _ => format!(
                "The worst interval is {}; without it χ² is {without:.0}",
                times.join(" or ")
            ),
        };
        let text = format!(
            "The static fit of {of} is poor (χ² {chi_square:.0} with {degrees} degrees of freedom; limit \
             {limit:.0}). turncal widened σ {}. {place}. {cause}",
            widened_by(growth)
        );
        let figures = json!({
            "of": of, "chi_square": chi_square, "degrees": degrees, "limit": limit, "growth": growth,
            "worst": worst, "without": without, "base": base
        });
        Finding::new(Kind::ResidualsLarge, text, figures)
    }

    /// Decrease of χ² if these equations may have any error.
    fn falls_without(&self, equations: &[usize]) -> f64 {
        self.fall(self.whitening.select_columns(equations)).fall
    }

    /// Improvement by additional unknowns with these columns.
    pub fn explained_by(&self, columns: &DMatrix<f64>) -> Explained {
        self.fall(&self.whitening * columns)
    }

    /// The same for whitened columns.
    fn fall(&self, shifts: DMatrix<f64>) -> Explained {
        let free = &shifts - &self.explained * self.explained.tr_mul(&shifts);
        let of_shifts = shifts.column_iter().map(|c| c.norm_squared());
        let least = ROUNDING * of_shifts.fold(0.0, f64::max);
        let SymmetricEigen {
            eigenvectors,
            eigenvalues,
        } = free.tr_mul(&free).symmetric_eigen();
        let along = eigenvectors.tr_mul(&free.tr_mul(&self.whitened));
        let told: Vec<usize> = (0..eigenvalues.len())
            .filter(|&k| eigenvalues[k] > least)
            .collect();
        let fall = |&k: &usize| along[k].powi(2) / eigenvalues[k];
        let part = |&k: &usize| eigenvectors.column(k) * (along[k] / eigenvalues[k]);
        let none = DVector::zeros(eigenvalues.len());
        Explained {
            fall: told.iter().map(fall).sum(),
            degrees: told.len(),
            coefficients: told.iter().map(part).fold(none, |a, b| a + b).data.into(),
        }
    }
}

fn limit(degrees: usize) -> f64 {
    chi_square_limit(degrees as f64, FALSE_ALARM / TRIADS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Vector3};

    use crate::calibration::start::equations::of_sensitivity;

    fn six() -> Vec<Vector3<f64>> {
        (0..6)
            .map(|k| Vector3::ith(k / 2, if k % 2 == 0 { 9.8 } else { -9.8 }))
            .collect()
    }

    /// Of a triad's sensitivity and bias, three rows an input.
    fn design(inputs: &[Vector3<f64>]) -> DMatrix<f64> {
        let mut design = DMatrix::zeros(3 * inputs.len(), 12);
        for (k, input) in inputs.iter().enumerate() {
            let mut rows = design.fixed_rows_mut::<3>(3 * k);
            rows.copy_from(&of_sensitivity(input.push(1.0)));
        }
        design
    }

    #[test]
    fn six_positions_leave_six_degrees_and_what_a_triad_explains_leaves_nothing() {
        let inputs = six();
        let a = Matrix3::new(1.0, 0.01, 0.0, 0.02, 0.99, -0.01, 0.0, 0.03, 1.01);
        let errors =
            DVector::from_iterator(18, inputs.iter().flat_map(|u| <[f64; 3]>::from(a * u)));
        let covariance = DMatrix::identity(18, 18) * 1e-8;
        let residuals = Residuals::new(&design(&inputs), &errors, &covariance).unwrap();
        assert_eq!(residuals.degrees(), 6);
        assert!(residuals.chi_square() < 1e-6);
        assert_eq!(residuals.growth(), None);
    }

    #[test]
    fn a_position_that_is_off_is_named_with_its_opposite_where_none_other_tells_them_apart() {
        let mut inputs = six();
        let mut errors = DVector::zeros(18);
        errors[3 * 2 + 2] = 0.1;
        let covariance = DMatrix::identity(18, 18) * 1e-6;
        let of = |inputs: &[Vector3<f64>], errors: &DVector<f64>, covariance: &DMatrix<f64>| {
            let residuals = Residuals::new(&design(inputs), errors, covariance).unwrap();
            assert!(residuals.growth().is_some());
            let of_each: Vec<_> = (0..inputs.len())
                .map(|k| (3 * k..3 * k + 3).collect())
                .collect();
            residuals.worst(&of_each)
        };
        let worst = of(&inputs, &errors, &covariance);
        assert_eq!(worst.groups, [2, 3]);
        assert!(worst.without < 1e-6);
        inputs.push(Vector3::new(0.0, 9.8, 0.0));
        let errors = errors.resize_vertically(21, 0.0);
        let covariance = DMatrix::identity(21, 21) * 1e-6;
        assert_eq!(of(&inputs, &errors, &covariance).groups, [2]);
    }

    #[test]
    fn sigma_grow_by_the_root_of_chi_squared_over_its_degrees() {
        // Nothing is to be found of nine errors of 2 σ: χ² is 36.
        let (design, errors) = (DMatrix::zeros(9, 0), DVector::repeat(9, 2.0));
        let residuals = Residuals::new(&design, &errors, &DMatrix::identity(9, 9)).unwrap();
        assert!((residuals.growth().unwrap() - 2.0).abs() < 1e-12);
    }
}
