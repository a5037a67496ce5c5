//! The instrument as `run.toml` describes it: its record, noise, unit, nominal scale and prior.

use std::path::Path;

use nalgebra::Vector3;

use super::axes::BodyAxes;
use super::clock::{Breaks, Clock};
use super::error::FileError;
use super::fields::{Field, Fields};
use super::imu_log::{ImuLog, TimeStamp};
use super::quantity::{OUTPUTS, units};
use super::source::{Source, accel_from};
use super::temperature::TemperatureColumns;
use crate::imu::NoiseKeys;
use crate::imu::{
    GaussMarkov, Instrument, MotionNoise, Noise, Nominal, Output, PerSensor, Prior, Sensor, Term,
    TermVector,
};
use crate::units::{ARCSEC, DEGREE, PPM};

/// 1σ of the scale factors, misalignments and biases of a sensor of which nothing is stated: usual of consumer MEMS.
pub(super) const USUAL_SCALE: f64 = 50_000.0 * PPM;
pub(super) const USUAL_INSTALLATION: f64 = 2.0 * DEGREE;
/// rad/s and m/s².
pub(super) const USUAL_BIAS: PerSensor<f64> = PerSensor {
    gyro: 2.0 * DEGREE,
    accel: 1.0,
};
/// The period of rows of which none is known, until their motion shows it, s.
pub(super) const USUAL_PERIOD: f64 = 0.01;
/// 1σ of a scale factor of which nothing is known, of the scale factor.
const WIDEST_SCALE: f64 = 10.0;
/// 1σ of a bias beyond the range of any instrument, rad/s or m/s².
const WIDEST_BIAS: f64 = 1e6;
/// Beyond any error of an angle, ″.
pub(super) const HALF_TURN: f64 = 648_000.0;

/// Keys of `[imu]`.
const KEYS: [&str; 20] = [
    "file",
    "stream",
    "salvage",
    "accel_from",
    "output",
    "gyro_unit",
    "accel_unit",
    "gyro_full_scale",
    "accel_full_scale",
    "time_unit",
    "sample_period_s",
    "time_stamp",
    "continuous",
    "instance",
    "temperature_unit",
    "body_axes",
    "columns",
    "noise",
    "prior",
    "terms",
];

/// What `[imu]` and the tables below it say.
pub(super) struct InstrumentFields<'a> {
    pub log: ImuLog<'a>,
    pub known: Instrument,
    /// Whether neither run.toml nor a time column tells how long a row lasts.
    pub without_period: bool,
}

impl<'a> InstrumentFields<'a> {
    /// Reads the fields; remarks on those without effect go to `notes`.
    pub fn of_fields(
        top: &Fields<'a>,
        directory: &Path,
        notes: &mut Vec<String>,
    ) -> Result<Self, FileError> {
        let fields = top.need_table("imu", &KEYS, "the instrument and its record")?;
        let (output, axes) = output_and_axes(&fields)?;
        let columns = fields.need_table(
            "columns",
            &["time", "gyro", "accel", "temperature"],
            "the names of the columns",
        )?;
        let temperature = TemperatureColumns::of_fields(&fields, &columns)?;

        let instance = instance(&fields)?;
        let mut clock = Clock::of_fields(&fields, &columns)?;
        let source = Source::of_fields(&fields, directory, None)?;
        let accel_from = accel_from(&fields, directory, &source, clock)?;
        check_instance(&fields, accel_from.is_some(), instance)?;
        clock.breaks = allowed_breaks(top, accel_from.is_some());
        let without_period = clock.column.is_none() && clock.period.is_none();
        if without_period {
            check_without_period(top, &columns, output)?;
            clock.period = Some(USUAL_PERIOD);
        }
        let full_scale = |name| fields.get(name).map(|field| field.positive()).transpose();

        let triads = triads(&columns, accel_from.is_some())?;
        for sensor in Sensor::ALL {
            if triads.get(sensor)[0].is_empty() {
                notes.push(format!(
                    "The log has no columns of {}: they are taken to be zero.",
                    sensor.name()
                ));
            }
        }
        let mut known = knowledge(&fields, &triads, (output, axes), notes)?;
        let log = ImuLog {
            source,
            clock,
            accel_from,
            instance,
            triads,
            temperature,
            output,
            axes,
            stamp: fields
                .need("time_stamp", "which moment of a sample its time names")?
                .choice(&TimeStamp::WORDS)?,
            continuous: match fields.get("continuous") {
                Some(field) => field.flag()?,
                None => true,
            },
            nominal: known.nominal,
            full_scale: PerSensor {
                gyro: full_scale("gyro_full_scale")?,
                accel: full_scale("accel_full_scale")?,
            },
        };
        known.term_sigma = term_sigma(&fields)?;
        Ok(Self {
            log,
            known,
            without_period,
        })
    }
}

