//! The draft as TOML.

use std::fmt::Write;

use super::Draft;
use super::name::axes_of_program;
use super::units::short;
use crate::imu::{NoiseKeys, Output, Sensor};

impl Draft {
    /// The draft as a `run.toml` in which the log is named so. Lines with `TODO` must be completed before it
    /// can be read; the others are guesses, each with its reason.
    pub fn to_toml(&self, file: &str) -> String {
        let of_it = match self.only {
            Some(rows) => format!("the first {rows} rows of the log"),
            None => "the log alone".to_owned(),
        };
        let mut text = format!(
            "# Made from {of_it}. Check what is guessed and complete what is open; `turncal check` then says what the run \
             holds.\nformat = \"turncal-run/1\"\n"
        );
        self.stated.site(&mut text);
        // Writing to a string cannot fail.
        let _ = write!(text, "\n[imu]\nfile = {}\n", quoted(file));
        if let Some(streams) = &self.streams {
            streams.write(&mut text);
        }
        self.rows(&mut text);
        self.noise_table(&mut text);
        for sensor in self.present() {
            self.prior(&mut text, sensor);
        }
        self.table(&mut text);
        text
    }

    fn rows(&self, text: &mut String) {
        self.output_and_units(text);
        self.time_unit(text);
        self.sample_period(text);
        line(
            text,
            "time_stamp",
            "\"end\"",
            "guessed: a row covers the time up to its stamp; else \"start\" or \"middle\"",
        );
        if self.cuts > 0 {
            let why = format!(
                "gravity changes its direction at once in {}: sections laid end to end; if not, true",
                places(self.cuts)
            );
            line(text, "continuous", "false", &why);
        } else {
            line(text, "continuous", "true", &self.gaps());
        }
        self.body_axes(text);
        if let Some((column, number)) = self.instance {
            let of = format!(
                "{{ column = {}, number = {number} }}",
                quoted(&self.columns.names[column])
            );
            line(
                text,
                "instance",
                &of,
                "rows of several instruments: those of the first",
            );
        }
        self.columns(text);
    }

    fn output_and_units(&self, text: &mut String) {
        let found = &self.quantities;
        let output = match found.output {
            Output::Pulse => "pulse",
            Output::Increment => "increment",
            Output::Rate => "rate",
        };
        line(text, "output", &quoted(output), &found.output_why);
        for sensor in self.present() {
            let (key, unit) = (format!("{}_unit", sensor.name()), found.units.get(sensor));
            match unit.word {
                Some(word) => line(text, &key, &quoted(word), &unit.why),
                None => todo(
                    text,
                    &key,
                    &format!("{}; the data sheet or the logger says", unit.why),
                ),
            }
        }
        if found.opposed {
            text.push_str(
                "# Gravity turns against the gyros: one triad has the opposite sign. Reverse its columns or give it a \
                 negative scale.\n",
            );
        }
    }

    fn time_unit(&self, text: &mut String) {
        let clock = &self.clock;
        let unit = self
            .streams
            .as_ref()
            .filter(|streams| streams.accel.is_some());
        let unit = unit
            .map(|streams| &streams.time.gyro.1)
            .filter(|unit| !unit.is_empty());
        if let Some(unit) = unit {
            line(text, "time_unit", &word_or_number(unit), "as the file says");
        } else if clock.unit != "s" {
            line(text, "time_unit", &word_or_number(&clock.unit), &clock.why);
        }
    }

    fn sample_period(&self, text: &mut String) {
        let clock = &self.clock;
        match clock.period {
            Some(period) if clock.is_stated => {
                let rate = short(period.recip());
                let why = format!("{rate} Hz, as the file says");
                line(text, "sample_period_s", &seven(period).to_string(), &why);
            }
            Some(period) => {
                let rate = short(period.recip());
                let _ = writeln!(
                    text,
                    "# sample_period_s = {}  # {rate} Hz, found from the times when this is left out",
                    seven(period)
                );
            }
            None if self.rows_show_period() => {}
            None => todo(
                text,
                "sample_period_s",
                "s from row to row, which a counter does not tell",
            ),
        }
    }

