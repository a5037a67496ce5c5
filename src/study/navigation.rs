//! Navigation accuracy of a calibration: the nonlinear equations of navigation give the navigation error due to the
//! errors of the calibration, and the linear model predicts the σ of this error from the covariance.

mod methods;
mod outlook;
mod quantity;
mod suited;

use nalgebra::{Matrix3, SMatrix, Vector3};
use thiserror::Error;

use crate::attitude::from_pitch_roll_heading;
use crate::calibration::result::frame::{in_common_form, own_nominal};
use crate::calibration::{ComparisonError, Named, PARAMETERS, ParameterMatrix, parameter};
use crate::earth::Site;
use crate::imu::{BodyFrame, PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad};
use crate::models::{self, ModelError, Place};
use crate::navigation::error_model::{POSITION, STATES};
use crate::navigation::{
    ErrorMatrix, ErrorVector, Forcing, InputError, Instant, Linearisation, NavigationError,
    NearPole, NonlinearError, SensedErrors, Sensitivity, Solution, Stride, Strides, Trajectory,
    within_reach,
};

pub use methods::{MethodOutlook, navigate_with_each};
pub use outlook::Outlook;
pub use quantity::Quantity;

/// Time in s between two moments of a result.
pub const INTERVAL: f64 = 60.0;
/// Number of intervals in the 40 h of the paper's study.
pub const FORTY_HOURS: u32 = 40 * 60;
/// Motion of a navigating body.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// At rest.
    Standing(Solution),
    /// Along a trajectory.
    Moving(Trajectory),
}

impl Motion {
    /// At rest at a latitude in rad and a height in m, with pitch, roll and heading in rad.
    pub fn at_rest(latitude: f64, height: f64, [pitch, roll, heading]: [f64; 3]) -> Self {
        Self::Standing(Solution {
            attitude: from_pitch_roll_heading(pitch, roll, heading),
            velocity: Vector3::zeros(),
            latitude,
            longitude: 0.0,
            height,
        })
    }

    /// Motion along a trajectory with this name, moved to another latitude in rad or height in m; also returns the name
    /// of the trajectory.
    ///
    /// # Errors
    /// Returns [`ModelError`] if the trajectory cannot be read.
    pub fn along(
        name: &str,
        latitude: Option<f64>,
        height: Option<f64>,
    ) -> Result<(Self, String), ModelError> {
        let (mut trajectory, name) = models::trajectory(name, &Place::CommandLine)?;
        if let Some(latitude) = latitude {
            trajectory = trajectory.at_latitude(latitude);
        }
        if let Some(height) = height {
            trajectory = trajectory.at_height(height);
        }
        Ok((Self::Moving(trajectory), name))
    }
}

/// Motion and duration of navigation, starting from perfect alignment, with the height fixed to the true height.
#[derive(Debug, Clone, PartialEq)]
pub struct Mission {
    /// Motion of the body.
    pub motion: Motion,
    /// Number of intervals.
    pub intervals: u32,
    /// Time between two moments of the result, s; [`INTERVAL`], except for missions of minutes or less.
    pub interval: f64,
}

/// A calibration and the truth, in one body frame and one misalignment form.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// The true triads.
    pub truth: PerSensor<Triad>,
    /// The triads according to the calibration.
    pub calibration: PerSensor<Triad>,
    /// Covariance of the calibration minus the truth; `None` if no σ is stated.
    pub covariance: Option<ParameterMatrix>,
}

/// Sensitivity of navigation errors to the parameters of both triads at one moment.
#[derive(Debug, Clone, PartialEq)]
pub struct Exposure {
    /// Time since the start, s.
    pub time: f64,
    /// Errors for a unit parameter error (true − estimated), in the order of [`NavigationError::to_vector`].
    pub by_parameter: SMatrix<f64, STATES, PARAMETERS>,
}

/// Reasons why the navigation error of a calibration cannot be computed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum NavigationStudyError {
    /// East-North-Up is singular at the poles.
    #[error(transparent)]
    NearPole(#[from] NearPole),
    /// The calibration cannot be inverted.
    #[error("the sensitivity matrix K·C of the {} is singular: this calibration cannot be used for navigation", .sensor.name())]
    Singular {
        /// The triad.
        sensor: Sensor,
    },
    /// Roll and heading cannot be distinguished.
    #[error(
        "at a pitch of ±90°, roll and heading cannot be distinguished: give a pitch within ±89°"
    )]
    Upright,
}

impl Pair {
    /// Makes a pair from two records, converted to the general form and a common body frame; also returns this frame.
    /// The truth may be a calibration with its own σ.
    ///
    /// # Errors
    /// An error if the records cannot be compared.
    pub fn of_records(
        calibration: Named,
        truth: Named,
    ) -> Result<(Self, BodyFrame), ComparisonError> {
        let nominal = own_nominal(truth.record);
        let [truth, calibration] = in_common_form(truth, calibration, &nominal)?;
        let of_truth = truth.covariance.unwrap_or_default();
        let pair = Self {
            truth: truth.triads,
            covariance: calibration.covariance.map(|own| own + of_truth),
            calibration: calibration.triads,
        };
        Ok((pair, calibration.body_frame))
    }

