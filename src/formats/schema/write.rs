//! A [`Run`] as a run directory.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use flate2::{Compression, GzBuilder};
use nalgebra::Vector3;
use toml::Spanned;

use super::{
    Angle, FORMAT, Gravity, Height, ImuColumns, ImuFile, Latitude, Longitude, META, Milligals,
    Names, NonNegative, Positive, PriorFile, PriorsFile, RunFile, SegmentsFile, SiteFile,
    StandstillFile, TableColumns, TemperatureColumn, TermFile, TimeColumn, TurntableFile,
};
use crate::calibration::Calibration;
use crate::earth::Site;
use crate::formats::error::{FileError, Place, list, suggestion};
use crate::formats::imu_log::TimeStamp;
use crate::formats::inputs::table_log::LETTERS;
use crate::formats::quantity::units;
use crate::imu::{Instrument, NoiseKeys, Output, Sensor, Term};
use crate::recording::{ImuSamples, Segment, TableLog, nanoseconds};
use crate::run::Run;
use crate::turntable::AxisError;
use crate::units::{ARCSEC, DEGREE, MILLIGAL, PPM};

/// Columns of the angles of a table's axes, outermost first.
const ANGLES: [&str; 3] = ["outer", "middle", "inner"];

/// Writes a run into a directory that is there: `run.toml`, `imu.csv.gz`, `table.csv.gz`,
/// `segments.csv`, `truth.json`.
///
/// [`Run::read`] returns the same run, except for rounding in the last digit, its name (which is the
/// directory's) and its notes. The same run gives the same bytes. `run.instrument.unit` must be a unit of this
/// `output`.
pub fn write_run(
    directory: &Path,
    run: &Run,
    output: Output,
    truth: Option<&Calibration>,
) -> Result<(), FileError> {
    let configuration = directory.join("run.toml");
    check_words(&configuration, run, output)?;
    let write = |name: &str, content: &dyn Fn(&mut dyn Write) -> io::Result<()>| {
        let path = directory.join(name);
        let written = File::create(&path).and_then(|file| write_rows(&path, file, content));
        written.map_err(|error| {
            FileError::io(
                &path,
                "write the file",
                &error,
                "Make room or choose another place.",
            )
        })
    };
    let toml = configuration_text(run, output).map_err(|error| {
        let advice = "Nothing was written.";
        FileError::new(
            &configuration,
            Place::File,
            error,
            "values that TOML can hold",
            advice,
        )
    })?;
    write("run.toml", &|file| file.write_all(toml.as_bytes()))?;
    write("imu.csv.gz", &|file| imu_rows(file, run, output))?;
    if let Some(table) = &run.recording.table {
        write("table.csv.gz", &|file| table_rows(file, run, table))?;
    }
    if !run.recording.segments.is_empty() {
        write("segments.csv", &|file| {
            segment_rows(file, &run.recording.segments)
        })?;
    }
    if let Some(truth) = truth {
        let path = directory.join("truth.json");
        let bytes = truth.to_json(&path)?;
        write("truth.json", &|file| file.write_all(&bytes))?;
    }
    Ok(())
}

/// Units must be of this output, and meta fields among those that [`Run::read`] knows.
fn check_words(configuration: &Path, run: &Run, output: Output) -> Result<(), FileError> {
    for sensor in Sensor::ALL {
        let unit = run.instrument.unit.get(sensor);
        let names = || units(sensor, output).map(|(name, _)| name);
        if !names().any(|name| name == unit) {
            return Err(FileError::new(
                configuration,
                Place::File,
                format_args!("{}_unit = `{unit}` for this output", sensor.name()),
                format_args!("one of {}", list(names())),
                "Change the unit or the output.",
            ));
        }
    }
    let mut fields = run.recording.meta.keys();
    match fields.find(|name| !META.contains(&name.as_str())) {
        Some(name) => Err(FileError::new(
            configuration,
            Place::File,
            format_args!("`{name}` among the meta fields"),
            format_args!("one of {}", list(META)),
            suggestion(name, META, "Rename it."),
        )),
        None => Ok(()),
    }
}

