//! The draft as the fields of `run.toml`, with reasons and with the fields that the user must complete.

use std::collections::BTreeMap;

use super::name::is_of_autopilot;
use super::triads::Doubt;
use super::{AXES_OF_PROGRAM, Draft, NO_COLUMNS};
use crate::schema::page;
use crate::schema::page::Remarks;
use crate::schema::{
    BodyAxes, FORMAT, ImuColumns, ImuFile, InstanceFile, Names, PriorsFile, RunFile, SiteFile,
    TemperatureColumn, TimeColumn, TimeStamp, TimeUnitField,
};
use turncal::imu::{Noise, NoiseKeys, Output, Sensor};
use turncal::number::rounded;
use turncal::units::PPM;
use turncal_input::{Finite, Gravity, Height, Latitude, NonNegative, Positive};

/// `[imu.noise]` of `run.toml`.
type NoiseFields = BTreeMap<String, Option<NonNegative>>;

impl Draft {
    /// The draft as the text of a `run.toml` in which the log has this name. Lines with `TODO` must be completed before
    /// the file can be read; the other lines are guesses, each with its reason.
    pub fn to_toml(&self, file: &str) -> String {
        let (run, remarks) = self.run_file(file);
        page::text(FORMAT, &run, &remarks)
    }

    /// The fields of the draft, with their reasons.
    pub fn run_file(&self, file: &str) -> (RunFile, Remarks) {
        let mut remarks = Remarks::default();
        let of_it = match self.only {
            Some(rows) => format!("the first {rows} rows of the log"),
            None => "the log alone".to_owned(),
        };
        let remark = format_args!(
            "Draft made from {of_it}. Check the guesses and complete the fields marked TODO; then run `turncal check`."
        );
        remarks.before("format", remark);
        let run = RunFile {
            site: self.site(&mut remarks),
            imu: self.imu(file, &mut remarks),
            ..RunFile::default()
        };
        let of_table = match &self.columns.quaternion {
            Some(four) => format!(
                "{} form a quaternion. If it comes from a turntable (body right-front-up to East-North-Up, order w, x, \
                 y, z), add a [turntable] that reads this file. Do not use this attitude if the instrument itself \
                 computed it.",
                self.list(four)
            ),
            None => "If you have a turntable log, add [turntable] with file, columns, position_sigma_arcsec and \
                     reading_sigma_arcsec."
                .to_owned(),
        };
        remarks.before("turntable", of_table);
        (run, remarks)
    }

    fn site(&self, remarks: &mut Remarks) -> SiteFile {
        let remark = "location of the instrument; if a field is missing, turncal uses a wide σ";
        remarks.before("site", remark);
        let mut field = |key: &str, value: Option<f64>, why: &str| {
            let path = format!("site.{key}");
            match value {
                Some(_) => remarks.reason(&path, "as stated"),
                None => remarks.suggestion(&path, why),
            }
            value
        };
        let (of, latitude) = (&self.stated, "north positive; 0.1° is accurate enough");
        let gravity = "measured gravity; if this field is omitted, turncal uses normal gravity";
        SiteFile {
            latitude_deg: field("latitude_deg", of.latitude_deg, latitude).map(Latitude),
            height_m: field("height_m", of.height_m, "above the ellipsoid").map(Height),
            gravity_m_s2: field("gravity_m_s2", of.gravity_m_s2, gravity).map(Gravity),
            ..SiteFile::default()
        }
    }

