//! Determines quantity, axis and unit from the name of a column.

use crate::quantity::{Of, spelled};
use turncal::imu::Sensor;

/// A unit of `run.toml`, and the size of the file's unit in this unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    pub word: &'static str,
    pub times: f64,
    pub of: Of,
}

/// Parts of triad column names, and whole names.
#[rustfmt::skip]
const TRIADS: [(Sensor, &[&str], &[&str]); 2] = [
    (
        Sensor::Gyro,
        &["gyr", "angvel", "angularv", "angularr", "angrate", "omega", "deltaangle", "dang", "deltatheta", "dtheta",
          "wrs", "rotationrate"],
        &["g", "w", "wb", "om", "rate", "pqr"],
    ),
    (
        Sensor::Accel,
        &["acc", "specificforce", "deltav", "dvel", "velinc", "ars"],
        &["a", "f", "fb", "sf", "dv", "force", "gf"],
    ),
];
/// Parts of the names of other columns.
#[rustfmt::skip]
const OTHERS: [&str; 8] = ["quat", "euler", "cov", "std", "bias", "orientation", "useracc", "gravity"];
/// Parts of the names of magnetometer columns.
const MAGNETOMETERS: [&str; 2] = ["mag", "compass"];

/// A parsed name.
#[derive(Debug, Clone, PartialEq)]
pub struct Name {
    /// Letters and digits of the name in lower case, without those of the axis and the unit.
    pub stem: String,
    /// The axis part.
    pub axis: Option<char>,
    pub unit: Option<Unit>,
}

/// Whether the columns are those of PX4's sensor_combined or ArduPilot's IMU, whose axes are front, right, down.
pub fn is_of_autopilot(columns: &[String]) -> bool {
    let has = |name: &str| columns.iter().any(|column| column == name);
    has("accelerometer_m_s2[0]") || has("TimeUS") && (has("GyrX") || has("AccX"))
}

/// The unit in a string, with an optional preceding factor.
pub fn unit(text: &str) -> Option<Unit> {
    let text = text.trim_matches(['[', ']', ' ']);
    let text = text.strip_suffix("/LSB").unwrap_or(text);
    let number = |text: &str| match text.strip_prefix("1/") {
        Some(of_one) => of_one.parse::<f64>().map(f64::recip),
        None => text.parse(),
    };
    let parts = text.split_once(' ');
    let counted = parts.and_then(|(times, rest)| Some((number(times).ok()?, rest)));
    let (times, text) = counted.unwrap_or((1.0, text));
    let (word, of_it, of) = spelled(text)?;
    let times = times * of_it;
    (times > 0.0 && times.is_finite()).then_some(Unit { word, times, of })
}

