//! Fields detected in a log, and how certain they are.

use std::path::Path;

use super::motion::Motion;
use super::time::Certainty;
use super::{AXES_OF_PROGRAM, Draft, NO_COLUMNS};
use turncal::imu::Sensor;
use turncal::number::rounded;
use turncal_input::FileError;

/// A detected field.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Name, such as `gyros`.
    pub what: &'static str,
    /// Value.
    pub value: String,
    /// Certainty.
    pub certainty: Certainty,
    /// The reason.
    pub why: String,
}

impl Draft {
    /// All detected fields, in the order in which they are displayed.
    pub fn found(&self) -> Vec<Found> {
        let mut found = vec![self.time_found()];
        let sensors = Sensor::ALL
            .into_iter()
            .filter(|_| !self.is_of_magnetometer());
        found.extend(sensors.map(|sensor| self.triad_found(sensor)));
        found.extend(self.magnetometer_found());
        found.push(self.axes_found());
        found.extend((!self.is_of_magnetometer()).then(|| self.place_found()));
        found
    }

    /// Fails for a damaged log, and for a field that the log does not show but a run needs.
    pub(crate) fn check(&self, file: &Path) -> Result<(), FileError> {
        let damage = self.streams.as_ref().and_then(|of| of.damage.clone());
        let wrong =
            |[found, expected, advice]: [String; 3]| FileError::of(file, found, expected, advice);
        let unknown =
            |[what, why, advice]: [String; 3]| FileError::unknown(file, &what, &why, &advice);
        let contradiction = self.contradiction.clone().map(wrong);
        let error = damage.or(contradiction);
        let error = error.or_else(|| self.open_question().map(unknown));
        error.map_or(Ok(()), Err)
    }

    /// The first unknown field that prevents a run: what is unknown, why, and the remedy.
    fn open_question(&self) -> Option<[String; 3]> {
        let (_, remarks) = self.run_file("log");
        let (field, why) = remarks.open.into_iter().next()?;
        let is_zero = |motion: &Motion| motion.gravity == 0.0;
        let has_accels =
            self.columns.triads.accel.is_some() && !self.motion.as_ref().is_some_and(is_zero);
        let why = match &*field {
            "gyro_unit" if !has_accels => {
                "no columns recognised as accelerometers that measure gravity".to_owned()
            }
            _ => why,
        };
        let (what, advice) = match &*field {
            "gyro_unit" if !has_accels => (
                "the unit of the gyros",
                "Rename the columns of the accelerometers to ax, ay, az, or give both logs: `turncal init GYROS ACCELS \
                 -o run.toml`. For an Allan analysis of the gyros alone, add --gyro-unit.",
            ),
            "gyro_unit" => (
                "the unit of the gyros",
                "Add --gyro-unit (deg/s, rad/s, or '1/131 deg/s').",
            ),
            "accel_unit" => (
                "the unit of the accelerometers",
                "Add --accel-unit (g, m/s^2, or '1/16384 g').",
            ),
            "scale" => (
                "the size of one count",
                "Add the size from the data sheet, such as --gyro-unit '1/131 deg/s' or --accel-unit '1/16384 g'.",
            ),
            "sample_period_s" => ("the sample rate", "Add --rate."),
            other => (
                other,
                "Write a draft with `turncal init LOG -o run.toml` and complete it.",
            ),
        };
        Some([what.to_owned(), why, advice.to_owned()])
    }