    /// A copy with the errors of one triad only; the other triad is perfectly calibrated.
    pub fn with_errors_of(mut self, only: Sensor) -> Self {
        for sensor in Sensor::ALL.into_iter().filter(|&sensor| sensor != only) {
            *self.calibration.get_mut(sensor) = *self.truth.get(sensor);
            if let Some(covariance) = &mut self.covariance {
                let first = parameter(sensor, 0);
                covariance.fixed_rows_mut::<PER_TRIAD>(first).fill(0.0);
                covariance.fixed_columns_mut::<PER_TRIAD>(first).fill(0.0);
            }
        }
        self
    }

    /// Calibrated output of the instrument, `u_est = M u + m` for each triad.
    fn sensed(&self) -> Result<PerSensor<Sensed>, NavigationStudyError> {
        let of = |sensor: Sensor| {
            let (truth, calibration) = (self.truth.get(sensor), self.calibration.get(sensor));
            let correction = calibration
                .correction()
                .ok_or(NavigationStudyError::Singular { sensor })?;
            // Written as u + (M − I) u, so that a small error keeps all its digits.
            let difference = truth.sensitivity() - calibration.sensitivity();
            Ok::<_, NavigationStudyError>(Sensed {
                relative: correction * difference,
                constant: correction * (truth.bias - calibration.bias),
            })
        };
        PerSensor::try_from_fn(of)
    }
}

/// Error of the sensed input of a triad: a proportional part, and a constant one.
struct Sensed {
    relative: Matrix3<f64>,
    constant: Vector3<f64>,
}

impl Sensed {
    fn error(&self, input: &Vector3<f64>) -> Vector3<f64> {
        self.relative * input + self.constant
    }
}

fn input_errors(sensed: &PerSensor<Sensed>, at: &Instant) -> InputError {
    let (rate, force) = (sensed.gyro.error(&at.rate), sensed.accel.error(&at.force));
    InputError::new(rate.x, rate.y, rate.z, force.x, force.y, force.z)
}

impl Mission {
    /// A mission in which the body is stationary and level at a site and heads north.
    pub fn standing_level(site: &Site, intervals: u32) -> Self {
        Self {
            motion: Motion::Standing(Solution {
                attitude: from_pitch_roll_heading(0.0, 0.0, 0.0),
                velocity: Vector3::zeros(),
                latitude: site.latitude,
                longitude: site.longitude,
                height: site.height,
            }),
            intervals,
            interval: INTERVAL,
        }
    }

    /// True state and sensed input at the start.
    pub fn start(&self) -> Instant {
        *Course::new(&self.motion).here()
    }

    /// Navigates and returns the errors and their predicted covariance at the start and after each interval.
    ///
    /// # Errors
    /// Returns an error if the mission leads to a pole or the calibration is singular.
    pub fn navigate(&self, pair: &Pair) -> Result<Vec<Outlook>, NavigationStudyError> {
        let mut moments = self.errors(pair)?;
        if let Some(covariance) = &pair.covariance {
            for (moment, exposure) in moments.iter_mut().zip(self.exposure(&pair.truth)?) {
                moment.sigma = Some(outlook::sigma(&exposure.covariance(covariance)));
            }
        }
        Ok(moments)
    }

    /// Navigation errors without σ, from the nonlinear equations; the calculation takes milliseconds for 40 h at rest.
    ///
    /// # Errors
    /// The errors of [`Self::navigate`].
    pub fn errors(&self, pair: &Pair) -> Result<Vec<Outlook>, NavigationStudyError> {
        self.errors_from(&ErrorVector::zeros(), pair)
    }

    /// Does the same as [`Self::errors`], but navigation starts with these errors.
    ///
    /// # Errors
    /// The same errors as [`Self::navigate`].
    pub fn errors_from(
        &self,
        start: &ErrorVector,
        pair: &Pair,
    ) -> Result<Vec<Outlook>, NavigationStudyError> {
        let sensed = pair.sensed()?;
        let mut course = Course::new(&self.motion);
        within_reach(course.here().truth.latitude + start[POSITION])?;
        let mut errors = NonlinearError::new(start);
        let mut moments = vec![moment(0.0, &errors, &course.here().truth)];
        for interval in 1..=self.intervals {
            let time = f64::from(interval) * self.interval;
            let forcing = |at: &Instant| Forcing::of(at, &input_errors(&sensed, at));
            let mut start = forcing(course.here());
            course.go(time, sensed.gyro.constant.norm(), |stride| {
                let [middle, end] = [&stride.middle, &stride.end].map(forcing);
                errors.advance(stride.duration, [&start, &middle, &end])?;
                start = end;
                Ok::<_, NavigationStudyError>(())
            })?;
            moments.push(moment(time, &errors, &course.here().truth));
        }
        Ok(moments)
    }