/// The words of a name in lower case, separated by blanks, marks or capitals.
fn words(name: &str) -> Vec<String> {
    let letters: Vec<char> = name.chars().collect();
    let mut words = vec![String::new()];
    for (k, &c) in letters.iter().enumerate() {
        let before = k.checked_sub(1).map_or(' ', |k| letters[k]);
        let ends_capitals =
            before.is_uppercase() && letters.get(k + 1).is_some_and(|c| c.is_lowercase());
        let begins = c.is_uppercase() && (before.is_lowercase() || ends_capitals);
        if begins || !c.is_alphanumeric() {
            words.push(String::new());
        }
        if let Some(word) = words.last_mut().filter(|_| c.is_alphanumeric()) {
            word.extend(c.to_lowercase());
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

impl Name {
    /// Analyses the name of a column whose unit may be in a separate row.
    pub fn of_column(name: &str, unit_below: &str) -> Self {
        let mut of = Self::of(name);
        of.unit = of.unit.or_else(|| unit(unit_below));
        of
    }

    pub fn of(name: &str) -> Self {
        let (mut rest, mut found) = (name.to_owned(), None);
        if let Some(open) = name.rfind(['[', '(']) {
            let inside = name[open..].trim_matches(['[', ']', '(', ')', ' ']);
            found = unit(inside);
            let within = Self::of(inside);
            match found {
                // `%float(RawGyroX)`
                None if within.axis.is_some()
                    && (within.sensor().is_some() || within.is_magnetic()) =>
                {
                    return within;
                }
                // An index is not a unit.
                None if inside.chars().all(|c| c.is_ascii_digit()) => {}
                _ => rest = name[..open].to_owned(),
            }
        }
        let mut words = words(&rest);
        // `gyro_x_dps`, `timestamp_us`, `acc_z_m_s2`; but the last letter of `acc_g` may as well be a name.
        let named = (1..words.len().min(4)).rev().find_map(|count| {
            let (before, last) = words.split_at(words.len() - count);
            let named = unit(&last.concat())?;
            let is_long = count > 1 || last[0].len() > 1;
            (is_long || axis_at_end(before.last()?).is_some()).then_some((named, count))
        });
        if let Some((named, count)) = named.filter(|_| found.is_none()) {
            found = Some(named);
            words.truncate(words.len() - count);
        }
        // `Gyroscope X CAL`
        let is_axis = |word: &String| ["x", "y", "z"].contains(&&**word);
        let single = words.iter().position(is_axis).filter(|_| words.len() > 1);
        let axis = single.and_then(|place| words.remove(place).chars().next());
        let whole = words.concat();
        // With the unit of a triad, an axis alone is enough.
        let is_row = found.is_some_and(|unit| matches!(unit.of, Of::Rows(..)));
        let alone = whole.chars().next().filter(|_| is_row && is_axis(&whole));
        let apart = match axis {
            Some(axis) => Some((&*whole, axis)),
            None if alone.is_some() => alone.map(|axis| ("", axis)),
            None => axis_at_end(&whole).or(axis_at_start(&whole)),
        };
        Self {
            stem: apart.map_or(&*whole, |(stem, _)| stem).to_owned(),
            axis: apart.map(|(_, axis)| axis),
            unit: found,
        }
    }

    /// The triad to which the stem of the name belongs; if the stem fits both triads, the unit decides.
    pub fn sensor(&self) -> Option<Sensor> {
        if self.is_of_another_sensor() {
            return None;
        }
        let names = |(_, parts, all): &&(Sensor, &[&str], &[&str])| {
            parts.iter().any(|part| self.stem.contains(part)) || all.contains(&&*self.stem)
        };
        let named = TRIADS.iter().find(names).map(|(sensor, ..)| *sensor);
        match self.unit.map(|unit| unit.of) {
            Some(Of::Rows(of_unit, _)) if named.is_some() || self.stem.is_empty() => Some(of_unit),
            _ => named,
        }
    }

    /// Whether the name belongs to neither a gyro nor an accelerometer.
    pub fn is_of_another_sensor(&self) -> bool {
        self.is_magnetic() || OTHERS.iter().any(|other| self.stem.contains(other))
    }

    /// Whether the name belongs to an axis of a magnetometer.
    pub fn is_magnetic(&self) -> bool {
        let is_of_field = self.unit.is_some_and(|unit| unit.of == Of::Field);
        let is_named = MAGNETOMETERS.iter().any(|part| self.stem.contains(part))
            && !OTHERS.iter().any(|other| self.stem.contains(other));
        let is_letter = self.stem == "m" && matches!(self.axis, Some('x' | 'y' | 'z'));
        is_of_field || is_named || is_letter
    }

    /// How similar the name is to the typical name of a time column; larger means more similar.
    pub fn is_time(&self) -> u8 {
        let whole = self.whole();
        let has = |parts: &[&str]| parts.iter().any(|part| whole.contains(part));
        let is = |all: &[&str]| all.contains(&&*whole);
        // The time of the instrument takes precedence over that of the receiver.
        let ends = ["headerstamp", "timestampsample"];
        if ends.iter().any(|end| whole.ends_with(end)) || whole == "sample" && self.is_of_time() {
            4
        } else if is(&["t", "time", "timestamp", "tow", "gpstime", "stamp"]) {
            3
        } else if has(&["time", "tow", "clock", "stamp", "elapsed"])
            || is(&[
                "sec", "seconds", "secs", "ms", "us", "ns", "millis", "micros",
            ])
        {
            2
        } else {
            u8::from(self.is_counter())
        }
    }

    pub fn is_counter(&self) -> bool {
        let whole = self.whole();
        let parts = ["count", "cntr", "sample", "index", "packet", "seq"];
        parts.iter().any(|part| whole.contains(part)) || ["n", "i", "k", "id"].contains(&&*whole)
    }

    /// Whether the unit is a unit of time.
    pub fn is_of_time(&self) -> bool {
        self.unit.is_some_and(|unit| unit.of == Of::Time)
    }

    /// Whether this column contains one part of a time that is split into two columns: the whole seconds or the
    /// fraction.
    pub fn is_part_of_time(&self, word: &str) -> bool {
        let unit = self.unit.or_else(|| unit(&self.whole()));
        unit.is_some_and(|unit| unit.word == word)
    }

    /// Whether the values of the column distinguish several instruments.
    pub fn is_instance(&self) -> bool {
        let names = [
            "i", "id", "instance", "imu", "imuid", "device", "deviceid", "sensorid",
        ];
        names.contains(&&*self.whole())
    }

    /// Whether the column counts the ticks of a clock.
    pub fn is_in_ticks(&self) -> bool {
        self.whole().contains("tick")
    }

    /// Duration of a tick in s, if the name defines it.
    pub fn tick(&self) -> Option<f64> {
        // Xsens, MT Low-Level Communication Protocol: 10 kHz.
        (self.whole() == "sampletimefine").then_some(1e-4)
    }

    pub fn is_temperature(&self) -> bool {
        self.stem.contains("temp") || self.unit.is_some_and(|unit| unit.word == "degC")
    }

    fn whole(&self) -> String {
        let mut whole = self.stem.clone();
        whole.extend(self.axis);
        whole
    }
}

/// Groups of three columns whose names differ only in the axis.
pub fn by_stem(names: &[Name], candidates: &[usize]) -> Vec<[usize; 3]> {
    let mut triads = Vec::new();
    for &first in candidates {
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

fn axis_at_end(word: &str) -> Option<(&str, char)> {
    let axis = word.chars().next_back()?;
    let stem = word.strip_suffix(['x', 'y', 'z', '0', '1', '2', '3'])?;
    (!stem.is_empty()).then_some((stem, axis))
}

fn axis_at_start(word: &str) -> Option<(&str, char)> {
    let axis = word.chars().next()?;
    let stem = word.strip_prefix(['x', 'y', 'z'])?;
    (!stem.is_empty()).then_some((stem, axis))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_many_programs_are_understood() {
        use Sensor::{Accel, Gyro};
        for (text, sensor, axis, unit) in [
            ("gx", Gyro, 'x', None),
            ("Gyr_Y", Gyro, 'y', None),
            ("GyrZ", Gyro, 'z', None),
            ("gyro_x_dps", Gyro, 'x', Some("deg/s")),
            ("Gyroscope x (rad/s)", Gyro, 'x', Some("rad/s")),
            ("w_RS_S_x [rad s^-1]", Gyro, 'x', Some("rad/s")),
            ("a_RS_S_z [m s^-2]", Accel, 'z', Some("m/s^2")),
            ("field.angular_velocity.y", Gyro, 'y', None),
            ("field.linear_acceleration.y", Accel, 'y', None),
            ("xgyro", Gyro, 'x', None),
            ("accelerometer_m_s2[1]", Accel, '1', None),
            ("AccX", Accel, 'x', None),
            ("acc_x_mg", Accel, 'x', Some("mg")),
            ("fz", Accel, 'z', None),
            ("wx", Gyro, 'x', None),
            ("%float(RawGyroX)", Gyro, 'x', None),
            ("Acc X (calibrated)", Accel, 'x', None),
            ("X Accel [x8004]", Accel, 'x', None),
            ("UncalGyroXRadPerSec", Gyro, 'x', Some("rad/s")),
            ("Gyroscope Y CAL", Gyro, 'y', None),
            ("gyroADC[0] (deg/s)", Gyro, '0', Some("deg/s")),
            ("accSmooth[2] (m/s/s)", Accel, '2', Some("m/s^2")),
            ("acc_z_m_s2", Accel, 'z', Some("m/s^2")),
            ("ARS-X [deg/s]", Gyro, 'x', Some("deg/s")),
        ] {
            let name = Name::of(text);
            assert_eq!(
                (name.sensor(), name.axis, name.unit.map(|unit| unit.word)),
                (Some(sensor), Some(axis), unit),
                "{text}"
            );
        }
        for text in [
            "t",
            "mag_x",
            "Mat[1][1]",
            "field.angular_velocity_covariance0",
            "Temp",
            "gyro_bias_x",
            "%float(RawCompassX)",
        ] {
            assert_eq!(Name::of(text).sensor(), None, "{text}");
        }
        assert_eq!(
            (
                Name::of("timestamp_us").is_time(),
                Name::of("timestamp_us").unit.map(|unit| unit.word)
            ),
            (3, Some("us"))
        );
        assert_eq!(
            (
                Name::of("#timestamp [ns]").is_time(),
                Name::of("timestamp [ns]").unit.map(|unit| unit.word)
            ),
            (3, Some("ns"))
        );
        let compass = Name::of("%float(RawCompassY)");
        assert!(compass.is_magnetic() && compass.axis == Some('y'));
        assert!(Name::of("PacketCounter").is_counter() && Name::of("Temp_C").is_temperature());
    }
}
