//! Contribution of each group of parameters to the position error.

use nalgebra::SMatrix;

use super::method::Calibrated;
use crate::calibration::{Group, PARAMETERS, ParameterMatrix};

/// Horizontal position error, east and north in nmile, per parameter error.
pub(super) type ByParameter = SMatrix<f64, 2, PARAMETERS>;

/// Budget of the final position error from the stated covariance, averaged over all instruments.
///
/// The errors of groups are correlated, because the filter determines many sums of parameters better than the
/// individual parameters. The share of a group is the covariance of its contribution with the total, divided by the
/// variance of the total,
///
/// ```text
/// share_g = tr(S_g P_g· Sᵀ) / tr(S P Sᵀ)
/// ```
///
/// so the cross terms of two groups are divided equally between them, and all shares add up to one. A group that
/// compensates another group has a negative share.
#[derive(Debug, Clone, PartialEq)]
pub struct Budget {
    /// Stated RMS position error, nmile.
    pub claimed: f64,
    /// The contribution of each of [`Group::all`].
    pub parts: Vec<Part>,
}

/// The contribution of one group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// The group.
    pub group: Group,
    /// RMS position error of this group alone, nmile.
    pub alone: f64,
    /// Share of the variance, as in [`Budget`].
    pub share: f64,
}

impl Budget {
    pub(super) fn new(by_parameter: ByParameter, calibrated: &[&Calibrated]) -> Self {
        let count = calibrated.len() as f64;
        let sum: ParameterMatrix = calibrated.iter().map(|c| c.covariance).sum();
        let covariance = sum / count;
        let variance = (by_parameter * covariance * by_parameter.transpose()).trace();
        let part = |group| {
            let mut of_group = by_parameter;
            for other in (0..PARAMETERS).filter(|&i| Group::of(i) != group) {
                of_group.column_mut(other).fill(0.0);
            }
            let with_all = (of_group * covariance * by_parameter.transpose()).trace();
            Part {
                group,
                alone: (of_group * covariance * of_group.transpose())
                    .trace()
                    .sqrt(),
                share: with_all / variance,
            }
        };
        Self {
            claimed: variance.sqrt(),
            parts: Group::all().map(part).collect(),
        }
    }
}
