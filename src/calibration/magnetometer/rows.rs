//! Rows of the mean output in a part of a dwell.

use nalgebra::{DMatrix, DVector, Matrix3};

use crate::calibration::Constant;
use crate::calibration::chain::states::{ATTITUDE, States};
use crate::magnetic::{MagneticTriad, MagneticVector};
use crate::recording::MagneticMean;

/// Three rows of states and constants, with the measured values; noise of σ = 1.
pub struct MagneticRows {
    pub states: DMatrix<f64>,
    pub constants: DMatrix<f64>,
    pub values: DVector<f64>,
    /// Log-determinant of the covariance of the output.
    pub log_determinant: f64,
}

impl MagneticRows {
    /// The rows of a mean output in a computed attitude, linearised at these constants; `weight` multiplies the
    /// variance.
    pub fn new(
        (mean, weight): (&MagneticMean, f64),
        attitude: &Matrix3<f64>,
        at: &MagneticVector,
        (states, constants): (&States, &[Constant]),
    ) -> Self {
        let response = MagneticTriad::from_vector(at).response(attitude);
        let sigma = mean.sigma * weight.sqrt();
        let whitening = Matrix3::from_diagonal(&sigma.map(f64::recip));
        let mut rows = Self {
            states: DMatrix::zeros(3, states.count),
            constants: DMatrix::zeros(3, constants.len()),
            values: DVector::from_column_slice(
                (whitening * (mean.output - response.output)).as_slice(),
            ),
            log_determinant: 2.0 * sigma.map(f64::ln).sum(),
        };
        let mut set = |first: usize, by: Matrix3<f64>| {
            let mut columns = rows.states.fixed_columns_mut::<3>(first);
            columns.copy_from(&(whitening * by));
        };
        set(ATTITUDE, response.by_attitude);
        if let Some(disturbance) = states.magnetic {
            set(disturbance, response.by_field);
        }
        for (column, constant) in constants.iter().enumerate() {
            if let Constant::Magnetic(k) = constant {
                let by = whitening * response.by_constants.column(*k);
                rows.constants.set_column(column, &by);
            }
        }
        rows
    }
}