/// Writes rows into a file, compressed if the name ends in `.gz`.
pub fn write_rows(
    name: &Path,
    file: File,
    rows: &dyn Fn(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    if name.extension().is_some_and(|extension| extension == "gz") {
        // No time of writing in the header, so that the same run gives the same bytes.
        let gz = GzBuilder::new()
            .mtime(0)
            .write(file, Compression::default());
        let mut buffer = BufWriter::with_capacity(1 << 16, gz);
        rows(&mut buffer)?;
        buffer.into_inner()?.finish()?;
        Ok(())
    } else {
        let mut buffer = BufWriter::new(file);
        rows(&mut buffer)?;
        buffer.flush()
    }
}

fn imu_rows(file: &mut dyn Write, run: &Run, output: Output) -> io::Result<()> {
    let ImuSamples {
        gyro,
        accel,
        period,
        ..
    } = &run.recording.imu;
    let temperature = run.recording.imu.temperature.as_ref();
    let further = if temperature.is_some() {
        ",temperature"
    } else {
        ""
    };
    writeln!(file, "t,gx,gy,gz,ax,ay,az{further}")?;
    for (k, samples) in gyro.iter().zip(accel.iter()).enumerate() {
        write!(file, "{}", nanoseconds(run.recording.imu.time(k)))?;
        for (sensor, sample) in [(Sensor::Gyro, samples.0), (Sensor::Accel, samples.1)] {
            let quantity = sample.component_mul(&run.instrument.nominal.get(sensor).0);
            for value in &quantity {
                match output {
                    // The addition turns −0 into 0.
                    Output::Pulse => write!(file, ",{}", value.round() + 0.0)?,
                    Output::Increment => write!(file, ",{value:e}")?,
                    Output::Rate => write!(file, ",{:e}", value / period)?,
                }
            }
        }
        if let Some(temperature) = temperature {
            let middle = run.recording.imu.time(k) + 0.5 * period;
            write!(file, ",{:.4}", temperature.at(middle).gyro[0])?;
        }
        writeln!(file)?;
    }
    Ok(())
}

fn table_rows(file: &mut dyn Write, run: &Run, table: &TableLog) -> io::Result<()> {
    let axes = axis_letters(run).map_or(0, |letters| letters.len());
    let angles: String = ANGLES[..axes]
        .iter()
        .map(|name| format!(",{name}"))
        .collect();
    writeln!(file, "t,qw,qx,qy,qz{angles}")?;
    for (row, (&time, q)) in table.time.iter().zip(&table.attitude).enumerate() {
        let time = nanoseconds(time);
        write!(file, "{time},{:e},{:e},{:e},{:e}", q.w, q.i, q.j, q.k)?;
        for (_, angle) in table
            .axes
            .get(row)
            .into_iter()
            .flatten()
            .flatten()
            .take(axes)
        {
            write!(file, ",{:e}", angle / DEGREE)?;
        }
        writeln!(file)?;
    }
    Ok(())
}

/// The axes of a table with stated errors, by their letters in files; `None` if no error is stated, or if an axis has
/// no letter.
fn axis_letters(run: &Run) -> Option<Vec<&'static str>> {
    let stated = AxisError::ALL
        .iter()
        .any(|&kind| run.table.geometry.has(kind));
    let axes = run
        .recording
        .table
        .as_ref()?
        .axes
        .first()
        .filter(|_| stated)?;
    let letter = |(direction, _): &(Vector3<f64>, f64)| {
        let known = LETTERS.iter().find(|(_, known)| known == direction);
        known.map(|(letter, _)| *letter)
    };
    axes.iter().flatten().map(letter).collect()
}

fn segment_rows(file: &mut dyn Write, segments: &[Segment]) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(file);
    csv.write_record(["start", "end", "label"])?;
    for segment in segments {
        let [start, end] = [segment.start, segment.end].map(|time| nanoseconds(time).to_string());
        csv.write_record([&start, &end, &segment.label])?;
    }
    csv.flush()
}

/// A number to fifteen digits: all that a conversion of units leaves true.
fn short(value: f64) -> f64 {
    format!("{value:.14e}").parse().unwrap_or(value)
}

/// A value in a file's unit; `None` if it is not above zero.
fn above_zero(value: f64, unit: f64) -> Option<f64> {
    Some(short(value / unit)).filter(|&value| value > 0.0)
}

