//! Assignment of columns.

use nalgebra::Vector3;

use super::name::{Name, by_stem};
use super::stated::StatedColumns;
use super::triads::{
    Doubt, Identified, MagnetometerColumns, Triad, consecutive, is_uneven, overlap,
};
use crate::Sheet;
use crate::quantity::Of;
use turncal::imu::{PerSensor, Sensor};

/// Columns, given by their index in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Columns {
    pub names: Vec<String>,
    pub time: Option<usize>,
    /// Column of nanoseconds to be added to a time column in whole seconds.
    pub nanoseconds: Option<usize>,
    pub triads: PerSensor<Option<[usize; 3]>>,
    /// Other candidates for the gyro and accelerometer triads.
    pub others: PerSensor<Vec<[usize; 3]>>,
    /// Whether the triads were identified by their values, because the column names are not informative.
    pub by_size: bool,
    /// Reasons why triads that were identified by their values are only a guess.
    pub doubt: Option<Doubt>,
    pub temperature: Option<usize>,
    pub magnetometer: Option<MagnetometerColumns>,
    /// Four columns that form a quaternion, because their norm is one.
    pub quaternion: Option<[usize; 4]>,
}

/// Fraction of rows that must be numeric.
const NUMBERS: f64 = 0.5;
/// Sensor failures affect fewer rows; if one triad is empty in more, the rates differ.
const LACKING: f64 = 0.1;
/// Maximum number of instruments in a log.
const MOST_INSTANCES: usize = 8;
/// Fraction of increasing steps in a time column, and in a column with the name of a time, where values may repeat.
const FORWARD: f64 = 0.9;
const SELDOM_FORWARD: f64 = 0.01;

/// Samples of both triads, row by row.
type Samples = PerSensor<Vec<Vector3<f64>>>;

impl Columns {
    pub fn find(sheet: &Sheet) -> Self {
        let columns = sheet.names.iter().zip(&sheet.units);
        let names: Vec<Name> = columns
            .map(|(name, unit)| Name::of_column(name, unit))
            .collect();
        let mut found = PerSensor::from_fn(|sensor| by_name(&names, sheet, sensor));
        // If there are several triads, those with a unit come first; for accelerometers, first of all those with a
        // constant magnitude.
        let is_bare =
            |triad: &[usize; 3]| names[triad[0]].unit.is_none_or(|unit| unit.word == "count");
        found.gyro.sort_by_key(is_bare);
        let rank = |triad: &Triad| (is_uneven(&sheet.columns, triad), is_bare(triad));
        found.accel.sort_by_cached_key(rank);
        let of_triads = found.gyro.iter().chain(&found.accel).flatten();
        let of_triads: Vec<usize> = of_triads.copied().collect();
        // Rows of another sensor may have other times.
        let is_sample = |row: &usize| of_triads.is_empty() || sheet.has(&of_triads, *row);
        let rows: Vec<usize> = (0..sheet.rows()).filter(is_sample).collect();
        let forward = |k: usize| forward(rows.iter().map(|&row| sheet.columns[k][row]));
        let split = split_time(sheet, &names);
        let nanoseconds = split.map(|pair| pair[1]);
        let time = (split.map(|pair| pair[0])).or_else(|| time(sheet, &names, forward));
        let is_temperature = |k: &usize| names[*k].is_temperature() && is_numeric(sheet, *k);
        let temperature = (0..names.len()).find(is_temperature);
        let quaternion = quaternion(sheet, time);
        let by_name = PerSensor::from_fn(|sensor| found.get(sensor).len());
        let taken = [time, nanoseconds, temperature].into_iter().flatten();
        let taken = taken.chain(quaternion.into_iter().flatten());
        let taken: Vec<usize> = taken.chain(of_triads).collect();
        let of_bare = MagnetometerColumns::of_bare(sheet);
        let (mut found, doubt) = match of_bare {
            Some(_) => Default::default(),
            None => identified(sheet, &names, &taken, found),
        };
        let named = of_bare.or_else(|| MagnetometerColumns::find(sheet, &names));
        let by_turns = || field_of_turns(sheet, &taken, doubt.as_ref(), &mut found);
        let magnetometer = named.or_else(by_turns);
        let is_new = |&of: &Sensor| *by_name.get(of) == 0 && !found.get(of).is_empty();
        let others = |of| found.get(of).iter().skip(1).copied().collect();
        Self {
            names: (0..names.len())
                .map(|k| distinct(&sheet.names, k))
                .collect(),
            time,
            nanoseconds,
            triads: PerSensor::from_fn(|sensor| found.get(sensor).first().copied()),
            others: PerSensor::from_fn(others),
            by_size: Sensor::ALL.iter().any(is_new),
            doubt,
            temperature,
            magnetometer,
            quaternion,
        }
    }

