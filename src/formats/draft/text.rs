//! The draft as TOML: lines with reasons, and open fields.

use super::name::axes_of_program;
use super::units::short;
use super::{AXES_OF_PROGRAM, Draft, NO_COLUMNS};
use crate::formats::quantity::output_word;
use crate::formats::schema::FORMAT;
use crate::formats::schema::page::Page;
use crate::imu::{Noise, NoiseKeys, Output, Sensor};

impl Draft {
    /// The draft as a `run.toml` with this name for the log. Lines with `TODO` must be completed before it can be read;
    /// the others are guesses, each with its reason.
    pub fn to_toml(&self, file: &str) -> String {
        self.page(file).text
    }

    pub(super) fn page(&self, file: &str) -> Page {
        let of_it = match self.only {
            Some(rows) => format!("the first {rows} rows of the log"),
            None => "the log alone".to_owned(),
        };
        let remark = format!(
            "Draft made from {of_it}. Check the guesses and complete the open fields, then run `turncal check`."
        );
        let mut page = Page::of(FORMAT, &remark);
        self.site(&mut page);
        page.table("imu", "");
        page.field("file", file);
        if let Some(streams) = &self.streams {
            streams.write(&mut page);
        }
        self.output_and_units(&mut page);
        self.clock(&mut page);
        self.body_axes(&mut page);
        if let Some((column, number)) = self.instance {
            let of = format!("{{ column = {}, number = {number} }}", self.name(column));
            let why = "the log contains several instruments; this selects the first";
            page.line("instance", of, why);
        }
        self.columns(&mut page);
        self.noise_table(&mut page);
        for sensor in self.present() {
            self.prior(&mut page, sensor);
        }
        self.table(&mut page);
        page
    }

    fn site(&self, page: &mut Page) {
        page.table(
            "site",
            "location of the instrument; missing fields get a wide σ",
        );
        let stated = &self.stated;
        for (key, value, why) in [
            (
                "latitude_deg",
                stated.latitude_deg,
                "north positive; 0.1° is accurate enough",
            ),
            ("height_m", stated.height_m, "above the ellipsoid"),
            (
                "gravity_m_s2",
                stated.gravity_m_s2,
                "if measured; otherwise normal gravity is used",
            ),
        ] {
            match value {
                Some(value) => page.line(key, format_args!("{value:?}"), "as stated"),
                None => page.optional(key, why),
            }
        }
    }

    fn output_and_units(&self, page: &mut Page) {
        let found = &self.quantities;
        let output = quoted(output_word(found.output));
        page.line("output", output, &found.output_why);
        for sensor in self.present() {
            let (key, unit) = (format!("{}_unit", sensor.name()), found.units.get(sensor));
            match unit.word {
                Some(word) => page.line(&key, quoted(word), &unit.why),
                None => {
                    let why = format!("{}; see the data sheet or the logger", unit.why);
                    page.open(&format!("{key} ="), why);
                }
            }
        }
        if found.opposed {
            page.remark(
                "Gravity rotates opposite to the gyro output, so one triad has the wrong sign. Negate its columns or \
                 give it a negative scale.",
            );
        }
    }

    fn clock(&self, page: &mut Page) {
        let clock = &self.clock;
        if clock.unit != "s" {
            page.line("time_unit", word_or_number(&clock.unit), &clock.why);
        }
        let rate = clock.period.map_or(0.0, |period| short(period.recip()));
        match clock.period.map(seven) {
            Some(period) if clock.is_stated => {
                page.line(
                    "sample_period_s",
                    period,
                    format_args!("{rate} Hz, stated in the file"),
                );
            }
            Some(period) => page.remark(format_args!(
                "sample_period_s = {period}  # {rate} Hz; estimated from the time column if omitted"
            )),
            None if self.rows_show_period() => {}
            None => {
                let why = "seconds between rows, which a counter does not give";
                page.open("sample_period_s =", why);
            }
        }
        let why = "guess: a row covers the interval that ends at its time stamp; otherwise \"start\" or \"middle\"";
        page.line("time_stamp", quoted("end"), why);
        let cuts = self.motion.as_ref().map_or(0, |motion| motion.cuts.len());
        let why = match (cuts, clock.gaps.len(), clock.repeated) {
            (0, 0, 0) => "no gaps".to_owned(),
            (0, 0, repeated) => {
                format!(
                    "no gaps, but time repeats or steps back in {}",
                    places(repeated)
                )
            }
            (0, gaps, _) => format!("rows are missing in {}", places(gaps)),
            (cuts, ..) => format!(
                "gravity direction jumps in {}, as in concatenated sections; otherwise set true",
                places(cuts)
            ),
        };
        page.line("continuous", cuts == 0, why);
    }

