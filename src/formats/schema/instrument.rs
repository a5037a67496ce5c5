//! The instrument as `run.toml` describes it: its record, noise, unit, nominal scale and prior.

use std::path::Path;

use nalgebra::Vector3;

use super::{Document, ImuFile, Names, OneOrThree, PriorFile, RunFile, TermFile};
use crate::formats::clock::{Breaks, Clock};
use crate::formats::error::{FileError, list, suggestion};
use crate::formats::imu_log::ImuLog;
use crate::formats::inputs::source::{Source, accel_from, clock};
use crate::formats::inputs::temperature::{TemperatureColumns, TemperatureUnit};
use crate::formats::quantity::units;
use crate::imu::NoiseKeys;
use crate::imu::{
    GaussMarkov, Instrument, MotionNoise, Noise, Nominal, Output, PerSensor, Prior, Sensor, Term,
    TermVector,
};
use crate::units::{ARCSEC, DEGREE, PPM};

/// 1σ of the scale factors, misalignments and biases of a sensor of which nothing is stated: usual of consumer MEMS.
pub const USUAL_SCALE: f64 = 50_000.0 * PPM;
pub const USUAL_INSTALLATION: f64 = 2.0 * DEGREE;
/// rad/s and m/s².
pub const USUAL_BIAS: PerSensor<f64> = PerSensor {
    gyro: 2.0 * DEGREE,
    accel: 1.0,
};
/// The period of rows of which none is known, until their motion shows it, s.
pub const USUAL_PERIOD: f64 = 0.01;
/// 1σ of a scale factor of which nothing is known, of the scale factor.
const WIDEST_SCALE: f64 = 10.0;
/// 1σ of a bias beyond the range of any instrument, rad/s or m/s².
const WIDEST_BIAS: f64 = 1e6;
/// Beyond any error of an angle, ″.
const HALF_TURN: f64 = 648_000.0;

/// What `[imu]` and the tables below it say.
pub struct InstrumentFields<'a> {
    pub log: ImuLog<'a>,
    pub known: Instrument,
    /// Whether neither run.toml nor a time column tells how long a row lasts.
    pub without_period: bool,
}

impl<'a> InstrumentFields<'a> {
    /// Remarks on what is assumed or without effect go to `notes`.
    pub fn of_file(
        document: Document,
        run: &'a RunFile,
        directory: &Path,
        notes: &mut Vec<String>,
    ) -> Result<Self, FileError> {
        let imu = &run.imu;
        let known = knowledge(document, imu, notes)?;
        let mut of_gyro = clock(
            document,
            "imu",
            imu.columns.time.as_ref(),
            (imu.time_unit, imu.sample_period_s),
        )?;
        let source = Source::of_fields(directory, &imu.file, &imu.stream, imu.salvage);
        let accel_from = accel_from(document, imu, directory, &source, of_gyro)?;
        if let (Some(of), Some(_)) = (&imu.instance, &accel_from) {
            let meaning = format!(
                "one instrument without `{}`, as accel_from needs",
                of.column
            );
            return Err(document.missing("imu.stream", &meaning));
        }
        of_gyro.breaks = match run.turntable.is_some() || run.segments.is_some() {
            _ if accel_from.is_some() => Breaks::None,
            true => Breaks::Pauses,
            false => Breaks::Settings,
        };
        let without_period = with_usual_period(document, run, &mut of_gyro)?;
        let columns = &imu.columns;
        let names = |sensor| match columns_of(imu, sensor) {
            Some(Names(names)) => names.each_ref().map(String::as_str),
            None => [""; 3],
        };
        let log = ImuLog {
            source,
            clock: of_gyro,
            accel_from,
            instance: (imu.instance.as_ref()).map(|of| (of.column.as_str(), of.number.0)),
            triads: PerSensor::from_fn(names),
            temperature: columns.temperature.as_ref().map(|column| {
                let unit = imu.temperature_unit.unwrap_or(TemperatureUnit::WORDS[0].1);
                TemperatureColumns::of_fields(column, unit)
            }),
            output: imu.output,
            axes: imu.body_axes.unwrap_or_default(),
            stamp: imu.time_stamp,
            continuous: imu.continuous.unwrap_or(true),
            nominal: known.nominal,
            full_scale: PerSensor {
                gyro: imu.gyro_full_scale.map(|of| of.0),
                accel: imu.accel_full_scale.map(|of| of.0),
            },
        };
        Ok(Self {
            log,
            known,
            without_period,
        })
    }
}

