//! What the name of a column says: a quantity, an axis, a unit.

use crate::imu::Sensor;

/// Units as names write them, and as `run.toml` does.
const UNITS: [(&str, &[&str]); 17] = [
    (
        "m/s^2",
        &[
            "m/s^2", "m/s2", "m/s²", "m/s/s", "ms^-2", "ms-2", "mps2", "ms2",
        ],
    ),
    (
        "rad/s",
        &["rad/s", "rads^-1", "rads-1", "rads", "radps", "rps"],
    ),
    (
        "deg/s",
        &["deg/s", "°/s", "degs^-1", "degs-1", "degs", "dps", "degps"],
    ),
    ("deg/h", &["deg/h", "°/h", "dph", "deg/hr"]),
    ("m/s", &["m/s", "mps"]),
    ("g*s", &["g*s", "gs"]),
    ("mg", &["mg"]),
    ("g", &["g"]),
    ("count", &["count", "counts", "lsb", "raw", "cnt"]),
    ("arcsec", &["arcsec", "\""]),
    ("rad", &["rad"]),
    ("deg", &["deg", "°"]),
    ("s", &["s", "sec", "secs", "seconds"]),
    ("ms", &["ms", "msec", "millis", "milliseconds"]),
    ("us", &["us", "µs", "μs", "usec", "micros", "microseconds"]),
    ("ns", &["ns", "nsec", "nanos", "nanoseconds"]),
    ("mdps", &["mdps"]),
];

/// A name taken apart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Name {
    /// Letters and digits in lower case, without axis and unit.
    pub stem: String,
    /// What stands for the axis.
    pub axis: Option<char>,
    /// As `run.toml` writes it; others as they are known.
    pub unit: Option<&'static str>,
}

/// The body axes of the program whose columns have such names; none if it is not known.
pub(super) fn axes_of_program(columns: &[String]) -> Option<&'static str> {
    let has = |name: &str| columns.iter().any(|column| column == name);
    // PX4's sensor_combined and ArduPilot's IMU: front, right, down.
    let is_autopilot =
        has("accelerometer_m_s2[0]") || has("TimeUS") && (has("GyrX") || has("AccX"));
    is_autopilot.then_some("frd")
}

/// The unit that a text names.
pub(super) fn unit(text: &str) -> Option<&'static str> {
    let text: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    let text = text.trim_matches(['[', ']', '(', ')']).to_lowercase();
    let known = UNITS
        .iter()
        .find(|(_, spellings)| spellings.contains(&text.as_str()));
    known.map(|&(unit, _)| unit)
}

impl Name {
    pub fn of(name: &str) -> Self {
        let (mut rest, mut found) = (name.to_owned(), None);
        if let Some(open) = name.find(['[', '(']) {
            let inside = name[open..].trim_matches(['[', ']', '(', ')', ' ']);
            found = unit(inside);
            let within = Self::of(inside);
            match found {
                // `%float(RawGyroX)`
                None if within.axis.is_some() && within.stem.len() > 1 => return within,
                // An index is no unit.
                None if inside.chars().all(|c| c.is_ascii_digit()) => {}
                _ => rest = name[..open].to_owned(),
            }
        }
        let rest = rest
            .to_lowercase()
            .replace("m_s2", "mps2")
            .replace("rad_s", "radps");
        let mut words: Vec<&str> = rest
            .split(|c: char| !c.is_alphanumeric())
            .filter(|word| !word.is_empty())
            .collect();
        // `gyro_x_dps`, `timestamp_us`; but the last letter of `acc_g` may as well be a name.
        if let [.., before, last] = words[..]
            && let Some(named) = unit(last)
            && found.is_none()
            && (axis_at_end(before).is_some() || named.len() > 1)
        {
            found = Some(named);
            words.pop();
        }
        let whole = words.concat();
        let (stem, axis) = match (axis_at_end(&whole), axis_at_start(&whole)) {
            (Some((stem, axis)), _) | (None, Some((stem, axis))) => (stem, Some(axis)),
            (None, None) => (whole.as_str(), None),
        };
        Self {
            stem: stem.to_owned(),
            axis,
            unit: found,
        }
    }

