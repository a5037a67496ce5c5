//! Where the uncertainty of an estimate comes from.

use serde::{Deserialize, Serialize};

use crate::calibration::layout::{Layout, POSITION, VELOCITY};
use crate::calibration::noise::Source;
use crate::calibration::pass::Driver;
use crate::imu::{Sensor, Term};
use crate::turntable::AxisError;

/// A source of uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BudgetSource {
    /// Angle random walk.
    GyroNoise,
    /// Velocity random walk.
    AccelNoise,
    /// Attitude noise of moves.
    GyroMoves,
    /// Velocity noise of moves.
    AccelMoves,
    /// Gauss–Markov biases of the gyros.
    GyroWander,
    /// Gauss–Markov biases of the accelerometers.
    AccelWander,
    /// Samples that were missing and are interpolated.
    Interpolated,
    /// Whole pulses, of both triads.
    Pulses,
    /// White velocity at standstill.
    VelocityAtRest,
    /// White attitude at standstill, without a table.
    AttitudeAtRest,
    /// Turning at standstill, without a table.
    Turning,
    /// Velocity at the first sample, and position in every dwell: the IMU's distance from the table's
    /// centre.
    Place,
    /// Position errors of the table, new at every position.
    TablePosition,
    /// Readings of the table.
    TableReading,
    /// Level of the table's base.
    TableLevel,
    /// North of the table's base.
    TableNorth,
    /// Axes of the table that are not at right angles.
    TableSquareness,
    /// Wobble of its axes.
    TableWobble,
    /// Encoder errors that repeat with angle.
    TableEncoder,
    /// Gravity at the site.
    Gravity,
    /// What was known of the attitude at the first sample.
    InitialAttitude,
    /// What was known of the parameters.
    Prior,
    /// What was known of how parameters change with temperature.
    Temperature,
    /// By how much the instrument differs between recordings.
    Recording,
    /// What was known of second order of the accelerometers, which is estimated.
    AccelSecondOrder,
    /// Of their asymmetry.
    AccelAsymmetry,
    /// Of their size effect.
    SizeEffect,
    /// Of the time between gyros and accelerometers.
    TimeOffset,
    /// Of the g-sensitivity of the gyros.
    GSensitivity,
    /// Of the asymmetry of the gyros.
    GyroAsymmetry,
    /// Of their second order.
    GyroSecondOrder,
    /// Of their nonlinearity.
    GyroNonlinearity,
    /// Of third order of the accelerometers.
    AccelThirdOrder,
    /// Of their cross coupling.
    AccelCrossCoupling,
    /// Second order of the installation form in angles that are hardly known.
    Curvature,
    /// Headings that the data do not tell apart.
    Headings,
    /// By how much dwells scatter more than all noise says.
    DwellScatter,
    /// Noise that is learnt and could as well be another.
    LearntNoise,
    /// Rounding of rates to steps wider than their noise.
    Rounding,
    /// What error terms do that the data show and that are not estimated.
    ErrorTermsLeftOff,
    /// What biases do that may vary though the noise learnt from the record does not hold that.
    UnseenVariation,
}

