//! The magnetometer of a run: columns of the IMU log, or a log of its own.

use std::path::PathBuf;

use nalgebra::Vector3;

use crate::quantity::units_of_field;
use crate::schema::Names;
use crate::schema::instrument::Fields;
use turncal::calibration::Source as NoiseSource;
use turncal::earth::Site;
use turncal::imu::Sensor;
use turncal::magnetic::LocalField;
use turncal::recording::{ColumnFacts, ImuSamples, Magnetometer};
use turncal_input::{FileError, list, suggestion};
use turncal_logs::clock::{Clock, Stamp};
use turncal_logs::{DataFile, Source};

/// Rows after which times are released, and number of values whose step is determined.
const ROWS: usize = 1 << 16;

/// Settings of the magnetometer in `run.toml`.
pub struct MagnetometerLog<'a> {
    pub source: Source<'a>,
    clock: Clock<'a>,
    columns: [&'a str; 3],
    instance: Option<(&'a str, f64)>,
    empty: Magnetometer,
    /// Whether it has rows of its own.
    is_separate: bool,
}

impl<'a> Fields<'a> {
    /// The magnetometer, if there are columns; `gyro` is the log of the gyros.
    pub fn magnetometer(
        &mut self,
        site: &Site,
        (gyro, clock): (&Source<'a>, Clock<'a>),
    ) -> Result<Option<MagnetometerLog<'a>>, FileError> {
        let imu = &self.run.imu;
        let Some(Names(columns)) = &imu.columns.mag else {
            return Ok(None);
        };
        let Some(unit) = imu.mag_unit.as_deref() else {
            let meaning = "the unit of the values in the file";
            return Err(self.document.missing("imu.mag_unit", meaning));
        };
        let names = || units_of_field().map(|(name, _)| name);
        let Some((_, nominal)) = units_of_field().find(|(name, _)| *name == unit) else {
            let expected = format!("one of {}", list(names()));
            let advice = suggestion(unit, names(), "Choose one of them.");
            return Err(self.document.wrong("imu.mag_unit", expected, advice));
        };
        let from = self.further(imu.mag_from.as_ref(), "imu.mag_from", (gyro, clock))?;
        let is_separate = from.is_some();
        let (source, clock) = from.unwrap_or_else(|| (gyro.clone(), clock));
        let (_, (key, of_key)) = NoiseSource::MagneticDisturbance.stated_in();
        let stated = imu.noise.get(key).copied().flatten();
        let mut empty = Magnetometer::new(unit, nominal);
        empty.disturbance = stated.map_or(0.0, |stated| stated.0 * of_key);
        empty.field = self.field(site);
        empty.has_times = clock.column.is_some() || imu.sample_period_s.is_some();
        let instance = imu.instance.as_ref().filter(|_| !is_separate);
        Ok(Some(MagnetometerLog {
            source,
            clock,
            columns: columns.each_ref().map(String::as_str),
            is_separate,
            instance: instance.map(|of| (of.column.as_str(), of.number.0)),
            empty,
        }))
    }

    /// The field at the place and on the date of the run, if both are stated.
    fn field(&mut self, site: &Site) -> Option<LocalField> {
        let is_placed = site.is_known && self.run.site.longitude_deg.is_some();
        let date = self.run.meta.get("date").and_then(|text| date(text));
        let place = (site.latitude, site.longitude, site.height);
        let field = date.filter(|_| is_placed).and_then(|date| {
            let (latitude, longitude, height) = place;
            LocalField::of_model(latitude, longitude, height, date)
        });
        if field.is_none() {
            self.notes.push(
                "Place or date of the magnetometer is not stated, or outside the World Magnetic Model. turncal \
                 calibrated the magnetometer in units of the local field. Set latitude_deg and longitude_deg in \
                 [site], and date (such as 2026-05-01) in [meta]."
                    .to_owned(),
            );
        }
        field
    }
}

/// Year, month and day of a text that begins with them, such as `2026-05-01 14:00`.
fn date(text: &str) -> Option<(i32, u8, u8)> {
    let mut parts = text.trim().get(..10)?.split('-');
    let year = parts.next()?.parse().ok()?;
    let (month, day) = (parts.next()?.parse().ok()?, parts.next()?.parse().ok()?);
    Some((year, month, day))
}

impl MagnetometerLog<'_> {
    /// The file, if it is not that of the gyros.
    pub fn own_file(&self, gyro: &DataFile) -> Option<PathBuf> {
        (self.source.file != *gyro).then(|| self.source.file.to_path_buf())
    }

    /// Reads the values of a run with these samples; rows without a value are left out. `notes` receives remarks about a
    /// log of its own.
    pub fn read(
        self,
        imu: &ImuSamples,
        notes: &mut Vec<String>,
    ) -> Result<Magnetometer, FileError> {
        let mut csv = self.source.open()?;
        let mut stamps = self.clock.start(&mut csv)?;
        let mut columns = Vec::new();
        for name in self.columns {
            let (place, column) = csv.signed_column(name)?;
            columns.push((place, if column.reversed { -1.0 } else { 1.0 }));
        }
        let instance = match self.instance {
            Some((name, number)) => Some((csv.column(name)?, number)),
            None => None,
        };
        let mut series = self.empty;
        if !Sensor::ALL.iter().any(|&sensor| imu.has(sensor)) {
            // Nothing shows the motion within a span.
            series.in_spans_of(imu.period);
        }
        let mut first = [(); 3].map(|()| Vec::new());
        while csv.advance()? && !csv.may_be_cut() {
            let is_other = |(place, number)| csv.number(place).is_ok_and(|value| value != number);
            if instance.is_some_and(is_other) {
                continue;
            }
            let Stamp::New(place) = stamps.take(&csv, |_| true)? else {
                continue;
            };
            let time = stamps.of_rows.get(place).map_or(0.0, |&(time, _)| time);
            if columns.iter().any(|&(place, _)| csv.is_blank(place)) {
                continue;
            }
            let mut value = Vector3::zeros();
            for (axis, &(place, sign)) in columns.iter().enumerate() {
                value[axis] = sign * csv.number(place)?;
                if first[axis].len() < ROWS {
                    first[axis].push(value[axis]);
                }
            }
            series.push(stamps.told(time), value);
            if stamps.of_rows.len() > 2 * ROWS {
                stamps.let_go(ROWS);
            }
        }
        if self.is_separate {
            notes.extend(csv.left_out());
            notes.extend(csv.cut_off("turncal ignored it"));
        }
        let facts = first.map(|values| ColumnFacts::of("", &values, 1.0));
        let step = facts.map(|facts| facts.step.unwrap_or(0.0) / series.nominal);
        series.step = step.into();
        if let (None, Some(period)) = (self.clock.column, self.clock.period) {
            // The period of a log without times may be estimated.
            series.slower(imu.period / period);
        }
        Ok(series)
    }
}