    /// Whether rows without a time show how long they last: rates, whose sums are angles.
    fn rows_show_period(&self) -> bool {
        let gyro = &self.quantities.units.gyro;
        self.columns.time.is_none()
            && self.quantities.output == Output::Rate
            && gyro.word.is_some_and(|word| word != "count")
    }

    fn body_axes(&self, page: &mut Page) {
        if let Some(axes) = self.streams.as_ref().and_then(|streams| streams.axes) {
            page.line("body_axes", quoted(axes), AXES_OF_PROGRAM);
            return;
        }
        let mut why = "guess: x right, y front, z up; otherwise \"frd\" or \"flu\"".to_owned();
        if let Some(axes) = axes_of_program(&self.columns.names) {
            why +=
                &format!("; the column names are those of PX4 or ArduPilot, which use \"{axes}\"");
        }
        page.line("body_axes", quoted("rfu"), why);
    }

    /// The name of a column in quotes.
    fn name(&self, column: usize) -> String {
        quoted(&self.columns.names[column])
    }

    /// The names of some columns.
    fn names(&self, columns: &[usize]) -> String {
        let names: Vec<String> = columns.iter().map(|&k| self.name(k)).collect();
        names.join(", ")
    }

    fn columns(&self, page: &mut Page) {
        self.doubts_of_triads(page);
        let columns = &self.columns;
        let mut fields: Vec<String> = match (columns.time, columns.nanoseconds) {
            (Some(time), Some(further)) => {
                vec![format!("time = [{}]", self.names(&[time, further]))]
            }
            (Some(time), None) => vec![format!("time = {}", self.name(time))],
            (None, _) => {
                self.without_time(page);
                Vec::new()
            }
        };
        let known = columns.triads.gyro.or(columns.triads.accel);
        for sensor in Sensor::ALL {
            let name = sensor.name();
            if let Some(triad) = columns.triads.get(sensor) {
                fields.push(format!("{name} = [{}]", self.names(triad)));
                continue;
            }
            let all: Vec<usize> = (0..columns.names.len()).collect();
            let why = format!("three of {}; {NO_COLUMNS}", self.names(&all));
            match known {
                None => page.open("", format_args!("{name} = {why}")),
                Some(_) => page.remark(format_args!(
                    "{name} = {why}; without them only `turncal allan` can use the log"
                )),
            }
        }
        let temperature = columns.temperature;
        fields.extend(temperature.map(|k| format!("temperature = {}", self.name(k))));
        self.turned_axes(page);
        let fields = format!("{{ {} }}", fields.join(", "));
        match self.blocked.is_empty() {
            true => page.plain("columns", fields),
            false => page.open(&format!("columns = {fields}"), self.blocked.join("; ")),
        }
    }

    /// Remarks on alternative triad columns and on identification by value.
    fn doubts_of_triads(&self, page: &mut Page) {
        let columns = &self.columns;
        for sensor in Sensor::ALL {
            for other in columns.others.get(sensor) {
                let names = self.names(other);
                page.remark(format_args!("{} could also be [{names}]", sensor.name()));
            }
        }
        if columns.by_size && columns.triads.gyro.is_some() {
            page.remark(
                "The triads were identified by their values: gravity keeps the magnitude of the accelerometers constant.",
            );
        }
        if let Some((down, accel)) = self.down.zip(columns.triads.accel) {
            let reversed = accel.map(|k| quoted(&format!("-{}", columns.names[k])));
            page.remark(format_args!(
                "At the start {}. If that axis pointed up, write accel = [{}].",
                self.down_words(down),
                reversed.join(", ")
            ));
        }
    }

