//! Sources of the uncertainty of an estimate.

use crate::imu::{Sensor, Term};

/// A source of uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum BudgetSource {
    /// Random walk of a triad's output.
    White(Sensor),
    /// Additional noise of a triad during moves.
    Moves(Sensor),
    /// Gauss–Markov biases of a triad.
    Wander(Sensor),
    /// Interpolation of missing samples.
    Interpolated,
    /// Whole pulses, of both triads.
    Pulses,
    /// White velocity at standstill.
    VelocityAtRest,
    /// White attitude at standstill, without a table.
    AttitudeAtRest,
    /// Turning at standstill, without a table.
    RotationAtRest,
    /// Velocity at the first sample, and position in every dwell (because the IMU is not at the table centre).
    Place,
    /// Table position errors, independent at each position.
    TablePosition,
    /// Readings of the table.
    TableReading,
    /// Settling of the table after stops.
    Settling,
    /// Slips of the instrument on the table and of the table on the ground.
    Slips,
    /// Level of the table's base.
    TableLevel,
    /// North of the table's base.
    TableNorth,
    /// Non-orthogonality of the table axes.
    TableSquareness,
    /// Wobble of the table axes.
    TableWobble,
    /// Encoder errors that repeat with angle.
    TableEncoder,
    /// Gravity at the site.
    Gravity,
    /// Prior of the attitude at the first sample.
    InitialAttitude,
    /// Prior of the parameters.
    Prior,
    /// Prior of the parameters' temperature dependence.
    Temperature,
    /// Differences of the instrument between recordings.
    Recording,
    /// Parameters of an error term.
    Term(Term),
    /// Second-order effects of the misalignment form in poorly known angles.
    Curvature,
    /// Headings not determined by Earth rate.
    Headings,
    /// Rounding of rates to steps wider than their noise.
    Rounding,
    /// Sample period, if not determined by a clock.
    Period,
    /// Earth rate, if it may differ from that at the stated latitude.
    EarthRate,
    /// Prior of the magnetometer and the field at its site.
    Magnetometer,
    /// Noise of the magnetometer.
    MagneticNoise,
    /// Disturbances of the magnetic field.
    MagneticDisturbance,
}

impl BudgetSource {
    /// The source of the integrated output of a triad at standstill.
    pub fn at_rest(sensor: Sensor) -> Self {
        match sensor {
            Sensor::Gyro => Self::AttitudeAtRest,
            Sensor::Accel => Self::VelocityAtRest,
        }
    }

    /// Name for reports.
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
            Self::Place => "position of the IMU",
            Self::TablePosition => "table position",
            Self::TableReading => "table reading",
            Self::Settling => "settling of the table",
            Self::Slips => "slips in moves",
            Self::TableLevel => "table level",
            Self::TableNorth => "table north",
            Self::TableSquareness => "non-orthogonality of the table axes",
            Self::TableWobble => "wobble of the table axes",
            Self::TableEncoder => "table encoders",
            Self::Gravity => "gravity",
            Self::InitialAttitude => "initial attitude",
            Self::Prior => "prior",
            Self::Temperature => "temperature coefficients",
            Self::Recording => "differences between recordings",
            Self::Term(term) => return term.name().to_owned(),
            Self::Curvature => "second-order effect of unknown angles",
            Self::Headings => "unknown heading",
            Self::Rounding => "rounding of rates",
            Self::Period => "sample period",
            Self::EarthRate => "Earth rate at an uncertain latitude",
            Self::Magnetometer => "prior of the magnetometer and its field",
            Self::MagneticNoise => "noise of the magnetometer",
            Self::MagneticDisturbance => "disturbances of the magnetic field",
        };
        name.to_owned()
    }
}
