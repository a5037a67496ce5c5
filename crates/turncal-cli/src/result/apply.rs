//! `turncal apply`

use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::error::ErrorKind;

use crate::arguments::{OfLog, keep, run_or_log, usable};
use crate::terminal::{Activity, stream};
use turncal::calibration::result::{Calibration, MagRecord};
use turncal::calibration::{Correction, TEMPERATURE_TOLERANCE, ThermalRecord};
use turncal::imu::{Sensor, Term};
use turncal::number::{count, rounded};
use turncal::recording::Magnetometer;
use turncal::run::Run;
use turncal::units::PPM;
use turncal_files::export::{FieldSamples, Samples};
use turncal_report::terminal::printable;

/// A scale factor that differs by more than this many prior σ probably belongs to another instrument.
const SUSPECT_SIGMAS: f64 = 10.0;

/// Converts the raw samples of a run to angular rate and specific force
///
/// Writes one row per sample: start and end in s, angular rate in rad/s and specific force in m/s², both averaged over
/// the sample, along the right, forward and up axes of the body frame of the calibration. Also corrects the data for
/// the error terms of the calibration and, if the run contains temperatures, for the temperature dependence. The
/// correction for the time offset neglects Earth rate. If calibration and run have a magnetometer, its columns contain
/// the field as means over 0.1 s, each in the row that contains the middle of the 0.1 s; the other rows are empty. The name of the last column states the verdict of the
/// calibration, for example verdict_good; the column contains 1 in every row. You can use the output as the log of
/// another run.toml with output = "rate" and time_stamp = "end".
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  turncal apply result/calibration.json run.toml -o calibrated.csv.gz
  turncal apply result/calibration.json run.toml | head")]
pub struct Apply {
    /// The calibration
    #[arg(value_name = "CALIBRATION.json")]
    calibration: PathBuf,
    /// A run.toml, a log, or - for text on standard input
    #[arg(value_name = "RUN.toml|LOG", value_parser = run_or_log)]
    run: PathBuf,
    #[command(flatten)]
    of_log: OfLog,
    /// File to write, `.csv` or `.csv.gz` [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Interpolate missing rows and mark them with 1 in a column `filled`; gaps that are too long for calibrate to
    /// bridge are not filled
    #[arg(long)]
    fill: bool,
    /// Replace an existing output file, and apply a calibration even if its verdict is FAILED
    #[arg(long)]
    force: bool,
}

impl Apply {
    pub fn run(&self) -> anyhow::Result<()> {
        self.check_output();
        let record = usable(&self.calibration, None, self.force)?;
        let activity = Activity::new(format!("reading {}", self.run.display()));
        let run = self.of_log.open_any(&self.run)?.run;
        if record.is_of_magnetometer() || run.is_of_magnetometer() {
            drop(activity);
            return self.magnetometer(&record, &run);
        }
        let correction = Correction::for_run(&record, &run)
            .with_context(|| format!("{}, {}", self.calibration.display(), self.run.display()))?;
        let lost: usize = run.recording.imu.lost().iter().map(Range::len).sum();
        if let Some(missing) = run.recording.imu.missing().next().filter(|_| self.fill) {
            bail!(
                "{}: {} rows are missing from {:.3} s on, which is too many to interpolate. Omit --fill, or split the log at this gap",
                self.run.display(),
                missing.len(),
                run.recording.imu.time(missing.start)
            );
        }
        activity.next("writing");
        let samples = Samples {
            run: &run,
            correction: &correction,
            fill: self.fill,
            magnetometer: magnetometer(&record, &run).map(|(of, _)| of),
            verdict: record.word(),
        };
        match self.kept(&run)? {
            Some(output) => samples.write(output, self.force)?,
            None => stream(|rows| samples.rows(rows))?,
        }
        drop(activity);
        tell!(
            "wrote {} rows ({} Hz){}. Axes: x right, y front, z up; body frame: {}",
            count(run.recording.imu.len() - if self.fill { 0 } else { lost }),
            rounded(run.recording.imu.period.recip(), 6),
            match (lost, self.fill) {
                (0, _) => String::new(),
                (lost, true) =>
                    format!(", of which {lost} were missing in the log and interpolated"),
                (lost, false) => format!(
                    "; {lost} rows missing in the log were skipped (--fill interpolates them)"
                ),
            },
            record.body_frame.words()
        );
        for note in notes(&record, &correction, &run) {
            tell!("note: {}", printable(&note));
        }
        Ok(())
    }

    /// Writes the field of the magnetometer, one row per value.
    fn magnetometer(&self, record: &Calibration, run: &Run) -> anyhow::Result<()> {
        let Some((mag, log)) = magnetometer(record, run) else {
            let other = other_magnetometer(record, run);
            let other =
                other.unwrap_or_else(|| "calibration or log has no magnetometer".to_owned());
            bail!(
                "{}, {}: {other}",
                self.calibration.display(),
                self.run.display()
            );
        };
        let samples = FieldSamples {
            mag,
            log,
            verdict: record.word(),
        };
        match self.kept(run)? {
            Some(output) => samples.write(output, self.force)?,
            None => stream(|rows| samples.rows(rows))?,
        }
        tell!(
            "wrote the corrected field of {} values",
            count(log.values().count())
        );
        Ok(())
    }