    /// The triad that the stem names.
    pub fn sensor(&self) -> Option<Sensor> {
        let has = |parts: &[&str]| parts.iter().any(|part| self.stem.contains(part));
        let is = |all: &[&str]| all.contains(&self.stem.as_str());
        if self.is_of_another_sensor() {
            None
        } else if has(&[
            "gyr",
            "angvel",
            "angularv",
            "angularr",
            "angrate",
            "omega",
            "deltaangle",
            "dang",
            "deltatheta",
            "dtheta",
            "wrs",
        ]) || is(&["g", "w", "wb", "om", "rate", "pqr"])
        {
            Some(Sensor::Gyro)
        } else if has(&["acc", "specificforce", "deltav", "dvel", "velinc", "ars"])
            || is(&["a", "f", "fb", "sf", "dv", "force"])
        {
            Some(Sensor::Accel)
        } else {
            None
        }
    }

    /// Whether it is neither a gyro's nor an accelerometer's, by its name.
    pub fn is_of_another_sensor(&self) -> bool {
        let others = [
            "mag",
            "compass",
            "quat",
            "euler",
            "cov",
            "std",
            "bias",
            "orientation",
        ];
        others.iter().any(|other| self.stem.contains(other))
    }

    /// How much like a column of time it is, more is more.
    pub fn is_time(&self) -> u8 {
        let whole = self.whole();
        let is = |all: &[&str]| all.contains(&whole.as_str());
        // The instrument's own time before that of whoever received it.
        let ends = ["headerstamp", "timestampsample", "sampleus"];
        if ends.iter().any(|end| whole.ends_with(end)) {
            4
        } else if is(&["t", "time", "timestamp", "tow", "gpstime", "stamp"]) {
            3
        } else if whole.contains("time") || is(&["sec", "seconds", "secs", "ms", "us", "ns"]) {
            2
        } else if self.is_counter() {
            1
        } else {
            0
        }
    }

    pub fn is_counter(&self) -> bool {
        let whole = self.whole();
        let parts = ["count", "sample", "index", "packet", "seq"];
        parts.iter().any(|part| whole.contains(part)) || ["n", "i", "k", "id"].contains(&&*whole)
    }

    /// Whole seconds of a time that goes on in another column.
    pub fn is_seconds(&self) -> bool {
        let whole = self.whole();
        ["sec", "secs", "seconds"]
            .iter()
            .any(|end| whole.ends_with(end))
    }

    /// What goes on there.
    pub fn is_nanoseconds(&self) -> bool {
        let whole = self.whole();
        let ends = ["nanosec", "nsec", "nsecs", "nanosecs", "nanoseconds"];
        ends.iter().any(|end| whole.ends_with(end))
    }

    /// Whether it tells several instruments apart.
    pub fn is_instance(&self) -> bool {
        let whole = self.whole();
        [
            "i", "id", "instance", "imu", "imuid", "device", "deviceid", "sensorid",
        ]
        .contains(&whole.as_str())
    }

    /// Ticks in s, where a maker's name for a time says what they are.
    pub fn tick(&self) -> Option<f64> {
        // Xsens, MT Low-Level Communication Protocol: 10 kHz.
        (self.whole() == "sampletimefine").then_some(1e-4)
    }

    pub fn is_temperature(&self) -> bool {
        self.stem.contains("temp")
    }

    fn whole(&self) -> String {
        let mut whole = self.stem.clone();
        whole.extend(self.axis);
        whole
    }
}

fn is_axis(c: char) -> bool {
    matches!(c, 'x' | 'y' | 'z' | '0'..='3')
}

fn axis_at_end(word: &str) -> Option<(&str, char)> {
    let axis = word.chars().next_back().filter(|&c| is_axis(c))?;
    let stem = &word[..word.len() - axis.len_utf8()];
    (!stem.is_empty()).then_some((stem, axis))
}

fn axis_at_start(word: &str) -> Option<(&str, char)> {
    let axis = word
        .chars()
        .next()
        .filter(|&c| matches!(c, 'x' | 'y' | 'z'))?;
    let stem = &word[axis.len_utf8()..];
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
        ] {
            let name = Name::of(text);
            assert_eq!(
                (name.sensor(), name.axis, name.unit),
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
                Name::of("timestamp_us").unit
            ),
            (3, Some("us"))
        );
        assert_eq!(
            (
                Name::of("#timestamp [ns]").is_time(),
                Name::of("timestamp [ns]").unit
            ),
            (3, Some("ns"))
        );
        assert!(Name::of("PacketCounter").is_counter() && Name::of("Temp_C").is_temperature());
    }
}