/// Units, nominal scales, priors and noise of both triads, with every error term off.
fn knowledge(
    imu: &Fields,
    triads: &PerSensor<[&str; 3]>,
    row: (Output, BodyAxes),
    notes: &mut Vec<String>,
) -> Result<Instrument, FileError> {
    let priors = imu.table("prior", &["gyro", "accel"])?;
    let mut of = |sensor: Sensor| match triads.get(sensor) {
        ["", ..] => Ok(TriadKnowledge::of_none(sensor)),
        _ => triad(imu, priors.as_ref(), sensor, row, notes),
    };
    let (gyro, accel) = (of(Sensor::Gyro)?, of(Sensor::Accel)?);
    let (noise, motion_noise) = noise(imu, notes)?;
    let noise_is_stated = |sensor| {
        let noise = imu
            .get("noise")
            .map(|noise| noise.has(NoiseKeys::of(sensor).random_walk.0));
        noise.unwrap_or(false)
    };
    Ok(Instrument {
        nominal: PerSensor {
            gyro: gyro.nominal,
            accel: accel.nominal,
        },
        unit: PerSensor {
            gyro: gyro.unit,
            accel: accel.unit,
        },
        prior: PerSensor {
            gyro: gyro.prior,
            accel: accel.prior,
        },
        noise,
        noise_is_stated: PerSensor::from_fn(noise_is_stated),
        motion_noise,
        term_sigma: TermVector::zeros(),
    })
}

/// The names of the columns of both triads; none of one that is not there.
fn triads<'a>(
    columns: &Fields<'a>,
    needs_both: bool,
) -> Result<PerSensor<[&'a str; 3]>, FileError> {
    let has = |sensor: Sensor| columns.get(sensor.name()).is_some();
    let may_lack = !needs_both && Sensor::ALL.into_iter().any(has);
    let of = |sensor: Sensor| match may_lack && !has(sensor) {
        true => Ok([""; 3]),
        false => columns
            .need(sensor.name(), "the names of three columns")?
            .three_texts(),
    };
    Ok(PerSensor {
        gyro: of(Sensor::Gyro)?,
        accel: of(Sensor::Accel)?,
    })
}

/// The column that tells instruments apart, and what it says of the one that is meant.
fn instance<'a>(imu: &Fields<'a>) -> Result<Option<(&'a str, f64)>, FileError> {
    let Some(of) = imu.table("instance", &["column", "number"])? else {
        return Ok(None);
    };
    Ok(Some((
        of.need("column", "the column that tells instruments apart")?
            .text()?,
        of.need("number", "what it says of the one that is meant")?
            .number()?,
    )))
}

/// Rows of several instruments cannot be one of two streams.
fn check_instance(
    imu: &Fields,
    has_accel_from: bool,
    instance: Option<(&str, f64)>,
) -> Result<(), FileError> {
    match instance {
        Some((column, _)) if has_accel_from => Err(imu.missing(
            "stream",
            &format!("one instrument without `{column}`, as accel_from needs"),
        )),
        _ => Ok(()),
    }
}

/// What a row holds, and along which axes.
fn output_and_axes(imu: &Fields) -> Result<(Output, BodyAxes), FileError> {
    let output = imu
        .need("output", "what a row holds: pulse, increment or rate")?
        .choice(&OUTPUTS)?;
    let axes = match imu.get("body_axes") {
        Some(field) => field.choice(&BodyAxes::WORDS)?,
        None => BodyAxes::Rfu,
    };
    Ok((output, axes))
}

/// What times may do, by the other records that are put beside the instrument's.
fn allowed_breaks(top: &Fields, has_accel_from: bool) -> Breaks {
    let told = ["turntable", "segments"];
    match told.iter().any(|name| top.get(name).is_some()) {
        _ if has_accel_from => Breaks::None,
        true => Breaks::Pauses,
        false => Breaks::Settings,
    }
}