    /// The output file, if any; no input may have its name.
    fn kept(&self, run: &Run) -> anyhow::Result<Option<&Path>> {
        let Some(output) = &self.output else {
            return Ok(None);
        };
        let inputs = run.recording.files.iter().chain([&self.calibration]);
        keep(output, inputs)?;
        Ok(Some(output))
    }

    /// Exits if the output does not have the name of a CSV file.
    fn check_output(&self) {
        if let Some(output) = &self.output {
            let name = output.to_string_lossy();
            if !(name.ends_with(".csv") || name.ends_with(".csv.gz")) {
                let message = format!(
                    "-o {name}: the output is CSV; give a name that ends in .csv, or in .csv.gz for compression\n"
                );
                clap::Error::raw(ErrorKind::ValueValidation, message).exit();
            }
        }
    }
}

/// The calibration of a magnetometer and its values in a run, if both are in one unit.
fn magnetometer<'a>(
    record: &'a Calibration,
    run: &'a Run,
) -> Option<(&'a MagRecord, &'a Magnetometer)> {
    let both = record.mag.as_ref().zip(run.recording.magnetometer.as_ref());
    both.filter(|(mag, log)| mag.unit == log.unit)
}

/// Remark on a magnetometer in another unit than that of the calibration.
fn other_magnetometer(record: &Calibration, run: &Run) -> Option<String> {
    let (own, log) = record
        .mag
        .as_ref()
        .zip(run.recording.magnetometer.as_ref())?;
    let (own, other) = (&own.unit, &log.unit);
    (own != other).then(|| {
        format!(
            "the magnetometer was calibrated in {own}, but the run has {other}: turncal left it out; set mag_unit in \
             run.toml to {own}"
        )
    })
}

fn notes(record: &Calibration, correction: &Correction, run: &Run) -> Vec<String> {
    let mut notes = Vec::new();
    let kept: Vec<&str> = record.undetermined().map(String::as_str).collect();
    if !kept.is_empty() {
        let names = kept.join(", ");
        notes.push(format!(
            "the calibration did not determine {names}: they keep their prior values"
        ));
    }
    if record.unit.is_none() {
        notes.push(
            "the calibration does not state units, so turncal assumed the units of the run"
                .to_owned(),
        );
    }
    notes.extend(other_magnetometer(record, run));
    for sensor in Sensor::ALL {
        let scale = correction.sensitivity.get(sensor).diagonal();
        let off = scale
            .component_div(&run.instrument.nominal.get(sensor).0)
            .add_scalar(-1.0);
        let sigmas = off
            .abs()
            .component_div(&run.instrument.prior.get(sensor).scale_sigma);
        if sigmas.max() > SUSPECT_SIGMAS {
            notes.push(format!(
                "{} scale factors differ from the nominal values of the run by up to {:.0} ppm, which is {:.0} times \
                 the 1σ in [imu.prior.{0}]. Check that this calibration belongs to this instrument",
                sensor.name(),
                off.amax() / PPM,
                sigmas.max()
            ));
        }
    }
    if let Some(thermal) = &record.temperature {
        notes.extend(of_temperature(thermal, run));
    }
    if correction.has(Term::TimeOffset) {
        notes.push(
            "the correction for the accelerometer time offset neglects Earth rate".to_owned(),
        );
    }
    if correction.has(Term::SizeEffect) && !run.recording.imu.continuous {
        notes.push(
            "the recording is not continuous, so the part of the size effect that depends on angular acceleration is \
             not corrected"
                .to_owned(),
        );
    }
    notes
}

/// Prints a note if the temperature of the run is unknown or outside the range of the calibration.
fn of_temperature(thermal: &ThermalRecord, run: &Run) -> Vec<String> {
    let Some(temperature) = &run.recording.imu.temperature else {
        return vec![format!(
            "the calibration depends on temperature, but the run has none: all rows are corrected for {} °C, and their \
             column in_range is 0",
            thermal.range.gyro.reference
        )];
    };
    let beyond = Sensor::ALL.into_iter().filter_map(|sensor| {
        let ([lowest, highest], range) = (temperature.range(sensor), thermal.range.get(sensor));
        let is_beyond = lowest < range.lowest - TEMPERATURE_TOLERANCE
            || highest > range.highest + TEMPERATURE_TOLERANCE;
        is_beyond.then(|| {
            format!(
                "{}: the temperatures of the run are {lowest:.1} to {highest:.1} °C, but the calibration is valid \
                 only from {:.1} to {:.1} °C; in rows outside this range, the column in_range is 0",
                sensor.name(),
                range.lowest,
                range.highest
            )
        })
    });
    beyond.collect()
}