    fn imu(&self, file: &str, remarks: &mut Remarks) -> ImuFile {
        let (found, clock) = (&self.quantities, &self.clock);
        let magnetometer = self.columns.magnetometer.as_ref();
        let mut imu = ImuFile {
            file: file.to_owned(),
            output: found.output,
            // The rate is requested first, because it may determine the units.
            sample_period_s: self.period(remarks),
            gyro_unit: self.unit(Sensor::Gyro, remarks),
            accel_unit: self.unit(Sensor::Accel, remarks),
            sample_period_sigma_ppm: (clock.sigma > 0.0)
                .then(|| NonNegative(rounded(clock.sigma / PPM, 3))),
            time_unit: (clock.unit != "s").then(|| TimeUnitField::of_text(&clock.unit)),
            time_stamp: TimeStamp::End,
            continuous: Some(self.cuts() == 0 && !self.of_means),
            body_axes: Some(self.body_axes(remarks)),
            instance: self.instance.map(|(column, number)| InstanceFile {
                column: self.name(column),
                number: Finite(number),
            }),
            columns: self.columns(remarks),
            mag_unit: magnetometer.map(|of| of.unit.to_owned()),
            noise: self.noise_fields(remarks),
            prior: self.priors(remarks),
            ..ImuFile::default()
        };
        if let Some(of) = magnetometer {
            remarks.reason("imu.mag_unit", of.why());
        }
        if let Some(streams) = &self.streams {
            streams.describe(&mut imu, remarks);
        }
        remarks.reason("imu.output", &found.output_why);
        let why = "1σ of the sample rate, because no time stamps confirm it; the σ of the gyro scale factors include \
        this uncertainty";
        remarks.reason("imu.sample_period_sigma_ppm", why);
        if found.opposed {
            remarks.before(
                "imu.time_unit",
                "Gravity rotates in the opposite direction to the gyro output, so one triad has the wrong \
                 sign. Reverse the signs of its columns, or give it a negative scale.",
            );
        }
        remarks.reason("imu.time_unit", &clock.why);
        let why = "guess: a row covers the interval that ends at its time stamp; if not, set \"start\" or \"middle\"";
        remarks.reason("imu.time_stamp", why);
        remarks.reason("imu.continuous", self.why_continuous());
        let why = "the log contains several instruments; this value selects the first";
        remarks.reason("imu.instance", why);
        imu
    }

    /// The unit of a triad; open if it is unknown.
    fn unit(&self, sensor: Sensor, remarks: &mut Remarks) -> Option<String> {
        let unit = self.quantities.units.get(sensor);
        if !self.is_present(sensor) {
            return None;
        }
        let path = format!("imu.{}_unit", sensor.name());
        let why = &unit.why;
        match unit.word {
            Some(_) => remarks.reason(&path, why),
            None => remarks.open(
                &path,
                format_args!(
                    "{why}; for the value, see the data sheet or the settings of the logger"
                ),
            ),
        }
        unit.word.map(str::to_owned)
    }

    fn period(&self, remarks: &mut Remarks) -> Option<Positive> {
        let (path, clock) = ("imu.sample_period_s", &self.clock);
        let Some(period) = clock.period else {
            if !self.rows_show_period() && !self.is_of_magnetometer() {
                let why = "time between rows in s; a counter does not give it";
                remarks.open(path, why);
            }
            return None;
        };
        let rate = rounded(period.recip(), 4);
        if clock.is_stated {
            remarks.reason(path, format_args!("{rate} Hz, stated in the file"));
        } else {
            let why =
                format!("{rate} Hz; if this field is omitted, estimated from the time column");
            remarks.suggestion(path, why);
        }
        Some(Positive(rounded(period, 7)))
    }

    /// Number of jumps of the gravity direction.
    fn cuts(&self) -> usize {
        self.motion.as_ref().map_or(0, |motion| motion.cuts.len())
    }

    fn why_continuous(&self) -> String {
        let clock = &self.clock;
        if self.of_means {
            return "each row is the mean of a position".to_owned();
        }
        match (self.cuts(), clock.gaps.len(), clock.repeated) {
            (0, 0, 0) => "no gaps".to_owned(),
            (0, 0, repeated) => {
                let repeated = places(repeated);
                format!("there are no gaps, but the time repeats or steps back in {repeated}")
            }
            (0, gaps, _) => format!("rows are missing in {}", places(gaps)),
            (cuts, ..) => format!(
                "the gravity direction jumps in {}, as it does between concatenated sections; if the log is \
                 continuous, set this field to true",
                places(cuts)
            ),
        }
    }

    /// Whether rows without a time show their duration: they do if they are rates, because the sums of rates are
    /// angles.
    fn rows_show_period(&self) -> bool {
        let gyro = &self.quantities.units.gyro;
        self.columns.time.is_none()
            && self.quantities.output == Output::Rate
            && gyro.word.is_some_and(|word| word != "count")
    }