    /// Replaces detected columns by the columns stated by the user.
    pub fn state(&mut self, stated: &StatedColumns) {
        let place = |name: &String| self.names.iter().position(|of| of == name);
        let of_triads = PerSensor::from_fn(|sensor| {
            let [x, y, z] = stated.triads.get(sensor).as_ref()?;
            Some([place(x)?, place(y)?, place(z)?])
        });
        let time = stated.time.as_ref().and_then(place);
        let temperature = stated.temperature.as_ref().and_then(place);
        for sensor in Sensor::ALL {
            let stated = of_triads.gyro.iter().chain(&of_triads.accel).flatten();
            let is_taken = |of: [usize; 3]| stated.clone().any(|k| of.contains(k));
            let found = self.triads.get_mut(sensor);
            *found = found.filter(|of| !is_taken(*of));
            self.magnetometer.take_if(|of| is_taken(of.columns));
            if let Some(triad) = of_triads.get(sensor) {
                *self.triads.get_mut(sensor) = Some(*triad);
                self.others.get_mut(sensor).clear();
                (self.by_size, self.doubt) = (false, None);
            }
        }
        if time.is_some() {
            (self.time, self.nanoseconds) = (time, None);
        }
        self.temperature = temperature.or(self.temperature);
        self.time = self.time.filter(|time| Some(*time) != temperature);
    }

    /// The times of all rows, in the unit of the column.
    pub fn stamps(&self, sheet: &Sheet) -> Option<Vec<f64>> {
        let times = &sheet.columns[self.time?];
        Some(match self.nanoseconds {
            Some(column) => both(times, &sheet.columns[column]),
            None => times.clone(),
        })
    }

    /// Rows in which both triads are numeric, and their samples; a missing triad has zeros.
    pub fn samples(&self, sheet: &Sheet) -> Option<(Vec<usize>, Samples)> {
        let at = |sensor: Sensor, row: usize| match self.triads.get(sensor) {
            Some(columns) => Vector3::from(columns.map(|k| sheet.columns[k][row])),
            None => Vector3::zeros(),
        };
        let (mut rows, mut samples) = (Vec::new(), PerSensor::from_fn(|_| Vec::new()));
        let any = self.triads.gyro.or(self.triads.accel)?;
        for row in 0..sheet.columns[any[0]].len() {
            let both = PerSensor::from_fn(|sensor| at(sensor, row));
            if (both.gyro + both.accel).sum().is_finite() {
                rows.push(row);
                samples.gyro.push(both.gyro);
                samples.accel.push(both.accel);
            }
        }
        (rows.len() > 1).then_some((rows, samples))
    }
}

/// The name of a column, or its number if the name is missing or not unique.
fn distinct(names: &[String], column: usize) -> String {
    let like = names.iter().filter(|name| **name == names[column]);
    if names[column].is_empty() || like.count() > 1 {
        (column + 1).to_string()
    } else {
        names[column].clone()
    }
}

/// Columns whose names belong to this sensor.
pub fn named(sheet: &Sheet, sensor: Sensor) -> Vec<usize> {
    let is = |k: &usize| Name::of(&sheet.names[*k]).sensor() == Some(sensor);
    (0..sheet.names.len()).filter(is).collect()
}

/// Whether the column names show that gyros and accelerometers are in separate rows.
pub fn have_rows_of_their_own(sheet: &Sheet) -> bool {
    let places = PerSensor::from_fn(|sensor| named(sheet, sensor));
    let (mut both, mut one) = (0, 0);
    for row in 0..sheet.rows() {
        match (sheet.has(&places.gyro, row), sheet.has(&places.accel, row)) {
            (true, true) => both += 1,
            (false, false) => {}
            _ => one += 1,
        }
    }
    let has = |sensor: Sensor| !places.get(sensor).is_empty();
    Sensor::ALL.into_iter().all(has) && f64::from(one) > LACKING * f64::from(both + one)
}

/// Name and value of the first column whose name is that of a time, but whose value never changes.
pub fn standing_time(sheet: &Sheet) -> Option<(&str, f64)> {
    let stands = |k: &usize| {
        let is_time = Name::of(&sheet.names[*k]).is_time() > 1;
        let mut values = sheet.columns[*k].iter();
        is_time && values.all(|value| value.is_finite()) && !sheet.varies(*k)
    };
    let column = (0..sheet.names.len()).find(stands)?;
    Some((&sheet.names[column], *sheet.columns[column].first()?))
}

/// The first column with the name of a time whose values decrease from row to row.
pub fn falling_time(sheet: &Sheet) -> Option<&str> {
    let falls = |k: &usize| {
        let is_text = sheet.units[*k] == "h:m:s";
        let (_, back) = forward(sheet.columns[*k].iter().copied());
        back >= FORWARD && (is_text || Name::of(&sheet.names[*k]).is_time() > 1)
    };
    let column = (0..sheet.names.len()).find(falls)?;
    Some(&sheet.names[column])
}

