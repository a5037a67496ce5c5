//! The coarse start: where the filter begins, not what it knows. The filter's prior stays its own.

mod equations;
mod gravity;
mod heading;
mod table;
mod turns;

use super::error::CalibrationError;
use super::outcome::{from_vector, to_vector};
use super::pass::{Linearisation, singular};
use super::schedule::first_reading;
use crate::imu::{FurtherVector, InstallationForm, PerSensor, Triad};
use crate::run::{Dwell, Run};
use equations::Equations;

/// Steps of Gauss–Newton at most; scale factors wrong by percents need three.
const STEPS: usize = 6;
/// A step below this (1 ppm, 0.2″, and as much of rad/s or m/s²) is no step.
const SMALL: f64 = 1e-6;

/// Both triads and the initial attitude by least squares over whole dwells and turns.
///
/// With a table, its attitudes are known. Without, accelerometers follow from `|f| = g` over the
/// dwells, gyros from the direction of gravity before and after each turn, and gyro biases together
/// with the heading from the rates at rest.
///
/// # Errors
/// [`CalibrationError`] if there are fewer than two dwells, or data and prior do not fit each other.
pub fn coarse_start(
    run: &Run,
    dwells: &[Dwell],
    form: InstallationForm,
) -> Result<Linearisation, CalibrationError> {
    if let [] | [_] = dwells {
        return Err(CalibrationError::TooFewDwells {
            found: dwells.len(),
            needed: 2,
        });
    }
    match (&run.table, first_reading(run, dwells)) {
        (Some(table), Some(initial_attitude)) => Ok(Linearisation {
            triads: table::from_table(run, table, dwells, form)?,
            further: FurtherVector::zeros(),
            initial_attitude,
        }),
        _ => {
            let triads = gravity::accelerometers(run, dwells, &run.prior_mean(form))?;
            turns::gyros_and_attitude(run, dwells, &triads)
        }
    }
}

/// Steps from a first point on, each by equations made there, until they are small.
fn gauss_newton(
    from: PerSensor<Triad>,
    equations: impl Fn(&PerSensor<Triad>) -> Result<Equations, CalibrationError>,
) -> Result<PerSensor<Triad>, CalibrationError> {
    let mut triads = from;
    for _ in 0..STEPS {
        let step = equations(&triads)?.solve();
        if !step.iter().all(|v| v.is_finite()) {
            return Err(singular(&from));
        }
        triads = from_vector(triads.gyro.form, &(to_vector(&triads) + step));
        if step.amax() < SMALL {
            break;
        }
    }
    Ok(triads)
}
