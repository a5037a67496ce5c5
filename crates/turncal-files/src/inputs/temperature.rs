//! Temperature columns of a log.

use crate::schema::{TemperatureColumn, TemperatureUnit};
use turncal::imu::PerSensor;
use turncal::recording::{TEMPERATURE_SPACING, Temperature, TemperatureFacts};
use turncal_input::{FileError, OneOrThree, counted};
use turncal_logs::rows::LogRows;

/// Values beyond this limit, °C, mean that the column has another unit or is not a temperature.
const LARGEST: f64 = 100.0;
/// Maximum number of spans of [`TEMPERATURE_SPACING`]: one year.
const MOST_SPANS: f64 = 366.0 * 86_400.0;

/// Temperature settings in `run.toml`.
pub struct TemperatureColumns<'a> {
    names: Vec<&'a str>,
    of: PerSensor<[usize; 3]>,
    unit: TemperatureUnit,
}

impl<'a> TemperatureColumns<'a> {
    /// One column for both triads, or one column or three columns for each triad.
    pub fn of_fields(column: &'a TemperatureColumn, unit: TemperatureUnit) -> Self {
        let mut all = Self {
            names: Vec::new(),
            of: PerSensor::default(),
            unit,
        };
        match column {
            TemperatureColumn::One(name) => all.names.push(name),
            TemperatureColumn::Triads { gyro, accel } => {
                all.of.gyro = all.places(gyro);
                all.of.accel = all.places(accel);
            }
        }
        all
    }

    fn places(&mut self, columns: &'a OneOrThree<String>) -> [usize; 3] {
        let names = match columns {
            OneOrThree::One(name) => [name; 3],
            OneOrThree::Three(names) => names.each_ref(),
        };
        names.map(|name| {
            let known = self.names.iter().position(|known| known == name);
            known.unwrap_or_else(|| {
                self.names.push(name);
                self.names.len() - 1
            })
        })
    }

    /// The columns, each listed only once.
    pub fn names(&self) -> &[&'a str] {
        &self.names
    }

    /// Name of the column of the first axis.
    pub fn first(&self) -> &'a str {
        self.names[0]
    }

    /// Starts to read the columns of a file.
    pub fn start(&self, csv: &mut LogRows) -> Result<Temperatures, FileError> {
        let channels = self.names.iter().map(|&name| {
            Ok(Channel {
                place: csv.column(name)?,
                name: name.to_owned(),
                ..Channel::default()
            })
        });
        Ok(Temperatures {
            channels: channels.collect::<Result<_, FileError>>()?,
            of: self.of,
            unit: self.unit,
            first: None,
        })
    }
}

/// Temperatures collected while reading a file.
pub struct Temperatures {
    channels: Vec<Channel>,
    of: PerSensor<[usize; 3]>,
    unit: TemperatureUnit,
    /// Stamp of the first row, s.
    first: Option<f64>,
}

#[derive(Default)]
struct Channel {
    place: usize,
    name: String,
    /// Sum and number of values in each span.
    spans: Vec<(f64, u32)>,
    /// Statistics of all values, with the sum instead of the mean.
    facts: Option<TemperatureFacts>,
    /// Rows without a number, and the line of the first.
    missing: (usize, u64),
    /// The first invalid value, unchanged, and its line.
    beyond: Option<(f64, u64)>,
}

/// Temperatures read from a file.
pub struct Read {
    pub temperature: Option<Temperature>,
    pub facts: Option<TemperatureFacts>,
    /// Remarks on faults, one sentence each.
    pub notes: Vec<String>,
}

impl Temperatures {
    /// Processes a row with this time stamp, s.
    pub fn take(&mut self, csv: &LogRows, time: f64) {
        let first = *self.first.get_or_insert(time);
        let span = (time - first) / TEMPERATURE_SPACING;
        if !(0.0..MOST_SPANS).contains(&span) {
            return;
        }
        for channel in &mut self.channels {
            channel.take(csv, span as usize, self.unit);
        }
    }

    /// Returns the temperatures, for stamps that are delayed by this time relative to the start of the first sample, s.
    pub fn read(self, file: &str) -> Read {
        let facts = self.channels.first().and_then(|channel| {
            let count: f64 = channel.spans.iter().map(|of| f64::from(of.1)).sum();
            let sums = channel.facts?;
            let mean = sums.mean / count;
            Some(TemperatureFacts { mean, ..sums })
        });
        let channels = self.channels.iter();
        let notes = channels.flat_map(|channel| channel.notes(file)).collect();
        let sound = |channel: &Channel| channel.beyond.is_none() && channel.facts.is_some();
        let usable = self.channels.iter().all(sound);
        let first = self.first.unwrap_or(0.0);
        let values = self.channels.into_iter().map(Channel::filled).collect();
        let middle = first + 0.5 * TEMPERATURE_SPACING;
        let temperature = usable
            .then(|| Temperature::new(middle, values, self.of))
            .flatten();
        Read {
            temperature,
            facts,
            notes,
        }
    }
}

impl Channel {
    fn take(&mut self, csv: &LogRows, span: usize, unit: TemperatureUnit) {
        let value = csv.number(self.place).ok();
        let Some(value) = value.filter(|value| value.is_finite()) else {
            if self.missing.0 == 0 {
                self.missing.1 = csv.line();
            }
            self.missing.0 += 1;
            return;
        };
        let celsius = unit.celsius(value);
        if celsius.abs() > LARGEST {
            self.beyond.get_or_insert((value, csv.line()));
            return;
        }
        if self.spans.len() <= span {
            self.spans.resize(span + 1, (0.0, 0));
        }
        let (sum, count) = &mut self.spans[span];
        *sum += celsius;
        *count += 1;
        let facts = self.facts.get_or_insert(TemperatureFacts {
            smallest: celsius,
            mean: 0.0,
            largest: celsius,
        });
        facts.smallest = facts.smallest.min(celsius);
        facts.largest = facts.largest.max(celsius);
        facts.mean += celsius;
    }

    fn notes(&self, file: &str) -> Vec<String> {
        let mut notes = Vec::new();
        if let Some((value, line)) = self.beyond {
            let (name, largest) = (&self.name, LARGEST);
            notes.push(format!(
                "{file}, line {line}, column {name}: found {value}, expected a temperature within ±{largest} °C. \
                 turncal ignored the column. If the unit is kelvin or fahrenheit, set temperature_unit = \"K\" or \
                 \"degF\" in [imu]."
            ));
        }
        let (missing, line) = self.missing;
        if missing > 0 {
            let name = &self.name;
            notes.push(format!(
                "{file}, column {name}: the temperature is missing in {}, first in line {line}. turncal interpolated \
                 the missing temperatures.",
                counted(missing, "row")
            ));
        }
        notes
    }

    /// Means of the spans, with linear interpolation for spans without a value.
    fn filled(self) -> Vec<f64> {
        let known = self.spans.iter().enumerate().filter(|(_, of)| of.1 > 0);
        let mean = |(k, (sum, count)): (usize, &(f64, u32))| (k, sum / f64::from(*count));
        let known: Vec<(usize, f64)> = known.map(mean).collect();
        let filled = |k: usize| {
            let behind = known.partition_point(|&(at, _)| at <= k);
            let [before, after] = [behind.wrapping_sub(1), behind].map(|of| known.get(of));
            match (before, after) {
                (Some(&(from, start)), Some(&(to, end))) => {
                    start + (end - start) * ((k - from) as f64 / (to - from) as f64)
                }
                (of, other) => of.or(other).map_or(0.0, |&(_, value)| value),
            }
        };
        (0..self.spans.len()).map(filled).collect()
    }
}
