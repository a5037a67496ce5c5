//! Information of a recording about the constants, at one linearisation point and with given noise.
//!
//! The Kalman filter has the moving and the reset states; constants are columns that it propagates (see
//! [`super::filter::columns`]). Each dwell gives whitened rows `[G ν]` with `ν = G c + noise of σ 1`: with a prior,
//! they give the estimate of any subset of the constants, without another pass.

mod script;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use crate::attitude::from_tilt_and_heading;
use crate::calibration::constants::triangle;
use crate::calibration::filter::Filter;
use crate::calibration::several::day_to_day::OwnState;
use crate::calibration::{
    Constant, Difference, Known, Linearisation, ParameterVector, Posterior, Prior, from_vector,
    to_vector,
};
pub use script::{Keeping, Moves, Script};

/// Whitened rows of all dwells, and the dependent states.
#[derive(Debug, Clone)]
pub struct Reduction {
    /// The constants of the columns; one more column, the last, is the observation.
    pub constants: Vec<Constant>,
    pub parts: Vec<Part>,
    /// Sum of squares independent of all constants.
    pub squares: f64,
    /// Logarithm of the determinant of the covariance of all observations, given the constants.
    pub log_determinant: f64,
    /// Initial attitude of each stretch.
    pub attitudes: Vec<Smoothed>,
    /// States that belong to a single recording, for each recording; empty if none.
    pub own: Vec<Smoothed>,
    /// Gravity at the last site, if there are several.
    pub gravity: Option<Smoothed>,
}

/// Rows of a part of a dwell.
#[derive(Debug, Clone)]
pub struct Part {
    /// Number of the dwell.
    pub dwell: usize,
    /// Time of its end, s.
    pub time: f64,
    pub rows: DMatrix<f64>,
}

/// Estimate of the parameters of both triads at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Epoch {
    /// Time, s.
    pub time: f64,
    /// Parameters of both triads.
    pub estimate: ParameterVector,
    /// 1σ of each.
    pub sigma: ParameterVector,
}

/// The rows of several parts.
fn stacked(parts: &[Part]) -> DMatrix<f64> {
    let count = parts.iter().map(|part| part.rows.nrows()).sum();
    let columns = parts.first().map_or(0, |part| part.rows.ncols());
    let mut all = DMatrix::zeros(count, columns);
    let mut first = 0;
    for Part { rows, .. } in parts {
        all.rows_mut(first, rows.nrows()).copy_from(rows);
        first += rows.nrows();
    }
    all
}

/// One triangle of the rows of several parts; `None` without parts.
fn folded(parts: &[Part]) -> Option<Part> {
    let last = parts.last()?;
    Some(Part {
        dwell: last.dwell,
        time: last.time,
        rows: triangle(&stacked(parts)),
    })
}

