//! Which columns hold what.

use nalgebra::Vector3;

use super::name::Name;
use super::units::offset;
use crate::formats::Sheet;
use crate::imu::{PerSensor, Sensor};
use crate::statistics::median;

/// Columns by their place in the file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Columns {
    pub names: Vec<String>,
    pub time: Option<usize>,
    /// Nanoseconds beside a time in whole seconds.
    pub nanoseconds: Option<usize>,
    /// A column that counts rows.
    pub counter: Option<usize>,
    pub triads: PerSensor<Option<[usize; 3]>>,
    /// Others that might be meant.
    pub others: PerSensor<Vec<[usize; 3]>>,
    /// Whether the triads were told by their numbers, for their names say nothing.
    pub by_size: bool,
    pub temperature: Option<usize>,
    /// Four columns of norm one.
    pub quaternion: Option<[usize; 4]>,
}

/// Part of the rows that must be numbers.
const NUMBERS: f64 = 0.5;
/// Sensors fail in fewer rows; where one of both says nothing in more, the other has another rate.
const LACKING: f64 = 0.1;
/// So many instruments may share a log.
const MOST_INSTANCES: usize = 8;
/// Part of the steps of a time that go forward.
const FORWARD: f64 = 0.9;

/// Of both triads, row by row.
type Samples = PerSensor<Vec<Vector3<f64>>>;

impl Columns {
    pub fn find(sheet: &Sheet) -> Self {
        let names: Vec<Name> = sheet.names.iter().map(|name| Name::of(name)).collect();
        let split = split_time(sheet, &names);
        let time = split.map(|pair| pair[0]).or_else(|| time(sheet, &names));
        let temperature =
            (0..names.len()).find(|&k| names[k].is_temperature() && is_numeric(sheet, k));
        let mut found = PerSensor::from_fn(|sensor| by_name(&names, sheet, sensor));
        let by_size = Sensor::ALL
            .iter()
            .all(|&sensor| found.get(sensor).is_empty());
        let is_echo = by_size && is_echo(sheet);
        if is_echo {
            found = PerSensor {
                gyro: vec![ECHO_GYRO],
                accel: vec![ECHO_ACCEL],
            };
        } else if by_size {
            found = by_numbers(sheet, &names, [time, temperature]);
        }
        let first = |triads: &Vec<[usize; 3]>| triads.first().copied();
        Self {
            names: sheet.names.clone(),
            time,
            nanoseconds: split.map(|pair| pair[1]),
            counter: (0..names.len()).find(|&k| names[k].is_counter() && goes_forward(sheet, k)),
            triads: PerSensor::from_fn(|sensor| first(found.get(sensor))),
            others: PerSensor::from_fn(|sensor| {
                found.get(sensor).iter().skip(1).copied().collect()
            }),
            by_size: by_size && !is_echo,
            temperature,
            quaternion: quaternion(sheet, time),
        }
    }

    /// The times of all rows, in the column's unit.
    pub fn stamps(&self, sheet: &Sheet) -> Option<Vec<f64>> {
        let times = &sheet.columns[self.time?];
        Some(match self.nanoseconds {
            Some(column) => both(times, &sheet.columns[column]),
            None => times.clone(),
        })
    }

    /// The rows in which both triads are numbers, and their samples.
    pub fn samples(&self, sheet: &Sheet) -> Option<(Vec<usize>, Samples)> {
        let triads = PerSensor {
            gyro: self.triads.gyro?,
            accel: self.triads.accel?,
        };
        let at = |columns: &[usize; 3], row: usize| {
            Vector3::from(columns.map(|k| sheet.columns[k][row]))
        };
        let (mut rows, mut samples) = (Vec::new(), PerSensor::from_fn(|_| Vec::new()));
        for row in 0..sheet.columns[triads.gyro[0]].len() {
            let both = PerSensor::from_fn(|sensor| at(triads.get(sensor), row));
            if (both.gyro + both.accel)
                .iter()
                .all(|value| value.is_finite())
            {
                rows.push(row);
                Sensor::ALL
                    .iter()
                    .for_each(|&sensor| samples.get_mut(sensor).push(*both.get(sensor)));
            }
        }
        (rows.len() > 1).then_some((rows, samples))
    }
}