    /// Sensitivity to each parameter at the start and after each interval, from the linear model. The sensitivity
    /// depends so little on the instrument that one result serves for a whole grade.
    ///
    /// # Errors
    /// The same errors as [`Self::navigate`].
    pub fn exposure(
        &self,
        truth: &PerSensor<Triad>,
    ) -> Result<Vec<Exposure>, NavigationStudyError> {
        self.exposure_from(Sensitivity::zeros(), truth)
    }

    /// Does the same as [`Self::exposure`], if the initial errors also depend on the parameters.
    ///
    /// # Errors
    /// The same errors as [`Self::navigate`].
    pub fn exposure_from(
        &self,
        mut sensitivity: Sensitivity,
        truth: &PerSensor<Triad>,
    ) -> Result<Vec<Exposure>, NavigationStudyError> {
        let sensed = sensed_errors(truth)?;
        let Motion::Standing(truth) = &self.motion else {
            return self.exposure_moving(sensitivity, &sensed);
        };
        // At rest, one exact step serves for all intervals.
        let at = truth.steady();
        let transition = at.linear_model().over(self.interval);
        let added = transition.input * sensed.at(&at);
        let mut exposures = vec![exposure(0.0, &sensitivity, truth)?];
        for interval in 1..=self.intervals {
            sensitivity = transition.errors * sensitivity + added;
            exposures.push(exposure(
                f64::from(interval) * self.interval,
                &sensitivity,
                truth,
            )?);
        }
        Ok(exposures)
    }

    /// Does the same as [`Self::exposure`], step by step along a trajectory.
    fn exposure_moving(
        &self,
        mut sensitivity: Sensitivity,
        sensed: &SensedErrors,
    ) -> Result<Vec<Exposure>, NavigationStudyError> {
        let linear = |at: &Instant| Linearisation::about(at, sensed);
        let mut course = Course::new(&self.motion);
        let mut exposures = vec![exposure(0.0, &sensitivity, &course.here().truth)?];
        for interval in 1..=self.intervals {
            let time = f64::from(interval) * self.interval;
            let mut start = linear(course.here());
            course.go(time, 0.0, |stride| {
                let [middle, end] = [&stride.middle, &stride.end].map(linear);
                let linearised = [&start, &middle, &end];
                sensitivity = Linearisation::follow(&sensitivity, stride.duration, linearised);
                start = end;
                Ok::<_, NavigationStudyError>(())
            })?;
            exposures.push(exposure(time, &sensitivity, &course.here().truth)?);
        }
        Ok(exposures)
    }
}

impl Exposure {
    /// Horizontal position error, east and north in m, for a unit parameter error, true − estimated.
    pub fn position(&self) -> SMatrix<f64, 2, PARAMETERS> {
        self.by_parameter.fixed_rows::<2>(6).into_owned()
    }

    /// Covariance of the errors from the covariance of the parameters, in the order of [`NavigationError::to_vector`].
    pub fn covariance(&self, parameters: &ParameterMatrix) -> ErrorMatrix {
        self.by_parameter * parameters * self.by_parameter.transpose()
    }
}

fn sensed_errors(triads: &PerSensor<Triad>) -> Result<SensedErrors, NavigationStudyError> {
    SensedErrors::new(triads).map_err(|sensor| NavigationStudyError::Singular { sensor })
}

fn moment(time: f64, errors: &NonlinearError, truth: &Solution) -> Outlook {
    Outlook {
        time,
        error: Some(NavigationError::of(&errors.computed(truth), truth)),
        sigma: None,
    }
}

fn exposure(
    time: f64,
    sensitivity: &Sensitivity,
    truth: &Solution,
) -> Result<Exposure, NavigationStudyError> {
    within_reach(truth.latitude)?;
    let by_state = NavigationError::by_state(truth).ok_or(NavigationStudyError::Upright)?;
    Ok(Exposure {
        time,
        by_parameter: by_state * sensitivity,
    })
}

/// True motion of a body step by step, at rest or moving.
enum Course<'a> {
    Standing { here: Instant, time: f64 },
    Moving(Box<Strides<'a>>),
}

impl<'a> Course<'a> {
    fn new(motion: &'a Motion) -> Self {
        match motion {
            Motion::Standing(truth) => Self::Standing {
                here: truth.steady(),
                time: 0.0,
            },
            Motion::Moving(trajectory) => Self::Moving(Box::new(trajectory.strides())),
        }
    }

    /// The current true state and sensed input.
    fn here(&self) -> &Instant {
        match self {
            Self::Standing { here, .. } => here,
            Self::Moving(strides) => strides.here(),
        }
    }

    /// Continues until the given time, in s since the start, like [`Strides::go`].
    fn go<E>(
        &mut self,
        until: f64,
        beside: f64,
        mut each: impl FnMut(&Stride) -> Result<(), E>,
    ) -> Result<(), E> {
        match self {
            Self::Standing { here, time } => {
                let steps = Stride::count(until - *time, here.rate.norm() + beside);
                let stride = Stride {
                    duration: (until - *time) / f64::from(steps),
                    middle: *here,
                    end: *here,
                };
                *time = until;
                (0..steps).try_for_each(|_| each(&stride))
            }
            Self::Moving(strides) => strides.go(until, beside, each),
        }
    }
}

#[cfg(test)]
mod tests;
