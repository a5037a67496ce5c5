//! What a calibration is worth: the navigation error that what is wrong with it causes, by the
//! nonlinear equations of navigation, and the σ of that error that its covariance predicts, by the linear model.

mod outlook;
mod warming;

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use thiserror::Error;

use crate::attitude::from_pitch_roll_heading;
use crate::calibration::{
    Comparison, ComparisonError, Named, PARAMETERS, ParameterMatrix, compare, parameter,
};
use crate::earth::Site;
use crate::imu::{BodyFrame, PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad};
use crate::navigation::error_model::{POSITION, STATES};
use crate::navigation::{
    ErrorMatrix, ErrorVector, Forcing, InputError, Instant, Linearisation, NavigationError,
    NearPole, NonlinearError, SensedErrors, Sensitivity, Solution, Stride, Strides, Trajectory,
    within_reach,
};

pub use outlook::Outlook;
pub use warming::{Warming, WarmingError, WarmingPair};

/// Time in s between two moments of a result.
pub const INTERVAL: f64 = 60.0;
/// Intervals in the 40 h of the paper's study.
pub const FORTY_HOURS: u32 = 40 * 60;
/// How a body moves while it navigates.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// It stands.
    Standing(Solution),
    /// It follows a trajectory.
    Moving(Trajectory),
}

/// How, and how long, a body navigates, from perfect alignment, its height held to the true one.
#[derive(Debug, Clone, PartialEq)]
pub struct Mission {
    /// How it moves.
    pub motion: Motion,
    /// How many intervals it lasts.
    pub intervals: u32,
    /// Time between two moments of the result, s; [`INTERVAL`], except for missions of minutes or less.
    pub interval: f64,
}

/// A calibration and the truth, in one body frame and one installation form.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// What the instrument is.
    pub truth: PerSensor<Triad>,
    /// What it is taken for.
    pub calibration: PerSensor<Triad>,
    /// Covariance of the calibration minus the truth; none if no σ is claimed.
    pub covariance: Option<ParameterMatrix>,
}

/// Navigation errors of one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Epoch {
    /// Time since the start, s.
    pub time: f64,
    /// The actual error.
    pub error: NavigationError,
    /// The covariance predicted, in the order of [`NavigationError::to_vector`]; none if the
    /// calibration claims no σ.
    pub covariance: Option<ErrorMatrix>,
}

impl Epoch {
    /// Predicted 1σ of each error, in the order of [`NavigationError::to_vector`].
    pub fn sigma(&self) -> Option<SVector<f64, STATES>> {
        let covariance = self.covariance.as_ref()?;
        Some(covariance.diagonal().map(|v| v.max(0.0).sqrt()))
    }
}

/// Navigation errors against the parameters of both triads at one moment.
#[derive(Debug, Clone, PartialEq)]
pub struct Exposure {
    /// Time since the start, s.
    pub time: f64,
    /// Errors in the order of [`NavigationError::to_vector`] by parameter errors, true − estimated.
    pub by_parameter: SMatrix<f64, STATES, PARAMETERS>,
}