/// How long a row lasts can only be found of rates that stand alone.
fn check_without_period(top: &Fields, columns: &Fields, output: Output) -> Result<(), FileError> {
    match output == Output::Rate && top.get("turntable").is_none() {
        true => Ok(()),
        false => Err(columns.missing(
            "time",
            "the name of a column; rows of pulses or increments, or rows beside a [turntable], need it, or else \
             sample_period_s",
        )),
    }
}

/// 1σ of the parameters of the terms that `[imu.terms]` switches on.
fn term_sigma(imu: &Fields) -> Result<TermVector, FileError> {
    let mut sigma = TermVector::zeros();
    let Some(terms) = imu.table("terms", &Term::NAMES)? else {
        return Ok(sigma);
    };
    for term in Term::ALL {
        let meaning = "1σ of each of its parameters";
        if let Some(fields) = terms.table(term.name(), &["sigma"])? {
            let unit = term.entry().unit.1;
            let most = (term.entry().largest / unit).round();
            let given = fields.need("sigma", meaning)?.positive_to(most)?;
            for parameter in term.parameters() {
                sigma[parameter] = given * unit;
            }
        }
    }
    Ok(sigma)
}

/// Noise of both triads at rest and in moves; zero where it is not stated.
fn noise(
    imu: &Fields,
    notes: &mut Vec<String>,
) -> Result<(PerSensor<Noise>, PerSensor<MotionNoise>), FileError> {
    let keys = Sensor::ALL.map(NoiseKeys::of);
    let known = keys.map(NoiseKeys::names);
    let Some(fields) = imu.table("noise", known.as_flattened())? else {
        return Ok((PerSensor::default(), PerSensor::default()));
    };
    let mut triad = |keys: NoiseKeys| {
        let ((walk, walk_unit), (sigma, sigma_unit)) = (keys.random_walk, keys.gauss_markov);
        let former = fields
            .get(keys.former)
            .filter(|_| fields.get(sigma).is_none());
        if former.is_some() {
            notes.push(format!(
                "imu.noise.{} is read as the 1σ of a Gauss–Markov bias, not as the floor of the Allan \
                 deviation that data sheets call instability; write {sigma}.",
                keys.former
            ));
        }
        let time = keys.correlation_time;
        let gauss_markov = match (fields.get(sigma).or(former), fields.get(time)) {
            (None, None) => None,
            (Some(sigma), Some(time)) => Some(GaussMarkov {
                sigma: sigma.positive()? * sigma_unit,
                correlation_time: time.positive()?,
            }),
            (Some(_), None) => return Err(fields.missing(time, "its correlation time")),
            (None, Some(_)) => {
                return Err(fields.missing(sigma, "the 1σ of the Gauss–Markov bias"));
            }
        };
        let or_zero = |name: &str| match fields.get(name) {
            Some(field) => field.not_negative(),
            None => Ok(0.0),
        };
        let (by_duration, unit) = keys.by_duration;
        Ok((
            Noise {
                random_walk: or_zero(walk)? * walk_unit,
                gauss_markov,
            },
            MotionNoise {
                by_motion: or_zero(keys.by_motion)?,
                by_duration: or_zero(by_duration)? * unit,
            },
        ))
    };
    let [of_gyro, of_accel] = keys;
    let (gyro, gyro_in_moves) = triad(of_gyro)?;
    let (accel, accel_in_moves) = triad(of_accel)?;
    let in_moves = PerSensor {
        gyro: gyro_in_moves,
        accel: accel_in_moves,
    };
    Ok((PerSensor { gyro, accel }, in_moves))
}

/// Unit, nominal scale and prior of a triad, along right-front-up.
struct TriadKnowledge {
    unit: String,
    nominal: Nominal,
    prior: Prior,
}

impl TriadKnowledge {
    /// Of a triad that is not there: nothing depends on it.
    fn of_none(sensor: Sensor) -> Self {
        Self {
            unit: "count".to_owned(),
            nominal: Nominal(Vector3::repeat(1.0)),
            prior: Prior {
                scale_sigma: Vector3::repeat(USUAL_SCALE),
                installation_sigma: Vector3::repeat(USUAL_INSTALLATION),
                bias: Vector3::zeros(),
                bias_sigma: Vector3::repeat(*USUAL_BIAS.get(sensor)),
            },
        }
    }
}