/// The columns whose names say that they are of this sensor.
pub(super) fn named(sheet: &Sheet, sensor: Sensor) -> Vec<usize> {
    let is = |k: &usize| Name::of(&sheet.names[*k]).sensor() == Some(sensor);
    (0..sheet.names.len()).filter(is).collect()
}

/// Whether gyros and accelerometers have rows of their own, as their names tell.
pub(super) fn have_rows_of_their_own(sheet: &Sheet) -> bool {
    let places = PerSensor::from_fn(|sensor| named(sheet, sensor));
    let is_there =
        |places: &[usize], row: usize| places.iter().any(|&k| sheet.columns[k][row].is_finite());
    let (mut both, mut one) = (0, 0);
    for row in 0..sheet.columns.first().map_or(0, Vec::len) {
        match (is_there(&places.gyro, row), is_there(&places.accel, row)) {
            (true, true) => both += 1,
            (false, false) => {}
            _ => one += 1,
        }
    }
    let has = |sensor: Sensor| !places.get(sensor).is_empty();
    Sensor::ALL.into_iter().all(has) && f64::from(one) > LACKING * f64::from(both + one)
}

fn is_numeric(sheet: &Sheet, column: usize) -> bool {
    let values = &sheet.columns[column];
    let numbers = values.iter().filter(|value| value.is_finite()).count();
    numbers as f64 >= NUMBERS * values.len() as f64
}

/// The columns of `sensor_msgs/Imu` as `ros2 topic echo --csv` writes them, without names: seconds,
/// nanoseconds, frame, orientation, angular velocity and linear acceleration, each with its covariance.
const ECHO: usize = 40;
const ECHO_GYRO: [usize; 3] = [16, 17, 18];
const ECHO_ACCEL: [usize; 3] = [28, 29, 30];

fn is_echo(sheet: &Sheet) -> bool {
    let is_numbered = sheet.names.first().is_some_and(|name| name == "1");
    is_numbered && sheet.names.len() == ECHO && (0..ECHO).all(|k| is_numeric(sheet, k) != (k == 2))
}

fn both(seconds: &[f64], nanoseconds: &[f64]) -> Vec<f64> {
    let rows = seconds.iter().zip(nanoseconds);
    rows.map(|(seconds, nanoseconds)| seconds + 1e-9 * nanoseconds)
        .collect()
}

/// Whole seconds with the nanoseconds beside them.
fn split_time(sheet: &Sheet, names: &[Name]) -> Option<[usize; 2]> {
    let is_pair = |k: &usize| match is_echo(sheet) {
        true => *k == 0,
        false => names[*k].is_seconds() && names[k + 1].is_nanoseconds(),
    };
    let pair = (0..names.len().saturating_sub(1)).find(is_pair)?;
    let times = both(&sheet.columns[pair], &sheet.columns[pair + 1]);
    are_forward(&times).then_some([pair, pair + 1])
}

/// The column that tells rows of several instruments apart, with what it says of the first.
pub(super) fn instance(sheet: &Sheet) -> Option<(usize, f64)> {
    let column = (0..sheet.names.len()).find(|&k| {
        let values = &sheet.columns[k];
        let mut known: Vec<f64> = Vec::new();
        Name::of(&sheet.names[k]).is_instance()
            && values.iter().all(|value| {
                if !known.contains(value) {
                    known.push(*value);
                }
                value.fract() == 0.0 && known.len() <= MOST_INSTANCES
            })
            && known.len() > 1
    })?;
    Some((column, *sheet.columns[column].first()?))
}

fn goes_forward(sheet: &Sheet, column: usize) -> bool {
    are_forward(&sheet.columns[column])
}

fn are_forward(values: &[f64]) -> bool {
    let forward = values.windows(2).filter(|pair| pair[1] > pair[0]).count();
    forward as f64 >= FORWARD * (values.len() as f64 - 1.0)
}

/// The column most like a time by its name, else the first that goes forward.
fn time(sheet: &Sheet, names: &[Name]) -> Option<usize> {
    let forward = (0..names.len()).filter(|&k| goes_forward(sheet, k));
    let best = forward.max_by_key(|&k| (names[k].is_time(), names.len() - k))?;
    // The angle of an integrating sensor goes forward, too.
    let named_otherwise = names[best].is_time() == 0 && names[best].sensor().is_some();
    (!named_otherwise).then_some(best)
}

