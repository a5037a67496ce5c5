//! The instrument as described in `run.toml`: log, noise, unit, nominal scale and prior.

use std::path::Path;

use nalgebra::Vector3;

use super::{Names, RunFile};
use crate::imu_log::ImuLog;
use crate::inputs::temperature::TemperatureColumns;
use crate::quantity::units;
use turncal::calibration::Source;
use turncal::imu::{
    GaussMarkov, Instrument, MotionNoise, Noise, NoiseKeys, Nominal, Output, PerSensor, Prior,
    Sensor,
};
use turncal::models::stated_terms;
use turncal::units::{ARCSEC, DEGREE, PPM};
use turncal_input::{Document, FileError, OneOrThree, list, suggestion};
use turncal_logs::DataFile;
use turncal_logs::clock::{Breaks, Clock};

/// Default 1σ of scale factors, misalignments and biases, typical of consumer MEMS sensors.
pub const USUAL_SCALE: f64 = 50_000.0 * PPM;
pub const USUAL_INSTALLATION: f64 = 2.0 * DEGREE;
/// Default 1σ of biases, rad/s and m/s².
pub const USUAL_BIAS: PerSensor<f64> = PerSensor {
    gyro: 2.0 * DEGREE,
    accel: 1.0,
};
/// Sample period that is assumed until it has been estimated from motion, s.
pub const USUAL_PERIOD: f64 = 0.01;
/// Sample period of values without times, s.
const PERIOD_OF_VALUES: f64 = 1.0;
/// Relative 1σ of a rate that is not confirmed by time stamps: the tolerance of the oscillators in MEMS sensors.
pub const RATE_SIGMA: f64 = 0.01;
/// Maximum relative 1σ of a scale factor.
const WIDEST_SCALE: f64 = 10.0;
/// Maximum 1σ of a bias, beyond the range of any instrument, rad/s or m/s².
const WIDEST_BIAS: f64 = 1e6;
/// Maximum angle error, ″.
const HALF_TURN: f64 = 648_000.0;

/// Content of a `run.toml` that is being read; `notes` receives remarks on assumptions and on fields without effect.
pub struct Fields<'a> {
    pub document: Document<'a>,
    pub run: &'a RunFile,
    pub directory: &'a Path,
    /// Files of this directory that are in memory.
    pub in_memory: &'a [DataFile],
    pub notes: Vec<String>,
}

/// Content of `[imu]` and its subtables.
pub struct InstrumentFields<'a> {
    pub log: ImuLog<'a>,
    pub known: Instrument,
    /// Whether neither run.toml nor a time column gives the sample period.
    pub without_period: bool,
    /// Relative 1σ of the sample period.
    pub period_sigma: f64,
}

impl<'a> Fields<'a> {
    /// The fields of a document; the files that it names are in its directory.
    pub fn new(document: Document<'a>, run: &'a RunFile, in_memory: &'a [DataFile]) -> Self {
        Self {
            document,
            run,
            directory: document.file.parent().unwrap_or(Path::new("")),
            in_memory,
            notes: Vec::new(),
        }
    }