fn is_numeric(sheet: &Sheet, column: usize) -> bool {
    let values = &sheet.columns[column];
    let numbers = values.iter().filter(|value| value.is_finite()).count();
    numbers as f64 >= NUMBERS * values.len() as f64
}

fn both(seconds: &[f64], nanoseconds: &[f64]) -> Vec<f64> {
    let rows = seconds.iter().zip(nanoseconds);
    rows.map(|(seconds, nanoseconds)| seconds + 1e-9 * nanoseconds)
        .collect()
}

/// Columns of whole seconds and of nanoseconds, found by their names or, without names, by their values.
fn split_time(sheet: &Sheet, names: &[Name]) -> Option<[usize; 2]> {
    let is_whole = |k: usize| sheet.columns[k].iter().all(|value| value.fract() == 0.0);
    let is_pair = |k: &usize| {
        let is_named = names[*k].is_part_of_time("s") && names[k + 1].is_part_of_time("ns");
        let is_numbered = sheet.names[*k] == (k + 1).to_string();
        let mut rest = sheet.columns[k + 1].iter();
        let mut are_nanoseconds = || rest.all(|value| (0.0..1e9).contains(value));
        (is_named || is_numbered && are_nanoseconds()) && is_whole(*k) && is_whole(k + 1)
    };
    let goes_on = |k: &usize| {
        let [seconds, rest] = [*k, k + 1].map(|k| &sheet.columns[k]);
        let forward_of = |values: &[f64]| forward(values.iter().copied()).0;
        let whole = forward_of(seconds);
        // The fraction begins again with each second.
        let begins = seconds.windows(2).zip(rest.windows(2));
        let begins = begins.filter(|(whole, _)| whole[1] > whole[0]);
        let begins: Vec<f64> = begins
            .map(|(_, rest)| f64::from(rest[1] < rest[0]))
            .collect();
        whole > 0.0
            && whole < FORWARD
            && forward_of(&both(seconds, rest)) >= FORWARD
            && begins.iter().sum::<f64>() >= FORWARD * begins.len() as f64
    };
    let mut pairs = (0..names.len().saturating_sub(1)).filter(is_pair);
    let pair = pairs.find(goes_on)?;
    Some([pair, pair + 1])
}

/// The column that distinguishes several instruments, with its value for the first of them.
pub fn instance(sheet: &Sheet) -> Option<(usize, f64)> {
    let tells = |k: &usize| {
        let mut known: Vec<f64> = Vec::new();
        let is_number = |value: &f64| {
            if !known.contains(value) {
                known.push(*value);
            }
            value.fract() == 0.0 && known.len() <= MOST_INSTANCES
        };
        Name::of(&sheet.names[*k]).is_instance()
            && sheet.columns[*k].iter().all(is_number)
            && known.len() > 1
    };
    let column = (0..sheet.names.len()).find(tells)?;
    Some((column, *sheet.columns[column].first()?))
}

/// Fractions of increasing and decreasing steps.
fn forward(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (mut steps, mut forward, mut back) = (0.0, 0.0, 0.0);
    let mut last = f64::NAN;
    for value in values {
        steps += f64::from(!last.is_nan());
        forward += f64::from(value > last);
        back += f64::from(value < last);
        last = value;
    }
    (forward / f64::max(steps, 1.0), back / f64::max(steps, 1.0))
}

/// Whether a column counts rows.
fn counts(values: &[f64]) -> bool {
    values.windows(2).all(|pair| pair[1] - pair[0] == 1.0)
}

/// The column whose name is most like a time, otherwise the first increasing column.
fn time(sheet: &Sheet, names: &[Name], forward: impl Fn(usize) -> (f64, f64)) -> Option<usize> {
    let goes_on = |k: &usize| match forward(*k) {
        (forward, _) if forward >= FORWARD => true,
        (forward, back) => {
            names[*k].is_time() > 1 && forward > SELDOM_FORWARD && back < 1.0 - FORWARD
        }
    };
    let rank = |k: &usize| {
        let is_text = sheet.units[*k] == "h:m:s";
        // Raw ticks rank after times that have a unit.
        let is_raw = names[*k].unit.is_some_and(|unit| unit.word == "count");
        let named = names[*k].is_time().saturating_sub(u8::from(is_raw));
        let is_of_time = names[*k].is_of_time() && !is_text;
        (
            named,
            is_of_time,
            !counts(&sheet.columns[*k]),
            names.len() - k,
        )
    };
    let best = (0..names.len()).filter(goes_on).max_by_key(rank)?;
    // The angle of an integrating sensor and a rising temperature also increase steadily.
    let name = &names[best];
    let named_otherwise = name.is_time() == 0 && (name.sensor().is_some() || name.is_temperature());
    (!named_otherwise).then_some(best)
}

