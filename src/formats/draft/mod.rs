//! A draft of `run.toml` for a log that has none: what its names and numbers show, each with the reason, and
//! what only a person knows left open.

mod columns;
mod motion;
mod name;
mod noise;
mod text;
mod time;
mod turns;
mod units;

use std::path::Path;

use crate::formats::{FileError, Sheet};
use crate::imu::{PerSensor, Sensor};
use columns::Columns;
use motion::Motion;
use time::Clock;
use units::Quantities;

/// Fewer rows than a run may have show nothing.
const FEWEST_ROWS: usize = 100;
/// The period taken where none is known, only to look for rests and turns, s.
const USUAL_PERIOD: f64 = 0.01;

/// What a log shows of the instrument and its record.
#[derive(Debug, Clone, PartialEq)]
pub struct Draft {
    columns: Columns,
    clock: Clock,
    quantities: Quantities,
    /// What a register says at zero, a row.
    offset: PerSensor<f64>,
    /// White noise in the file's quantity per second and √Hz, where something stands.
    noise: PerSensor<Option<f64>>,
    /// Output of the gyros at rest, the file's quantity a row.
    rest: Option<f64>,
    /// Sections laid end to end, as far as gravity shows.
    cuts: usize,
}

impl Draft {
    /// Looks at a file of rows.
    ///
    /// # Errors
    /// [`FileError`] if it cannot be read or has hardly any rows.
    pub fn of_file(path: &Path) -> Result<Self, FileError> {
        let sheet = Sheet::read(path, FEWEST_ROWS)?;
        let columns = Columns::find(&sheet);
        let clock = Clock::find(&sheet, columns.time);
        let mut triads = columns.samples(&sheet);
        let offset = triads.as_mut().map(units::centre).unwrap_or_default();
        let period = clock.period.unwrap_or(USUAL_PERIOD);
        let motion = triads.as_ref().map(|triads| Motion::find(triads, period));
        let quantities =
            Quantities::find(&sheet, &columns, &clock, triads.as_ref(), motion.as_ref());
        let noise = PerSensor::from_fn(|sensor: Sensor| {
            clock.period?;
            let samples = triads.as_ref()?.get(sensor);
            let rest = motion.as_ref()?.longest_rest.clone();
            noise::white_level(&samples[rest], period, quantities.per_second(period))
        });
        Ok(Self {
            rest: motion.as_ref().map(|motion| motion.rest.amax()),
            cuts: motion.as_ref().map_or(0, |motion| motion.cuts),
            columns,
            clock,
            quantities,
            offset,
            noise,
        })
    }
}

#[cfg(test)]
mod tests;
