//! The instrument's samples.

mod parts;
mod reading;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::clock::Clock;
use super::error::FileError;
use super::joined::{self, Part};
use super::rows::LogRows;
use super::source::Source;
use super::temperature::TemperatureColumns;
use crate::imu::{AxisOrder, Nominal, Output, PerSensor, Sensor};
use crate::recording::{FileColumn, ImuSamples, NamedColumns};
use parts::Sizes;
use reading::Reading;

/// The moment of a sample that its time stamp marks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum TimeStamp {
    End,
    Start,
    Middle,
}

impl TimeStamp {
    /// Time from the start of a sample to its stamp, in samples.
    pub fn lag(self) -> f64 {
        match self {
            Self::Start => 0.0,
            Self::Middle => 0.5,
            Self::End => 1.0,
        }
    }
}

/// Log settings in `run.toml`.
pub struct ImuLog<'a> {
    pub source: Source<'a>,
    pub clock: Clock<'a>,
    /// Source of the accelerometers, if not in the gyro rows.
    pub accel_from: Option<(Source<'a>, Clock<'a>)>,
    /// Column and number of the selected instrument, if the log has several.
    pub instance: Option<(&'a str, f64)>,
    /// Empty names for a missing triad.
    pub triads: PerSensor<[&'a str; 3]>,
    pub temperature: Option<TemperatureColumns<'a>>,
    pub output: Output,
    pub axes: AxisOrder,
    pub stamp: TimeStamp,
    pub continuous: bool,
    /// Along right-front-up.
    pub nominal: PerSensor<Nominal>,
    /// Largest magnitude of a row value.
    pub full_scale: PerSensor<Option<f64>>,
}

/// Column indices of the values of a sample.
#[derive(Clone)]
pub struct Layout {
    /// Gyro x, y, z and accelerometer x, y, z, in file order.
    names: [FileColumn; 6],
    /// `None` for a missing triad.
    places: [Option<usize>; 6],
    /// Body axis of each (right, front or up).
    body_axes: [usize; 6],
}

fn sensor(column: usize) -> Sensor {
    Sensor::ALL[column / 3]
}

impl Layout {
    /// Rad and m/s per unit of each column in a row, from nominal scales.
    fn units(&self, log: &ImuLog, period: f64) -> [f64; 6] {
        let unit = |k: usize| log.seconds(period) / log.nominal.get(sensor(k)).0[self.body_axes[k]];
        std::array::from_fn(unit)
    }

    fn full_scale(&self, log: &ImuLog) -> [Option<f64>; 6] {
        std::array::from_fn(|k| *log.full_scale.get(sensor(k)))
    }

    /// The columns of a triad along right, front and up.
    fn columns(&self, sensor: Sensor) -> [usize; 3] {
        let first = 3 * sensor as usize;
        let along = |axis: usize| (first..first + 3).find(|&k| self.body_axes[k] == axis);
        [0, 1, 2].map(|axis| along(axis).unwrap_or(first + axis))
    }

    /// One rad and m/s along right, front and up, in the unit of the corresponding column.
    fn body_nominal(&self, log: &ImuLog, sensor: Sensor) -> Vector3<f64> {
        let columns = self.columns(sensor);
        Vector3::from_fn(|axis, _| {
            let k = columns[axis];
            let sign = if self.names[k].reversed { -1.0 } else { 1.0 };
            let along = log.axes.apply(&Vector3::ith(k % 3, sign));
            log.nominal.get(sensor).0[axis] * along[axis]
        })
    }

    fn triads(&self) -> PerSensor<[FileColumn; 3]> {
        let name = |k: usize| self.names[k].clone();
        PerSensor::from_fn(|sensor| [0, 1, 2].map(|axis| name(3 * sensor as usize + axis)))
    }
}

impl ImuLog<'_> {
    /// Factor that converts a row value to an integral over its sample.
    fn seconds(&self, period: f64) -> f64 {
        match self.output {
            Output::Pulse | Output::Increment => 1.0,
            Output::Rate => period,
        }
    }

    /// Reads the samples, finds and bridges faults; `notes` receives remarks about the file.
    pub fn read(&self, notes: &mut Vec<String>) -> Result<ImuSamples, FileError> {
        self.read_by(Sizes::default(), notes)
    }

    fn read_by(&self, sizes: Sizes, notes: &mut Vec<String>) -> Result<ImuSamples, FileError> {
        let mut known = None;
        loop {
            let mut csv = self.open()?;
            let layout = self.layout(&mut csv)?;
            let mut reading = Reading::begin(self, &mut csv, layout.places)?;
            let parts = reading.all(&mut csv, &layout, sizes, known.as_ref())?;
            let clock = parts.clock().map_err(|error| csv.placed(error))?;
            if parts.are_packed() && known.is_none() && clock.wander.is_some() {
                // Too long to be held: it is read again with the clock that it was found to have.
                known = clock.wander;
                continue;
            }
            notes.extend(clock.uneven());
            notes.extend(csv.cut_off("turncal ignored it"));
            notes.extend_from_slice(csv.remarks());
            notes.extend(reading.notes());
            notes.extend(reading.stamps.notes(&self.source.file, parts.missing()));
            let mut imu = parts.finish(clock, reading.duplicates, csv.integral_error());
            for stretch in &mut imu.stretches {
                stretch.start = reading.stamps.told(stretch.start);
            }
            if let Some(temperature) = reading.temperature {
                let read = temperature.read(&self.source.file.display().to_string());
                notes.extend(read.notes);
                imu.temperature = read.temperature;
                if let Some(log) = &mut imu.log {
                    log.temperature = read.facts;
                }
            }
            return Ok(imu);
        }
    }

    /// The columns with their names in the file.
    fn named_columns(&self, layout: &Layout) -> NamedColumns {
        NamedColumns {
            time: self.clock_of_rows().column.map(str::to_owned),
            triads: layout.triads(),
            temperature: self.temperature.as_ref().map(|t| t.first().to_owned()),
            axes: self.axes,
        }
    }

    /// The rows of both triads.
    fn open(&self) -> Result<LogRows, FileError> {
        let Some((source, clock)) = &self.accel_from else {
            return self.source.open();
        };
        let parts = PerSensor {
            gyro: Part {
                source: &self.source,
                clock: self.clock,
                columns: self.triads.gyro,
                further: self
                    .temperature
                    .as_ref()
                    .map_or(&[], |columns| columns.names()),
            },
            accel: Part {
                source,
                clock: *clock,
                columns: self.triads.accel,
                further: &[],
            },
        };
        joined::read(&parts, self.output, self.stamp.lag()).map(LogRows::new)
    }

    fn clock_of_rows(&self) -> Clock<'_> {
        match self.accel_from {
            Some(_) => joined::clock(self.clock.period),
            None => self.clock,
        }
    }

    fn layout(&self, csv: &mut LogRows) -> Result<Layout, FileError> {
        let names = match self.accel_from {
            Some(_) => joined::distinct(&self.triads),
            None => PerSensor::from_fn(|sensor| self.triads.get(sensor).map(str::to_owned)),
        };
        let names = names.gyro.iter().chain(&names.accel);
        let mut layout = Layout {
            names: std::array::from_fn(|_| FileColumn::default()),
            places: [None; 6],
            body_axes: std::array::from_fn(|k| self.axes.inverse().source[k % 3]),
        };
        for (k, name) in names.enumerate().filter(|(_, name)| !name.is_empty()) {
            let (place, column) = csv.signed_column(name)?;
            (layout.places[k], layout.names[k]) = (Some(place), column);
        }
        Ok(layout)
    }
}

#[cfg(test)]
mod tests;
