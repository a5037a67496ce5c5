//! The instrument's samples.

use nalgebra::Vector3;

use super::axes::BodyAxes;
use super::clock::{Clock, Stamp, Stamps};
use super::error::FileError;
use super::joined::{self, Joined, Part};
use super::rows::LogRows;
use super::source::Source;
use super::temperature::{TemperatureColumns, Temperatures};
use super::uniform::Uniform;
use crate::imu::{Nominal, Output, PerSensor, Sensor};
use crate::recording::faults::{Repaired, Rows};
use crate::recording::stretches_between;
use crate::recording::{ColumnFacts, FileColumn, ImuSamples, LogFacts, NamedColumns};

/// Fewer samples than this are no record of a turntable: not one dwell can be told from a turn.
const FEWEST_SAMPLES: usize = 100;

/// Which moment of a sample its time stamp names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TimeStamp {
    Start,
    Middle,
    End,
}

impl TimeStamp {
    /// The words for it in `run.toml`.
    pub const WORDS: [(&'static str, Self); 3] = [
        ("end", Self::End),
        ("start", Self::Start),
        ("middle", Self::Middle),
    ];

    /// From the begin of a sample to its stamp, in samples.
    pub fn lag(self) -> f64 {
        match self {
            Self::Start => 0.0,
            Self::Middle => 0.5,
            Self::End => 1.0,
        }
    }
}

/// What `run.toml` says of the file.
pub(super) struct ImuLog<'a> {
    pub source: Source<'a>,
    pub clock: Clock<'a>,
    /// Where the accelerometers are, if not in the rows of the gyros.
    pub accel_from: Option<(Source<'a>, Clock<'a>)>,
    /// Of rows of several instruments those that have this number in this column.
    pub instance: Option<(&'a str, f64)>,
    pub triads: PerSensor<[&'a str; 3]>,
    pub temperature: Option<TemperatureColumns<'a>>,
    pub output: Output,
    pub axes: BodyAxes,
    pub stamp: TimeStamp,
    pub continuous: bool,
    /// Along right-front-up.
    pub nominal: PerSensor<Nominal>,
    /// Largest magnitude of a row's value.
    pub full_scale: PerSensor<Option<f64>>,
}

/// What the file holds.
struct Content {
    stamps: Stamps,
    triads: PerSensor<[FileColumn; 3]>,
    /// Gyro x, y, z and accelerometer x, y, z as they stand.
    columns: [Vec<f64>; 6],
    /// Rows before each duplicate, and its line.
    duplicates: Vec<(usize, u64)>,
    temperature: Option<Temperatures>,
    clock: Uniform,
    /// Of the integrals of the accelerometers' columns, in their unit times s.
    integral_error: [f64; 3],
}

impl ImuLog<'_> {
    /// Reads the samples, finds what is wrong with them, and bridges it; what the file leaves open goes to
    /// `notes`.
    pub fn read(&self, notes: &mut Vec<String>) -> Result<ImuSamples, FileError> {
        let Content {
            stamps,
            triads,
            columns,
            duplicates,
            temperature,
            clock,
            integral_error,
        } = self.content(notes)?;
        let mut temperature = temperature.map(|t| t.read(&self.source.file.display().to_string()));
        notes.extend(temperature.iter_mut().flat_map(|t| t.notes.drain(..)));
        let samples = clock.numbers.last().map_or(0, |last| last + 1);
        notes.extend(stamps.lost_count(samples - clock.numbers.len()));
        let stamps = stamps.of_rows;
        let period = clock.period;
        let seconds = match self.output {
            Output::Pulse | Output::Increment => 1.0,
            Output::Rate => period,
        };
        let body_axes = std::array::from_fn(|column| self.axes.body_axis(column % 3));
        let sensor = |column: usize| Sensor::ALL[column / 3];
        let named = |k: usize| &triads.get(sensor(k))[k % 3];
        let unit = |k| seconds / self.nominal.get(sensor(k)).0[body_axes[k]];
        let units = std::array::from_fn(unit);
        let facts = std::array::from_fn(|k| ColumnFacts::of(&named(k).name, &columns[k], units[k]));
        let rows = Rows {
            columns,
            facts: &facts,
            full_scale: std::array::from_fn(|k| *self.full_scale.get(sensor(k))),
            pulses: self.output == Output::Pulse,
            body_axes,
            units,
            lines: stamps.iter().map(|&(_, line)| line).collect(),
            numbers: clock.numbers,
            period,
            duplicates,
        };
        let count = stamps.len() + rows.duplicates.len();
        let Repaired {
            columns,
            faults,
            bridges,
        } = rows.repair();

        let samples = PerSensor::from_fn(|sensor| {
            let nominal = self.nominal.get(sensor).0;
            let [x, y, z] = std::array::from_fn(|axis| &columns[3 * sensor as usize + axis]);
            let signs = triads.get(sensor).each_ref();
            let signs = Vector3::from(signs.map(|column| if column.reversed { -1.0 } else { 1.0 }));
            let rows = x.iter().zip(y).zip(z);
            let sample = |((&x, &y), &z)| {
                let row = self
                    .axes
                    .vector(Vector3::new(x, y, z).component_mul(&signs));
                (row * seconds).component_div(&nominal)
            };
            rows.map(sample).collect::<Vec<_>>()
        });
        let mut pulse = PerSensor::from_fn(|sensor| match self.output {
            Output::Pulse => self.nominal.get(sensor).0.map(|n| n.abs().recip()).mean(),
            Output::Increment | Output::Rate => 0.0,
        });
        // As bounded as the error of whole pulses, and as independent of how long it is summed over.
        let error = self
            .axes
            .each(Vector3::from(integral_error))
            .component_div(&self.nominal.accel.0);
        pulse.accel = pulse.accel.hypot(12f64.sqrt() * error.norm() / 3f64.sqrt());
        let mut of_axes = PerSensor::<[ColumnFacts; 3]>::default();
        for (k, facts) in facts.into_iter().enumerate() {
            of_axes.get_mut(sensor(k))[body_axes[k]] = facts;
        }
        Ok(ImuSamples {
            stretches: stretches_between(
                samples.gyro.len(),
                clock.first - self.stamp.lag() * period,
                period,
                &faults,
            ),
            period,
            continuous: self.continuous,
            gyro: samples.gyro,
            accel: samples.accel,
            pulse,
            faults,
            bridges,
            temperature: temperature.as_mut().and_then(|t| t.temperature.take()),
            log: Some(LogFacts {
                rows: count,
                jitter_rms: clock.jitter_rms,
                jitter_max: clock.jitter_max,
                off_stated_period: clock.off_given,
                columns: of_axes,
                named: NamedColumns {
                    time: self.clock_of_rows().column.map(str::to_owned),
                    triads,
                    temperature: self.temperature.as_ref().map(|t| t.first().to_owned()),
                    axes: self.axes.order(),
                },
                temperature: temperature.as_ref().and_then(|t| t.facts),
            }),
        })
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
        Joined::read(&parts, self.output, self.stamp.lag()).map(LogRows::joined)
    }

    fn clock_of_rows(&self) -> Clock<'_> {
        match self.accel_from {
            Some(_) => joined::clock(self.clock.period),
            None => self.clock,
        }
    }