/// The usual period where none is stated; how long a row lasts can only be found of rates that stand alone.
fn with_usual_period(
    document: Document,
    run: &RunFile,
    clock: &mut Clock,
) -> Result<bool, FileError> {
    if clock.column.is_some() || clock.period.is_some() {
        return Ok(false);
    }
    if run.imu.output != Output::Rate || run.turntable.is_some() {
        let meaning = "the name of a column; rows of pulses or increments, or rows with a [turntable], need it, \
                       or else sample_period_s";
        return Err(document.missing("imu.columns.time", meaning));
    }
    clock.period = Some(USUAL_PERIOD);
    Ok(true)
}

/// Units, nominal scales, priors, noise and error terms.
fn knowledge(
    document: Document,
    imu: &ImuFile,
    notes: &mut Vec<String>,
) -> Result<Instrument, FileError> {
    let unit = PerSensor {
        gyro: unit(document, imu, Sensor::Gyro, notes)?,
        accel: unit(document, imu, Sensor::Accel, notes)?,
    };
    let gyro = nominal(document, imu, Sensor::Gyro, &unit.gyro)?;
    let accel = nominal(document, imu, Sensor::Accel, &unit.accel)?;
    let axes = imu.body_axes.unwrap_or_default();
    let names = Sensor::ALL.map(|sensor| NoiseKeys::of(sensor).names());
    document.only("imu.noise", imu.noise.keys(), names.as_flattened())?;
    let (gyro_noise, gyro_in_moves) = noise(document, imu, Sensor::Gyro)?;
    let (accel_noise, accel_in_moves) = noise(document, imu, Sensor::Accel)?;
    Ok(Instrument {
        prior: PerSensor {
            gyro: prior(document, imu, Sensor::Gyro, gyro, notes)?,
            accel: prior(document, imu, Sensor::Accel, accel, notes)?,
        },
        nominal: PerSensor {
            gyro: Nominal(axes.each(gyro)),
            accel: Nominal(axes.each(accel)),
        },
        unit,
        noise: PerSensor {
            gyro: gyro_noise,
            accel: accel_noise,
        },
        noise_is_stated: PerSensor::from_fn(|sensor| {
            imu.noise.contains_key(NoiseKeys::of(sensor).random_walk.0)
        }),
        motion_noise: PerSensor {
            gyro: gyro_in_moves,
            accel: accel_in_moves,
        },
        term_sigma: term_sigma(document, "imu.terms", &imu.terms)?,
    })
}

/// 1σ of the parameters of the terms that a table of them switches on, in SI; zero for the others.
pub fn term_sigma(
    document: Document,
    table: &str,
    terms: &std::collections::BTreeMap<String, TermFile>,
) -> Result<TermVector, FileError> {
    document.only(table, terms.keys(), &Term::NAMES)?;
    let mut sigma = TermVector::zeros();
    for term in Term::ALL {
        let Some(TermFile { sigma: stated }) = terms.get(term.name()) else {
            continue;
        };
        let unit = term.entry().unit.1;
        let most = (term.entry().largest / unit).round();
        if stated.0 > most {
            let path = format!("{table}.{}.sigma", term.name());
            let expected = format_args!("a number above zero, at most {most}");
            return Err(document.wrong(&path, expected, "Correct this value."));
        }
        for parameter in term.parameters() {
            sigma[parameter] = stated.0 * unit;
        }
    }
    Ok(sigma)
}

