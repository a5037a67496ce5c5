//! Rows of the mean output of a magnetometer in a part of a dwell.

use nalgebra::Matrix3;

use super::rows::Rows;
use crate::calibration::Constant;
use crate::calibration::chain::dynamics::Dynamics;
use crate::calibration::chain::states::ATTITUDE;
use crate::calibration::record::Rest;
use crate::magnetic::MagneticTriad;

/// The rows, with the log-determinant of the covariance of the output; `None` if the magnetometer is not observed there.
/// `weight` multiplies the variance.
pub fn magnetic(dynamics: &Dynamics, rest: &Rest, weight: f64) -> Option<(Rows, f64)> {
    let (mean, at) = (rest.magnetic.as_ref()?, dynamics.magnetic.as_ref()?);
    let response = MagneticTriad::from_vector(at).response(&rest.begin.attitude);
    let sigma = mean.sigma * weight.sqrt();
    let whitening = Matrix3::from_diagonal(&sigma.map(f64::recip));
    let (states, constants) = (dynamics.states, dynamics.constants);
    let mut rows = Rows::none(states.count, constants.len()).of(3);
    rows.values
        .copy_from(&(whitening * (mean.output - response.output)));
    let of_states = [
        (Some(ATTITUDE), response.by_attitude),
        (states.magnetic, response.by_field),
    ];
    for (first, by) in of_states {
        if let Some(first) = first {
            let mut columns = rows.states.fixed_columns_mut::<3>(first);
            columns.copy_from(&(whitening * by));
        }
    }
    for (column, constant) in constants.iter().enumerate() {
        if let Constant::Magnetic(k) = constant {
            let by = whitening * response.by_constants.column(*k);
            rows.constants.set_column(column, &by);
        }
    }
    Some((rows, 2.0 * sigma.map(f64::ln).sum()))
}