/// Comments above tables and fields of `run.toml`.
const COMMENTS: [(&str, &str); 8] = [
    ("[site]", "the place of the turntable"),
    ("[meta]", "carried into calibration and report"),
    (
        "[imu]",
        "the instrument's samples, along body right-front-up",
    ),
    (
        "[imu.prior.gyro]",
        "known before calibration: N = scale * installation * u + bias, N the file's quantity per second",
    ),
    ("[imu.terms", "error terms, 1σ around zero"),
    (
        "[standstill]",
        "how still the IMU is while the table is at rest",
    ),
    (
        "[turntable]",
        "attitude of the table's mounting face, body right-front-up to East-North-Up; position errors are constant while \
         the table stands and new at every position, reading errors are white",
    ),
    ("[segments]", "labelled sections of the record, in s"),
];

fn configuration_text(run: &Run, output: Output) -> Result<String, toml::ser::Error> {
    let mut text = format!("format = \"{FORMAT}\"\n\n");
    for paragraph in toml::to_string(&run_file(run, output))?.split("\n\n") {
        let paragraph = paragraph.trim_end();
        let (table, fields) = paragraph.split_once('\n').unwrap_or((paragraph, ""));
        // Columns are one line of their table, as the line that puts them in order is.
        if table.ends_with(".columns]") {
            let fields: Vec<&str> = fields.lines().collect();
            text.truncate(text.trim_end().len());
            text += &format!("\ncolumns = {{ {} }}\n\n", fields.join(", "));
            continue;
        }
        let comment = COMMENTS.iter().find(|(of, _)| table.starts_with(of));
        if let Some((_, comment)) = comment.filter(|(_, comment)| !text.contains(comment)) {
            text += &format!("# {comment}\n");
        }
        text += &format!("{paragraph}\n\n");
    }
    text.truncate(text.trim_end().len() + 1);
    Ok(text)
}

fn run_file(run: &Run, output: Output) -> RunFile {
    let segments = &run.recording.segments;
    let standstill = &run.standstill;
    RunFile {
        site: site_file(&run.site),
        meta: run.recording.meta.clone(),
        imu: imu_file(run, output),
        standstill: StandstillFile {
            velocity_sigma_m_s: standstill.sigma.accel.map(Positive),
            attitude_sigma_arcsec: (standstill.sigma.gyro).map(|of| Positive(short(of / ARCSEC))),
            turning_deg_per_sqrt_s: above_zero(standstill.turning, DEGREE).map(NonNegative),
            position_sigma_m: Some(Positive(standstill.position_sigma)),
        },
        turntable: run.recording.table.as_ref().map(|_| turntable_file(run)),
        segments: (!segments.is_empty()).then(|| SegmentsFile {
            file: "segments.csv".to_owned(),
            position_sigma_deg: Some(Positive(short(run.segment_sigma / DEGREE))),
        }),
    }
}

fn site_file(site: &Site) -> SiteFile {
    let known = |value: f64| Some(value).filter(|_| site.is_known);
    SiteFile {
        latitude_deg: known(short(site.latitude / DEGREE)).map(Latitude),
        longitude_deg: known(short(site.longitude / DEGREE)).map(Longitude),
        height_m: known(site.height).map(Height),
        gravity_m_s2: Some(Spanned::new(0..0, Gravity(site.gravity))),
        gravity_sigma_mgal: Some(Milligals(short(site.gravity_sigma / MILLIGAL))),
    }
}

fn imu_file(run: &Run, output: Output) -> ImuFile {
    let (imu, instrument) = (&run.recording.imu, &run.instrument);
    let name = str::to_owned;
    let of = |sensor| noise_fields(instrument, sensor);
    let terms = Term::ALL.into_iter().filter_map(|term| {
        let sigma = instrument.term_sigma[term.parameters().start];
        let sigma = Positive(above_zero(sigma, term.entry().unit.1)?);
        Some((name(term.name()), TermFile { sigma }))
    });
    ImuFile {
        file: name("imu.csv.gz"),
        stream: None,
        salvage: None,
        accel_from: None,
        output,
        gyro_unit: Some(instrument.unit.gyro.clone()),
        accel_unit: Some(instrument.unit.accel.clone()),
        gyro_full_scale: None,
        accel_full_scale: None,
        time_unit: None,
        sample_period_s: Some(Positive(imu.period)),
        time_stamp: TimeStamp::Start,
        continuous: Some(imu.continuous),
        instance: None,
        temperature_unit: None,
        body_axes: None,
        columns: ImuColumns {
            time: Some(TimeColumn::One(name("t"))),
            gyro: Some(Names(["gx", "gy", "gz"].map(name))),
            accel: Some(Names(["ax", "ay", "az"].map(name))),
            temperature: (imu.temperature.as_ref())
                .map(|_| TemperatureColumn::One(name("temperature"))),
        },
        noise: Sensor::ALL.into_iter().flat_map(of).collect(),
        prior: PriorsFile {
            gyro: prior_file(instrument, Sensor::Gyro),
            accel: prior_file(instrument, Sensor::Accel),
        },
        terms: terms.collect(),
    }
}

