//! A [`Run`] as a run directory.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use flate2::{Compression, GzBuilder};
use nalgebra::Vector3;
use toml::Value;

use super::page::Page;
use super::read::check;
use super::{AXIS_ERRORS, Document, FORMAT};
use crate::calibration::Calibration;
use crate::formats::error::FileError;
use crate::formats::inputs::table_log::LETTERS;
use crate::formats::quantity::output_word;
use crate::imu::{NoiseKeys, Output, Sensor, Term};
use crate::recording::{ImuSamples, Segment, TableLog, nanoseconds};
use crate::run::Run;
use crate::turntable::AxisError;
use crate::units::{ARCSEC, DEGREE, MILLIGAL, PPM};

/// Columns of the table axis angles, outermost first.
const ANGLES: [&str; 3] = ["outer", "middle", "inner"];

/// Writes a run into an existing directory: `run.toml`, `imu.csv.gz`, `table.csv.gz`, `segments.csv`, `truth.json`.
///
/// [`Run::read`] returns the same run, except for rounding in the last digit, its name (that of the directory) and its
/// notes. The same run gives the same bytes. `run.instrument.unit` must be a unit of this `output`.
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
    let toml = configuration_text(run, output);
    check(Document::of(&configuration, &toml))?;
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

/// Writes rows into a file, compressed if the name ends in `.gz`.
pub fn write_rows(
    name: &Path,
    file: File,
    rows: impl FnOnce(&mut dyn Write) -> io::Result<()>,
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

/// A number to fifteen digits, the accuracy of a unit conversion.
fn short(value: f64) -> f64 {
    format!("{value:.14e}").parse().unwrap_or(value)
}

/// A value in the unit of the file; `None` if it is not above zero.
fn above_zero(value: f64, unit: f64) -> Option<f64> {
    Some(short(value / unit)).filter(|&value| value > 0.0)
}

fn configuration_text(run: &Run, output: Output) -> String {
    let mut page = Page::of(FORMAT, "");
    let site = &run.site;
    page.table("site", "location of the turntable");
    let known = |value: f64| Some(value).filter(|_| site.is_known);
    page.known("latitude_deg", known(short(site.latitude / DEGREE)));
    page.known("longitude_deg", known(short(site.longitude / DEGREE)));
    page.known("height_m", known(site.height));
    page.field("gravity_m_s2", site.gravity);
    page.field("gravity_sigma_mgal", short(site.gravity_sigma / MILLIGAL));
    if !run.recording.meta.is_empty() {
        page.table("meta", "copied into calibration and report");
    }
    for (key, value) in &run.recording.meta {
        page.field(key, value.as_str());
    }
    imu(&mut page, run, output);
    page.table("standstill", "motion of the IMU while the table is at rest");
    let of = &run.standstill;
    let attitude = of.sigma.gyro.map(|sigma| short(sigma / ARCSEC));
    page.known("velocity_sigma_m_s", of.sigma.accel);
    page.known("attitude_sigma_arcsec", attitude);
    page.known("turning_deg_per_sqrt_s", above_zero(of.turning, DEGREE));
    page.field("position_sigma_m", of.position_sigma);
    if run.recording.table.is_some() {
        turntable(&mut page, run);
    }
    if !run.recording.segments.is_empty() {
        page.table("segments", "labelled sections of the recording, in s");
        page.field("file", "segments.csv");
        page.field("position_sigma_deg", short(run.segment_sigma / DEGREE));
    }
    page.text
}

fn imu(page: &mut Page, run: &Run, output: Output) {
    let (imu, instrument) = (&run.recording.imu, &run.instrument);
    page.table("imu", "instrument samples along body right-front-up");
    page.field("file", "imu.csv.gz");
    page.field("output", output_word(output));
    page.field("gyro_unit", instrument.unit.gyro.as_str());
    page.field("accel_unit", instrument.unit.accel.as_str());
    page.field("sample_period_s", imu.period);
    page.field("time_stamp", "start");
    page.field("continuous", imu.continuous);
    let temperature = match &imu.temperature {
        Some(_) => ", temperature = \"temperature\"",
        None => "",
    };
    let triads = r#"gyro = ["gx", "gy", "gz"], accel = ["ax", "ay", "az"]"#;
    let columns = format_args!("{{ time = \"t\", {triads}{temperature} }}");
    page.plain("columns", columns);
    page.table("imu.noise", "");
    for sensor in Sensor::ALL {
        let (keys, noise) = (NoiseKeys::of(sensor), instrument.noise.get(sensor));
        let (varying, moves) = (noise.gauss_markov, instrument.motion_noise.get(sensor));
        let time = varying.map(|of| of.correlation_time);
        let ((walk, of_walk), (sigma, of_sigma)) = (keys.random_walk, keys.gauss_markov);
        page.field(walk, short(noise.random_walk / of_walk));
        page.known(sigma, varying.map(|of| short(of.sigma / of_sigma)));
        page.known(keys.correlation_time, time);
        page.known(keys.by_motion, above_zero(moves.by_motion, 1.0));
        let (by_duration, unit) = keys.by_duration;
        page.known(by_duration, above_zero(moves.by_duration, unit));
    }
    let known = "known before calibration: N = scale * installation * u + bias, with N in the file's quantity per \
        second";
    for (sensor, remark) in [(Sensor::Gyro, known), (Sensor::Accel, "")] {
        let prior = instrument.prior.get(sensor);
        let nominal = instrument.nominal.get(sensor).0;
        let three = |v: Vector3<f64>| Value::from(v.map(short).as_slice().to_vec());
        page.table(&format!("imu.prior.{}", sensor.name()), remark);
        // All digits, so that pulses stay whole.
        page.field("scale", nominal.as_slice().to_vec());
        page.field("scale_sigma_ppm", three(prior.scale_sigma / PPM));
        let installation = three(prior.installation_sigma / ARCSEC);
        page.field("installation_sigma_arcsec", installation);
        page.field("bias", three(prior.bias.component_mul(&nominal)));
        let sigma = prior.bias_sigma.component_mul(&nominal.abs());
        page.field("bias_sigma", three(sigma));
    }
    let mut remark = "error terms, 1σ around zero";
    for term in Term::ALL {
        let sigma = instrument.term_sigma[term.parameters().start];
        if let Some(sigma) = above_zero(sigma, term.entry().unit.1) {
            page.table(&format!("imu.terms.{}", term.name()), remark);
            page.field("sigma", sigma);
            remark = "";
        }
    }
}

fn turntable(page: &mut Page, run: &Run) {
    let (table, geometry) = (&run.table, &run.table.geometry);
    page.table(
        "turntable",
        "attitude of the table's mounting face, body right-front-up to East-North-Up; position errors are constant \
         in a dwell and independent between dwells, reading errors are white",
    );
    let sigma = |sigma: f64| above_zero(sigma, ARCSEC);
    page.field("file", "table.csv.gz");
    page.field(
        "position_sigma_arcsec",
        short(table.position_sigma / ARCSEC),
    );
    page.field("reading_sigma_arcsec", short(table.reading_sigma / ARCSEC));
    page.known("level_sigma_arcsec", sigma(geometry.base.x));
    page.known("north_sigma_arcsec", sigma(geometry.base.z));
    let mut columns = r#"time = "t", quaternion = ["qw", "qx", "qy", "qz"]"#.to_owned();
    if let Some(letters) = axis_letters(run) {
        for (kind, key) in AxisError::ALL.into_iter().zip(AXIS_ERRORS) {
            page.known(key, sigma(geometry.axes.rows_range(kind.range()).max()));
        }
        let angles = Value::from(ANGLES[..letters.len()].to_vec());
        columns += &format!(", angles = {angles}, axes = {}", Value::from(letters));
    }
    page.plain("columns", format_args!("{{ {columns} }}"));
}
