//! The size of a count, either stated or measured.

use crate::draft::motion::TOLERANCE;
use crate::draft::name::Unit;
use crate::unit_scale;
use turncal::imu::{Output, Sensor};
use turncal::number::rounded;
use turncal::units::{DEGREE, STANDARD_GRAVITY};

/// Data-sheet values for counts per degree per second; those for counts per g are powers of two.
const PER_DEGREE: [f64; 17] = [
    131.0, 65.5, 32.8, 16.4, 262.144, 14.375, 114.29, 57.14, 28.57, 14.29, 160.0, 100.0, 80.0,
    50.0, 40.0, 20.0, 10.0,
];

/// Counts per unit of `run.toml`, with the reason.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    /// The file's quantity per second for one rad/s or m/s².
    pub value: f64,
    /// Relative uncertainty of the value from the recording.
    pub off: f64,
    pub why: String,
}

impl Scale {
    /// Size of a count for a named unit that is a multiple of a unit of `run.toml`.
    pub fn of_unit(sensor: Sensor, unit: Unit) -> Option<Self> {
        let of_one = unit_scale(sensor, unit.word).filter(|_| unit.times != 1.0)?;
        let times = rounded(unit.times, 4);
        Some(Self {
            value: of_one / unit.times,
            off: 0.0,
            why: format!("1 unit of the file is {times} {}", unit.word),
        })
    }

    /// Size of a count, in counts per g, from the magnitude of gravity at rest, assuming that the zero is nominal.
    pub fn of_gravity(per_g: f64) -> Self {
        let sheet = [2f64.powf(per_g.log2().round())];
        let by = "the magnitude of gravity at rest, assuming that the zero offset is zero";
        Self::measured(per_g, ("g", STANDARD_GRAVITY), &sheet, by)
    }

    /// Size of a count from turns: counts per rad/s or, for increments, counts per rad.
    pub fn of_turns(per_rad: f64, output: Output) -> Self {
        // The size of a pulse is specific to each instrument.
        let sheet = match output {
            Output::Rate => &PER_DEGREE[..],
            Output::Pulse | Output::Increment => &[],
        };
        let by = "the change of gravity direction";
        Self::measured(per_rad * DEGREE, ("deg/s", DEGREE), sheet, by)
    }

    /// The data-sheet value if one is close enough, otherwise the measured one.
    fn measured(size: f64, (of, one): (&str, f64), sheet: &[f64], by: &str) -> Self {
        let measured = rounded(size, 4);
        let off = |stated: f64| (stated / size - 1.0).abs();
        let nearest = { sheet.iter().copied() }.min_by(|a, b| off(*a).total_cmp(&off(*b)));
        match nearest.filter(|&stated| off(stated) < TOLERANCE) {
            Some(stated) => Self {
                value: stated / one,
                off: off(stated),
                why: format!("{stated} counts per {of}; measured {measured}, from {by}"),
            },
            None => Self {
                value: measured / one,
                off: 2.0 * TOLERANCE,
                why: format!(
                    "{measured} counts per {of}, estimated from {by}; prefer the value in the data sheet"
                ),
            },
        }
    }
}
