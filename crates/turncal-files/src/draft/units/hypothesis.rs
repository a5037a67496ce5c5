//! A possible unit of the rows, with the evidence from gravity at rest and from turns.

use crate::draft::motion::Motion;
use crate::draft::name::Unit;
use turncal::imu::{Output, PerSensor, Sensor};
use turncal::number::rounded;
use turncal::units::STANDARD_GRAVITY;

/// Turns can distinguish two gyro rates or units that differ by this factor.
pub const TURNS_TOLD_APART: f64 = 1.3;
/// Gravity at rest and turns distinguish units that differ by more than this factor, because raw sensors may be off by
/// tenths.
const TOLD_APART: PerSensor<f64> = PerSensor {
    gyro: TURNS_TOLD_APART,
    accel: 1.25,
};

/// The rows of a triad.
pub struct TriadRows<'a> {
    pub motion: &'a Motion,
    /// Sample period in s; NaN if unknown.
    pub period: f64,
    /// Whether the period is stated and not derived from times.
    pub is_stated: bool,
    /// Unit named in the file.
    pub named: Option<Unit>,
    /// Whether the rows are whole numbers.
    pub whole: bool,
}

/// A possible unit of the rows.
pub struct Hypothesis {
    pub word: &'static str,
    pub output: Output,
    pub per_si: f64,
    /// Ratio of measured gravity, or of the measured turn, to its value in this unit; `None` if it is not observed.
    pub factor: Option<f64>,
    told_apart: f64,
}

impl Hypothesis {
    /// A unit: its name, and the number of these units in one SI unit (rad/s or m/s²).
    pub fn new(
        sensor: Sensor,
        (word, per_si): (&'static str, f64),
        output: Output,
        of: &TriadRows,
    ) -> Self {
        let (gravity, angle) = (of.motion.gravity / STANDARD_GRAVITY, of.motion.angle);
        let factor = match (sensor, output) {
            (Sensor::Accel, Output::Rate) => Some(gravity / per_si),
            (Sensor::Accel, _) => Some(gravity / per_si / of.period),
            (Sensor::Gyro, Output::Rate) => angle.map(|angle| angle.abs() * per_si / of.period),
            (Sensor::Gyro, _) => angle.map(|angle| angle.abs() * per_si),
        };
        Self {
            word,
            output,
            per_si,
            factor: factor.filter(|factor| sensor == Sensor::Accel || factor.is_finite()),
            told_apart: *TOLD_APART.get(sensor),
        }
    }

    pub fn fits(&self) -> bool {
        let fits = |factor: f64| factor < self.told_apart && factor > self.told_apart.recip();
        self.factor.is_some_and(fits)
    }

    pub fn is_contradicted(&self) -> bool {
        self.factor.is_some() && !self.fits()
    }

    /// Evidence from motion.
    pub fn evidence(&self, sensor: Sensor, motion: &Motion) -> String {
        let Some(factor) = self.factor.map(|factor| rounded(factor, 4)) else {
            return String::new();
        };
        match (sensor, self.fits()) {
            (Sensor::Accel, true) => format!("{} at rest", rounded(motion.gravity, 4)),
            (Sensor::Accel, false) => {
                format!("the magnitude of the specific force at rest is {factor} times gravity")
            }
            (Sensor::Gyro, true) => {
                "integrated gyro angles match the change of gravity direction".to_owned()
            }
            (Sensor::Gyro, false) => {
                format!("the gravity direction changes by {factor} times the integrated gyro angle")
            }
        }
    }

    /// Reason for the unit named in the file.
    pub fn why_named(&self, sensor: Sensor, motion: &Motion) -> String {
        let link = match self.factor {
            None => "",
            Some(_) if self.fits() => "; ",
            Some(_) => ", but ",
        };
        format!("stated in the file{link}{}", self.evidence(sensor, motion))
    }
}
