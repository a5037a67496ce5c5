//! Least-squares solution of [`Equations`]: one triangular factor, and one common factor for all σ (Birge 1932,
//! Physical Review 40).

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, SMatrix};

use super::equations::{Common, Equations, Event, Rows};
use crate::calibration::checks::residuals::Residuals;
use crate::calibration::{
    CalibrationError, PARAMETERS, ParameterMatrix, ParameterVector, sensor_and_parameter,
};
use crate::imu::Sensor;

/// Solution of equations, with σ widened by the Birge ratio of their residuals.
pub struct Solution {
    /// δθ.
    pub step: ParameterVector,
    pub covariance: ParameterMatrix,
    /// Response of the unknowns to each error of the table, by number.
    pub by_table: BTreeMap<usize, SMatrix<f64, PARAMETERS, 3>>,
    pub residuals: Residuals,
}

impl Equations {
    /// Least-squares δθ with the prior; the weight of a row is the inverse of its variance times the Birge ratio. If
    /// the noise is understated, rows must not move parameters that they hardly determine far from the prior.
    ///
    /// # Errors
    /// Returns [`CalibrationError::Singular`] with the triad of an unknown that is not a number.
    pub fn step(&self) -> Result<ParameterVector, CalibrationError> {
        let Some(&first) = self.unknown.first() else {
            return Ok(ParameterVector::zeros());
        };
        let singular = |index: usize| CalibrationError::Singular {
            sensor: sensor_and_parameter(index).0,
        };
        let factor = self.weighted_factor();
        let step = |growth| {
            let solved = self.with_prior(&factor, growth);
            solved.map(|(step, _)| step).ok_or_else(|| singular(first))
        };
        let (design, residual) = self.scaled();
        let left = residual - design * step(1.0)?;
        let degrees = left.len().saturating_sub(self.unknown.len()).max(1);
        let growth = (left.norm_squared() / degrees as f64).sqrt().max(1.0);
        let step = self.expanded(&step(growth)?);
        let lost = step.iter().position(|value| !value.is_finite());
        lost.map_or(Ok(step), |index| Err(singular(index)))
    }

    /// The solution; `None` if prior and rows leave an unknown undetermined.
    pub fn solved(&self) -> Option<Solution> {
        let eliminated = self.correlated.then(|| self.eliminated());
        let factor = match &eliminated {
            Some(eliminated) => eliminated.of_unknowns(),
            None => self.weighted_factor(),
        };
        let (step, as_stated) = self.with_prior(&factor, 1.0)?;
        let unknown = self.unknown.len();
        let degrees = self.rows.len().saturating_sub(unknown);
        let left = factor
            .get((unknown, unknown))
            .map_or(0.0, |left| left * left);
        let by_table = eliminated.map_or_else(BTreeMap::new, |of| of.by_table(&as_stated));
        let residuals = |chi_square, step: &DMatrix<f64>| Residuals {
            chi_square,
            degrees,
            worst: self.worst(step),
        };
        let (step, covariance, residuals) = if self.correlated {
            let residuals = residuals(left, &step);
            let (step, covariance) = self.with_prior(&factor, residuals.growth())?;
            (step, covariance, residuals)
        } else {
            // The weights are not the inverse of the variances, so the expected sum of weighted squares is computed
            // from the errors.
            let scores = self.scores();
            let expected = self.weighted_variance() - (&scores * &as_stated).trace();
            let residuals = residuals(left * degrees as f64 / expected, &step);
            let of_prior = DMatrix::from_diagonal(&self.sigma.map(|sigma| sigma.powi(-2)));
            let sum = scores * residuals.growth().powi(2) + of_prior;
            (step, &as_stated * sum * &as_stated, residuals)
        };
        Some(Solution {
            step: self.expanded(&step),
            covariance: self.whole(&covariance),
            by_table: by_table
                .iter()
                .map(|(&number, by)| (number, self.expanded(by)))
                .collect(),
            residuals,
        })
    }

    /// Covariance of δθ due to the errors of rows whose weights follow from other variances; `None` as in
    /// [`Self::solved`].
    pub fn by_errors(&self) -> Option<ParameterMatrix> {
        let (_, gain) = self.with_prior(&self.weighted_factor(), 1.0)?;
        Some(self.whole(&(&gain * self.scores() * &gain)))
    }

    /// Triangular factor of the rows, weighted by their variances: columns of the unknowns and of the residual.
    fn weighted_factor(&self) -> DMatrix<f64> {
        let (design, residual) = self.scaled();
        let unknown = design.ncols();
        let mut all = design.insert_column(unknown, 0.0);
        all.set_column(unknown, &residual);
        all.qr().r()
    }