/// Noise of a triad at rest and in moves; zero where it is not stated.
fn noise(
    document: Document,
    imu: &ImuFile,
    sensor: Sensor,
) -> Result<(Noise, MotionNoise), FileError> {
    let keys = NoiseKeys::of(sensor);
    let get = |name: &str| imu.noise.get(name).map(|value| value.0);
    let ((key, sigma_unit), time) = (keys.gauss_markov, keys.correlation_time);
    let gauss_markov = match (get(key), get(time)) {
        (None, None) => None,
        (Some(sigma), Some(correlation_time)) => {
            for (name, value) in [(key, sigma), (time, correlation_time)] {
                if value <= 0.0 {
                    let path = format!("imu.noise.{name}");
                    let expected = "a number above zero";
                    return Err(document.wrong(&path, expected, "Correct this value."));
                }
            }
            Some(GaussMarkov {
                sigma: sigma * sigma_unit,
                correlation_time,
            })
        }
        (Some(_), None) => {
            let path = format!("imu.noise.{time}");
            return Err(document.missing(&path, "its correlation time"));
        }
        (None, Some(_)) => {
            let path = format!("imu.noise.{key}");
            return Err(document.missing(&path, "the 1σ of the Gauss–Markov bias"));
        }
    };
    let or_zero = |(name, unit): (&str, f64)| get(name).unwrap_or(0.0) * unit;
    Ok((
        Noise {
            random_walk: or_zero(keys.random_walk),
            gauss_markov,
        },
        MotionNoise {
            by_motion: or_zero((keys.by_motion, 1.0)),
            by_duration: or_zero(keys.by_duration),
        },
    ))
}

/// The columns of a triad, if it is there.
fn columns_of(imu: &ImuFile, sensor: Sensor) -> Option<&Names<3>> {
    match sensor {
        Sensor::Gyro => imu.columns.gyro.as_ref(),
        Sensor::Accel => imu.columns.accel.as_ref(),
    }
}

/// The unit of a triad; one of two may be missing from a log.
fn unit(
    document: Document,
    imu: &ImuFile,
    sensor: Sensor,
    notes: &mut Vec<String>,
) -> Result<String, FileError> {
    let [gyro, accel] = Sensor::ALL.map(|sensor| columns_of(imu, sensor).is_some());
    let (is_there, unit) = match sensor {
        Sensor::Gyro => (gyro, &imu.gyro_unit),
        Sensor::Accel => (accel, &imu.accel_unit),
    };
    let name = sensor.name();
    if !is_there && (imu.accel_from.is_some() || !(gyro || accel)) {
        let path = format!("imu.columns.{name}");
        return Err(document.missing(&path, "the names of three columns"));
    }
    if !is_there {
        notes.push(format!(
            "The log has no columns of {name}: they are taken to be zero."
        ));
        return Ok("count".to_owned());
    }
    let missing = || document.missing(&format!("imu.{name}_unit"), "the unit of the file");
    unit.clone().ok_or_else(missing)
}

fn prior_of(imu: &ImuFile, sensor: Sensor) -> &PriorFile {
    match sensor {
        Sensor::Gyro => &imu.prior.gyro,
        Sensor::Accel => &imu.prior.accel,
    }
}