    fn content(&self, notes: &mut Vec<String>) -> Result<Content, FileError> {
        let mut csv = self.open()?;
        let names = match self.accel_from {
            Some(_) => joined::distinct(&self.triads),
            None => PerSensor::from_fn(|sensor| self.triads.get(sensor).map(str::to_owned)),
        };
        let mut stamps = self.clock_of_rows().start(&mut csv)?;
        let mut triad = |[x, y, z]: &[String; 3]| -> Result<_, FileError> {
            Ok([
                csv.signed_column(x)?,
                csv.signed_column(y)?,
                csv.signed_column(z)?,
            ])
        };
        let found = PerSensor {
            gyro: triad(&names.gyro)?,
            accel: triad(&names.accel)?,
        };
        let places: [usize; 6] = std::array::from_fn(|k| found.get(Sensor::ALL[k / 3])[k % 3].0);
        let temperature = self
            .temperature
            .as_ref()
            .map(|columns| columns.start(&mut csv));
        let mut temperature = temperature.transpose()?;

        let instance = match self.instance {
            Some((name, number)) => Some((csv.column(name)?, number)),
            None => None,
        };
        let mut blank = 0;
        let mut columns = [const { Vec::new() }; 6];
        let mut duplicates = Vec::new();
        let mut before = [f64::NAN; 6];
        while csv.advance()? && !csv.may_be_cut() {
            if let Some((place, number)) = instance
                && csv.number(place)? != number
            {
                continue;
            }
            // Rows that another sensor wrote; without a time they would be missing.
            if self.clock_of_rows().column.is_some()
                && places.iter().all(|&place| csv.is_blank(place))
            {
                blank += 1;
                continue;
            }
            let mut row = [0.0; 6];
            for (value, &place) in row.iter_mut().zip(&places) {
                *value = self.value(&csv, place)?;
            }
            match stamps.look(&csv)? {
                Stamp::Same if row == before => {
                    duplicates.push((stamps.of_rows.len(), csv.line()));
                    continue;
                }
                Stamp::Same => return Err(Stamps::same(&csv)),
                Stamp::Later => before = row,
            }
            for (column, value) in columns.iter_mut().zip(row) {
                column.push(value);
            }
            if let (Some(temperature), Some(&(time, _))) = (&mut temperature, stamps.of_rows.last())
            {
                temperature.take(&csv, time);
            }
        }
        notes.extend(csv.cut_off("It is left out"));
        notes.extend_from_slice(csv.remarks());
        if blank > 0 {
            notes.push(format!(
                "{blank} row(s) of {} have nothing in the columns of both triads and are passed over.",
                self.source.file.display()
            ));
        }
        if stamps.of_rows.len() < FEWEST_SAMPLES {
            return Err(csv.error(
                format_args!("{} samples", stamps.of_rows.len()),
                format_args!("at least {FEWEST_SAMPLES}"),
                "Record a run with dwells and turns.",
            ));
        }
        let PerSensor { gyro, accel } = found;
        let clock = Uniform::new(&self.source.file, &stamps.of_rows, self.clock.period);
        Ok(Content {
            clock: clock.map_err(|error| csv.placed(error))?,
            integral_error: csv.integral_error(),
            stamps,
            triads: PerSensor {
                gyro: gyro.map(|(_, column)| column),
                accel: accel.map(|(_, column)| column),
            },
            columns,
            duplicates,
            temperature,
        })
    }

    /// A number of a row as it stands.
    fn value(&self, csv: &LogRows, column: usize) -> Result<f64, FileError> {
        let value = csv.number(column)?;
        if self.output == Output::Pulse && value.fract() != 0.0 {
            return Err(csv.not(
                column,
                "a whole number of pulses, or output = \"increment\" in run.toml",
            ));
        }
        Ok(value)
    }
}
