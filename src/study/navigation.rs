//! What a calibration is worth: the navigation error that what is wrong with it causes, by full
//! nonlinear navigation, and the σ of that error that its covariance predicts, by the linear model.

mod course;
mod outlook;
mod warming;

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use thiserror::Error;

use crate::attitude::from_pitch_roll_heading;
use crate::calibration::{Comparison, ComparisonError, Named, compare};
use crate::calibration::{PARAMETERS, ParameterMatrix, parameter};
use crate::earth::Site;
use crate::imu::BodyFrame;
use crate::imu::{PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad};
use crate::navigation::error_model::{INPUTS, STATES};
use crate::navigation::{
    ErrorMatrix, ErrorModel, ErrorVector, Height, Increments, NavigationError, NearPole,
    Sensitivity, Solution, Strapdown, Trajectory, Transition, sensed_errors, within_reach,
};
use course::Course;

pub use outlook::Outlook;
pub use warming::{Warming, WarmingError, WarmingPair};

/// Time in s between two moments of a result.
pub const INTERVAL: f64 = 60.0;
/// Intervals in the 40 h of the paper's study.
pub const FORTY_HOURS: u32 = 40 * 60;
/// Steps between two moments for a body that stands: 10 s. Against steps of a tenth 40 h differ by
/// 1e-8°.
const STANDING_STEPS: u32 = 6;
/// Steps between two moments for a body that moves: 0.1 s. An ideal instrument then errs by a
/// decimetre in a flight of four hours.
const MOVING_STEPS: u32 = 600;
/// Steps of the linear model between two moments for a body that moves: 0.25 s, in which a vehicle turns
/// by 5°.
const LINEAR_STEPS: u32 = 240;
/// Steps after which the linear model of a steady motion is made anew: 10 s.
const RENEWED: u32 = 40;

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
    /// Time between two moments of the result, s; [`INTERVAL`] but for what lasts minutes or less.
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
        Ok(PerSensor {
            gyro: of(Sensor::Gyro)?,
            accel: of(Sensor::Accel)?,
        })
    }
}

/// Error of what a triad senses: proportional to the input, and constant.
struct Sensed {
    relative: Matrix3<f64>,
    constant: Vector3<f64>,
}

impl Sensed {
    /// The integral over a step from that of the input.
    fn over(&self, input: &Vector3<f64>, period: f64) -> Vector3<f64> {
        input + self.relative * input + self.constant * period
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

    /// The errors alone, by nonlinear navigation: 7 ms for a body that stands for 40 h.
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
        let steps = match &self.motion {
            Motion::Standing(_) => STANDING_STEPS,
            Motion::Moving(_) => MOVING_STEPS,
        };
        let period = self.interval / f64::from(steps);
        let mut course = Course::new(&self.motion, period);
        let mut navigation = Strapdown::new(course.truth().with_errors(start), period)?;
        let mut moments = vec![moment(0.0, &navigation, course.truth())];
        for interval in 1..=self.intervals {
            let sensed = sensed(interval)?;
            for _ in 0..steps {
                let ideal = course.advance();
                let truth = course.truth();
                let held = Height::Held {
                    height: truth.height,
                    velocity: truth.velocity.z,
                };
                let increments = Increments {
                    angle: sensed.gyro.over(&ideal.angle, period),
                    velocity: sensed.accel.over(&ideal.velocity, period),
                };
                navigation.advance(&increments, held)?;
            }
            let time = f64::from(interval) * self.interval;
            moments.push(moment(time, &navigation, course.truth()));
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
        self.exposure_from(Sensitivity::new(), truth)
    }

    /// The same where the errors at the start depend on the parameters, too.
    ///
    /// # Errors
    /// As for [`Self::navigate`].
    pub fn exposure_from(
        &self,
        start: Sensitivity<PARAMETERS>,
        truth: &PerSensor<Triad>,
    ) -> Result<Vec<Exposure>, NavigationStudyError> {
        let steps = match &self.motion {
            Motion::Standing(_) => 1,
            Motion::Moving(_) => LINEAR_STEPS,
        };
        let step = self.interval / f64::from(steps);
        // Each step is linearised in its middle.
        let mut course = Course::new(&self.motion, 0.5 * step);
        let mut sensitivity = start;
        let mut steady: Option<Linear> = None;
        let mut exposures = vec![exposure(0.0, &sensitivity, course.truth())?];
        for interval in 1..=self.intervals {
            for k in 0..steps {
                let is_steady = course.is_steady_for(step);
                course.advance();
                // Motion that is steady leads over the Earth nevertheless.
                let renewed = k % RENEWED == 0 && matches!(self.motion, Motion::Moving(_));
                let kept = steady.take().filter(|_| is_steady && !renewed);
                let linear = match kept {
                    Some(linear) => linear,
                    None => Linear::about(&course, truth, step)?,
                };
                course.advance();
                sensitivity.advance(&linear.transition, &linear.sensed);
                steady = is_steady.then_some(linear);
            }
            let time = f64::from(interval) * self.interval;
            exposures.push(exposure(time, &sensitivity, course.truth())?);
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

fn moment(time: f64, navigation: &Strapdown, truth: &Solution) -> Epoch {
    Epoch {
        time,
        error: NavigationError::of(navigation.solution(), truth),
        covariance: None,
    }
}

fn exposure(
    time: f64,
    sensitivity: &Sensitivity<PARAMETERS>,
    truth: &Solution,
) -> Result<Exposure, NavigationStudyError> {
    within_reach(truth.latitude)?;
    let by_state = NavigationError::by_state(truth).ok_or(NavigationStudyError::Upright)?;
    Ok(Exposure {
        time,
        by_parameter: by_state * sensitivity.0,
    })
}

/// The linear model over a step.
struct Linear {
    transition: Transition,
    sensed: SMatrix<f64, INPUTS, PARAMETERS>,
}

impl Linear {
    fn about(
        course: &Course,
        triads: &PerSensor<Triad>,
        duration: f64,
    ) -> Result<Self, NavigationStudyError> {
        let truth = course.truth();
        let (rate, force) = course.sensed();
        let held = Height::Held {
            height: truth.height,
            velocity: truth.velocity.z,
        };
        let sensed = sensed_errors(triads, &rate, &force).ok_or_else(|| {
            let gyro = triads.gyro.correction().is_none();
            let sensor = if gyro { Sensor::Gyro } else { Sensor::Accel };
            NavigationStudyError::Singular { sensor }
        })?;
        Ok(Self {
            transition: ErrorModel::about(truth, &force, held).over(duration),
            sensed,
        })
    }
}

#[cfg(test)]
mod tests;