    /// Substitute for a time column.
    fn without_time(&self, page: &mut Page) {
        let why = &self.clock.why;
        if self.clock.is_stated {
            page.remark(format_args!("{why}; rows are taken as consecutive."));
        } else if self.rows_show_period() {
            page.remark(format_args!(
                "{why}; the sample period is estimated from the turns unless sample_period_s is set."
            ));
        } else {
            page.open(
                "",
                format_args!("{why}; name a time column or set sample_period_s."),
            );
        }
    }

    /// Remark that an axis points down or that the accelerometers output gravity.
    pub(super) fn down_words(&self, down: usize) -> String {
        format!(
            "{} is negative: the axis points down, or the accelerometers output gravity instead of specific force, \
             as iOS does",
            self.columns.names[down]
        )
    }

    /// Remark on gyro columns that do not match the accelerometer axes.
    fn turned_axes(&self, page: &mut Page) {
        let turns = self
            .registers
            .as_ref()
            .and_then(|found| found.turns.as_ref());
        let turns = turns.filter(|of| !of.agree() && self.quantities.is_count(Sensor::Gyro));
        let Some((turns, triad)) = turns.zip(self.columns.triads.gyro) else {
            return;
        };
        let [x, y, z] = [0, 1, 2].map(|k| {
            let sign = if turns.axes.scale[k] < 0.0 { "−" } else { "" };
            format!("{sign}{}", self.columns.names[triad[k]])
        });
        page.remark(format_args!(
            "From the gravity directions in {} moves, the gyros about the accelerometer axes x, y and z are {x}, {y} \
             and {z}.",
            turns.moves
        ));
        page.remark("The gyro column order and scale signs follow from this.");
    }

    fn noise_table(&self, page: &mut Page) {
        page.table(
            "imu.noise",
            "white noise; turncal estimates it from the recording unless it is stated",
        );
        for sensor in self.present() {
            if let Some(noise) = &self.stated.noise {
                stated_noise(page, sensor, noise.get(sensor));
                continue;
            }
            let (key, unit) = NoiseKeys::of(sensor).random_walk;
            match self.white_noise(sensor) {
                Some(walk) => page.remark(format_args!(
                    "{key} = {:?}  # measured at rest in this log; prefer a data sheet or turncal allan",
                    short(walk / unit)
                )),
                None => page.optional(key, "value from the data sheet"),
            }
        }
    }

    /// White noise of a triad, stated or at rest, (rad/s)√s or (m/s²)√s.
    pub(super) fn white_noise(&self, sensor: Sensor) -> Option<f64> {
        if let Some(noise) = &self.stated.noise {
            return Some(noise.get(sensor).random_walk);
        }
        let scale = self.quantities.scale(sensor)?;
        Some((*self.random_walk.get(sensor))? / scale.abs())
    }

    fn table(&self, page: &mut Page) {
        page.text.push('\n');
        match &self.columns.quaternion {
            Some(four) => page.remark(format_args!(
                "{} form a quaternion. If it comes from a turntable (body right-front-up to East-North-Up, order w, \
                 x, y, z), add a [turntable] that reads this file. Do not use an attitude computed by the instrument \
                 itself.",
                self.names(four)
            )),
            None => page.remark(
                "If you have a turntable log, add [turntable] with file, columns, position_sigma_arcsec and \
                 reading_sigma_arcsec.",
            ),
        }
    }
}

fn stated_noise(page: &mut Page, sensor: Sensor, noise: &Noise) {
    let keys = NoiseKeys::of(sensor);
    let mut line = |key, value, why| page.line(key, format_args!("{:?}", seven(value)), why);
    let (key, unit) = keys.random_walk;
    line(key, noise.random_walk / unit, "as stated");
    if let Some(bias) = noise.gauss_markov {
        let (key, unit) = keys.gauss_markov;
        line(key, bias.sigma / unit, "as stated");
        let why = "chosen here, because a random walk has no correlation time";
        line(keys.correlation_time, bias.correlation_time, why);
    }
}

fn places(count: usize) -> String {
    match count {
        1 => "one place".to_owned(),
        count => format!("{count} places"),
    }
}

/// A number to seven digits.
pub fn seven(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap_or(value)
}

/// A word in quotes, or a number unchanged.
pub fn word_or_number(text: &str) -> String {
    match text.parse::<f64>() {
        Ok(_) => text.to_owned(),
        Err(_) => quoted(text),
    }
}

pub fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}
