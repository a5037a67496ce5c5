//! Writes a [`Run`] as a run directory.

use super::calibration_json;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use flate2::{Compression, GzBuilder};
use nalgebra::Vector3;

use super::page::{self, Remarks};
use super::read::check;
use super::run::{
    ImuColumns, ImuFile, PriorFile, PriorsFile, SegmentsFile, SiteFile, StandstillFile,
    TableColumns, TemperatureColumn, TimeColumn, TurntableFile,
};
use super::words::{Names, TimeStamp};
use super::{FORMAT, RunFile};
use crate::inputs::table_log::LETTERS;
use turncal::calibration::Calibration;
use turncal::imu::{Instrument, NoiseKeys, Output, Sensor, Term};
use turncal::models::TermFile;
use turncal::number::rounded;
use turncal::recording::{Segment, TableLog, nanoseconds};
use turncal::run::Run;
use turncal::turntable::AxisError;
use turncal::units::{ARCSEC, DEGREE, MILLIGAL, PPM};
use turncal_input::{
    Angle, Document, FileError, Gravity, Height, Latitude, Longitude, Milligals, NonNegative,
    Positive,
};

/// Columns of the table axis angles, outermost first.
const ANGLES: [&str; 3] = ["outer", "middle", "inner"];

/// Writes a run into an existing directory: `run.toml`, `imu.csv.gz`, `table.csv.gz`, `segments.csv`, `truth.json`.
///
/// [`crate::read_run`] returns the same run, except for rounding in the last digit, the name (which becomes that of the
/// directory) and the notes. The same run always gives the same bytes. `run.instrument.unit` must be a unit of this
/// `output`.
pub fn write_run(
    directory: &Path,
    run: &Run,
    output: Output,
    truth: Option<&Calibration>,
) -> Result<(), FileError> {
    let configuration = directory.join("run.toml");
    let write = |name: &str, content: &dyn Fn(&mut dyn Write) -> io::Result<()>| {
        let path = directory.join(name);
        let written = File::create(&path).and_then(|file| write_rows(&path, file, content));
        written.map_err(|error| FileError::unwritten(&path, &error))
    };
    let toml = page::text(FORMAT, &run_file(run, output), &remarks(run));
    check(Document::of(&configuration, &toml))?;
    write("run.toml", &|file| file.write_all(toml.as_bytes()))?;
    write("imu.csv.gz", &|file| imu_rows(file, run, output))?;
    if let Some(table) = &run.recording.table {
        write("table.csv.gz", &|file| table_rows(file, run, table))?;
    }
    if !run.recording.segments.is_empty() {
        let segments = &run.recording.segments;
        write("segments.csv", &|file| segment_rows(file, segments))?;
    }
    if let Some(truth) = truth {
        let path = directory.join("truth.json");
        let bytes = calibration_json(truth, &path)?;
        write("truth.json", &|file| file.write_all(&bytes))?;
    }
    Ok(())
}

/// Writes rows into a file, compressed if the name ends in `.gz`.
pub fn write_rows(
    name: &Path,
    file: File,
    rows: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    if name.extension().is_some_and(|extension| extension == "gz") {
        // The header contains no time of writing, so that the same run gives the same bytes.
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
    let imu = &run.recording.imu;
    let (period, temperature) = (imu.period, imu.temperature.as_ref());
    let further = temperature.map_or("", |_| ",temperature");
    let mut mag = run
        .recording
        .magnetometer
        .as_ref()
        .map(|of| of.values().peekable());
    let columns = mag.as_ref().map_or("", |_| ",mx,my,mz");
    writeln!(file, "t,gx,gy,gz,ax,ay,az{further}{columns}")?;
    for (k, samples) in imu.gyro.iter().zip(imu.accel.iter()).enumerate() {
        write!(file, "{}", nanoseconds(imu.time(k)))?;
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
            let middle = imu.time(k) + 0.5 * period;
            write!(file, ",{:.4}", temperature.at(middle).gyro[0])?;
        }
        if let Some(mag) = &mut mag {
            // Each value is in the row of its time; the other rows have none.
            match mag.next_if(|(time, _)| *time < imu.time(k) + 0.5 * period) {
                Some((_, v)) => write!(file, ",{:e},{:e},{:e}", v.x, v.y, v.z)?,
                None => write!(file, ",,,")?,
            }
        }
        writeln!(file)?;
    }
    Ok(())
}