/// The random walk of a triad, and what else is stated of its noise.
fn noise_fields(
    instrument: &Instrument,
    sensor: Sensor,
) -> impl Iterator<Item = (String, NonNegative)> {
    let keys = NoiseKeys::of(sensor);
    let (noise, moves) = (
        instrument.noise.get(sensor),
        instrument.motion_noise.get(sensor),
    );
    let varying = noise.gauss_markov;
    let (walk, (sigma, sigma_unit)) = (keys.random_walk, keys.gauss_markov);
    let (by_duration, unit) = keys.by_duration;
    let fields = [
        (walk.0, Some(short(noise.random_walk / walk.1))),
        (sigma, varying.map(|of| short(of.sigma / sigma_unit))),
        (keys.correlation_time, varying.map(|of| of.correlation_time)),
        (keys.by_motion, above_zero(moves.by_motion, 1.0)),
        (by_duration, above_zero(moves.by_duration, unit)),
    ];
    let stated = fields.into_iter();
    stated.filter_map(|(name, value)| Some((name.to_owned(), NonNegative(value?))))
}

fn prior_file(instrument: &Instrument, sensor: Sensor) -> PriorFile {
    let (prior, nominal) = (
        instrument.prior.get(sensor),
        instrument.nominal.get(sensor).0,
    );
    let three = |v: Vector3<f64>| Some(v.map(short).into());
    PriorFile {
        // All digits, so that pulses stay whole.
        scale: Some(nominal.into()),
        scale_sigma_ppm: three(prior.scale_sigma / PPM),
        installation_sigma_arcsec: three(prior.installation_sigma / ARCSEC),
        bias: three(prior.bias.component_mul(&nominal)),
        bias_sigma: three(prior.bias_sigma.component_mul(&nominal.abs())),
    }
}

fn turntable_file(run: &Run) -> TurntableFile {
    let letters = axis_letters(run);
    let (table, geometry) = (&run.table, &run.table.geometry);
    let owned = |names: &[&str]| {
        names
            .iter()
            .map(|&name| name.to_owned())
            .collect::<Vec<_>>()
    };
    let stated = |sigma: f64| above_zero(sigma, ARCSEC).map(Angle);
    let of_axes = AxisError::ALL.map(|kind| {
        let sigma = stated(geometry.axes.rows_range(kind.range()).max());
        sigma.filter(|_| letters.is_some())
    });
    let [nonorthogonality, wobble, encoder] = of_axes;
    TurntableFile {
        file: "table.csv.gz".to_owned(),
        stream: None,
        salvage: None,
        time_unit: None,
        sample_period_s: None,
        columns: TableColumns {
            time: TimeColumn::One("t".to_owned()),
            quaternion: Some(Names(["qw", "qx", "qy", "qz"].map(str::to_owned))),
            angles: letters
                .as_ref()
                .map(|letters| owned(&ANGLES[..letters.len()])),
            axes: letters.as_deref().map(owned),
        },
        axes: None,
        position_sigma_arcsec: Angle(short(table.position_sigma / ARCSEC)),
        reading_sigma_arcsec: Angle(short(table.reading_sigma / ARCSEC)),
        level_sigma_arcsec: stated(geometry.base.x),
        north_sigma_arcsec: stated(geometry.base.z),
        nonorthogonality_sigma_arcsec: nonorthogonality,
        wobble_sigma_arcsec: wobble,
        encoder_sigma_arcsec: encoder,
        time_sigma_ms: None,
    }
}
