//! Where the uncertainty of an estimate comes from.

use crate::imu::{Sensor, Term};

/// A source of uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum BudgetSource {
    /// Random walk of a triad's output.
    White(Sensor),
    /// What moves add to it.
    Moves(Sensor),
    /// Its Gauss–Markov biases.
    Wander(Sensor),
    /// Samples that were missing and are interpolated.
    Interpolated,
    /// Whole pulses, of both triads.
    Pulses,
    /// White velocity at standstill.
    VelocityAtRest,
    /// White attitude at standstill, without a table.
    AttitudeAtRest,
    /// Turning at standstill, without a table.
    RotationAtRest,
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
    /// Heading that Earth rate does not tell.
    Headings,
    /// By how much dwells scatter more than all noise says.
    DwellScatter,
    /// Rounding of rates to steps wider than their noise.
    Rounding,
    /// Length of the rows where nothing tells it.
    Period,
    /// What error terms do that the data show and that are not estimated.
    ErrorTermsLeftOff,
    /// What biases do that may vary though the noise learnt from the record does not hold that.
    UnseenVariation,
}

impl BudgetSource {
    /// What outputs of a triad add up to at standstill.
    pub fn at_rest(sensor: Sensor) -> Self {
        match sensor {
            Sensor::Gyro => Self::AttitudeAtRest,
            Sensor::Accel => Self::VelocityAtRest,
        }
    }

    /// What an engineer calls it.
    pub fn name(self) -> String {
        let name = match self {
            Self::White(sensor) => return format!("{} white noise", sensor.name()),
            Self::Moves(sensor) => return format!("{} noise of moves", sensor.name()),
            Self::Wander(sensor) => return format!("{} bias variation", sensor.name()),
            Self::Interpolated => "interpolated samples",
            Self::Pulses => "pulses",
            Self::VelocityAtRest => "velocity at standstill",
            Self::AttitudeAtRest => "attitude at standstill",
            Self::RotationAtRest => "turning at standstill",
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
            Self::Headings => "unknown heading",
            Self::DwellScatter => "scatter of dwells",
            Self::Rounding => "rounding of rates",
            Self::Period => "sample period",
            Self::ErrorTermsLeftOff => "error terms that show and are left off",
            Self::UnseenVariation => "biases that may vary unseen",
        };
        name.to_owned()
    }
}