/// The triads by their names; if one has none, both by their values, with the reason why they are only a guess.
fn identified(
    sheet: &Sheet,
    names: &[Name],
    taken: &[usize],
    by_name: PerSensor<Vec<Triad>>,
) -> (PerSensor<Vec<Triad>>, Option<Doubt>) {
    if !by_name.gyro.is_empty() && !by_name.accel.is_empty() {
        return (by_name, None);
    }
    let candidates = candidates(sheet, names, taken, &by_name);
    let Identified { triads, doubt } = Identified::find(&sheet.columns, &candidates);
    (triads, doubt)
}

/// The magnetometer without names, unless nothing shows the gyros; accelerometers that are its columns are replaced.
fn field_of_turns(
    sheet: &Sheet,
    taken: &[usize],
    doubt: Option<&Doubt>,
    found: &mut PerSensor<Vec<Triad>>,
) -> Option<MagnetometerColumns> {
    let pair = (found.gyro.first()?, found.accel.first()?);
    let is_shown = doubt != Some(&Doubt::NoTurns);
    let by_turns = || MagnetometerColumns::by_turns(sheet, taken, pair);
    let (of, accel) = is_shown.then(by_turns)??;
    let is_other = |triad: &Triad| !overlap(triad, &of.columns) && *triad != accel;
    found.accel.retain(is_other);
    found.accel.insert(0, accel);
    Some(of)
}

/// Complete triads of a sensor, in order of their columns.
fn by_name(names: &[Name], sheet: &Sheet, sensor: Sensor) -> Vec<[usize; 3]> {
    let of_sensor = |k: &usize| names[*k].sensor() == Some(sensor) && is_numeric(sheet, *k);
    let candidates: Vec<usize> = (0..names.len()).filter(of_sensor).collect();
    by_stem(names, &candidates)
}

/// The triads by name; of a sensor without names, all that the names and units of other columns allow.
fn candidates(
    sheet: &Sheet,
    names: &[Name],
    taken: &[usize],
    by_name: &PerSensor<Vec<Triad>>,
) -> PerSensor<Vec<Triad>> {
    let is_free = |k: &usize| {
        !taken.contains(k) && !names[*k].is_of_another_sensor() && is_numeric(sheet, *k)
    };
    let varies = |k: &usize| sheet.varies(*k);
    let free: Vec<usize> = (0..names.len()).filter(is_free).collect();
    let has_stem = |k: &usize| names[*k].stem.contains(char::is_alphabetic);
    let with_stem: Vec<usize> = free.iter().copied().filter(has_stem).collect();
    let mut named = by_stem(names, &with_stem);
    let is_alone = |triad: &Triad| {
        let same = |k: &&usize| names[**k].stem == names[triad[0]].stem;
        with_stem.iter().filter(same).count() == 3
    };
    named.retain(|triad| is_alone(triad) && triad.iter().any(varies));
    let mut all = consecutive(
        &sheet.columns,
        &free.into_iter().filter(varies).collect::<Vec<_>>(),
    );
    // Columns that are named as a triad stay together.
    all.retain(|triad| named.iter().all(|other| !overlap(triad, other)));
    all.extend(named);
    all.sort_unstable();
    PerSensor::from_fn(|sensor| {
        let is_of = |k: usize| match names[k].unit.map(|unit| unit.of) {
            Some(Of::Rows(of_unit, _)) => of_unit == sensor,
            Some(Of::Time | Of::Field | Of::Other) => false,
            Some(Of::Count) | None => true,
        };
        match &by_name.get(sensor)[..] {
            [] => all
                .iter()
                .filter(|triad| triad.iter().all(|&k| is_of(k)))
                .copied()
                .collect(),
            named => named.to_vec(),
        }
    })
}

/// Four adjacent columns with similar or uninformative names whose squares add up to one in every row.
fn quaternion(sheet: &Sheet, time: Option<usize>) -> Option<[usize; 4]> {
    let begin = |k: usize| {
        let name = &sheet.names[k];
        name.chars().next().filter(|_| name.len() > 2)
    };
    let is_one = |four: &[usize; 4], row: usize| {
        let norm: f64 = four.iter().map(|&k| sheet.columns[k][row].powi(2)).sum();
        (norm - 1.0).abs() < 1e-3
    };
    let places = 0..sheet.names.len().saturating_sub(3);
    let mut all = places.map(|k| [k, k + 1, k + 2, k + 3]);
    all.find(|four| {
        let fits = |&k: &usize| Some(k) != time && begin(k) == begin(four[0]);
        four.iter().all(fits) && (0..sheet.rows()).all(|row| is_one(four, row))
    })
}
