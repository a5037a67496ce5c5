//! Conversion of a magnetometer to a body frame.

use nalgebra::SVector;

use super::accelerometer_frame;
use crate::calibration::parameters::derivatives;
use crate::calibration::result::{Calibration, MagRecord, triads_of};
use crate::calibration::{ParameterMatrix, from_vector, to_vector};
use crate::imu::{BodyFrame, Nominal, PerSensor};
use crate::magnetic::{MAGNETOMETER, MagneticTriad};

/// Matrix and bias of a magnetometer with their 1σ, zero if none is stated.
pub type MagneticValues = [SVector<f64, MAGNETOMETER>; 2];

/// The magnetometer of a record in a body frame: `M e = (M Rᵀ)(R e)`. The file states no correlation with the
/// accelerometers, whose errors turn the accelerometer frame.
pub fn magnetic_in(
    body_frame: BodyFrame,
    (mag, record): (&MagRecord, &Calibration),
    nominal: &PerSensor<Nominal>,
) -> MagneticValues {
    let (values, own) = (mag.vector(), mag.covariance_matrix());
    if body_frame == BodyFrame::Table {
        return [values, own.diagonal().map(f64::sqrt)];
    }
    let triads = triads_of(
        record,
        nominal,
        record.installation_form.unwrap_or_default(),
    );
    let to_axes = MagneticTriad::to_axes::<MAGNETOMETER>;
    let rotation = accelerometer_frame(&triads.accel.sensitivity());
    let by_frame = derivatives(&to_vector(&triads), |of| {
        let triads = from_vector(triads.accel.form, of);
        let frame = accelerometer_frame(&triads.accel.sensitivity());
        to_axes(&frame) * values
    });
    let of_frame: ParameterMatrix = record.covariance_by(nominal).unwrap_or_default();
    let turn = to_axes(&rotation);
    let covariance = turn * own * turn.transpose() + by_frame * of_frame * by_frame.transpose();
    let sigma = if mag.sigma.is_some() {
        covariance.diagonal().map(|v| v.max(0.0).sqrt())
    } else {
        SVector::zeros()
    };
    [turn * values, sigma]
}