    /// Units that are neither known nor whole counts: perhaps a rate or unit that only turns and gravity can check is
    /// wrong.
    pub(crate) fn doubts(&self) -> impl Iterator<Item = String> + '_ {
        let of_units = Sensor::ALL.into_iter().filter_map(|sensor| {
            let unit = self.quantities.units.get(sensor);
            let (name, why) = (sensor.name(), &unit.why);
            let found = match (&unit.scale, unit.word) {
                _ if !unit.is_unfit => return None,
                (Some(scale), _) => format!("estimated {}", scale.why),
                (None, word) => format!("used {}", word?),
            };
            Some(format!(
                "The unit of the {name} rows is uncertain: {why}. turncal {found}. Check --rate, and state \
                 --{name}-unit."
            ))
        });
        let left_out = self.left_out.map(|_| {
            "turncal left out the gyros because their unit cannot be determined without turns. To estimate the gyro \
             biases, add --gyro-unit."
                .to_owned()
        });
        let of_clock = self.clock.doubt.clone().into_iter();
        of_clock.chain(of_units).chain(left_out)
    }

    fn time_found(&self) -> Found {
        let clock = &self.clock;
        if self.of_means {
            return Found::new(
                "time",
                "none",
                Certainty::Guess,
                "each row is the mean of the output in one position",
            );
        }
        let name = self.columns.time.map(|k| self.columns.names[k].as_str());
        let hertz = |rate: f64| format!("{} Hz", rounded(rate, 4));
        let (value, certainty) = match (name, clock.period.map(f64::recip)) {
            (None, Some(rate)) if self.stated.rate_hz.is_some() && clock.doubt.is_none() => {
                return Found::new("time", hertz(rate), Certainty::Certain, "as stated");
            }
            (Some(name), Some(rate)) => (
                format!("{name}, {}, {}", clock.unit, hertz(rate)),
                clock.certainty,
            ),
            (None, Some(rate)) => (hertz(rate), clock.certainty),
            (_, None) if self.is_of_magnetometer() => {
                return Found::new(
                    "time",
                    "none",
                    Certainty::Certain,
                    "a magnetometer alone needs no times",
                );
            }
            (_, None) => {
                let why = format!("{}; set --rate", clock.why);
                return Found::new("time", "sample period", Certainty::Unknown, why);
            }
        };
        Found::new("time", value, certainty, &clock.why)
    }

    fn triad_found(&self, sensor: Sensor) -> Found {
        let what = sensor.pick("gyros", "accels");
        let unit = self.quantities.units.get(sensor);
        if let Some(triad) = self.left_out.filter(|_| sensor == Sensor::Gyro) {
            let names = triad.map(|k| self.columns.names[k].as_str()).join(" ");
            let why = "the sensor was not turned; to estimate the gyro biases, add --gyro-unit";
            return Found::new(what, format!("{names}, left out"), Certainty::Unknown, why);
        }
        let Some(triad) = self.columns.triads.get(sensor) else {
            return Found::new(what, "no columns", Certainty::Unknown, NO_COLUMNS);
        };
        let names = triad.map(|k| self.columns.names[k].as_str()).join(" ");
        let certainty = match unit.word {
            None => Certainty::Unknown,
            Some(_) if unit.is_shown && !unit.is_unfit && self.columns.doubt.is_none() => {
                Certainty::Certain
            }
            Some(_) => Certainty::Guess,
        };
        let mut value = format!("{names}, {}", unit.word.unwrap_or("unit unknown"));
        if let Some(scale) = &unit.scale {
            value += &format!(" ({})", scale.why);
        }
        let doubt = self.columns.doubt.as_ref();
        let doubt = doubt.map_or(String::new(), |doubt| {
            format!("; {}", self.doubt_words(doubt))
        });
        let mut why = unit.why.clone() + &doubt;
        if let Some(down) = self.down.filter(|_| sensor == Sensor::Accel) {
            why += &format!("; at the start {}", self.down_words(down));
        }
        Found::new(what, value, certainty, why)
    }

    fn magnetometer_found(&self) -> Option<Found> {
        let of_streams = self
            .streams
            .as_ref()
            .and_then(|of| of.magnetometer.as_ref());
        let (names, of) = match (of_streams, &self.columns.magnetometer) {
            (Some(stream), _) => (stream.names.clone(), &stream.found),
            (None, of) => {
                let of = of.as_ref()?;
                (of.columns.map(|k| self.columns.names[k].clone()), of)
            }
        };
        let certainty = if of.is_stated {
            Certainty::Certain
        } else {
            Certainty::Guess
        };
        let value = format!("{}, {}", names.join(" "), of.unit);
        Some(Found::new("mag", value, certainty, of.why()))
    }

    fn axes_found(&self) -> Found {
        let of_streams = self.streams.as_ref().and_then(|streams| streams.axes);
        let (value, certainty, why) = match of_streams {
            Some(axes) => (axes, Certainty::Certain, AXES_OF_PROGRAM),
            None => ("x right, y front, z up", Certainty::Guess, "check this"),
        };
        Found::new("axes", value, certainty, why)
    }

    fn place_found(&self) -> Found {
        let stated = &self.stated;
        let latitude = stated.latitude_deg.map(|of| format!("latitude {of}°"));
        let height = stated.height_m.map(|of| format!("height {of} m"));
        let gravity = stated.gravity_m_s2.map(|of| format!("gravity {of} m/s²"));
        let place: Vec<String> = [latitude, height, gravity].into_iter().flatten().collect();
        if !place.is_empty() {
            return Found::new("place", place.join(", "), Certainty::Certain, "as stated");
        }
        let gravity = "gravity 9.806 ± 0.015 m/s²";
        let why = "to reduce the σ, set --latitude and --height";
        Found::new("place", gravity, Certainty::Unknown, why)
    }
}

impl Found {
    fn new(
        what: &'static str,
        value: impl Into<String>,
        certainty: Certainty,
        why: impl AsRef<str>,
    ) -> Self {
        Self {
            what,
            value: value.into(),
            certainty,
            why: why.as_ref().to_owned(),
        }
    }
}
