//! Accelerometers from the size of gravity.

use super::super::error::CalibrationError;
use super::super::linearisation::singular;
use super::equations::Equations;
use super::gauss_newton;
use crate::imu::{PerSensor, Sensor, Triad, TriadVector};
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
    gauss_newton(*from, |triads| equations(run, dwells, triads))
}

/// `|f| = g` in every dwell.
pub(super) fn equations(
    run: &Run,
    dwells: &[Dwell],
    triads: &PerSensor<Triad>,
) -> Result<Equations, CalibrationError> {
    let mut equations = Equations::new(run, triads, &[Sensor::Accel]);
    let triad = &triads.accel;
    let correction = triad.correction().ok_or_else(|| singular(triads))?;
    let response = triad.response();
    for dwell in dwells {
        let rest = dwell.mean(Sensor::Accel, run);
        let force = correction * (rest.output - triad.bias);
        let direction = force.normalize();
        let row = TriadVector::from_fn(|p, _| {
            direction.dot(&(correction * (response[p] * force.push(1.0))))
        });
        let error = force.norm() - run.site.gravity;
        equations.add(Sensor::Accel, &row, error, rest.variance);
    }
    Ok(equations)
}
