//! A triad of another sensitivity than is stated, in words.

use std::fmt;

use crate::imu::{AXES, Output, Sensor};
use crate::number::three_digits;
use crate::run::Run;
use crate::units::{DEGREE, STANDARD_GRAVITY};

/// Half way to the sensitivity of the next range, which differs by two.
pub const NEXT_RANGE: f64 = std::f64::consts::SQRT_2;

/// A triad of another sensitivity than is stated, or one axis of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// Which triad.
    pub sensor: Sensor,
    /// Which axes.
    pub axes: Axes,
    /// How many times as sensitive as stated: the likeliest, and others that are hardly less likely.
    pub factors: Vec<f64>,
    /// What its rows hold, where a file says so.
    output: Option<Output>,
    /// The unit that is stated.
    unit: String,
}

/// All axes of a triad, or one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axes {
    /// All three.
    All,
    /// The one with this number.
    One(usize),
}

impl Axes {
    /// The triad, then each axis.
    pub const ALL: [Self; 4] = [Self::All, Self::One(0), Self::One(1), Self::One(2)];
}

impl Sensitivity {
    pub(super) fn of(run: &Run, sensor: Sensor, axes: Axes, factors: Vec<f64>) -> Self {
        Self {
            sensor,
            axes,
            factors,
            output: run.recording.imu.log.as_ref().map(|log| log.output),
            unit: run.instrument.unit.get(sensor).clone(),
        }
    }

    /// The triad, or its axis.
    fn named(&self, triad: &str) -> String {
        match self.axes {
            Axes::All => triad.to_owned(),
            Axes::One(axis) => format!("{} {}", self.sensor.name(), AXES[axis]),
        }
    }

    /// What may be wrong, as run.toml has it.
    fn causes(&self, factor: f64) -> Vec<String> {
        let name = self.sensor.name();
        let mut causes = Vec::new();
        if self.axes == Axes::All {
            let named = UNITS.iter().filter(|of| {
                let half_way = (factor / of.factor).ln().abs() < NEXT_RANGE.ln() / 2.0;
                of.sensor == self.sensor && of.stated == self.unit && half_way
            });
            causes.extend(named.map(|of| format!("{name}_unit = \"{}\"", of.true_unit)));
        }
        let times = three_digits(factor);
        causes.push(match self.axes {
            Axes::All => format!("prior.{name}.scale, which is {times} times the stated one"),
            Axes::One(axis) => format!(
                "prior.{name}.scale of {}, which is {times} times the stated one",
                AXES[axis]
            ),
        });
        // If a row lasts longer by a factor, the same turn takes a rate smaller by that factor.
        let lasts = match (self.output, self.sensor) {
            (Some(Output::Rate), Sensor::Gyro) => Some(factor.recip()),
            (Some(Output::Pulse | Output::Increment), Sensor::Accel) => Some(factor),
            _ => None,
        };
        if let Some(lasts) = lasts.filter(|_| self.axes == Axes::All) {
            causes.push(format!(
                "sample_period_s or time_unit, if a row lasts {} times as long as stated",
                three_digits(lasts)
            ));
        }
        causes
    }
}

impl fmt::Display for Sensitivity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let factor = self.factors.first().copied().unwrap_or(1.0);
        let times = three_digits(factor);
        match self.sensor {
            Sensor::Gyro => write!(
                f,
                "the record turns as if {} were {times} times as sensitive as run.toml states",
                self.named("the gyros")
            )?,
            Sensor::Accel => write!(
                f,
                "of gravity {} show {} m/s² at rest, {times} times as much as they should",
                self.named("the accelerometers"),
                three_digits(factor * STANDARD_GRAVITY)
            )?,
        }
        if let [_, others @ ..] = &self.factors[..]
            && !others.is_empty()
        {
            let others: Vec<String> = others.iter().map(|&other| three_digits(other)).collect();
            write!(f, " ({} times is hardly less likely)", others.join(", "))?;
        }
        write!(
            f,
            ". In [imu] correct one of these: {}",
            self.causes(factor).join("; ")
        )
    }
}

/// A unit that is stated for another.
struct Confused {
    sensor: Sensor,
    stated: &'static str,
    true_unit: &'static str,
    /// How many times as sensitive the triad then is.
    factor: f64,
}

const UNITS: [Confused; 6] = [
    confused(Sensor::Gyro, "rad/s", "deg/s", 1.0 / DEGREE),
    confused(Sensor::Gyro, "deg/s", "rad/s", DEGREE),
    confused(Sensor::Gyro, "rad", "deg", 1.0 / DEGREE),
    confused(Sensor::Gyro, "deg", "rad", DEGREE),
    confused(Sensor::Accel, "g", "m/s^2", STANDARD_GRAVITY),
    confused(Sensor::Accel, "m/s^2", "g", 1.0 / STANDARD_GRAVITY),
];

const fn confused(
    sensor: Sensor,
    stated: &'static str,
    true_unit: &'static str,
    factor: f64,
) -> Confused {
    Confused {
        sensor,
        stated,
        true_unit,
        factor,
    }
}