    /// Whether rows without a time show how long they last: rates, whose sums are angles.
    fn rows_show_period(&self) -> bool {
        let gyro = &self.quantities.units.gyro;
        self.columns.time.is_none()
            && self.quantities.output == Output::Rate
            && gyro.word.is_some_and(|word| word != "count")
    }

    fn body_axes(&self, text: &mut String) {
        let of_streams = self.streams.as_ref().and_then(|streams| streams.axes);
        match of_streams {
            Some(axes) => line(
                text,
                "body_axes",
                &quoted(axes),
                "as the program that wrote the log has them",
            ),
            None => {
                let mut why = "guessed: x right, y front, z up; else \"frd\" or \"flu\"".to_owned();
                if let Some(axes) = axes_of_program(&self.columns.names) {
                    why += &format!(
                        "; columns are called so by PX4 or ArduPilot, whose axes are \"{axes}\""
                    );
                }
                line(text, "body_axes", "\"rfu\"", &why);
            }
        }
    }

    fn gaps(&self) -> String {
        match (self.clock.gaps.len(), self.clock.repeated) {
            (0, 0) => "no gap in time".to_owned(),
            (0, repeated) => format!(
                "no gap in time, but it stays or goes back in {}",
                places(repeated)
            ),
            (gaps, _) => format!("but rows are missing in {}", places(gaps)),
        }
    }

    fn columns(&self, text: &mut String) {
        if let Some(streams) = self
            .streams
            .as_ref()
            .filter(|streams| streams.accel.is_some())
        {
            streams.write_columns(text);
            return;
        }
        self.doubts_of_triads(text);
        let columns = &self.columns;
        let mut fields: Vec<String> = self.time_column(text).into_iter().collect();
        let mut missing = Vec::new();
        for sensor in Sensor::ALL {
            match columns.triads.get(sensor) {
                Some(triad) => fields.push(format!("{} = {}", sensor.name(), self.named(triad))),
                None => missing.push(sensor.name()),
            }
        }
        if let Some(temperature) = columns.temperature {
            fields.push(format!(
                "temperature = {}",
                quoted(&columns.names[temperature])
            ));
        }
        let names: Vec<String> = columns.names.iter().map(|name| quoted(name)).collect();
        for sensor in missing {
            let why = "no names or numbers showed them";
            let names = names.join(", ");
            let _ = match columns.triads.gyro.or(columns.triads.accel) {
                None => writeln!(text, "# TODO: {sensor} = three of {names}; {why}"),
                Some(_) => writeln!(
                    text,
                    "# {sensor} = three of {names}; {why}, and without them `turncal allan` alone takes the log"
                ),
            };
        }
        let fields = fields.join(", ");
        if let Some(axes) = self.turned_axes() {
            text.push_str(&axes);
        }
        if self.blocked.is_empty() {
            let _ = writeln!(text, "columns = {{ {fields} }}");
        } else {
            let why = self.blocked.join("; ");
            let _ = writeln!(text, "# columns = {{ {fields} }}  # TODO: {why}");
        }
    }

    /// The names of a triad's columns, as a list.
    fn named(&self, triad: &[usize; 3]) -> String {
        let names = triad.map(|k| quoted(&self.columns.names[k]));
        format!("[{}]", names.join(", "))
    }

    /// Which other columns could be a triad, and whether only numbers told the triads.
    fn doubts_of_triads(&self, text: &mut String) {
        let columns = &self.columns;
        for sensor in Sensor::ALL {
            for other in columns.others.get(sensor) {
                let _ = writeln!(
                    text,
                    "# {} could be {}, too",
                    sensor.name(),
                    self.named(other)
                );
            }
        }
        if columns.by_size && columns.triads.gyro.is_some() {
            text.push_str("# The triads were told by their numbers: gravity keeps the magnitude of the accelerometers'.\n");
        }
        if let Some((down, accel)) = self.down.zip(columns.triads.accel) {
            let reversed = accel.map(|k| quoted(&format!("-{}", columns.names[k])));
            let _ = writeln!(
                text,
                "# At the beginning {}. If the sensor lay that side up, write accel = [{}].",
                self.down_words(down),
                reversed.join(", ")
            );
        }
    }