impl Reduction {
    /// The rows of each dwell.
    pub fn dwells(&self) -> impl Iterator<Item = DMatrix<f64>> + '_ {
        let dwells = self.parts.chunk_by(|one, other| one.dwell == other.dwell);
        dwells.map(stacked)
    }

    /// One triangle of all rows, which suffices if no dwell is evaluated separately.
    pub fn folded(mut self) -> Self {
        self.parts = folded(&self.parts).into_iter().collect();
        self
    }

    /// Combines the rows with a prior.
    pub fn posterior(&self, prior: &Prior) -> Posterior {
        let mut known = Known::new(prior.clone());
        self.parts.iter().for_each(|part| known.learn(&part.rows));
        let of_rows = known.posterior();
        Posterior {
            cost: of_rows.cost + self.squares,
            deviance: of_rows.deviance + self.squares + self.log_determinant,
            ..of_rows
        }
    }

    /// Estimate and σ against time, part by part.
    pub fn history(&self, prior: &Prior, at: &Linearisation) -> Vec<Epoch> {
        let mut known = Known::new(prior.clone());
        let parts = self.parts.iter().map(|part| {
            known.learn(&part.rows);
            let posterior = known.posterior();
            let variance = posterior.parameter_covariance.diagonal();
            Epoch {
                time: part.time,
                estimate: to_vector(&at.triads) + posterior.parameters,
                sigma: variance.map(f64::sqrt),
            }
        });
        parts.collect()
    }

    /// 1σ of the parameters of both triads without the rows between each of these increasing times in s and the next.
    ///
    /// The rows before and after are combined as triangles, so the cost is that of a few times all rows, and no row is
    /// subtracted from a sum that contains it.
    pub fn sigma_without(&self, prior: &Prior, times: &[f64]) -> Vec<ParameterVector> {
        let end = |&time: &f64| self.parts.partition_point(|part| part.time <= time);
        let ends: Vec<usize> = times.iter().map(end).collect();
        let (Some(&first), Some(&last)) = (ends.first(), ends.last()) else {
            return Vec::new();
        };
        let left_out = ends.windows(2);
        let left_out = left_out.map(|pair| self.parts.get(pair[0]..pair[1]).unwrap_or_default());
        let mut known = Known::new(prior.clone());
        folded(&self.parts[..first])
            .iter()
            .for_each(|part| known.learn(&part.rows));
        let before = left_out.clone().map(|parts| {
            let before = known.clone();
            parts.iter().for_each(|part| known.learn(&part.rows));
            before
        });
        let before: Vec<Known> = before.collect();
        let mut after = folded(&self.parts[last..]);
        let backward = before.into_iter().zip(left_out).rev();
        let mut sigma: Vec<ParameterVector> = backward
            .map(|(mut known, parts)| {
                after.iter().for_each(|part| known.learn(&part.rows));
                let rows: Vec<Part> = parts.iter().chain(&after).cloned().collect();
                after = folded(&rows);
                let variance = known.posterior().parameter_covariance.diagonal();
                variance.map(f64::sqrt)
            })
            .collect();
        sigma.reverse();
        sigma
    }

    /// Squares and products of all columns, summed over the rows.
    pub fn squares(&self) -> DMatrix<f64> {
        let n = self.constants.len();
        let mut squares = DMatrix::zeros(n + 1, n + 1);
        for part in &self.parts {
            squares.gemm_tr(1.0, &part.rows, &part.rows, 1.0);
        }
        squares
    }

    /// Information on the constants from the rows alone.
    pub fn information(&self) -> DMatrix<f64> {
        let n = self.constants.len();
        self.squares().view((0, 0), (n, n)).into_owned()
    }

    /// Deviation of each recording, linearised `at` a point.
    pub fn own(&self, at: &Linearisation, posterior: &Posterior) -> Vec<Own> {
        let each = self.own.iter().enumerate();
        each.map(|(recording, own)| own.difference(at.own(recording), posterior))
            .collect()
    }

    /// Linearisation point of the next pass after one `at` a point.
    pub fn estimate(&self, at: &Linearisation, posterior: &Posterior) -> Linearisation {
        let initial_attitude = |(at, error): (&Matrix3<f64>, &Smoothed)| {
            let (mean, _) = error.given(posterior);
            from_tilt_and_heading(&Vector3::from_column_slice(mean.as_slice())) * at
        };
        let attitudes = at.initial_attitudes.iter().zip(&self.attitudes);
        let own = self.own(at, posterior);
        let mut estimate = Linearisation {
            triads: from_vector(
                at.triads.gyro.form,
                &(to_vector(&at.triads) + posterior.parameters),
            ),
            own: own.iter().map(|own| own.values).collect(),
            initial_attitudes: attitudes.map(initial_attitude).collect(),
            ..at.clone()
        };
        for (constant, error) in self.constants.iter().zip(&posterior.mean) {
            match constant {
                Constant::Term(index) => estimate.terms[*index] += error,
                Constant::Thermal(of) => *of.of_mut(&mut estimate.thermal) += error,
                _ => {}
            }
        }
        estimate
    }
}

/// States with the effect of constants: for constants c, their mean is `x + U c`.
///
/// Source: Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and Navigation*, §1.4.14, for the
/// regression of states on constants.
#[derive(Debug, Clone)]
pub struct Smoothed {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
    /// U
    by_constants: DMatrix<f64>,
    /// Their meanings, if they belong to a recording.
    own: Vec<OwnState>,
}

/// Deviation of a recording from the common parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Own {
    /// The estimate.
    pub values: Difference,
    /// 1σ; zero for parameters common to all.
    pub sigma: Difference,
}

impl Smoothed {
    /// The current values of `count` states of a filter, from a first one on.
    pub fn of(filter: &Filter, first: usize, count: usize) -> Self {
        Self {
            mean: filter.x.rows(first, count).into_owned(),
            covariance: filter.p.view((first, first), (count, count)).into_owned(),
            by_constants: filter.columns.of_states.columns(first, count).transpose(),
            own: Vec::new(),
        }
    }

    /// The states that only this recording has; `None` if it has none.
    pub fn of_recording(filter: &Filter) -> Option<Self> {
        let (states, own): (Vec<usize>, Vec<OwnState>) = filter.layout.own.iter().copied().unzip();
        let first = *states.first()?;
        Some(Self {
            own,
            ..Self::of(filter, first, states.len())
        })
    }

    /// Mean and covariance.
    pub fn given(&self, posterior: &Posterior) -> (DVector<f64>, DMatrix<f64>) {
        let by = &self.by_constants;
        (
            &self.mean + by * &posterior.mean,
            &self.covariance + by * &posterior.covariance * by.transpose(),
        )
    }

    /// Covariance with the constants, one row each.
    pub fn with_constants(&self, posterior: &Posterior) -> DMatrix<f64> {
        &posterior.covariance * self.by_constants.transpose()
    }

    /// The states of a recording, as a change of these values.
    pub fn difference(&self, values: Difference, posterior: &Posterior) -> Own {
        let (mean, covariance) = self.given(posterior);
        let sigma = Difference::default();
        let mut own = Own { values, sigma };
        for (k, &of) in self.own.iter().enumerate() {
            *own.values.get_mut(of) += mean[k];
            *own.sigma.get_mut(of) = covariance[(k, k)].max(0.0).sqrt();
        }
        own
    }
}

#[cfg(test)]
mod tests;