    fn body_axes(&self, remarks: &mut Remarks) -> BodyAxes {
        let path = "imu.body_axes";
        let of_program = self.streams.as_ref().and_then(|streams| streams.axes);
        if let Some(axes) = of_program.and_then(|axes| toml::Value::from(axes).try_into().ok()) {
            remarks.reason(path, AXES_OF_PROGRAM);
            return axes;
        }
        let mut why = "guess: x right, y front, z up; if not, set \"frd\" or \"flu\"".to_owned();
        if is_of_autopilot(&self.columns.names) {
            why += "; the column names are those of PX4 or ArduPilot, which use \"frd\"";
        }
        remarks.reason(path, why);
        BodyAxes::Rfu
    }

    /// The name of a column.
    fn name(&self, column: usize) -> String {
        self.columns.names[column].clone()
    }

    /// The names of some columns, for a remark.
    fn list(&self, columns: &[usize]) -> String {
        let names: Vec<String> = columns.iter().map(|&k| self.name(k)).collect();
        toml::Value::from(names).to_string()
    }

    fn columns(&self, remarks: &mut Remarks) -> ImuColumns {
        if !self.is_of_magnetometer() {
            self.doubts_of_triads(remarks);
        }
        let (path, columns) = ("imu.columns", &self.columns);
        let time = columns.time.map(|time| match columns.nanoseconds {
            Some(further) => {
                TimeColumn::SecondsAndNanoseconds([time, further].map(|k| self.name(k)))
            }
            None => TimeColumn::One(self.name(time)),
        });
        if time.is_none() && !self.is_of_magnetometer() {
            self.without_time(remarks);
        }
        let known = columns.triads.gyro.or(columns.triads.accel);
        for sensor in Sensor::ALL
            .into_iter()
            .filter(|_| !self.is_of_magnetometer())
        {
            let all: Vec<usize> = (0..columns.names.len()).collect();
            let why = || {
                let (name, all) = (sensor.name(), self.list(&all));
                format!("{name} = three of {all}; {NO_COLUMNS}")
            };
            match (columns.triads.get(sensor), known) {
                (Some(_), _) => {}
                (None, None) => remarks.open_before(path, why()),
                (None, Some(_)) => {
                    let without = sensor.pick(
                        "without these columns, only the accelerometers can be calibrated",
                        "without these columns, only `turncal allan` can use the log",
                    );
                    remarks.before(path, format_args!("{}; {without}", why()));
                }
            }
        }
        if !self.blocked.is_empty() {
            remarks.open(path, self.blocked.join("; "));
        }
        let names = |triad: Option<[usize; 3]>| Some(Names(triad?.map(|k| self.name(k))));
        ImuColumns {
            time,
            gyro: names(columns.triads.gyro),
            accel: names(columns.triads.accel),
            mag: names(columns.magnetometer.as_ref().map(|of| of.columns)),
            temperature: (columns.temperature).map(|k| TemperatureColumn::One(self.name(k))),
        }
    }

    /// Remarks on alternative triad columns and on identification by value.
    fn doubts_of_triads(&self, remarks: &mut Remarks) {
        let columns = &self.columns;
        for sensor in Sensor::ALL {
            for other in columns.others.get(sensor) {
                let (name, other) = (sensor.name(), self.list(other));
                remarks.before("imu.columns", format_args!("{name} could also be {other}"));
            }
        }
        if let Some(doubt) = &columns.doubt {
            let words = self.doubt_words(doubt);
            remarks.before("imu.columns", format_args!("Guess: {words}"));
        } else if columns.by_size && columns.triads.gyro.is_some() {
            let why = "The triads were identified by their values: turns of the gyros rotate the vector of the \
            accelerometers.";
            remarks.before("imu.columns", why);
        }
        if let Some((down, accel)) = self.down.zip(columns.triads.accel) {
            let reversed = accel.map(|k| format!("-{}", columns.names[k]));
            let remark = format!(
                "At the start {}. If that axis pointed up, write accel = {}.",
                self.down_words(down),
                toml::Value::from(reversed.to_vec())
            );
            remarks.before("imu.columns", remark);
        }
    }

