//! The instrument's samples.

use std::path::{Path, PathBuf};

use nalgebra::Vector3;

use super::axes::BodyAxes;
use super::csv_file::CsvFile;
use super::error::{Place, RunError};
use super::{ImuRecord, nanoseconds};
use crate::imu::{Nominal, Output, PerSensor, Sensor};

/// Fewer samples than this are no record of a turntable: not one dwell can be told from a turn.
const FEWEST_SAMPLES: usize = 100;

/// Which moment of a sample its time stamp names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TimeStamp {
    Start,
    Middle,
    End,
}

impl TimeStamp {
    /// The words for it in `run.toml`.
    pub const WORDS: [(&'static str, Self); 3] = [
        ("end", Self::End),
        ("start", Self::Start),
        ("middle", Self::Middle),
    ];

    /// From the begin of a sample to its stamp, in samples.
    fn lag(self) -> f64 {
        match self {
            Self::Start => 0.0,
            Self::Middle => 0.5,
            Self::End => 1.0,
        }
    }
}

/// What `run.toml` says of the file.
pub(super) struct ImuLog<'a> {
    pub file: PathBuf,
    pub time: &'a str,
    pub triads: PerSensor<[&'a str; 3]>,
    pub temperature: Option<&'a str>,
    pub output: Output,
    pub axes: BodyAxes,
    pub stamp: TimeStamp,
    pub period: Option<f64>,
    pub continuous: bool,
    /// Along right-front-up.
    pub nominal: PerSensor<Nominal>,
}

impl ImuLog<'_> {
    /// Reads the samples.
    pub fn read(&self) -> Result<ImuRecord, RunError> {
        let mut csv = CsvFile::open(&self.file)?;
        let time = csv.column(self.time)?;
        let mut triads = PerSensor::from_fn(|_| [0; 3]);
        for sensor in Sensor::ALL {
            for (index, name) in triads
                .get_mut(sensor)
                .iter_mut()
                .zip(self.triads.get(sensor))
            {
                *index = csv.column(name)?;
            }
        }
        let temperature = self.temperature.map(|name| csv.column(name)).transpose()?;

        let mut stamps = Vec::new();
        let mut samples = PerSensor::from_fn(|_| Vec::new());
        while csv.advance()? {
            let before = stamps.last().map(|&(stamp, _)| stamp);
            stamps.push((csv.time(time, before)?, csv.line()));
            for sensor in Sensor::ALL {
                samples
                    .get_mut(sensor)
                    .push(self.sample(&csv, triads.get(sensor))?);
            }
            if let Some(column) = temperature {
                csv.number(column)?;
            }
        }
        if stamps.len() < FEWEST_SAMPLES {
            return Err(csv.error(
                format_args!("{} samples", stamps.len()),
                format_args!("at least {FEWEST_SAMPLES}"),
                "Record a run with dwells and turns.",
            ));
        }

        let (first, period) = uniform_time(&self.file, &stamps, self.period)?;
        let seconds = match self.output {
            Output::Pulse | Output::Increment => 1.0,
            Output::Rate => period,
        };
        for sensor in Sensor::ALL {
            let nominal = self.nominal.get(sensor).0;
            for sample in samples.get_mut(sensor) {
                *sample = (*sample * seconds).component_div(&nominal);
            }
        }
        let pulse = PerSensor::from_fn(|sensor| match self.output {
            Output::Pulse => self.nominal.get(sensor).0.map(|n| n.abs().recip()).mean(),
            Output::Increment | Output::Rate => 0.0,
        });
        Ok(ImuRecord {
            start: first - self.stamp.lag() * period,
            period,
            continuous: self.continuous,
            gyro: samples.gyro,
            accel: samples.accel,
            pulse,
            faults: Vec::new(),
            bridges: Vec::new(),
            log: None,
        })
    }

    /// A triad's numbers in a row, as they stand but along right-front-up.
    fn sample(&self, csv: &CsvFile, columns: &[usize; 3]) -> Result<Vector3<f64>, RunError> {
        let mut sample = Vector3::zeros();
        for (entry, &column) in sample.iter_mut().zip(columns) {
            *entry = csv.number(column)?;
            if self.output == Output::Pulse && entry.fract() != 0.0 {
                return Err(csv.not(
                    column,
                    "a whole number of pulses, or output = \"increment\" in run.toml",
                ));
            }
        }
        Ok(self.axes.vector(sample))
    }
}

/// The first stamp and the period of increasing stamps that are printed rounded but belong to samples of equal
/// length. There must be at least two.
fn uniform_time(
    file: &Path,
    stamps: &[(f64, u64)],
    given: Option<f64>,
) -> Result<(f64, f64), RunError> {
    let error = |line, found: String, expected: String, advice: &str| {
        Err(RunError::new(
            file,
            Place::Line(line),
            found,
            expected,
            advice,
        ))
    };
    let steps = || stamps.windows(2).map(|w| (w[0], w[1], w[1].0 - w[0].0));
    let first = stamps[0];
    let last = stamps[stamps.len() - 1].0;
    let mut sorted: Vec<f64> = steps().map(|(_, _, step)| step).collect();
    let middle = sorted.len() / 2;
    let median = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1;
    if let Some(period) = given
        && (median - period).abs() > 0.5 * period
    {
        return error(
            first.1,
            format!("steps of {} s from row to row", nanoseconds(median)),
            format!("sample_period_s = {period} as in run.toml"),
            "Correct sample_period_s or the time column.",
        );
    }
    let step_limit = 1.5 * given.unwrap_or(median);
    for ((before, _), (time, line), step) in steps() {
        if step > step_limit {
            return error(
                line,
                format!("a gap in time from {before} s to {time} s"),
                format!("a step of {} s", nanoseconds(step_limit / 1.5)),
                "Only uniform sampling can be integrated: fill the gap or split the record there.",
            );
        }
    }
    // Without gaps the mean step is free of the rounding that the median of printed steps keeps.
    let period = given.unwrap_or((last - first.0) / (stamps.len() - 1) as f64);
    for (k, &(time, line)) in stamps.iter().enumerate() {
        let due = first.0 + k as f64 * period;
        if (time - due).abs() > 0.5 * period {
            return error(
                line,
                format!("time {time} s at sample {}", k + 1),
                format!("{} s at {period} s a sample", nanoseconds(due)),
                "Correct sample_period_s, or resample the record to a uniform clock.",
            );
        }
    }
    Ok((first.0, period))
}
