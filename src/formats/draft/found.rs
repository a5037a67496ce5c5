//! What a log shows, and how sure that is.

use super::Draft;
use super::units::short;
use crate::imu::Sensor;

/// How sure something is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Certainty {
    /// The log states it and the motion agrees, or the motion alone shows it, or the user states it.
    Certain,
    /// The log states it, or it is usual; the motion does not show it.
    Guess,
    /// Neither.
    Unknown,
}

impl Certainty {
    /// Its word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Certain => "certain",
            Self::Guess => "guess",
            Self::Unknown => "unknown",
        }
    }
}

/// One thing that was found in a log.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Of what, such as `gyros`.
    pub what: &'static str,
    /// What was found.
    pub value: String,
    /// How sure it is.
    pub certainty: Certainty,
    /// Why.
    pub why: String,
}

/// Something that must be known, is not shown by the log and has no usual value.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenQuestion {
    /// What the log has.
    pub found: String,
    /// What is needed.
    pub expected: String,
    /// What to do.
    pub advice: String,
}

impl Draft {
    /// What was found, in the order in which it is shown.
    pub fn found(&self) -> Vec<Found> {
        let mut found = vec![self.time_found()];
        found.extend(Sensor::ALL.map(|sensor| self.triad_found(sensor)));
        found.push(self.axes_found());
        found.push(self.place_found());
        found
    }

    /// What stands between the draft and a run.
    pub fn open_questions(&self) -> Vec<OpenQuestion> {
        let text = self.to_toml("log");
        let open = text.lines().filter_map(|line| {
            let (field, why) = line.strip_prefix("# ")?.split_once("TODO: ")?;
            let field = field
                .split('=')
                .next()
                .unwrap_or_default()
                .trim()
                .trim_end_matches("  #");
            let (expected, advice) = match field {
                "gyro_unit" => ("the unit of the gyros", "State it with --gyro-unit."),
                "accel_unit" => (
                    "the unit of the accelerometers",
                    "State it with --accel-unit.",
                ),
                "sample_period_s" => ("the rate of the rows", "State it with --rate."),
                _ => (
                    "what run.toml needs",
                    "Write a draft by `turncal init LOG -o run.toml` and complete it.",
                ),
            };
            Some(OpenQuestion {
                found: format!("nothing that shows `{field}` ({why})"),
                expected: expected.to_owned(),
                advice: advice.to_owned(),
            })
        });
        open.collect()
    }

    fn time_found(&self) -> Found {
        let clock = &self.clock;
        let name = self.columns.time.map(|k| self.columns.names[k].as_str());
        let rate = clock
            .period
            .map(|period| format!("{} Hz", short(period.recip())));
        let (value, certainty, why) = match (name, rate) {
            _ if self.stated.rate_hz.is_some() => {
                let rate = short(self.stated.rate_hz.unwrap_or_default());
                (
                    format!("{rate} Hz"),
                    Certainty::Certain,
                    "as stated".to_owned(),
                )
            }
            (Some(name), Some(rate)) => {
                let certainty = match clock.why.starts_with("as the file") {
                    true => Certainty::Certain,
                    false => Certainty::Guess,
                };
                (
                    format!("{name}, {}, {rate}", clock.unit),
                    certainty,
                    clock.why.clone(),
                )
            }
            (None, Some(rate)) => (rate, Certainty::Guess, clock.why.clone()),
            (_, None) => (
                "period of the rows".to_owned(),
                Certainty::Unknown,
                clock.why.clone(),
            ),
        };
        Found {
            what: "time",
            value,
            certainty,
            why,
        }
    }

    fn triad_found(&self, sensor: Sensor) -> Found {
        let unit = self.quantities.units.get(sensor);
        let what = match sensor {
            Sensor::Gyro => "gyros",
            Sensor::Accel => "accels",
        };
        let Some(triad) = self.columns.triads.get(sensor) else {
            return Found {
                what,
                value: "no columns".to_owned(),
                certainty: Certainty::Unknown,
                why: "no names or numbers showed them".to_owned(),
            };
        };
        let names = triad.map(|k| self.columns.names[k].as_str()).join(" ");
        let certainty = match unit.word {
            None => Certainty::Unknown,
            Some(_) if unit.is_shown => Certainty::Certain,
            Some(_) => Certainty::Guess,
        };
        let mut value = format!("{names}, {}", unit.word.unwrap_or("unit unknown"));
        if let Some(scale) = &unit.scale {
            value += &format!(" ({})", scale.why);
        }
        Found {
            what,
            value,
            certainty,
            why: match self.down.filter(|_| sensor == Sensor::Accel) {
                Some(down) => format!("{}; at the beginning {}", unit.why, self.down_words(down)),
                None => unit.why.clone(),
            },
        }
    }

    fn axes_found(&self) -> Found {
        let of_streams = self.streams.as_ref().and_then(|streams| streams.axes);
        let (value, certainty, why) = match of_streams {
            Some(axes) => (
                axes,
                Certainty::Certain,
                "as the program that wrote the log has them",
            ),
            None => ("x right, y front, z up", Certainty::Guess, "please check"),
        };
        Found {
            what: "axes",
            value: value.to_owned(),
            certainty,
            why: why.to_owned(),
        }
    }

    fn place_found(&self) -> Found {
        let stated = &self.stated;
        let place = [
            stated
                .latitude_deg
                .map(|degrees| format!("latitude {degrees}°")),
            stated.height_m.map(|height| format!("height {height} m")),
            stated
                .gravity_m_s2
                .map(|gravity| format!("gravity {gravity} m/s²")),
        ];
        let place: Vec<String> = place.into_iter().flatten().collect();
        let (value, certainty, why) = match place.is_empty() {
            false => (place.join(", "), Certainty::Certain, "as stated"),
            true => (
                "gravity 9.806 ± 0.015 m/s²".to_owned(),
                Certainty::Unknown,
                "state --latitude and --height for smaller σ",
            ),
        };
        Found {
            what: "place",
            value,
            certainty,
            why: why.to_owned(),
        }
    }
}
