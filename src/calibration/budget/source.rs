//! Where the uncertainty of an estimate comes from.

use crate::calibration::layout::{Layout, POSITION, VELOCITY};
use crate::calibration::noise::Source;
use crate::calibration::pass::Driver;
use crate::imu::{Sensor, Term};
use crate::turntable::AxisError;

/// A source of uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
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
    /// What was known of the parameters of an error term, which is estimated.
    Term(Term),
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
    pub fn name(self) -> String {
        let name = match self {
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
            Self::Term(term) => return format!("prior of {}", term.name()),
            Self::Curvature => "second order of unknown angles",
            Self::Headings => "headings that cannot be told apart",
            Self::DwellScatter => "scatter of dwells",
            Self::LearntNoise => "learnt noise",
            Self::Rounding => "rounding of rates",
            Self::ErrorTermsLeftOff => "error terms that show and are left off",
            Self::UnseenVariation => "biases that may vary unseen",
        };
        name.to_owned()
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
            return Term::of(index).map_or(Self::Prior, Self::Term);
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
