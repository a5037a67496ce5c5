//! A [`Run`] as a run directory.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use flate2::{Compression, GzBuilder};
use nalgebra::Vector3;

use super::error::{FileError, Place, list, suggestion};
use super::quantity::{OUTPUTS, units};
use super::read::{FORMAT, META};
use super::table_log::{AXIS_KEYS, LETTERS};
use crate::calibration::Calibration;
use crate::imu::{MotionNoise, NoiseKeys};
use crate::imu::{Output, Sensor, Term};
use crate::recording::{ImuSamples, Segment, TableLog, nanoseconds};
use crate::run::Run;
use crate::turntable::AxisError;
use crate::units::{ARCSEC, DEG_PER_SQRT_H, DEGREE, MICRO_G_PER_SQRT_HZ, MILLIGAL, PPM};

/// Columns of the angles of a table's axes, outermost first.
const ANGLES: [&str; 3] = ["outer", "middle", "inner"];

/// Writes a run into a directory that is there: `run.toml`, `imu.csv.gz`, `table.csv.gz`,
/// `segments.csv`, `truth.json`.
///
/// [`Run::read`] gives the same run again, but for rounding in the last digit, its name (which is the
/// directory's) and its notes. The same run gives the same bytes. `run.instrument.unit` must be a unit of this
/// `output`.
pub fn write_run(
    directory: &Path,
    run: &Run,
    output: Output,
    truth: Option<&Calibration>,
) -> Result<(), FileError> {
    check_words(&directory.join("run.toml"), run, output)?;
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
    let toml = configuration_text(run, output);
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
        let names = || units(sensor, output).iter().map(|&(name, _)| name);
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
pub(crate) fn write_rows(
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

/// The axes of a table of which errors are stated, as files name them; none where nothing is stated, or they stand
/// otherwise.
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

fn triple(v: Vector3<f64>) -> String {
    let [x, y, z] = [v.x, v.y, v.z].map(short);
    format!("[{x:?}, {y:?}, {z:?}]")
}

fn configuration_text(run: &Run, output: Output) -> String {
    let mut sections = vec![
        site_text(run),
        meta_text(&run.recording.meta),
        imu_text(run, output),
    ];
    sections.extend(
        Sensor::ALL
            .into_iter()
            .filter_map(|sensor| gauss_markov_text(run, sensor)),
    );
    sections.extend(Sensor::ALL.map(|sensor| motion_noise_text(run, sensor)));
    sections.push(
        "\n# known before calibration: N = scale * installation * u + bias, N the file's quantity \
         per second\n"
            .to_owned(),
    );
    sections.extend(Sensor::ALL.map(|sensor| prior_text(run, sensor)));
    sections.extend(terms_text(run));
    sections.push(standstill_text(run));
    if run.recording.table.is_some() {
        sections.push(turntable_text(run));
    }
    if !run.recording.segments.is_empty() {
        sections.push(format!(
            r#"
# labelled sections of the record, in s
[segments]
file = "segments.csv"
position_sigma_deg = {:?}
"#,
            short(run.segment_sigma / DEGREE)
        ));
    }
    sections.concat()
}

/// The format of the file and `[site]`.
fn site_text(run: &Run) -> String {
    let site = &run.site;
    let place = match site.is_known {
        true => format!(
            "latitude_deg = {:?}\nlongitude_deg = {:?}\nheight_m = {:?}\n",
            short(site.latitude / DEGREE),
            short(site.longitude / DEGREE),
            site.height,
        ),
        false => String::new(),
    };
    format!(
        r#"format = "{FORMAT}"

# the place of the turntable
[site]
{place}gravity_m_s2 = {gravity:?}
gravity_sigma_mgal = {gravity_sigma:?}
"#,
        gravity = site.gravity,
        gravity_sigma = short(site.gravity_sigma / MILLIGAL),
    )
}

/// `[imu]`, and the random walks of `[imu.noise]`.
fn imu_text(run: &Run, output: Output) -> String {
    let (output, _) = OUTPUTS
        .into_iter()
        .find(|&(_, known)| known == output)
        .unwrap_or(OUTPUTS[0]);
    let (imu, noise) = (&run.recording.imu, &run.instrument.noise);
    format!(
        r#"
# the instrument's samples, along body right-front-up
[imu]
file = "imu.csv.gz"
output = "{output}"
gyro_unit = {gyro_unit}
accel_unit = {accel_unit}
sample_period_s = {period:?}
time_stamp = "start"
continuous = {continuous}
columns = {{ time = "t", gyro = ["gx", "gy", "gz"], accel = ["ax", "ay", "az"]{temperature} }}

[imu.noise]
angle_random_walk_deg_per_sqrt_h = {angle_walk:?}
velocity_random_walk_ug_per_sqrt_hz = {velocity_walk:?}
"#,
        gyro_unit = quoted(&run.instrument.unit.gyro),
        accel_unit = quoted(&run.instrument.unit.accel),
        period = imu.period,
        continuous = imu.continuous,
        temperature = match imu.temperature {
            Some(_) => ", temperature = \"temperature\"",
            None => "",
        },
        angle_walk = short(noise.gyro.random_walk / DEG_PER_SQRT_H),
        velocity_walk = short(noise.accel.random_walk / MICRO_G_PER_SQRT_HZ),
    )
}

fn gauss_markov_text(run: &Run, sensor: Sensor) -> Option<String> {
    let keys = NoiseKeys::of(sensor);
    let (sigma, unit) = keys.gauss_markov;
    let bias = run.instrument.noise.get(sensor).gauss_markov?;
    Some(format!(
        "{sigma} = {:?}\n{} = {:?}\n",
        short(bias.sigma / unit),
        keys.correlation_time,
        bias.correlation_time
    ))
}

fn motion_noise_text(run: &Run, sensor: Sensor) -> String {
    let keys = NoiseKeys::of(sensor);
    let MotionNoise {
        by_motion,
        by_duration,
    } = *run.instrument.motion_noise.get(sensor);
    let (name, unit) = keys.by_duration;
    [(keys.by_motion, by_motion), (name, by_duration / unit)]
        .into_iter()
        .filter(|&(_, value)| value > 0.0)
        .map(|(name, value)| format!("{name} = {:?}\n", short(value)))
        .collect()
}

fn standstill_text(run: &Run) -> String {
    let mut text = format!(
        "# how still the IMU is while the table is at rest\n[standstill]\nposition_sigma_m = {:?}\n",
        run.standstill.position_sigma
    );
    if let Some(sigma) = run.standstill.sigma.gyro {
        let sigma = short(sigma / ARCSEC);
        text += &format!("attitude_sigma_arcsec = {sigma:?}\n");
    }
    if let Some(sigma) = run.standstill.sigma.accel {
        text += &format!("velocity_sigma_m_s = {sigma:?}\n");
    }
    if run.standstill.turning > 0.0 {
        let turning = short(run.standstill.turning / DEGREE);
        text += &format!("turning_deg_per_sqrt_s = {turning:?}\n");
    }
    text
}

fn turntable_text(run: &Run) -> String {
    let letters = axis_letters(run);
    let mut text = format!(
        r#"
# attitude of the table's mounting face, body right-front-up to East-North-Up
[turntable]
file = "table.csv.gz"
columns = {{ time = "t", quaternion = ["qw", "qx", "qy", "qz"]{angles} }}
position_sigma_arcsec = {position:?}    # constant while the table stands, new at every position
reading_sigma_arcsec = {reading:?}    # white, each reading
"#,
        angles = letters.as_ref().map_or_else(String::new, |letters| format!(
            ", angles = {:?}, axes = {letters:?}",
            &ANGLES[..letters.len()]
        )),
        position = short(run.table.position_sigma / ARCSEC),
        reading = short(run.table.reading_sigma / ARCSEC),
    );
    let geometry = &run.table.geometry;
    let of_base = [
        ("level_sigma_arcsec", geometry.base.x),
        ("north_sigma_arcsec", geometry.base.z),
    ];
    let of_axes = AXIS_KEYS.into_iter().zip(AxisError::ALL);
    let of_axes = of_axes.filter(|_| letters.is_some());
    let of_axes = of_axes.map(|(key, kind)| (key, geometry.axes.rows_range(kind.range()).max()));
    let stated = of_base.into_iter().chain(of_axes);
    for (key, sigma) in stated.filter(|&(_, sigma)| sigma > 0.0) {
        text += &format!("{key} = {:?}\n", short(sigma / ARCSEC));
    }
    text
}

fn prior_text(run: &Run, sensor: Sensor) -> String {
    let (prior, nominal) = (
        run.instrument.prior.get(sensor),
        run.instrument.nominal.get(sensor).0,
    );
    format!(
        r#"[imu.prior.{name}]
scale = [{x:?}, {y:?}, {z:?}]
scale_sigma_ppm = {scale_sigma}
installation_sigma_arcsec = {installation_sigma}
bias = {bias}
bias_sigma = {bias_sigma}

"#,
        name = sensor.name(),
        // All digits, so that pulses stay whole.
        x = nominal.x,
        y = nominal.y,
        z = nominal.z,
        scale_sigma = triple(prior.scale_sigma / PPM),
        installation_sigma = triple(prior.installation_sigma / ARCSEC),
        bias = triple(prior.bias.component_mul(&nominal)),
        bias_sigma = triple(prior.bias_sigma.component_mul(&nominal.abs())),
    )
}

/// `[imu.terms]`, if any is on.
fn terms_text(run: &Run) -> Option<String> {
    let on = Term::ALL.into_iter().filter_map(|term| {
        let sigma = run.instrument.term_sigma[term.parameters().start];
        let (unit, in_si) = term.entry().unit;
        let line = || {
            format!(
                "{} = {{ sigma = {:?} }} # {unit}\n",
                term.name(),
                short(sigma / in_si)
            )
        };
        (sigma > 0.0).then(line)
    });
    let lines: String = on.collect();
    (!lines.is_empty()).then(|| format!("# error terms, 1σ around zero\n[imu.terms]\n{lines}\n"))
}

fn meta_text(meta: &BTreeMap<String, String>) -> String {
    if meta.is_empty() {
        return String::new();
    }
    let fields: String = meta
        .iter()
        .map(|(name, value)| format!("{name} = {}\n", quoted(value)))
        .collect();
    format!("\n# carried into calibration and report\n[meta]\n{fields}")
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}