fn triad(
    imu: &Fields,
    priors: Option<&Fields>,
    sensor: Sensor,
    (output, axes): (Output, BodyAxes),
    notes: &mut Vec<String>,
) -> Result<TriadKnowledge, FileError> {
    let unit = imu.need(&format!("{}_unit", sensor.name()), "the unit of a row")?;
    let unit_scale = unit.choice(units(sensor, output))?;
    let names = [
        "scale",
        "scale_sigma_ppm",
        "installation_sigma_arcsec",
        "bias",
        "bias_sigma",
    ];
    let fields = priors.map(|priors| priors.table(sensor.name(), &names));
    let fields = fields.transpose()?.flatten();
    let get = |name| fields.as_ref().and_then(|fields| fields.get(name));
    let nominal = match (get("scale"), unit_scale) {
        (Some(field), unit_scale) => {
            let scale = field.triple()?;
            check_scale(&field, scale, unit_scale)?;
            scale
        }
        (None, Some(unit_scale)) => Vector3::repeat(unit_scale),
        (None, None) => {
            let meaning =
                "counts per second for one rad/s or m/s², for a count has no size of its own";
            let name = format!("prior.{}.scale", sensor.name());
            return Err(match &fields {
                Some(fields) => fields.missing("scale", meaning),
                None => imu.missing(&name, meaning),
            });
        }
    };
    let mut assumed = Vec::new();
    let mut sigma =
        |name, most: f64, (usual, unit): (Vector3<f64>, f64), words: &str| match get(name) {
            Some(field) => field.positive_triple_to(most),
            None => {
                assumed.push(words.to_owned());
                Ok(usual / unit)
            }
        };
    let bias = match get("bias") {
        Some(field) => field.triple()?,
        None => Vector3::zeros(),
    };
    let usual_bias = *USUAL_BIAS.get(sensor);
    let scale_sigma = sigma(
        "scale_sigma_ppm",
        WIDEST_SCALE / PPM,
        (Vector3::repeat(USUAL_SCALE), PPM),
        "scale factor ± 5 %",
    )?;
    let installation_sigma = sigma(
        "installation_sigma_arcsec",
        HALF_TURN,
        (Vector3::repeat(USUAL_INSTALLATION), ARCSEC),
        "misalignment ± 2°",
    )?;
    let bias_sigma = sigma(
        "bias_sigma",
        WIDEST_BIAS * nominal.amax(),
        (nominal.abs() * usual_bias, 1.0),
        match sensor {
            Sensor::Gyro => "bias ± 2 °/s",
            Sensor::Accel => "bias ± 1 m/s²",
        },
    )?;
    if !assumed.is_empty() {
        let name = sensor.name();
        notes.push(format!(
            "run.toml does not state everything in [imu.prior.{name}]. turncal assumed (1σ): {}.",
            assumed.join(", ")
        ));
    }
    Ok(TriadKnowledge {
        unit: unit.text()?.to_owned(),
        nominal: Nominal(axes.each(nominal)),
        prior: Prior {
            scale_sigma: axes.each(scale_sigma) * PPM,
            installation_sigma: axes.each(installation_sigma) * ARCSEC,
            bias: axes.vector(bias.component_div(&nominal)),
            bias_sigma: axes.each(bias_sigma.component_div(&nominal.abs())),
        },
    })
}

/// A scale factor is never zero, and where the unit gives it, never far from that.
fn check_scale(
    field: &Field,
    scale: Vector3<f64>,
    unit_scale: Option<f64>,
) -> Result<(), FileError> {
    if scale.iter().any(|&s| s == 0.0) {
        return Err(field.error("no zeros", "Give the data sheet's scale factor."));
    }
    if let Some(unit_scale) = unit_scale
        && scale
            .iter()
            .any(|s| !(0.5..=2.0).contains(&(s.abs() / unit_scale)))
    {
        return Err(field.error(
            format_args!("about {unit_scale}, which this unit says for one rad/s or m/s²"),
            "Correct the scale or the unit, or leave the scale out.",
        ));
    }
    Ok(())
}