    pub fn instrument(&mut self) -> Result<InstrumentFields<'a>, FileError> {
        let imu = &self.run.imu;
        let known = self.knowledge()?;
        let stated = (imu.time_unit.as_ref(), imu.sample_period_s);
        let mut of_gyro = self.clock("imu", imu.columns.time.as_ref(), stated)?;
        let source = self.source(&imu.file, &imu.stream, imu.salvage);
        let accel_from = self.accel_from(&source, of_gyro)?;
        if let (Some(of), Some(_)) = (&imu.instance, &accel_from) {
            let meaning = format!(
                "a stream that contains only one instrument, without `{}`, because accel_from is given",
                of.column
            );
            return Err(self.document.missing("imu.stream", &meaning));
        }
        of_gyro.breaks = if accel_from.is_some() {
            Breaks::None
        } else if self.run.turntable.is_some() || self.run.segments.is_some() {
            Breaks::Pauses
        } else {
            Breaks::Settings
        };
        let without_period = self.with_usual_period(&mut of_gyro)?;
        let names = |sensor| match imu.of(sensor).columns {
            Some(Names(names)) => names.each_ref().map(String::as_str),
            None => [""; 3],
        };
        let log = ImuLog {
            source,
            clock: of_gyro,
            accel_from,
            instance: (imu.instance.as_ref()).map(|of| (of.column.as_str(), of.number.0)),
            triads: PerSensor::from_fn(names),
            temperature: imu.columns.temperature.as_ref().map(|column| {
                let unit = imu.temperature_unit.unwrap_or_default();
                TemperatureColumns::of_fields(column, unit)
            }),
            output: imu.output,
            axes: imu.axes(),
            stamp: imu.time_stamp,
            continuous: imu.continuous.unwrap_or(true),
            nominal: known.nominal,
            full_scale: PerSensor::from_fn(|sensor| imu.of(sensor).full_scale),
        };
        let is_confirmed = log.clock.column.is_some() || self.run.turntable.is_some();
        let usual = if is_confirmed || log.output != Output::Rate {
            0.0
        } else {
            RATE_SIGMA
        };
        let stated = imu.sample_period_sigma_ppm.map(|sigma| sigma.0 * PPM);
        Ok(InstrumentFields {
            log,
            known,
            without_period,
            period_sigma: stated.unwrap_or(usual),
        })
    }

    /// The default period if none is stated; the period can only be estimated for rates without other logs.
    fn with_usual_period(&self, clock: &mut Clock) -> Result<bool, FileError> {
        if self.run.imu.is_of_magnetometer() && clock.column.is_none() {
            // The values of a magnetometer alone need no times.
            clock.period = clock.period.or(Some(PERIOD_OF_VALUES));
        }
        if clock.column.is_some() || clock.period.is_some() {
            return Ok(false);
        }
        if self.run.imu.output != Output::Rate || self.run.turntable.is_some() {
            let meaning = "a column name (pulses, increments and runs with a [turntable] need either a time column or \
            sample_period_s)";
            return Err(self.document.missing("imu.columns.time", meaning));
        }
        clock.period = Some(USUAL_PERIOD);
        Ok(true)
    }

    /// Units, nominal scales, priors, noise and error terms.
    fn knowledge(&mut self) -> Result<Instrument, FileError> {
        let imu = &self.run.imu;
        let axes = imu.axes();
        let unit = PerSensor::try_from_fn(|sensor| self.unit(sensor))?;
        let nominal = PerSensor::try_from_fn(|sensor| self.nominal(sensor, unit.get(sensor)))?;
        let names = Sensor::ALL.map(|sensor| NoiseKeys::of(sensor).names());
        let (_, (disturbance, _)) = Source::MagneticDisturbance.stated_in();
        let names = [names.as_flattened(), &[disturbance]].concat();
        (self.document).only("imu.noise", imu.noise.keys(), &names)?;
        let noise = PerSensor::try_from_fn(|sensor| self.noise(sensor))?;
        let prior = PerSensor::try_from_fn(|sensor| self.prior(sensor, *nominal.get(sensor)))?;
        let (term_sigma, absent_terms) = stated_terms(self.document, "imu.terms", &imu.terms)?;
        let walk = |sensor| NoiseKeys::of(sensor).random_walk.0;
        Ok(Instrument {
            prior,
            nominal: PerSensor::from_fn(|sensor| Nominal(axes.each(*nominal.get(sensor)))),
            unit,
            noise: PerSensor::from_fn(|sensor| noise.get(sensor).0),
            noise_is_stated: PerSensor::from_fn(|sensor| imu.noise.contains_key(walk(sensor))),
            motion_noise: PerSensor::from_fn(|sensor| noise.get(sensor).1),
            term_sigma,
            absent_terms,
        })
    }

    /// Noise of a triad at rest and in moves; zero if not stated.
    fn noise(&self, sensor: Sensor) -> Result<(Noise, MotionNoise), FileError> {
        let keys = NoiseKeys::of(sensor);
        let get = |name: &str| (*self.run.imu.noise.get(name)?).map(|value| value.0);
        let ((key, sigma_unit), time) = (keys.gauss_markov, keys.correlation_time);
        let key = get(keys.former).map_or(key, |_| keys.former);
        let path = |name: &str| format!("imu.noise.{name}");
        let missing = |name, meaning| Err(self.document.missing(&path(name), meaning));
        let gauss_markov = match (get(key), get(time)) {
            (None, None) => None,
            (Some(_), None) => return missing(time, "its correlation time"),
            (None, Some(_)) => return missing(key, "the 1σ of the Gauss–Markov bias"),
            (Some(sigma), Some(correlation_time)) => {
                let all = [(key, sigma), (time, correlation_time)];
                if let Some((name, _)) = all.into_iter().find(|(_, value)| *value <= 0.0) {
                    let (expected, advice) = ("a number above zero", "Correct this value.");
                    return Err(self.document.wrong(&path(name), expected, advice));
                }
                let sigma = sigma * sigma_unit;
                Some(GaussMarkov {
                    sigma,
                    correlation_time,
                })
            }
        };
        let or_zero = |(name, unit): (&str, f64)| get(name).unwrap_or(0.0) * unit;
        let noise = Noise {
            random_walk: or_zero(keys.random_walk),
            gauss_markov,
        };
        let of_moves = MotionNoise {
            by_motion: or_zero((keys.by_motion, 1.0)),
            by_duration: or_zero(keys.by_duration),
        };
        Ok((noise, of_moves))
    }

    /// The unit of a triad; one of two may be missing from a log.
    fn unit(&mut self, sensor: Sensor) -> Result<String, FileError> {
        let (imu, name) = (&self.run.imu, sensor.name());
        let is_there = |sensor| imu.of(sensor).columns.is_some();
        if is_there(sensor) {
            let (path, meaning) = (
                format!("imu.{name}_unit"),
                "the unit of the values in the file",
            );
            let unit = imu.of(sensor).unit.map(str::to_owned);
            return unit.ok_or_else(|| self.document.missing(&path, meaning));
        }
        if imu.is_of_magnetometer() {
            return Ok("count".to_owned());
        }
        if imu.accel_from.is_some() || !Sensor::ALL.into_iter().any(is_there) {
            let path = format!("imu.columns.{name}");
            return Err(self.document.missing(&path, "the names of three columns"));
        }
        let note =
            format!("The log has no {name} columns. turncal assumed that their output is zero.");
        self.notes.push(note);
        Ok("count".to_owned())
    }

    /// The file's quantity per second for one rad/s or m/s², along the file's axes.
    fn nominal(&self, sensor: Sensor, unit: &str) -> Result<Vector3<f64>, FileError> {
        let (imu, document) = (&self.run.imu, self.document);
        let of = imu.of(sensor);
        if of.columns.is_none() {
            return Ok(Vector3::repeat(1.0));
        }
        let known = || units(sensor, imu.output);
        let names = || known().map(|(name, _)| name);
        let Some((_, of_unit)) = known().find(|(name, _)| *name == unit) else {
            let path = format!("imu.{}_unit", sensor.name());
            let expected = format!("one of {}", list(names()));
            let advice = suggestion(unit, names(), "Choose one of them.");
            return Err(document.wrong(&path, expected, advice));
        };
        let path = format!("imu.prior.{}.scale", sensor.name());
        let is_near = |scale: &Vector3<f64>, of_unit: f64| {
            let mut ratios = scale.iter().map(|s| s.abs() / of_unit);
            ratios.all(|ratio| (0.5..=2.0).contains(&ratio))
        };
        match (of.prior.scale.map(OneOrThree::vector), of_unit) {
            (None, Some(of_unit)) => Ok(Vector3::repeat(of_unit)),
            (None, None) => {
                let meaning = "the counts per second for 1 rad/s or 1 m/s², because the size of a count depends on the \
                               instrument";
                Err(document.missing(&path, meaning))
            }
            (Some(scale), _) if scale.iter().any(|&s| s == 0.0) => {
                let advice = "Set the scale factor from the data sheet.";
                Err(document.wrong(&path, "non-zero values", advice))
            }
            (Some(scale), Some(of_unit)) if !is_near(&scale, of_unit) => {
                let expected = format_args!("about {of_unit} (1 rad/s or 1 m/s² in this unit)");
                let advice = "Correct the scale or the unit, or omit the scale.";
                Err(document.wrong(&path, expected, advice))
            }
            (Some(scale), _) => Ok(scale),
        }
    }

    /// The prior of a triad with this nominal scale, along the right, front and up axes; wide defaults if it is not
    /// stated.
    fn prior(&mut self, sensor: Sensor, nominal: Vector3<f64>) -> Result<Prior, FileError> {
        let (of, axes) = (self.run.imu.of(sensor), self.run.imu.axes());
        let bias_words = sensor.pick("bias ± 2 °/s", "bias ± 1 m/s²");
        let (scale, angle) = (of.prior.scale_sigma_ppm, of.prior.installation_sigma_arcsec);
        let stated = [
            ("scale_sigma_ppm", scale, WIDEST_SCALE / PPM),
            ("installation_sigma_arcsec", angle, HALF_TURN),
            (
                "bias_sigma",
                of.prior.bias_sigma,
                WIDEST_BIAS * nominal.amax(),
            ),
        ];
        let mut sigma = [
            Vector3::repeat(USUAL_SCALE / PPM),
            Vector3::repeat(USUAL_INSTALLATION / ARCSEC),
            nominal.abs() * *USUAL_BIAS.get(sensor),
        ];
        let words = ["scale factor ± 5 %", "misalignment ± 2°", bias_words];
        let mut assumed = Vec::new();
        for (k, (key, stated, most)) in stated.into_iter().enumerate() {
            let Some(stated) = stated.map(OneOrThree::vector) else {
                assumed.push(words[k]);
                continue;
            };
            if !stated.iter().all(|&s| s > 0.0 && s <= most) {
                let path = format!("imu.prior.{}.{key}", sensor.name());
                let expected = format_args!("numbers above zero and at most {most}");
                return Err(self.document.wrong(&path, expected, "Correct this value."));
            }
            sigma[k] = stated;
        }
        let [scale_sigma, installation_sigma, bias_sigma] = sigma;
        if !assumed.is_empty() && of.columns.is_some() {
            self.notes.push(format!(
                "The fields of [imu.prior.{}] in run.toml are incomplete. turncal assumed (1σ): {}.",
                sensor.name(),
                assumed.join(", ")
            ));
        }
        let bias = (of.prior.bias).map_or_else(Vector3::zeros, OneOrThree::vector);
        Ok(Prior {
            scale_sigma: axes.each(scale_sigma) * PPM,
            installation_sigma: axes.each(installation_sigma) * ARCSEC,
            bias: axes.apply(&bias.component_div(&nominal)),
            bias_sigma: axes.each(bias_sigma.component_div(&nominal.abs())),
        })
    }
}
