//! States that a filter had, smoothed by what is known of the constants in the end.

use nalgebra::{DMatrix, DVector};

use crate::calibration::filter::Filter;
use crate::calibration::several::day_to_day::OwnState;
use crate::calibration::{Difference, Posterior};

/// States with what constants do to them: with these at c their mean is `x + U c`.
///
/// Source: Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and Navigation*, §1.4.14, for the
/// regression of states on constants.
#[derive(Debug, Clone)]
pub struct Smoothed {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
    /// U
    by_constants: DMatrix<f64>,
    /// What they are, if they are of a recording.
    own: Vec<OwnState>,
}

/// By how much a recording differs from what all recordings have in common.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Own {
    /// The estimate.
    pub values: Difference,
    /// 1σ; zero of what is common to all.
    pub sigma: Difference,
}

impl Smoothed {
    /// So many states of a filter from a first one on, as they are now.
    pub fn of(filter: &Filter, first: usize, count: usize) -> Self {
        Self {
            mean: filter.x.rows(first, count).into_owned(),
            covariance: filter.p.view((first, first), (count, count)).into_owned(),
            by_constants: filter.columns.of_states.columns(first, count).transpose(),
            own: Vec::new(),
        }
    }

    /// What the recording has of its own; none where it has nothing.
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

    /// Covariance with the constants, a row each.
    pub fn with_constants(&self, posterior: &Posterior) -> DMatrix<f64> {
        &posterior.covariance * self.by_constants.transpose()
    }

    /// What is of a recording, as a change of this.
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