impl BudgetSource {
    /// What an engineer calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::GyroNoise => "gyro white noise",
            Self::AccelNoise => "accel white noise",
            Self::GyroMoves => "gyro noise of moves",
            Self::AccelMoves => "accel noise of moves",
            Self::GyroWander => "gyro bias variation",
            Self::AccelWander => "accel bias variation",
            Self::Interpolated => "interpolated samples",
            Self::Pulses => "pulses",
            Self::VelocityAtRest => "velocity at standstill",
            Self::AttitudeAtRest => "attitude at standstill",
            Self::Turning => "turning at standstill",
            Self::Place => "place of the IMU",
            Self::TablePosition => "table position",
            Self::TableReading => "table reading",
            Self::TableLevel => "table level",
            Self::TableNorth => "table north",
            Self::TableSquareness => "squareness of the table's axes",
            Self::TableWobble => "wobble of the table's axes",
            Self::TableEncoder => "table encoders",
            Self::Gravity => "gravity",
            Self::InitialAttitude => "initial attitude",
            Self::Prior => "prior",
            Self::Temperature => "prior of temperature coefficients",
            Self::Recording => "differences between recordings",
            Self::AccelSecondOrder => "prior of accel-second-order",
            Self::AccelAsymmetry => "prior of accel-asymmetry",
            Self::SizeEffect => "prior of size-effect",
            Self::TimeOffset => "prior of time-offset",
            Self::GSensitivity => "prior of g-sensitivity",
            Self::GyroAsymmetry => "prior of gyro-asymmetry",
            Self::GyroSecondOrder => "prior of gyro-second-order",
            Self::GyroNonlinearity => "prior of gyro-nonlinearity",
            Self::AccelThirdOrder => "prior of accel-third-order",
            Self::AccelCrossCoupling => "prior of accel-cross-coupling",
            Self::Curvature => "second order of unknown angles",
            Self::Headings => "headings that cannot be told apart",
            Self::DwellScatter => "scatter of dwells",
            Self::LearntNoise => "learnt noise",
            Self::Rounding => "rounding of rates",
            Self::ErrorTermsLeftOff => "error terms that show and are left off",
            Self::UnseenVariation => "biases that may vary unseen",
        }
    }

    /// What draws a state anew, or is known of it before.
    pub(in crate::calibration) fn of_state(layout: &Layout, state: usize) -> Self {
        let within = |first: Option<usize>| {
            first.and_then(|first| state.checked_sub(first).filter(|&axis| axis < 3))
        };
        let varying = layout
            .varying_biases()
            .find(|&(varying, ..)| varying == state);
        if let Some((_, sensor, _)) = varying {
            return Self::of_driver(Driver::Wander(sensor));
        }
        if (VELOCITY..POSITION + 3).contains(&state) {
            return Self::Place;
        }
        let of_base = |&(base, _): &(usize, usize)| base == state;
        if let Some((_, axis)) = layout.table_base().find(of_base) {
            return match axis {
                2 => Self::TableNorth,
                _ => Self::TableLevel,
            };
        }
        if within(layout.table_position()).is_some() {
            return Self::TablePosition;
        }
        if within(layout.turn_at_rest()).is_some() {
            return Self::Turning;
        }
        if layout.gravity() == Some(state) {
            return Self::Gravity;
        }
        if let Some((_, index)) = layout.table_axes().find(|&(axis, _)| axis == state) {
            let mut kinds = AxisError::ALL.into_iter();
            let kind = kinds.find(|kind| kind.range().contains(&index));
            return match kind {
                Some(AxisError::Tilt) => Self::TableSquareness,
                Some(AxisError::Wobble) => Self::TableWobble,
                _ => Self::TableEncoder,
            };
        }
        if let Some((_, index)) = layout.terms().find(|&(term, _)| term == state) {
            return Term::of(index).map_or(Self::Prior, Self::of_term);
        }
        if layout.thermal().any(|(thermal, _)| thermal == state) {
            return Self::Temperature;
        }
        if layout.own().any(|(own, _)| own == state) {
            return Self::Recording;
        }
        match layout.parameters().any(|(parameter, _)| parameter == state) {
            true => Self::Prior,
            false => Self::InitialAttitude,
        }
    }

    fn of_term(term: Term) -> Self {
        match term {
            Term::AccelSecondOrder => Self::AccelSecondOrder,
            Term::AccelAsymmetry => Self::AccelAsymmetry,
            Term::SizeEffect => Self::SizeEffect,
            Term::TimeOffset => Self::TimeOffset,
            Term::GSensitivity => Self::GSensitivity,
            Term::GyroAsymmetry => Self::GyroAsymmetry,
            Term::GyroSecondOrder => Self::GyroSecondOrder,
            Term::GyroNonlinearity => Self::GyroNonlinearity,
            Term::AccelThirdOrder => Self::AccelThirdOrder,
            Term::AccelCrossCoupling => Self::AccelCrossCoupling,
        }
    }

    pub(in crate::calibration) fn of_driver(driver: Driver) -> Self {
        match driver {
            Driver::White(Sensor::Gyro) => Self::GyroNoise,
            Driver::White(Sensor::Accel) => Self::AccelNoise,
            Driver::Moves(Sensor::Gyro) => Self::GyroMoves,
            Driver::Moves(Sensor::Accel) => Self::AccelMoves,
            Driver::Wander(Sensor::Gyro) => Self::GyroWander,
            Driver::Wander(Sensor::Accel) => Self::AccelWander,
            Driver::Turning => Self::Turning,
            Driver::Interpolated => Self::Interpolated,
        }
    }

    /// What is learnt of it from a record, if anything is.
    pub(in crate::calibration) fn learnt(self) -> &'static [Source] {
        match self {
            Self::GyroNoise => &[Source::AngleRandomWalk],
            Self::AccelNoise => &[Source::VelocityRandomWalk],
            Self::GyroMoves => &[Source::GyroMotion, Source::GyroMoving],
            Self::AccelMoves => &[Source::AccelMotion, Source::AccelMoving],
            Self::GyroWander => &[Source::GyroGaussMarkov],
            Self::AccelWander => &[Source::AccelGaussMarkov],
            Self::VelocityAtRest => &[Source::Velocity],
            Self::AttitudeAtRest => &[Source::Attitude],
            Self::Turning => &[Source::Turning],
            Self::TablePosition => &[Source::TablePosition],
            Self::TableReading => &[Source::TableReading],
            _ => &[],
        }
    }
}
