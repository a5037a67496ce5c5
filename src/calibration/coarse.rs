//! The coarse start: where the filter begins, not what it knows. The filter's prior stays its own.

mod equations;
mod gravity;
mod heading;
mod table;
mod turns;

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix3, Vector3};

use super::error::CalibrationError;
use super::linearisation::{Linearisation, singular};
use super::outcome::{Estimate, from_vector, to_vector};
use super::schedule::first_reading;
use crate::attitude::exp;
use crate::imu::{FurtherVector, InstallationForm, PerSensor, Triad};
use crate::run::{Dwell, Run, TableRecord};
use crate::units::{ARCSEC, DEGREE};
use equations::Equations;
use turns::Turned;

/// Steps of Gauss–Newton at most; scale factors wrong by percents need three.
const STEPS: usize = 6;
/// A step below this (1 ppm, 0.2″, and as much of rad/s or m/s²) is no step.
const SMALL: f64 = 1e-6;

/// Where the filter begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoarseStart {
    /// The first point of linearisation.
    pub at: Linearisation,
    /// What is known of the initial attitude.
    pub attitude: AttitudePrior,
    /// Whether the noise of the gyros hides Earth rate, so that the heading may be any.
    pub hidden: bool,
}

impl CoarseStart {
    /// The same in the other three quadrants where the heading is hidden.
    pub(super) fn other_headings(self) -> impl Iterator<Item = Self> {
        let quadrants = if self.hidden { 1..4 } else { 0..0 };
        quadrants.map(move |quadrant| {
            let turn = exp(Vector3::z() * (FRAC_PI_2 * f64::from(quadrant)));
            let mut turned = self;
            turned.at.initial_attitude = turn * self.at.initial_attitude;
            turned.attitude.mean = turn * self.attitude.mean;
            turned
        })
    }
}

/// What is known of the attitude at the first sample before the filter runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AttitudePrior {
    /// `C_b_n`: a reading of the table or, without, the coarse alignment.
    pub mean: Matrix3<f64>,
    /// 1σ about East, North and Up, rad; the last is that of the heading.
    pub sigma: Vector3<f64>,
}

/// 1σ of the initial attitude before anything is known of it but one reading, rad.
const READ_ATTITUDE: f64 = 60.0 * ARCSEC;
/// 1σ of the initial level without a table, rad. What gave it is in the observations, too, so this is
/// far wider than it is wrong.
const LEVEL: f64 = 0.2 * DEGREE;
/// 1σ of the initial heading without a table, rad, if Earth rate shows it well; else …
const HEADING: f64 = 15.0 * DEGREE;
/// … so many times what Earth rate leaves of it.
const HEADING_SIGMAS: f64 = 3.0;
/// A heading less known than this, rad, is hidden: it may be in any quadrant, and …
const HIDDEN: f64 = 45.0 * DEGREE;
/// … within one, has the standard deviation of a uniform distribution, rad.
const IN_QUADRANT: f64 = 90.0 * DEGREE / 3.464_101_615_137_754_6;

impl AttitudePrior {
    /// From a reading of a table.
    pub(super) fn of_reading(table: &TableRecord, mean: Matrix3<f64>) -> Self {
        // The one reading that gave it has all errors.
        let known = table.position_sigma.hypot(table.reading_sigma);
        let known = known.hypot(table.geometry.base.max());
        Self {
            mean,
            sigma: Vector3::repeat(READ_ATTITUDE.max(10.0 * known)),
        }
    }

    /// From a coarse alignment that knows its heading to this 1σ.
    fn of_alignment(mean: Matrix3<f64>, heading_sigma: f64) -> Self {
        let heading = (HEADING_SIGMAS * heading_sigma).max(HEADING);
        let heading = if heading > HIDDEN {
            IN_QUADRANT
        } else {
            heading
        };
        Self {
            mean,
            sigma: Vector3::new(LEVEL, LEVEL, heading),
        }
    }
}

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
) -> Result<CoarseStart, CalibrationError> {
    enough(dwells)?;
    match (&run.table, first_reading(run, dwells)) {
        (Some(table), Some(initial_attitude)) => Ok(CoarseStart {
            at: Linearisation {
                triads: table::from_table(run, table, dwells, form)?,
                further: FurtherVector::zeros(),
                initial_attitude,
            },
            attitude: AttitudePrior::of_reading(table, initial_attitude),
            hidden: false,
        }),
        _ => {
            let triads = gravity::accelerometers(run, dwells, &run.prior_mean(form))?;
            let Turned {
                at, heading_sigma, ..
            } = turns::triads_and_attitude(run, dwells, &triads)?;
            Ok(CoarseStart {
                at,
                attitude: AttitudePrior::of_alignment(at.initial_attitude, heading_sigma),
                hidden: HEADING_SIGMAS * heading_sigma > HIDDEN,
            })
        }
    }
}

/// Both triads by gravity alone, as a result of its own.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ByGravity {
    pub estimate: Estimate,
    /// Mean square of the residuals, each over its σ; one if nothing but noise is left.
    pub misfit: f64,
}

/// The coarse start without a table, with its covariance.
pub(super) fn by_gravity(
    run: &Run,
    dwells: &[Dwell],
    form: InstallationForm,
) -> Result<ByGravity, CalibrationError> {
    enough(dwells)?;
    let triads = gravity::accelerometers(run, dwells, &run.prior_mean(form))?;
    let Turned { at, equations, .. } = turns::triads_and_attitude(run, dwells, &triads)?;
    let triads = at.triads;
    let covariance = equations.covariance().ok_or_else(|| singular(&triads))?;
    Ok(ByGravity {
        estimate: Estimate { triads, covariance },
        misfit: equations.misfit(),
    })
}

fn enough(dwells: &[Dwell]) -> Result<(), CalibrationError> {
    match dwells {
        [] | [_] => Err(CalibrationError::TooFewDwells {
            found: dwells.len(),
            needed: 2,
        }),
        _ => Ok(()),
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
