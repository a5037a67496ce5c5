//! Repeatability, from a comparison of each recording calibrated alone with the joint calibration.

use nalgebra::{DMatrix, DVector};

use super::day_to_day::Difference;
use crate::calibration::{Outcome, PARAMETERS, ParameterVector, SeparateEstimate, to_vector};
use crate::statistics::{FALSE_ALARM, chi_square_limit};

/// Repeatability of a parameter between recordings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repeatability {
    /// Index.
    pub parameter: usize,
    /// Standard deviation of the individual calibrations about the common curve.
    pub spread: f64,
    /// 1σ of this standard deviation.
    pub sigma: f64,
    /// Standard deviation expected from the stated σ of the calibrations.
    pub claimed: f64,
    /// χ² of the deviations per degree of freedom; one if the σ are correct.
    pub chi_square: f64,
    /// Limit of χ² per degree of freedom, for a false-alarm rate of 0.1 %.
    pub limit: f64,
}

impl Outcome {
    /// Deviation of a recording calibrated alone from the joint calibration at its temperature, reduced to the mean
    /// mounting. `None` without a calibration, or if its temperature is not constant.
    fn departure(&self, number: usize, alone: &SeparateEstimate) -> Option<ParameterVector> {
        let mounting = self.own.get(number).map(|own| own.values.mounting);
        let turned_back = Difference {
            mounting: -mounting.unwrap_or_default(),
            ..Difference::default()
        };
        let triads = turned_back.applied(&alone.estimate.as_ref()?.triads);
        let mut off = to_vector(&triads) - self.estimate.vector();
        if let Some(thermal) = &self.thermal {
            let (change, _) = thermal.at(alone.state.as_ref()?, &self.estimate.covariance);
            off -= change;
        }
        Some(off)
    }

    /// Squared normalised distance between a recording calibrated alone and the joint calibration, per parameter, and
    /// its limit at a false-alarm rate of 0.1 %. Returns `None` if the recording alone gives no calibration.
    pub fn distance_alone(&self, number: usize) -> Option<(f64, f64)> {
        let alone = self.alone.get(number)?;
        let off = self.departure(number, alone)?;
        let estimate = alone.estimate.as_ref()?;
        let estimated: Vec<usize> = estimate.estimated().collect();
        let n = estimated.len();
        let sigma = estimate.sigma();
        let together = match &self.thermal {
            Some(thermal) => {
                thermal
                    .at(alone.state.as_ref()?, &self.estimate.covariance)
                    .1
            }
            None => self.estimate.covariance,
        };
        let own = &self.model.day_to_day;
        // The mounting was already determined by all recordings together.
        let told = if own.mounting > 0.0 { 3 } else { 0 };
        let own = own.covariance(&self.estimate.triads);
        // The estimate from part of the data differs from that of all data by as much as its covariance is larger
        // (Hausman 1978, "Specification tests in econometrics", Econometrica 46(6)).
        let covariance = DMatrix::from_fn(n, n, |i, j| {
            let (i, j) = (estimated[i], estimated[j]);
            (estimate.covariance[(i, j)] + own[(i, j)] - together[(i, j)]) / (sigma[i] * sigma[j])
        });
        let off = DVector::from_fn(n, |i, _| off[estimated[i]] / sigma[estimated[i]]);
        let squared = off.dot(&covariance.cholesky()?.solve(&off));
        let freedom = n.checked_sub(told).filter(|&freedom| freedom > 0)? as f64;
        Some((
            squared / freedom,
            chi_square_limit(freedom, FALSE_ALARM) / freedom,
        ))
    }

    /// Repeatability of each parameter that at least three recordings determine alone.
    pub fn repeatability(&self) -> Vec<Repeatability> {
        let all = self.alone.iter().enumerate().filter_map(|(k, alone)| {
            Some((self.departure(k, alone)?, alone.estimate.as_ref()?.sigma()))
        });
        let all: Vec<(ParameterVector, ParameterVector)> = all.collect();
        let of = |parameter: usize| {
            let own = self.model.day_to_day.parameters[parameter];
            let known = all
                .iter()
                .map(|(off, sigma)| (off[parameter], sigma[parameter]));
            let known: Vec<(f64, f64)> = known.filter(|(_, sigma)| *sigma > 0.0).collect();
            let taken = 1 + self.thermal.as_ref().map_or(0, |t| t.order(parameter).0);
            let freedom = known.len().checked_sub(taken);
            let freedom = freedom.filter(|&f| f > 0 && known.len() > 2)? as f64;
            let variance = |sigma: f64| sigma * sigma + own * own;
            let squares: f64 = known.iter().map(|(off, _)| off * off).sum();
            let chi_square: f64 = known.iter().map(|(off, s)| off * off / variance(*s)).sum();
            let claimed: f64 = known.iter().map(|(_, s)| variance(*s)).sum();
            let spread = (squares / freedom).sqrt();
            Some(Repeatability {
                parameter,
                spread,
                sigma: spread / (2.0 * freedom).sqrt(),
                claimed: (claimed / known.len() as f64).sqrt(),
                chi_square: chi_square / freedom,
                limit: chi_square_limit(freedom, FALSE_ALARM) / freedom,
            })
        };
        (0..PARAMETERS).filter_map(of).collect()
    }
}
