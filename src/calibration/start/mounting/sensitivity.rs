//! Message about a triad with a sensitivity different from the stated one.

use std::fmt;

use crate::imu::{AXES, Output, Sensor};
use crate::number::three_digits;
use crate::run::Run;
use crate::units::{DEGREE, STANDARD_GRAVITY};

/// Halfway, in the logarithm, to the sensitivity of the next measuring range, which differs by a factor of two.
pub const NEXT_RANGE: f64 = std::f64::consts::SQRT_2;

/// A triad, or one axis of it, with a sensitivity different from the stated one.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// The triad.
    pub sensor: Sensor,
    /// The axes.
    pub axes: Axes,
    /// Factors relative to the stated sensitivity: the most likely factor, and others that are hardly less likely.
    pub factors: Vec<f64>,
    /// Quantity of its rows, if a file states it.
    output: Option<Output>,
    /// The stated unit.
    unit: String,
}

/// All axes of a triad, or one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axes {
    /// All three axes.
    All,
    /// The axis with this number.
    One(usize),
}

impl Axes {
    /// The possible cases: the whole triad, then each axis.
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

    /// Possible causes, in terms of run.toml.
    fn causes(&self, factor: f64) -> Vec<String> {
        let name = self.sensor.name();
        let mut causes = Vec::new();
        if self.axes == Axes::All {
            let named = UNITS.iter().filter(|(sensor, stated, _, times)| {
                let half_way = (factor / times).ln().abs() < NEXT_RANGE.ln() / 2.0;
                *sensor == self.sensor && *stated == self.unit && half_way
            });
            causes.extend(named.map(|(.., unit, _)| format!("{name}_unit = \"{unit}\"")));
        }
        let times = three_digits(factor);
        let axis = match self.axes {
            Axes::All => String::new(),
            Axes::One(axis) => format!(" of {}", AXES[axis]),
        };
        causes.push(format!(
            "prior.{name}.scale{axis} (should be {times} times the stated value)"
        ));
        // If a row lasts longer by a factor, the same turn takes a rate smaller by that factor.
        let lasts = match (self.output, self.sensor) {
            (Some(Output::Rate), Sensor::Gyro) => Some(factor.recip()),
            (Some(Output::Pulse | Output::Increment), Sensor::Accel) => Some(factor),
            _ => None,
        };
        if let Some(lasts) = lasts.filter(|_| self.axes == Axes::All) {
            causes.push(format!(
                "sample_period_s, --rate or time_unit (if a row lasts {} times as long as stated)",
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
        let (are, measure) = match self.axes {
            Axes::All => ("are", "measure"),
            Axes::One(_) => ("is", "measures"),
        };
        match self.sensor {
            Sensor::Gyro => write!(
                f,
                "the turns fit only if {} {are} {times} times as sensitive as stated",
                self.named("the gyros")
            )?,
            Sensor::Accel => write!(
                f,
                "{} {measure} gravity at rest as {} m/s², {times} times the true value",
                self.named("the accelerometers"),
                three_digits(factor * STANDARD_GRAVITY)
            )?,
        }
        if let [_, others @ ..] = &self.factors[..]
            && !others.is_empty()
        {
            let others: Vec<String> = others.iter().map(|&other| three_digits(other)).collect();
            write!(
                f,
                " (a factor of {} is almost equally probable)",
                others.join(", ")
            )?;
        }
        write!(
            f,
            ". Correct one of these in [imu]: {}",
            self.causes(factor).join("; ")
        )
    }
}

/// Units commonly confused: triad, stated unit, true unit, and the resulting sensitivity factor.
const UNITS: [(Sensor, &str, &str, f64); 6] = [
    (Sensor::Gyro, "rad/s", "deg/s", 1.0 / DEGREE),
    (Sensor::Gyro, "deg/s", "rad/s", DEGREE),
    (Sensor::Gyro, "rad", "deg", 1.0 / DEGREE),
    (Sensor::Gyro, "deg", "rad", DEGREE),
    (Sensor::Accel, "g", "m/s^2", STANDARD_GRAVITY),
    (Sensor::Accel, "m/s^2", "g", 1.0 / STANDARD_GRAVITY),
];