    /// δθ and its covariance from such a factor, with widened σ of the rows, and the prior.
    fn with_prior(
        &self,
        factor: &DMatrix<f64>,
        growth: f64,
    ) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let (rows, unknown) = (factor.nrows(), self.unknown.len());
        let mut all = (factor / growth).resize_vertically(rows + unknown, 0.0);
        for k in 0..unknown {
            all[(rows + k, k)] = self.sigma[k].recip();
            all[(rows + k, unknown)] = self.mean[k];
        }
        let r = all.qr().r();
        let of_unknowns = r.view((0, 0), (unknown, unknown));
        let inverse = of_unknowns.solve_upper_triangular(&DMatrix::identity(unknown, unknown))?;
        let step = &inverse * r.view((0, unknown), (unknown, 1));
        Some((step, &inverse * inverse.transpose()))
    }

    /// Sum of the outer products of the responses of the weighted normal equations to each error of 1σ.
    fn scores(&self) -> DMatrix<f64> {
        let unknown = self.unknown.len();
        let mut sum = DMatrix::zeros(unknown, unknown);
        let mut scores: BTreeMap<Common, DMatrix<f64>> = BTreeMap::new();
        for row in &self.rows {
            let partials = DVector::from_iterator(unknown, self.partials(row)) / row.weighted.x;
            sum.ger(row.own.x, &partials, &partials, 1.0);
            for (of, by) in &row.common {
                let score = scores
                    .entry(*of)
                    .or_insert_with(|| DMatrix::zeros(unknown, 3));
                *score += &partials * by;
            }
        }
        for (of, score) in &scores {
            sum += score * score.transpose() * self.variance_of(*of);
        }
        for sensor in Sensor::ALL {
            self.add_drift(&mut sum, sensor, &scores);
        }
        sum
    }

    /// Adds the covariance between different events due to the bias variation of a triad.
    fn add_drift(
        &self,
        sum: &mut DMatrix<f64>,
        sensor: Sensor,
        scores: &BTreeMap<Common, DMatrix<f64>>,
    ) {
        let of_sensor = scores.iter().filter_map(|(of, score)| match of {
            Common::Noise(of, event) if *of == sensor => Some((&self.events[*event], score)),
            _ => None,
        });
        let mut before: Option<(&Event, DMatrix<f64>)> = None;
        for (event, score) in of_sensor {
            let Some(drift) = event.drift(sensor, before.as_ref().map(|(event, _)| *event)) else {
                return;
            };
            let of_event = score * drift.mean;
            let mut at_end = of_event.clone();
            if let Some((_, earlier)) = before {
                let at_begin = earlier * drift.since;
                let across = of_event * at_begin.transpose() * drift.variance;
                *sum += &across + across.transpose();
                at_end += at_begin * drift.decay;
            }
            before = Some((event, at_end));
        }
    }

    /// Sum of the variances of all rows, each divided by the variance of its weight.
    fn weighted_variance(&self) -> f64 {
        let rows = self.rows.iter();
        rows.map(|row| self.variance(row) / row.weighted.x).sum()
    }

    fn variance(&self, row: &Rows<1>) -> f64 {
        let common = row.common.iter();
        let common = common.map(|(of, by)| by.norm_squared() * self.variance_of(*of));
        row.own.x + common.sum::<f64>()
    }

    /// Start and end, s, of the event whose rows are farthest from a solution, in their σ.
    fn worst(&self, step: &DMatrix<f64>) -> [f64; 2] {
        let mut squares: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
        for row in &self.rows {
            let explained: f64 = self.partials(row).zip(step).map(|(a, b)| a * b).sum();
            let (sum, count) = squares.entry(row.event).or_default();
            *sum += (row.residual.x - explained).powi(2) / self.variance(row);
            *count += 1.0;
        }
        let mean = |(sum, count): (f64, f64)| sum / count;
        let worst = squares
            .into_iter()
            .max_by(|a, b| mean(a.1).total_cmp(&mean(b.1)));
        let event = worst.and_then(|(event, _)| self.events.get(event));
        event.map_or([0.0; 2], |event| event.times)
    }

    /// Selects the rows of the unknowns among those of all parameters.
    fn expanded<const N: usize>(&self, of_unknowns: &DMatrix<f64>) -> SMatrix<f64, PARAMETERS, N> {
        let mut all = SMatrix::<f64, PARAMETERS, N>::zeros();
        for (&index, row) in self.unknown.iter().zip(of_unknowns.row_iter()) {
            all.row_mut(index).copy_from(&row);
        }
        all
    }
}
