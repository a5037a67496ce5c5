//! Settings for the instrument's log in `run.toml`, and the columns of this log.

use nalgebra::Vector3;

use crate::joined;
use crate::joined::Part;
use crate::schema::TimeStamp;
use crate::temperature::TemperatureColumns;
use turncal::imu::{AxisOrder, Nominal, Output, PerSensor, Sensor};
use turncal::recording::NamedColumns;
use turncal_input::{FileColumn, FileError};
use turncal_logs::Source;
use turncal_logs::clock::Clock;
use turncal_logs::rows::LogRows;

/// Log settings in `run.toml`.
pub struct ImuLog<'a> {
    pub source: Source<'a>,
    pub clock: Clock<'a>,
    /// Source of the accelerometers, if they are not in the gyro rows.
    pub accel_from: Option<(Source<'a>, Clock<'a>)>,
    /// Column that identifies the instrument, and its number, if the log contains several instruments.
    pub instance: Option<(&'a str, f64)>,
    /// The names are empty for a missing triad.
    pub triads: PerSensor<[&'a str; 3]>,
    pub temperature: Option<TemperatureColumns<'a>>,
    pub output: Output,
    pub axes: AxisOrder,
    pub stamp: TimeStamp,
    pub continuous: bool,
    /// Scale factors along the right, front and up axes.
    pub nominal: PerSensor<Nominal>,
    /// Largest magnitude of a row value.
    pub full_scale: PerSensor<Option<f64>>,
}

/// Column indices of the values of a sample.
#[derive(Clone)]
pub struct Layout {
    /// Gyro x, y, z and accelerometer x, y, z, in file order.
    pub names: [FileColumn; 6],
    /// `None` for a missing triad.
    pub places: [Option<usize>; 6],
    /// Body axis of each column (right, front or up).
    pub body_axes: [usize; 6],
}

/// The sensor of a column of a sample.
pub fn sensor(column: usize) -> Sensor {
    Sensor::ALL[column / 3]
}

impl Layout {
    /// The angle in rad or velocity in m/s that one unit of each column in a row represents, from nominal scales.
    pub fn units(&self, log: &ImuLog, period: f64) -> [f64; 6] {
        let unit = |k: usize| log.seconds(period) / log.nominal.get(sensor(k)).0[self.body_axes[k]];
        std::array::from_fn(unit)
    }

    pub fn full_scale(&self, log: &ImuLog) -> [Option<f64>; 6] {
        std::array::from_fn(|k| *log.full_scale.get(sensor(k)))
    }

    /// The columns of a triad along the right, front and up axes.
    pub fn columns(&self, sensor: Sensor) -> [usize; 3] {
        let first = 3 * sensor as usize;
        let along = |axis: usize| (first..first + 3).find(|&k| self.body_axes[k] == axis);
        [0, 1, 2].map(|axis| along(axis).unwrap_or(first + axis))
    }

    /// The unit of the corresponding column that equals one rad or one m/s, along the right, front and up axes.
    pub fn body_nominal(&self, log: &ImuLog, sensor: Sensor) -> Vector3<f64> {
        let columns = self.columns(sensor);
        Vector3::from_fn(|axis, _| {
            let k = columns[axis];
            let sign = if self.names[k].reversed { -1.0 } else { 1.0 };
            let along = log.axes.apply(&Vector3::ith(k % 3, sign));
            log.nominal.get(sensor).0[axis] * along[axis]
        })
    }

    pub fn triads(&self) -> PerSensor<[FileColumn; 3]> {
        let name = |k: usize| self.names[k].clone();
        PerSensor::from_fn(|sensor| [0, 1, 2].map(|axis| name(3 * sensor as usize + axis)))
    }
}

impl ImuLog<'_> {
    /// Factor that converts a row value to an integral over its sample.
    pub fn seconds(&self, period: f64) -> f64 {
        match self.output {
            Output::Pulse | Output::Increment => 1.0,
            Output::Rate => period,
        }
    }

    /// The columns with their names in the file.
    pub fn named_columns(&self, layout: &Layout) -> NamedColumns {
        NamedColumns {
            time: self.clock_of_rows().column.map(str::to_owned),
            triads: layout.triads(),
            temperature: self.temperature.as_ref().map(|t| t.first().to_owned()),
            axes: self.axes,
        }
    }

    /// The rows of both triads.
    pub fn open(&self) -> Result<LogRows, FileError> {
        let Some((source, clock)) = &self.accel_from else {
            return self.source.open();
        };
        let temperature = self.temperature.as_ref();
        let parts = PerSensor {
            gyro: Part {
                source: &self.source,
                clock: self.clock,
                columns: self.triads.gyro,
                further: temperature.map_or(&[], TemperatureColumns::names),
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

    pub fn clock_of_rows(&self) -> Clock<'_> {
        match self.accel_from {
            Some(_) => joined::clock(self.clock.period),
            None => self.clock,
        }
    }

    pub fn layout(&self, csv: &mut LogRows) -> Result<Layout, FileError> {
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
