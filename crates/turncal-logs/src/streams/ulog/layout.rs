//! Layout of the numbers in the messages of a topic.

use std::collections::BTreeMap;

use super::super::Column;
use super::super::bytes::{Broken, Kind};

/// Limit above the capacity of a message of 65,535 bytes.
const MOST: usize = 1 << 16;
/// Maximum nesting of topics; PX4 uses one level.
const DEEPEST: usize = 8;

pub struct Layout {
    pub columns: Vec<Column>,
    places: Vec<(usize, Kind)>,
    length: usize,
}

/// Content found and content expected.
type Wrong = (String, &'static str);

impl Layout {
    pub fn of(topic: &str, formats: &BTreeMap<String, String>) -> Result<Self, Wrong> {
        let mut layout = Self {
            columns: Vec::new(),
            places: Vec::new(),
            length: 0,
        };
        layout.add(topic, "", topic, formats, 0)?;
        Ok(layout)
    }

    fn add(
        &mut self,
        topic: &str,
        prefix: &str,
        format: &str,
        formats: &BTreeMap<String, String>,
        depth: usize,
    ) -> Result<(), Wrong> {
        let fields = formats
            .get(format)
            .filter(|_| depth < DEEPEST)
            .ok_or_else(|| {
                (
                    format!("a field of type `{format}`"),
                    "a numeric type or a format defined in this file",
                )
            })?;
        for field in fields.split(';').filter(|field| !field.trim().is_empty()) {
            let wrong = || (format!("the field `{field}`"), "`type name`");
            let (kind, name) = field.trim().split_once(' ').ok_or_else(wrong)?;
            let (kind, count) = match kind.split_once('[') {
                None => (kind, None),
                Some((kind, rest)) => {
                    let count = rest.strip_suffix(']').and_then(|count| count.parse().ok());
                    let count: usize = count.filter(|&count| count <= MOST).ok_or_else(wrong)?;
                    (kind, Some(count))
                }
            };
            for index in 0..count.unwrap_or(1) {
                let name = match count {
                    Some(_) => format!("{prefix}{name}[{index}]"),
                    None => format!("{prefix}{name}"),
                };
                self.number(topic, name, kind, formats, depth)?;
                if self.length > MOST {
                    return Err((
                        format!("a topic `{topic}` longer than {MOST} bytes"),
                        "a shorter topic",
                    ));
                }
            }
        }
        Ok(())
    }

    fn number(
        &mut self,
        topic: &str,
        name: String,
        kind: &str,
        formats: &BTreeMap<String, String>,
        depth: usize,
    ) -> Result<(), Wrong> {
        if kind == "char" {
            self.length += 1;
            return Ok(());
        }
        let Some(kind) = Kind::named(kind) else {
            return self.add(topic, &format!("{name}."), kind, formats, depth + 1);
        };
        if !name.contains("_padding") {
            let unit = unit(topic, &name);
            self.columns.push(Column::new(name, unit));
            self.places.push((self.length, kind));
        }
        self.length += kind.size();
        Ok(())
    }

    /// The number in a column of a message.
    pub fn value(&self, data: &[u8], column: usize) -> Option<f64> {
        let &(place, kind) = self.places.get(column)?;
        kind.number(data.get(place..)?, false)
    }

    /// The numbers of a message whose data start at this offset of the file.
    pub fn values(&self, data: &[u8], offset: u64, row: &mut Vec<f64>) -> Result<(), Broken> {
        row.clear();
        for &(place, kind) in &self.places {
            let bytes = data.get(place..).unwrap_or_default();
            let number = kind.number(bytes, false).ok_or_else(|| {
                Broken::new(
                    offset,
                    format_args!("{} bytes of data", data.len()),
                    format_args!("the {} bytes of their format", self.length),
                )
            })?;
            row.push(number);
        }
        Ok(())
    }
}

/// The unit of a field, from the PX4 message definitions.
fn unit(topic: &str, name: &str) -> &'static str {
    let of = |start: &str| name.starts_with(start);
    let is_axis = matches!(name, "x" | "y" | "z");
    match topic {
        _ if of("timestamp") || of("delta_angle_dt") || of("delta_velocity_dt") => "us",
        "sensor_gyro" if is_axis => "rad/s",
        "sensor_accel" if is_axis => "m/s^2",
        "vehicle_imu" if of("delta_angle[") => "rad",
        "vehicle_imu" if of("delta_velocity[") => "m/s",
        "sensor_combined" if of("gyro_rad[") => "rad/s",
        "sensor_combined" if of("accelerometer_m_s2[") => "m/s^2",
        _ => "",
    }
}