/// Complete triads of a sensor, in order of their columns.
fn by_name(names: &[Name], sheet: &Sheet, sensor: Sensor) -> Vec<[usize; 3]> {
    let of_sensor = |k: &usize| names[*k].sensor() == Some(sensor) && is_numeric(sheet, *k);
    let candidates: Vec<usize> = (0..names.len()).filter(of_sensor).collect();
    let mut triads = Vec::new();
    for &first in &candidates {
        let axes = match names[first].axis {
            Some('x') => ['x', 'y', 'z'],
            Some('0') => ['0', '1', '2'],
            Some('1') if !candidates.iter().any(|&k| names[k].axis == Some('0')) => ['1', '2', '3'],
            _ => continue,
        };
        let of = |axis| {
            let same =
                |k: &&usize| names[**k].stem == names[first].stem && names[**k].axis == Some(axis);
            candidates.iter().find(same).copied()
        };
        if let [Some(x), Some(y), Some(z)] = axes.map(of) {
            triads.push([x, y, z]);
        }
    }
    triads
}

/// Triads side by side: gravity keeps the magnitude of one of them, the other is a gyro's.
fn by_numbers(
    sheet: &Sheet,
    names: &[Name],
    taken: [Option<usize>; 2],
) -> PerSensor<Vec<[usize; 3]>> {
    let is_free = |&k: &usize| {
        !taken.contains(&Some(k)) && !names[k].is_of_another_sensor() && is_numeric(sheet, k)
    };
    let free: Vec<usize> = (0..sheet.names.len()).filter(is_free).collect();
    let mut triads: Vec<(f64, [usize; 3])> = free
        .chunks_exact(3)
        .map(|columns| [columns[0], columns[1], columns[2]])
        .map(|triad| (unevenness(sheet, &triad), triad))
        .collect();
    triads.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut triads = triads.into_iter().map(|(_, triad)| triad);
    let accel = triads.next();
    let mut gyro: Vec<[usize; 3]> = triads.collect();
    // Of several, the gyro is usually beside the accelerometer.
    gyro.sort_by_key(|triad| accel.map_or(0, |accel| triad[0].abs_diff(accel[0])));
    PerSensor {
        accel: accel.filter(|_| !gyro.is_empty()).into_iter().collect(),
        gyro,
    }
}

/// Median departure of a triad's magnitude from its median, relative.
fn unevenness(sheet: &Sheet, triad: &[usize; 3]) -> f64 {
    let rows = 0..sheet.columns[triad[0]].len();
    let at = |row: usize| Vector3::from(triad.map(|k| sheet.columns[k][row]));
    let samples: Vec<Vector3<f64>> = rows
        .map(at)
        .filter(|sample| sample.iter().all(|value| value.is_finite()))
        .collect();
    let zero = offset(&samples).unwrap_or(0.0);
    let mut sizes: Vec<f64> = samples
        .iter()
        .map(|sample| sample.add_scalar(-zero).norm())
        .collect();
    let middle = median(&mut sizes).unwrap_or(0.0);
    let mut off: Vec<f64> = sizes.iter().map(|size| (size - middle).abs()).collect();
    let off = median(&mut off).unwrap_or(0.0);
    if middle > 0.0 {
        off / middle
    } else {
        f64::INFINITY
    }
}

/// Four columns side by side whose squares add up to one in every row.
fn quaternion(sheet: &Sheet, time: Option<usize>) -> Option<[usize; 4]> {
    let rows = sheet.columns.first()?.len();
    let places = 0..sheet.names.len().saturating_sub(3);
    places.map(|k| [k, k + 1, k + 2, k + 3]).find(|four| {
        let norm = |row: usize| {
            four.iter()
                .map(|&k| sheet.columns[k][row].powi(2))
                .sum::<f64>()
        };
        !four.iter().any(|&k| Some(k) == time)
            && (0..rows).all(|row| (norm(row) - 1.0).abs() < 1e-3)
    })
}