fn table_rows(file: &mut dyn Write, run: &Run, table: &TableLog) -> io::Result<()> {
    let axes = axis_letters(run).map_or(0, |letters| letters.len());
    let columns = [&["t", "qw", "qx", "qy", "qz"], &ANGLES[..axes]].concat();
    writeln!(file, "{}", columns.join(","))?;
    for (row, (&time, q)) in table.time.iter().zip(&table.attitude).enumerate() {
        let time = nanoseconds(time);
        write!(file, "{time},{:e},{:e},{:e},{:e}", q.w, q.i, q.j, q.k)?;
        let angles = table.axes.get(row).into_iter().flatten().flatten();
        for (_, angle) in angles.take(axes) {
            write!(file, ",{:e}", angle / DEGREE)?;
        }
        writeln!(file)?;
    }
    Ok(())
}

/// The axes of a table with stated errors, by their letters in files; `None` if no error is stated, or if an axis has
/// no letter.
fn axis_letters(run: &Run) -> Option<Vec<&'static str>> {
    let is_stated = |&kind: &AxisError| run.table.geometry.has(kind);
    let axes = run.recording.table.as_ref()?.axes.first()?;
    if !AxisError::ALL.iter().any(is_stated) {
        return None;
    }
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

/// A value in the unit of the file, to fifteen digits: the accuracy of a conversion.
fn in_unit(value: f64, unit: f64) -> f64 {
    rounded(value / unit, 15)
}

/// A value in the unit of the file; `None` if it is not above zero.
fn above_zero(value: f64, unit: f64) -> Option<f64> {
    Some(in_unit(value, unit)).filter(|&value| value > 0.0)
}

fn run_file(run: &Run, output: Output) -> RunFile {
    let (site, standstill) = (&run.site, &run.standstill);
    let known = |value: f64| Some(value).filter(|_| site.is_known);
    let segments = || SegmentsFile {
        file: "segments.csv".to_owned(),
        position_sigma_deg: Some(Positive(in_unit(run.segment_sigma, DEGREE))),
    };
    RunFile {
        site: SiteFile {
            latitude_deg: known(in_unit(site.latitude, DEGREE)).map(Latitude),
            longitude_deg: known(in_unit(site.longitude, DEGREE)).map(Longitude),
            height_m: known(site.height).map(Height),
            gravity_m_s2: Some(Gravity(site.gravity)),
            gravity_sigma_mgal: Some(Milligals(in_unit(site.gravity_sigma, MILLIGAL))),
        },
        meta: run.recording.meta.clone(),
        imu: imu_file(run, output),
        standstill: StandstillFile {
            velocity_sigma_m_s: standstill.sigma.accel.map(Positive),
            attitude_sigma_arcsec: (standstill.sigma.gyro)
                .map(|sigma| Positive(in_unit(sigma, ARCSEC))),
            turning_deg_per_sqrt_s: above_zero(standstill.turning, DEGREE).map(NonNegative),
            position_sigma_m: Some(Positive(standstill.position_sigma)),
        },
        turntable: run.recording.table.as_ref().map(|_| turntable_file(run)),
        segments: (!run.recording.segments.is_empty()).then(segments),
    }
}

fn imu_file(run: &Run, output: Output) -> ImuFile {
    let (imu, instrument) = (&run.recording.imu, &run.instrument);
    let names = |names: [&str; 3]| Some(Names(names.map(str::to_owned)));
    let temperature = || TemperatureColumn::One("temperature".to_owned());
    let terms = Term::ALL.into_iter().filter_map(|term| {
        let sigma = instrument.term_sigma[term.parameters().start];
        let is_absent = instrument.absent_terms.contains(&term);
        let sigma = above_zero(sigma, term.entry().unit.1).or(is_absent.then_some(0.0))?;
        let sigma = NonNegative(sigma);
        Some((term.name().to_owned(), TermFile { sigma }))
    });
    ImuFile {
        file: "imu.csv.gz".to_owned(),
        output,
        gyro_unit: Some(instrument.unit.gyro.clone()),
        accel_unit: Some(instrument.unit.accel.clone()),
        mag_unit: run
            .recording
            .magnetometer
            .as_ref()
            .map(|of| of.unit.clone()),
        sample_period_s: Some(Positive(imu.period)),
        time_stamp: TimeStamp::Start,
        continuous: Some(imu.continuous),
        columns: ImuColumns {
            time: Some(TimeColumn::One("t".to_owned())),
            gyro: names(["gx", "gy", "gz"]),
            accel: names(["ax", "ay", "az"]),
            mag: run
                .recording
                .magnetometer
                .as_ref()
                .and_then(|_| names(["mx", "my", "mz"])),
            temperature: imu.temperature.as_ref().map(|_| temperature()),
        },
        noise: noise_fields(instrument),
        prior: PriorsFile {
            gyro: prior_file(instrument, Sensor::Gyro),
            accel: prior_file(instrument, Sensor::Accel),
        },
        terms: terms.collect(),
        ..ImuFile::default()
    }
}

