//! Accelerometers from the size of gravity.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::super::error::CalibrationError;
use super::super::linearisation::singular;
use super::equations::Equations;
use super::gauss_newton;
use crate::imu::{PARAMETERS, PerSensor, Sensor, Triad};
use crate::run::{Dwell, Run};

/// The accelerometers that sense `|f| = g` in every dwell, whichever way up; the prior ties down what
/// so many positions do not see. The gyros stay as they are.
///
/// Source: Skog and Händel 2006, "Calibration of a MEMS inertial measurement unit", XVII IMEKO World
/// Congress, §3.
pub(super) fn accelerometers(
    run: &Run,
    dwells: &[Dwell],
    from: &PerSensor<Triad>,
) -> Result<PerSensor<Triad>, CalibrationError> {
    gauss_newton(*from, |triads| {
        let mut equations = Equations::new(run, triads, &[Sensor::Accel]);
        add_size(&mut equations, run, dwells, triads)?;
        Ok(equations)
    })
}

/// Adds `|f| = g` in every dwell.
pub(super) fn add_size(
    equations: &mut Equations,
    run: &Run,
    dwells: &[Dwell],
    triads: &PerSensor<Triad>,
) -> Result<(), CalibrationError> {
    let triad = &triads.accel;
    let correction = triad.correction().ok_or_else(|| singular(triads))?;
    for dwell in dwells {
        let rest = dwell.mean(Sensor::Accel, run);
        let force = correction * (rest.output - triad.bias);
        let row = input_errors(triad, &correction, &force).tr_mul(&force.normalize());
        let error = force.norm() - run.site.gravity;
        equations.add(&[(Sensor::Accel, row)], error, rest.variance);
    }
    Ok(())
}

/// Error of a triad's computed input, estimated − true, by the error of each of its parameters.
pub(super) fn input_errors(
    triad: &Triad,
    correction: &Matrix3<f64>,
    input: &Vector3<f64>,
) -> SMatrix<f64, 3, PARAMETERS> {
    let of_parameter = triad.response().map(|w| correction * (w * input.push(1.0)));
    SMatrix::from_columns(&of_parameter)
}
