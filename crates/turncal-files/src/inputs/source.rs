//! Sources of rows and their clocks, described in `run.toml`.

use crate::schema::instrument::Fields;
use crate::schema::{AccelFromFile, TimeColumn, TimeUnitField};
use turncal_input::{FileError, Positive, list, suggestion};
use turncal_logs::clock::{Breaks, Clock, TimeUnit};
use turncal_logs::{DataFile, Source};

impl<'a> Fields<'a> {
    /// The file with this name in `run.toml`.
    pub fn file(&self, name: &str) -> DataFile {
        DataFile::find(self.directory.join(name), self.in_memory)
    }

    /// Source described by a TOML table.
    pub fn source(
        &self,
        file: &str,
        stream: &'a Option<String>,
        salvage: Option<bool>,
    ) -> Source<'a> {
        Source {
            file: self.file(file),
            stream: stream.as_deref(),
            salvage: salvage.unwrap_or(false),
        }
    }

    /// Clock described by a TOML table.
    pub fn clock(
        &self,
        table: &str,
        column: Option<&'a TimeColumn>,
        (unit, period): (Option<&TimeUnitField>, Option<Positive>),
    ) -> Result<Clock<'a>, FileError> {
        let unknown = |name: &str| {
            let known = || TimeUnit::WORDS.iter().map(|(word, _)| *word);
            let path = format!("{table}.time_unit");
            let expected = format!("one of {}, or the duration of a tick in s", list(known()));
            let advice = suggestion(name, known(), "Choose one of them.");
            self.document.wrong(&path, expected, advice)
        };
        let unit = unit.map(TimeUnitField::unit).transpose().map_err(unknown)?;
        if unit == Some(TimeUnit::Count) && period.is_none() {
            let path = format!("{table}.sample_period_s");
            return Err(self.document.missing(&path, "the duration of one count"));
        }
        let seconds = TimeUnit::PerSecond(1.0);
        let (column, nanoseconds) = match column {
            None => (None, None),
            Some(TimeColumn::One(column)) => (Some(column.as_str()), None),
            Some(TimeColumn::SecondsAndNanoseconds([seconds, rest])) => {
                (Some(seconds.as_str()), Some(rest.as_str()))
            }
        };
        if nanoseconds.is_some() && unit.is_some_and(|unit| unit != seconds) {
            let path = format!("{table}.time_unit");
            let advice = "Set time_unit to `s`, or remove it.";
            return Err(self.document.wrong(&path, "`s`", advice));
        }
        Ok(Clock {
            column,
            nanoseconds,
            unit: unit.unwrap_or(seconds),
            period: period.map(|period| period.0),
            breaks: Breaks::None,
        })
    }

    /// Source of the accelerometers and their clock, if they are not in the gyro rows.
    pub fn accel_from(
        &self,
        gyro: &Source<'a>,
        of_gyro: Clock<'a>,
    ) -> Result<Option<(Source<'a>, Clock<'a>)>, FileError> {
        let fields = self.run.imu.accel_from.as_ref();
        self.further(fields, "imu.accel_from", (gyro, of_gyro))
    }

    /// Source and clock of a sensor with these fields, at this path of the document, if they are there.
    pub fn further(
        &self,
        fields: Option<&'a AccelFromFile>,
        path: &str,
        (gyro, of_gyro): (&Source<'a>, Clock<'a>),
    ) -> Result<Option<(Source<'a>, Clock<'a>)>, FileError> {
        let Some(fields) = fields else {
            return Ok(None);
        };
        let file = fields.file.as_ref();
        let source = Source {
            file: file.map_or_else(|| gyro.file.clone(), |file| self.file(file)),
            stream: fields.stream.as_deref().or(gyro.stream),
            salvage: fields.salvage.unwrap_or(gyro.salvage),
        };
        let stated = (fields.time_unit.as_ref(), fields.sample_period_s);
        let mut clock = self.clock(path, fields.time.as_ref(), stated)?;
        if clock.column.is_none() {
            (clock.column, clock.nanoseconds) = (of_gyro.column, of_gyro.nanoseconds);
        }
        if fields.time_unit.is_none() {
            clock.unit = of_gyro.unit;
        }
        if clock.column.is_none() {
            let meaning = "the time column of the sensor, because two separate streams both need a time column";
            return Err(self.document.missing(&format!("{path}.time"), meaning));
        }
        Ok(Some((source, clock)))
    }
}