fn noise_fields(instrument: &Instrument) -> BTreeMap<String, Option<NonNegative>> {
    let mut fields = BTreeMap::new();
    for sensor in Sensor::ALL {
        let (keys, noise) = (NoiseKeys::of(sensor), instrument.noise.get(sensor));
        let moves = instrument.motion_noise.get(sensor);
        let ((walk, of_walk), (sigma, of_sigma)) = (keys.random_walk, keys.gauss_markov);
        let (by_duration, of_duration) = keys.by_duration;
        let bias = noise.gauss_markov;
        for (key, value) in [
            (walk, Some(in_unit(noise.random_walk, of_walk))),
            (sigma, bias.map(|bias| in_unit(bias.sigma, of_sigma))),
            (keys.correlation_time, bias.map(|of| of.correlation_time)),
            (keys.by_motion, above_zero(moves.by_motion, 1.0)),
            (by_duration, above_zero(moves.by_duration, of_duration)),
        ] {
            fields.insert(key.to_owned(), value.map(NonNegative));
        }
    }
    fields
}

fn prior_file(instrument: &Instrument, sensor: Sensor) -> PriorFile {
    let prior = instrument.prior.get(sensor);
    let nominal = instrument.nominal.get(sensor).0;
    let in_unit = |values: Vector3<f64>, unit: f64| Some(values.map(|v| in_unit(v, unit)).into());
    PriorFile {
        // All digits, so that pulses stay whole.
        scale: Some(nominal.into()),
        scale_sigma_ppm: in_unit(prior.scale_sigma, PPM),
        installation_sigma_arcsec: in_unit(prior.installation_sigma, ARCSEC),
        bias: in_unit(prior.bias.component_mul(&nominal), 1.0),
        bias_sigma: in_unit(prior.bias_sigma.component_mul(&nominal.abs()), 1.0),
    }
}

fn turntable_file(run: &Run) -> TurntableFile {
    let (table, geometry) = (&run.table, &run.table.geometry);
    let letters = axis_letters(run);
    let owned = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
    let angle = |sigma: f64| above_zero(sigma, ARCSEC).map(Angle);
    let of_axes = |kind: AxisError| {
        letters.as_ref()?;
        angle(geometry.axes.rows_range(kind.range()).max())
    };
    TurntableFile {
        file: "table.csv.gz".to_owned(),
        stream: None,
        salvage: None,
        time_unit: None,
        sample_period_s: None,
        columns: TableColumns {
            time: TimeColumn::One("t".to_owned()),
            quaternion: Some(Names(["qw", "qx", "qy", "qz"].map(str::to_owned))),
            angles: (letters.as_ref()).map(|letters| owned(&ANGLES[..letters.len()])),
            axes: letters.as_deref().map(owned),
        },
        axes: None,
        position_sigma_arcsec: Angle(in_unit(table.position_sigma, ARCSEC)),
        reading_sigma_arcsec: Angle(in_unit(table.reading_sigma, ARCSEC)),
        settling_sigma_arcsec: angle(table.settling_sigma),
        level_sigma_arcsec: angle(geometry.base.x),
        north_sigma_arcsec: angle(geometry.base.z),
        nonorthogonality_sigma_arcsec: of_axes(AxisError::Tilt),
        wobble_sigma_arcsec: of_axes(AxisError::Wobble),
        encoder_sigma_arcsec: of_axes(AxisError::Encoder),
        time_sigma_ms: None,
    }
}

fn remarks(run: &Run) -> Remarks {
    let mut remarks = Remarks::default();
    remarks.before(
        "imu",
        "samples of the instrument along the body axes right, front, up",
    );
    remarks.before(
        "imu.prior.gyro",
        "known before calibration: N = scale * installation * u + bias, with N in the file's quantity per second",
    );
    if run.recording.table.is_some() {
        remarks.before(
            "turntable",
            "attitude of the table's mounting face, body right-front-up to East-North-Up; position errors are \
             constant in a dwell and independent between dwells, reading errors are white",
        );
    }
    remarks
}