    /// The field of the columns of time; where there is none, a remark instead.
    fn time_column(&self, text: &mut String) -> Option<String> {
        let columns = &self.columns;
        let name = |k: usize| quoted(&columns.names[k]);
        match (columns.time, columns.nanoseconds) {
            (Some(time), Some(further)) => {
                Some(format!("time = [{}, {}]", name(time), name(further)))
            }
            (Some(time), None) => Some(format!("time = {}", name(time))),
            (None, _) if self.clock.is_stated => {
                let _ = writeln!(text, "# {}: rows follow one another.", self.clock.why);
                None
            }
            (None, _) if self.rows_show_period() => {
                let why = &self.clock.why;
                let _ = writeln!(
                    text,
                    "# {why}: the period of the rows is found from the turns, unless sample_period_s states it."
                );
                None
            }
            (None, _) => {
                let why = &self.clock.why;
                let _ = writeln!(
                    text,
                    "# TODO: {why}: name one that is, or give sample_period_s."
                );
                None
            }
        }
    }

    /// That an axis points down, or the accelerometers have the sign of gravity.
    pub(super) fn down_words(&self, down: usize) -> String {
        format!(
            "{} is negative: it points down, or the accelerometers give gravity instead of specific force, as iOS does",
            self.columns.names[down]
        )
    }

    /// Where gyros do not turn as the accelerometers' columns lie.
    fn turned_axes(&self) -> Option<String> {
        let axes = self.registers.as_ref()?.axes.as_ref();
        let axes = axes.filter(|axes| !axes.agree() && self.quantities.is_count(Sensor::Gyro))?;
        let triad = self.columns.triads.gyro?;
        let name = |k: usize| {
            let sign = if axes.scale[k] < 0.0 { "−" } else { "" };
            format!("{sign}{}", self.columns.names[triad[k]])
        };
        Some(format!(
            "# By gravity's directions over {} moves the gyros that turn about the accelerometers' axes are {}, {} and \
             {}:\n# hence the order of their columns and the signs of their scale.\n",
            axes.moves,
            name(0),
            name(1),
            name(2)
        ))
    }

    fn noise_table(&self, text: &mut String) {
        text.push_str(
            "\n# white noise at rest; better from hours at rest, by turncal allan\n[imu.noise]\n",
        );
        for sensor in self.present() {
            let (key, unit) = NoiseKeys::of(sensor).random_walk;
            let _ = match self.white_noise(sensor) {
                Some(walk) => writeln!(text, "{key} = {:?}", short(walk / unit)),
                None => writeln!(
                    text,
                    "# {key} =  # the data sheet's figure; without it, that of the quieter part of the record"
                ),
            };
        }
    }

    /// White noise of a triad at rest, (rad/s)√s or (m/s²)√s.
    pub(super) fn white_noise(&self, sensor: Sensor) -> Option<f64> {
        let scale = self.quantities.scale(sensor)?;
        Some((*self.random_walk.get(sensor))? / scale.abs())
    }

    fn table(&self, text: &mut String) {
        if let Some(four) = self.columns.quaternion {
            let names = four.map(|k| quoted(&self.columns.names[k]));
            let _ = writeln!(
                text,
                "\n# {} are a quaternion. If it is a turntable's, body right-front-up to East-North-Up in the order w, \
                 x, y, z, give it as [turntable] from the same file; what the instrument itself makes of its attitude \
                 is none.",
                names.join(", ")
            );
        } else {
            text.push_str(
                "\n# With a turntable's log: [turntable] with file, columns, position_sigma_arcsec and \
                 reading_sigma_arcsec.\n",
            );
        }
    }
}

pub(super) fn line(text: &mut String, key: &str, value: &str, why: &str) {
    let _ = writeln!(text, "{key} = {value}  # {why}");
}

pub(super) fn todo(text: &mut String, key: &str, why: &str) {
    let _ = writeln!(text, "# {key} =  # TODO: {why}");
}

fn places(count: usize) -> String {
    if count == 1 {
        "one place".to_owned()
    } else {
        format!("{count} places")
    }
}

/// A number to seven digits.
pub(super) fn seven(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap_or(value)
}

/// A word in quotes, or a number as it is.
pub(super) fn word_or_number(text: &str) -> String {
    match text.parse::<f64>() {
        Ok(_) => text.to_owned(),
        Err(_) => quoted(text),
    }
}

pub(super) fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}