    /// Reasons why triads that were identified by their values are only a guess, and what to check.
    pub fn doubt_words(&self, doubt: &Doubt) -> String {
        match doubt {
            Doubt::Order(order) => {
                let sign = |sign: f64| if sign < 0.0 { "-" } else { "" };
                let signed =
                    |&(k, of): &(usize, f64)| format!("{}{}", sign(of), self.columns.names[k]);
                let order: Vec<String> = order.iter().map(signed).collect();
                let gyro = toml::Value::from(order);
                format!(
                    "the change of gravity is consistent with gyro = {gyro}; check the order of the axes in the logger"
                )
            }
            Doubt::Rival(rival) => {
                let [gyro, accel] = [rival.gyro, rival.accel].map(|triad| self.list(&triad));
                format!(
                    "gyro = {gyro} with accel = {accel} fits equally well; check the columns in the logger"
                )
            }
            Doubt::NoTurns => {
                "the log contains no turns with which to compare the columns; check the columns in the logger, or \
                 record turns"
                    .to_owned()
            }
        }
    }

    /// Substitute for a time column.
    fn without_time(&self, remarks: &mut Remarks) {
        let (path, why) = ("imu.columns", &self.clock.why);
        let instead = if self.clock.is_stated {
            "turncal assumes that the rows are consecutive."
        } else if self.rows_show_period() {
            "turncal estimates the sample period from the turns unless sample_period_s is set."
        } else {
            let words = format_args!("{why}; name a time column or set sample_period_s.");
            return remarks.open_before(path, words);
        };
        remarks.before(path, format_args!("{why}; {instead}"));
    }

    /// Remark that an axis points down or that the accelerometers output gravity.
    pub fn down_words(&self, down: usize) -> String {
        format!(
            "{} is negative: either the axis points down, or the accelerometers output gravity instead of specific \
             force, as on iOS",
            self.columns.names[down]
        )
    }

    fn noise_fields(&self, remarks: &mut Remarks) -> NoiseFields {
        if self.is_of_magnetometer() {
            return NoiseFields::new();
        }
        remarks.before(
            "imu.noise",
            "white noise; if this field is omitted, turncal estimates the noise from the recording",
        );
        let mut fields = NoiseFields::new();
        for sensor in Sensor::ALL.into_iter().filter(|&of| self.is_present(of)) {
            if let Some(noise) = &self.stated.noise {
                stated_noise(&mut fields, remarks, sensor, noise.get(sensor));
                continue;
            }
            let (key, unit) = NoiseKeys::of(sensor).random_walk;
            let walk = self.white_noise(sensor);
            let why = match walk {
                Some(_) => {
                    "measured at rest in this log; a value from the data sheet or from turncal allan is more \
                accurate"
                }
                None => "value from the data sheet",
            };
            remarks.suggestion(&format!("imu.noise.{key}"), why);
            let walk = walk.map(|walk| NonNegative(rounded(walk / unit, 4)));
            fields.insert(key.to_owned(), walk);
        }
        fields
    }

    fn priors(&self, remarks: &mut Remarks) -> PriorsFile {
        let mut priors = PriorsFile::default();
        if self.is_present(Sensor::Gyro) {
            priors.gyro = self.prior(Sensor::Gyro, remarks);
        }
        if self.is_present(Sensor::Accel) {
            priors.accel = self.prior(Sensor::Accel, remarks);
        }
        priors
    }

    /// White noise of a triad, as stated or as measured at rest, in (rad/s)√s or (m/s²)√s.
    pub fn white_noise(&self, sensor: Sensor) -> Option<f64> {
        if let Some(noise) = &self.stated.noise {
            return Some(noise.get(sensor).random_walk);
        }
        let scale = self.quantities.scale(sensor)?;
        Some((*self.random_walk.get(sensor))? / scale.abs())
    }
}

fn stated_noise(fields: &mut NoiseFields, remarks: &mut Remarks, sensor: Sensor, noise: &Noise) {
    let keys = NoiseKeys::of(sensor);
    let mut state = |key: &str, value: f64, why| {
        let value = Some(NonNegative(rounded(value, 7)));
        fields.insert(key.to_owned(), value);
        remarks.reason(&format!("imu.noise.{key}"), why);
    };
    let (key, unit) = keys.random_walk;
    state(key, noise.random_walk / unit, "as stated");
    if let Some(bias) = noise.gauss_markov {
        let (key, unit) = keys.gauss_markov;
        state(key, bias.sigma / unit, "as stated");
        let why = "chosen by turncal, because a random walk has no correlation time";
        state(keys.correlation_time, bias.correlation_time, why);
    }
}

fn places(count: usize) -> String {
    match count {
        1 => "one place".to_owned(),
        count => format!("{count} places"),
    }
}