/// Why a calibration's navigation error cannot be had.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum NavigationStudyError {
    /// East-North-Up ends at the poles.
    #[error(transparent)]
    NearPole(#[from] NearPole),
    /// A calibration that cannot be inverted.
    #[error("the sensitivity matrix K·C of the {} is singular: such a calibration navigates nowhere", .sensor.name())]
    Singular {
        /// Which triad.
        sensor: Sensor,
    },
    /// Calibrations that cannot be navigated with while they warm up.
    #[error(transparent)]
    Warming(#[from] WarmingError),
    /// Roll and heading are one.
    #[error("at a pitch of ±90° roll and heading are not apart: give a pitch within ±89°")]
    Upright,
}

impl Pair {
    /// From records, brought to the general form and to a common body frame, which is returned, too.
    /// The truth may be a calibration with a σ of its own.
    ///
    /// # Errors
    /// If the records cannot be compared.
    pub fn of_records(
        calibration: Named,
        truth: Named,
    ) -> Result<(Self, BodyFrame), ComparisonError> {
        let Comparison {
            body_frame,
            reference,
            sides,
            ..
        } = compare(&[calibration], Some(truth))?;
        let Some(side) = sides.into_iter().next() else {
            return Err(ComparisonError::Single);
        };
        let of_truth = reference.covariance.unwrap_or_default();
        let pair = Self {
            truth: reference.triads,
            covariance: side.calibration.covariance.map(|own| own + of_truth),
            calibration: side.calibration.triads,
        };
        Ok((pair, body_frame))
    }

    /// The same with the errors of one triad only; the other is calibrated perfectly.
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

    /// What the calibration makes of the instrument's output, `u_est = M u + m` for each triad.
    fn sensed(&self) -> Result<PerSensor<Sensed>, NavigationStudyError> {
        let of = |sensor: Sensor| {
            let (truth, calibration) = (self.truth.get(sensor), self.calibration.get(sensor));
            let correction = calibration
                .correction()
                .ok_or(NavigationStudyError::Singular { sensor })?;
            // As u + (M − I) u, a small error keeps all its digits.
            let difference = truth.sensitivity() - calibration.sensitivity();
            Ok::<_, NavigationStudyError>(Sensed {
                relative: correction * difference,
                constant: correction * (truth.bias - calibration.bias),
            })
        };
        PerSensor::try_from_fn(of)
    }
}

/// Error of what a triad senses: proportional to the input, and constant.
struct Sensed {
    relative: Matrix3<f64>,
    constant: Vector3<f64>,
}

impl Sensed {
    fn error(&self, input: &Vector3<f64>) -> Vector3<f64> {
        self.relative * input + self.constant
    }
}

impl PerSensor<Sensed> {
    fn errors(&self, at: &Instant) -> InputError {
        let (rate, force) = (self.gyro.error(&at.rate), self.accel.error(&at.force));
        InputError::new(rate.x, rate.y, rate.z, force.x, force.y, force.z)
    }
}

impl Mission {
    /// Standing level at a site, heading North.
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

    /// Navigates: errors and their predicted covariance at the start and after each interval.
    ///
    /// # Errors
    /// If the mission leads to a pole or the calibration is singular.
    pub fn navigate(&self, pair: &Pair) -> Result<Vec<Epoch>, NavigationStudyError> {
        let mut moments = self.errors(pair)?;
        if let Some(covariance) = &pair.covariance {
            for (moment, exposure) in moments.iter_mut().zip(self.exposure(&pair.truth)?) {
                moment.covariance = Some(exposure.covariance(covariance));
            }
        }
        Ok(moments)
    }

    /// The errors alone, by their nonlinear equations: milliseconds for a body that stands for 40 h.
    ///
    /// # Errors
    /// As for [`Self::navigate`].
    pub fn errors(&self, pair: &Pair) -> Result<Vec<Epoch>, NavigationStudyError> {
        self.errors_from(&ErrorVector::zeros(), pair)
    }

    /// The same from a start with these errors.
    ///
    /// # Errors
    /// As for [`Self::navigate`].
    pub fn errors_from(
        &self,
        start: &ErrorVector,
        pair: &Pair,
    ) -> Result<Vec<Epoch>, NavigationStudyError> {
        self.errors_by(start, |_| pair.sensed())
    }

    /// The same where what is sensed is new in each interval, told by number.
    fn errors_by(
        &self,
        start: &ErrorVector,
        sensed: impl Fn(u32) -> Result<PerSensor<Sensed>, NavigationStudyError>,
    ) -> Result<Vec<Epoch>, NavigationStudyError> {
        let mut course = Course::new(&self.motion);
        within_reach(course.here().truth.latitude + start[POSITION])?;
        let mut errors = NonlinearError::new(start);
        let mut moments = vec![moment(0.0, &errors, &course.here().truth)];
        for interval in 1..=self.intervals {
            let sensed = sensed(interval)?;
            let time = f64::from(interval) * self.interval;
            let forcing = |at: &Instant| Forcing::of(at, &sensed.errors(at));
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

    /// What each parameter's error does, by the linear model, at the start and after each interval. It
    /// depends on the instrument so little that one will do for all of a grade.
    ///
    /// # Errors
    /// As for [`Self::navigate`].
    pub fn exposure(
        &self,
        truth: &PerSensor<Triad>,
    ) -> Result<Vec<Exposure>, NavigationStudyError> {
        self.exposure_from(Sensitivity::zeros(), truth)
    }

    /// The same where the errors at the start depend on the parameters, too.
    ///
    /// # Errors
    /// As for [`Self::navigate`].
    pub fn exposure_from(
        &self,
        mut sensitivity: Sensitivity,
        truth: &PerSensor<Triad>,
    ) -> Result<Vec<Exposure>, NavigationStudyError> {
        let sensed = sensed_errors(truth)?;
        let Motion::Standing(truth) = &self.motion else {
            let linear = |at: &Instant| Linearisation::about(at, &sensed);
            return self.exposure_by(sensitivity, |_| Ok(linear));
        };
        // At rest one exact step does for all intervals.
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

    /// The same with a linear model that is new in each interval, told by number.
    fn exposure_by<L: Fn(&Instant) -> Linearisation>(
        &self,
        mut sensitivity: Sensitivity,
        linear: impl Fn(u32) -> Result<L, NavigationStudyError>,
    ) -> Result<Vec<Exposure>, NavigationStudyError> {
        let mut course = Course::new(&self.motion);
        let mut exposures = vec![exposure(0.0, &sensitivity, &course.here().truth)?];
        for interval in 1..=self.intervals {
            let linear = linear(interval)?;
            let time = f64::from(interval) * self.interval;
            let mut start = linear(course.here());
            course.go(time, 0.0, |stride| {
                let [middle, end] = [&stride.middle, &stride.end].map(&linear);
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
    /// Horizontal position error, east and north in m, by parameter errors, true − estimated.
    pub fn position(&self) -> SMatrix<f64, 2, PARAMETERS> {
        self.by_parameter.fixed_rows::<2>(6).into_owned()
    }

    /// Covariance of the errors from that of the parameters, in the order of
    /// [`NavigationError::to_vector`].
    pub fn covariance(&self, parameters: &ParameterMatrix) -> ErrorMatrix {
        self.by_parameter * parameters * self.by_parameter.transpose()
    }
}

fn sensed_errors(triads: &PerSensor<Triad>) -> Result<SensedErrors, NavigationStudyError> {
    SensedErrors::new(triads).map_err(|sensor| NavigationStudyError::Singular { sensor })
}

fn moment(time: f64, errors: &NonlinearError, truth: &Solution) -> Epoch {
    Epoch {
        time,
        error: NavigationError::of(&errors.computed(truth), truth),
        covariance: None,
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

/// A body's true motion step by step, whether it stands or moves.
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

    /// The true state now and what is sensed in it.
    fn here(&self) -> &Instant {
        match self {
            Self::Standing { here, .. } => here,
            Self::Moving(strides) => strides.here(),
        }
    }

    /// Goes on until a time in s since the start, as [`Strides::go`] does.
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
