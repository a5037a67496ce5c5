//! Accelerometers from the magnitude of gravity.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::equations::{Equations, ErrorOf, gauss_newton};
use super::shared_noise::{SharedNoise, along, of_biases};
use crate::calibration::error::CalibrationError;
use crate::calibration::linearisation::singular;
use crate::calibration::parameters::from_vector;
use crate::calibration::problem::Problem;
use crate::imu::{PARAMETERS, PerSensor, Sensor, Triad};

/// The accelerometers that sense `|f| = g` in every dwell, whichever way up; the prior ties down what
/// so many positions do not see. The gyros stay as they are.
///
/// Source: Skog and Händel 2006, "Calibration of a MEMS inertial measurement unit", XVII IMEKO World
/// Congress, §3.
pub fn accelerometers(problem: &Problem) -> Result<PerSensor<Triad>, CalibrationError> {
    let model = &problem.model;
    let prior = from_vector(model.form, &model.prior_mean);
    gauss_newton(prior, |triads| {
        let mut equations = Equations::new(model, triads, &[Sensor::Accel]);
        add_magnitude(&mut equations, problem, triads)?;
        Ok(equations)
    })
}

/// Adds `|f| = g` in every dwell.
pub fn add_magnitude(
    equations: &mut Equations,
    problem: &Problem,
    triads: &PerSensor<Triad>,
) -> Result<(), CalibrationError> {
    let triad = &triads.accel;
    let correction = triad.correction().ok_or_else(|| singular(triads))?;
    let shared = SharedNoise::of(problem);
    let mut number = 0;
    for stretch in problem.stretches() {
        for dwell in &stretch.dwells {
            let rest = dwell.mean(Sensor::Accel, stretch.run);
            let force = correction * (rest.output - triad.bias);
            let size = size_of_force(&force)?;
            let row = input_errors(triad, &correction, &force).tr_mul(&(force / size));
            let error = size - stretch.run.site.gravity;
            let made_of = ErrorOf {
                own: 0.0,
                shared: along(shared.at_rest(Sensor::Accel, number), &of_biases(&row)),
                ..ErrorOf::default()
            };
            equations.add(&[(Sensor::Accel, row)], error, rest.variance, made_of);
            number += 1;
        }
    }
    Ok(())
}

/// Magnitude of a specific force in m/s², which is not zero where accelerometers sense gravity.
pub fn size_of_force(force: &Vector3<f64>) -> Result<f64, CalibrationError> {
    let sensor = Sensor::Accel;
    Some(force.norm())
        .filter(|&size| size > 0.0)
        .ok_or(CalibrationError::Singular { sensor })
}

/// Error of a triad's computed input, estimated − true, by the error of each of its parameters.
pub fn input_errors(
    triad: &Triad,
    correction: &Matrix3<f64>,
    input: &Vector3<f64>,
) -> SMatrix<f64, 3, PARAMETERS> {
    let of_parameter = triad.response().map(|w| correction * (w * input.push(1.0)));
    SMatrix::from_columns(&of_parameter)
}
