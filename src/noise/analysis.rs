//! The stretch of a run that is analysed, and its noise.

use std::ops::Range;

use super::clusters::Clusters;
use super::triad::TriadNoise;
use crate::imu::{Noise, PerSensor, Sensor};
use crate::recording::Segment;
use crate::run::Run;

/// Minimum fraction of a stretch within one standstill.
const STANDING: f64 = 0.95;
/// Minimum number of samples for the slopes of the Allan deviation.
const FEWEST: usize = 256;

/// A stretch of samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// Samples of the stretch.
    pub samples: Range<usize>,
    /// Name, such as `the whole recording`.
    pub name: String,
    /// Whether the instrument is at rest during the stretch, according to its own output.
    pub stands: bool,
}

/// Reasons why no stretch can be analysed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StretchError {
    /// No segment has the label.
    #[error("no segment is labelled `{label}`; {}", known(labels))]
    UnknownLabel {
        /// The requested label.
        label: String,
        /// All labels of the run.
        labels: Vec<String>,
    },
    /// There is no standstill.
    #[error(
        "the recording has no standstill. Leave the instrument undisturbed for minutes, preferably hours, or name a \
         section with --segment"
    )]
    NoStandstill,
    /// Too few samples.
    #[error(
        "{name} has {found} samples, but at least {FEWEST} are needed (minutes to hours for bias instability). \
         Record a longer standstill"
    )]
    TooShort {
        /// Name of the stretch.
        name: String,
        /// Number of samples.
        found: usize,
    },
}

fn known(labels: &[String]) -> String {
    let mut quoted: Vec<String> = labels.iter().map(|label| format!("`{label}`")).collect();
    quoted.dedup();
    match quoted.join(", ").as_str() {
        "" => "the run has no [segments]; omit --segment, or add [segments] to run.toml".to_owned(),
        quoted => format!("known labels are {quoted}"),
    }
}

impl Stretch {
    /// The longest segment with this label. Without a label, the longest standstill; if the recording is not
    /// continuous, the longest segment.
    ///
    /// # Errors [`StretchError`] if there is no such stretch, or if it is too short.
    pub fn find(run: &Run, label: Option<&str>) -> Result<Self, StretchError> {
        let segments = &run.recording.segments;
        let stretch = match label {
            Some(label) => Self::labelled(run, label)?,
            None if !run.recording.imu.continuous && !segments.is_empty() => segments
                .iter()
                .map(|segment| Self::of_segment(run, segment, "the longest static segment,"))
                .filter(|stretch| stretch.stands)
                .max_by_key(|stretch| stretch.samples.len())
                .ok_or(StretchError::NoStandstill)?,
            None => Self::standstill(run).ok_or(StretchError::NoStandstill)?,
        };
        match stretch.samples.len() {
            found if found < FEWEST => Err(StretchError::TooShort {
                name: stretch.name,
                found,
            }),
            _ => Ok(stretch),
        }
    }

    fn labelled(run: &Run, label: &str) -> Result<Self, StretchError> {
        let of_label = || run.recording.segments.iter().filter(|s| s.label == label);
        let length = |segment: &Segment| segment.end - segment.start;
        let longest = of_label().max_by(|a, b| length(a).total_cmp(&length(b)));
        let Some(segment) = longest else {
            return Err(StretchError::UnknownLabel {
                label: label.to_owned(),
                labels: run.recording.labels(),
            });
        };
        let which = match of_label().count() {
            1 => "segment".to_owned(),
            count => format!("the longest of {count} segments"),
        };
        Ok(Self::of_segment(run, segment, &which))
    }

    fn standstill(run: &Run) -> Option<Self> {
        let dwells = run.dwells(run.aiding()).into_iter();
        let samples = dwells
            .map(|of| of.samples)
            .max_by_key(ExactSizeIterator::len)?;
        let name = if samples.len() == run.recording.imu.len() {
            "the whole recording".to_owned()
        } else {
            format!("the longest standstill, {}", times(run, &samples))
        };
        Some(Self {
            samples,
            name,
            stands: true,
        })
    }

    fn of_segment(run: &Run, segment: &Segment, which: &str) -> Self {
        let samples = segment.samples.clone();
        let needed = STANDING * samples.len() as f64;
        let stands = run.dwells(run.aiding()).iter().any(|dwell| {
            let begin = samples.start.max(dwell.samples.start);
            let end = samples.end.min(dwell.samples.end);
            end.saturating_sub(begin) as f64 >= needed
        });
        Self {
            name: format!("{which} `{}`, {}", segment.label, times(run, &samples)),
            samples,
            stands,
        }
    }
}

fn times(run: &Run, samples: &Range<usize>) -> String {
    let at = |sample| run.recording.imu.time(sample);
    // Zero has no sign.
    let at = |row| (10.0 * at(row)).round() / 10.0 + 0.0;
    format!("{:.1} s to {:.1} s", at(samples.start), at(samples.end))
}

/// The noise of an instrument at rest, over one stretch of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseAnalysis {
    /// The analysed stretch.
    pub stretch: Stretch,
    /// Length of a sample, s.
    pub period: f64,
    /// Size of one pulse, rad and m/s; zero if samples are not pulses.
    pub pulse: PerSensor<f64>,
    /// Noise of both triads.
    pub triads: PerSensor<TriadNoise>,
    /// Noise stated in the run, if any.
    pub stated: PerSensor<Option<Noise>>,
    /// The triads that were recorded.
    pub sensors: Vec<Sensor>,
}

impl NoiseAnalysis {
    /// Analyses a stretch of a run.
    pub fn new(run: &Run, stretch: Stretch) -> Self {
        let imu = &run.recording.imu;
        let clusters = Clusters::new(stretch.samples.len(), imu.period);
        let triads = PerSensor::from_fn(|sensor| {
            let samples = imu.of(sensor).part(stretch.samples.clone());
            TriadNoise::new(&samples, imu.period, &clusters)
        });
        Self {
            period: imu.period,
            pulse: imu.pulse,
            stated: PerSensor::from_fn(|sensor| {
                let noise = run.instrument.noise.get(sensor);
                let is_stated = *run.instrument.noise_is_stated.get(sensor);
                is_stated.then_some(*noise)
            }),
            triads,
            stretch,
            sensors: Sensor::ALL
                .into_iter()
                .filter(|&sensor| imu.has(sensor))
                .collect(),
        }
    }

    /// Length of the analysed stretch, s.
    pub fn duration(&self) -> f64 {
        self.stretch.samples.len() as f64 * self.period
    }
}