/// The file's quantity per second for one rad/s or m/s², along the file's axes.
fn nominal(
    document: Document,
    imu: &ImuFile,
    sensor: Sensor,
    unit: &str,
) -> Result<Vector3<f64>, FileError> {
    if columns_of(imu, sensor).is_none() {
        return Ok(Vector3::repeat(1.0));
    }
    let known = || units(sensor, imu.output);
    let names = || known().map(|(name, _)| name);
    let Some((_, of_unit)) = known().find(|(name, _)| *name == unit) else {
        return Err(document.wrong(
            &format!("imu.{}_unit", sensor.name()),
            format_args!("one of {}", list(names())),
            suggestion(unit, names(), "Choose one of them."),
        ));
    };
    let path = format!("imu.prior.{}.scale", sensor.name());
    match (prior_of(imu, sensor).scale.map(OneOrThree::vector), of_unit) {
        (None, Some(of_unit)) => Ok(Vector3::repeat(of_unit)),
        (None, None) => Err(document.missing(
            &path,
            "counts per second for one rad/s or m/s², for a count has no size of its own",
        )),
        (Some(scale), _) if scale.iter().any(|&s| s == 0.0) => {
            Err(document.wrong(&path, "no zeros", "Give the data sheet's scale factor."))
        }
        (Some(scale), Some(of_unit))
            if !scale
                .iter()
                .all(|s| (0.5..=2.0).contains(&(s.abs() / of_unit))) =>
        {
            Err(document.wrong(
                &path,
                format_args!("about {of_unit}, which this unit says for one rad/s or m/s²"),
                "Correct the scale or the unit, or leave the scale out.",
            ))
        }
        (Some(scale), _) => Ok(scale),
    }
}

/// The prior of a triad of this nominal scale, along right-front-up; what is not stated is wide.
fn prior(
    document: Document,
    imu: &ImuFile,
    sensor: Sensor,
    nominal: Vector3<f64>,
    notes: &mut Vec<String>,
) -> Result<Prior, FileError> {
    let (file, axes) = (prior_of(imu, sensor), imu.body_axes.unwrap_or_default());
    let bias = file.bias.map_or_else(Vector3::zeros, OneOrThree::vector);
    let mut assumed = Vec::new();
    let mut sigma = |key: &str, stated: Option<OneOrThree>, most, usual, words| {
        let path = format!("imu.prior.{}.{key}", sensor.name());
        let stated = stated_sigma(document, &path, stated, most)?;
        assumed.extend(stated.is_none().then_some(words));
        Ok::<_, FileError>(stated.unwrap_or(usual))
    };
    let scale_sigma = sigma(
        "scale_sigma_ppm",
        file.scale_sigma_ppm,
        WIDEST_SCALE / PPM,
        Vector3::repeat(USUAL_SCALE / PPM),
        "scale factor ± 5 %",
    )?;
    let installation_sigma = sigma(
        "installation_sigma_arcsec",
        file.installation_sigma_arcsec,
        HALF_TURN,
        Vector3::repeat(USUAL_INSTALLATION / ARCSEC),
        "misalignment ± 2°",
    )?;
    let bias_sigma = sigma(
        "bias_sigma",
        file.bias_sigma,
        WIDEST_BIAS * nominal.amax(),
        nominal.abs() * *USUAL_BIAS.get(sensor),
        match sensor {
            Sensor::Gyro => "bias ± 2 °/s",
            Sensor::Accel => "bias ± 1 m/s²",
        },
    )?;
    if !assumed.is_empty() && columns_of(imu, sensor).is_some() {
        notes.push(format!(
            "run.toml does not state everything in [imu.prior.{}]. turncal assumed (1σ): {}.",
            sensor.name(),
            assumed.join(", ")
        ));
    }
    Ok(Prior {
        scale_sigma: axes.each(scale_sigma) * PPM,
        installation_sigma: axes.each(installation_sigma) * ARCSEC,
        bias: axes.vector(bias.component_div(&nominal)),
        bias_sigma: axes.each(bias_sigma.component_div(&nominal.abs())),
    })
}

/// A 1σ of each axis, as far as it is stated.
fn stated_sigma(
    document: Document,
    path: &str,
    stated: Option<OneOrThree>,
    most: f64,
) -> Result<Option<Vector3<f64>>, FileError> {
    let stated = stated.map(OneOrThree::vector);
    match stated.iter().flatten().all(|&s| s > 0.0 && s <= most) {
        true => Ok(stated),
        false => {
            let expected = format_args!("numbers above zero, at most {most}");
            Err(document.wrong(path, expected, "Correct this value."))
        }
    }
}
