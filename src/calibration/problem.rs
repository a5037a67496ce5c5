//! A calibration problem: preprocessed runs of one instrument, and the model to estimate.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::Matrix3;

use crate::attitude::to_tilt_and_heading;
use crate::calibration::budget::source::BudgetSource;
use crate::calibration::checks::finding::Finding;
use crate::calibration::linearisation::Start;
use crate::calibration::record::schedule::{Step, first_reading, steps};
use crate::calibration::record::standstill::{FLOOR, standstill_sigma};
use crate::calibration::{AttitudePrior, Model, Observation, Options};
use crate::imu::{PerSensor, Sensor};
use crate::recording::{MagneticMean, MagneticNoise, Recording, TableLog};
use crate::run::{Aiding, Dwell, LONG_ENOUGH, Run};

/// 1σ of the initial velocity of a body at rest, m/s, in addition to its sway.
const INITIAL_VELOCITY: f64 = 1e-3;

/// Runs of one instrument with the model to estimate.
///
/// Dwells, moves and the schedule of observations are determined once, and are shared by estimate, tests, bound and
/// quality. A copy with another [`Model`] is cheap.
#[derive(Debug, Clone)]
pub struct Problem<'a> {
    /// The estimated quantities with their prior.
    pub model: Model,
    pub(in crate::calibration) options: Options,
    run: &'a Run,
    others: Vec<&'a Run>,
    stretches: Arc<[Stretch<'a>]>,
    /// Names of recordings that have no dwell.
    left_out: Vec<String>,
}

/// Continuous part of a recording, from its first dwell to its last dwell.
#[derive(Debug, Clone)]
pub struct Stretch<'a> {
    pub run: &'a Run,
    /// The table's readings, if they are observed.
    pub table: Option<&'a TableLog>,
    /// Index, in the problem, of the run to which the stretch belongs.
    pub recording: usize,
    pub dwells: Vec<Dwell>,
    pub steps: Vec<Step>,
    /// White 1σ at standstill, stated in or estimated from the run: attitude in rad, velocity in m/s.
    pub standstill_sigma: PerSensor<f64>,
    /// Noise of the magnetometer in the dwells, if any.
    pub magnetic_noise: MagneticNoise,
}

impl<'a> Problem<'a> {
    /// The problem of a run.
    pub fn new(run: &'a Run, options: &Options) -> Self {
        let model = Model::new(run, options);
        Self {
            run,
            others: Vec::new(),
            stretches: stretches(run, 0, &model).into(),
            model,
            options: options.clone(),
            left_out: Vec::new(),
        }
    }

    /// A copy of the problem with an additional run of the instrument. The priors of the instrument and of the table
    /// remain those of the first run; each site has its own gravity.
    pub fn and(&self, run: &'a Run) -> Self {
        let mut all = self.stretches.to_vec();
        all.extend(stretches(run, self.others.len() + 1, &self.model));
        let mut with = self.with_stretches(all.into());
        with.others.push(run);
        let gravity_sigma = &mut with.model.gravity_sigma;
        *gravity_sigma = gravity_sigma.max(run.site.gravity_sigma);
        with
    }

    /// The problem with some of its recordings (at least one), selected by number.
    pub(in crate::calibration) fn recordings(&self, which: impl Fn(usize) -> bool) -> Self {
        let renumbered = self.stretches.iter().filter(|of| which(of.recording));
        let renumbered = renumbered.map(|stretch| Stretch {
            recording: (0..stretch.recording).filter(|&k| which(k)).count(),
            ..stretch.clone()
        });
        let runs = self.runs().enumerate().filter(|&(number, _)| which(number));
        let mut runs = runs.map(|(_, run)| run);
        let mut of = self.with_stretches(renumbered.collect());
        of.run = runs.next().unwrap_or(self.run);
        of.others = runs.collect();
        of
    }

    /// The problem without recordings that have no dwell (these are reported); unchanged if no recording has a dwell.
    pub(in crate::calibration) fn of_dwells(self) -> Self {
        let has = |number: usize| {
            let mut of = self.stretches.iter().filter(|of| of.recording == number);
            of.any(|stretch| !stretch.dwells.is_empty())
        };
        let runs = self.runs().enumerate();
        let (with, without): (Vec<_>, Vec<_>) = runs.partition(|&(number, _)| has(number));
        if with.is_empty() {
            return self;
        }
        let without = without.into_iter();
        let left_out = without.map(|(_, run)| run.recording.name.clone()).collect();
        Self {
            left_out,
            ..self.recordings(has)
        }
    }

    /// A copy with another model.
    pub fn with_model(&self, model: Model) -> Self {
        Self {
            model,
            ..self.clone()
        }
    }

    /// A copy with a modified model.
    pub fn with(&self, change: impl FnOnce(&mut Model)) -> Self {
        let mut changed = self.clone();
        change(&mut changed.model);
        changed
    }

    fn with_stretches(&self, stretches: Arc<[Stretch<'a>]>) -> Self {
        Self {
            stretches,
            ..self.clone()
        }
    }

    /// A copy that is observed only in the dwells with these numbers.
    pub(in crate::calibration) fn observed_in(&self, used: impl Fn(usize) -> bool) -> Self {
        self.with_dwells(|number, _, dwell| used(number).then(|| dwell.clone()))
    }

    /// A copy with each dwell, given by number, transformed.
    pub(in crate::calibration) fn with_dwells(
        &self,
        become_of: impl Fn(usize, &Stretch, &Dwell) -> Option<Dwell>,
    ) -> Self {
        let mut number = 0;
        let stretches = self.stretches.iter().map(|stretch| {
            let dwells = stretch.dwells.iter().filter_map(|dwell| {
                number += 1;
                become_of(number - 1, stretch, dwell)
            });
            let (dwells, sigma) = (dwells.collect(), stretch.standstill_sigma);
            Stretch::new(stretch.run, stretch.table, stretch.recording, dwells, sigma)
        });
        self.with_stretches(stretches.collect())
    }

    /// A copy whose run is at rest throughout.
    pub(in crate::calibration) fn as_one_dwell(&self) -> Self {
        let samples = 0..self.run.recording.imu.len();
        let dwell = Dwell {
            samples,
            position: None,
        };
        let stretch = Stretch::new(self.run, None, 0, vec![dwell], PerSensor::default());
        self.with_stretches([stretch].into())
    }

    pub(in crate::calibration) fn stretches(&self) -> &[Stretch<'a>] {
        &self.stretches
    }

    /// White 1σ at standstill in the first stretch, of attitude in rad (gyros) or velocity in m/s.
    pub(in crate::calibration) fn standstill_sigma(&self, sensor: Sensor) -> f64 {
        let first = self.stretches.first();
        first.map_or(0.0, |stretch| stretch.standstill_sigma(&self.model, sensor))
    }

    /// Variance at standstill in excess of the floor, of attitude in rad² (gyros) or velocity in m²/s²; the mean of
    /// several stretches.
    pub(in crate::calibration) fn standstill_variance(&self, sensor: Sensor) -> f64 {
        let of = |stretch: &Stretch| {
            let sigma = stretch.standstill_sigma(&self.model, sensor);
            (sigma.powi(2) - FLOOR.get(sensor).powi(2)).max(0.0)
        };
        let sum: f64 = self.stretches.iter().map(of).sum();
        sum / self.stretches.len().max(1) as f64
    }

    /// The run of the problem, or the first of several runs.
    pub fn run(&self) -> &'a Run {
        self.run
    }

    /// All runs, in order.
    pub(in crate::calibration) fn runs(&self) -> impl Iterator<Item = &'a Run> {
        std::iter::once(self.run).chain(self.others.iter().copied())
    }

    /// Contradictions between recordings and statements, reader notes, and excluded recordings.
    pub(in crate::calibration) fn remarks(&self) -> Vec<Finding> {
        let left_out = self.left_out.iter().map(|name| {
            format!(
                "{name}: turncal excluded this recording because it has no dwell. Keep the instrument still for \
                 {LONG_ENOUGH} s or more between turns."
            )
        });
        let doubts = self
            .of_recordings(|recording| &recording.doubts)
            .into_iter();
        let notes = self.of_recordings(|recording| &recording.notes).into_iter();
        let notes = notes.chain(left_out).map(Finding::of_recording);
        doubts.map(Finding::of_statement).chain(notes).collect()
    }

    /// Sentences about recordings, each once, with the names of the recordings concerned (no names if all are).
    fn of_recordings(&self, of: impl Fn(&Recording) -> &Vec<String>) -> Vec<String> {
        let mut found: Vec<(&String, Vec<&str>)> = Vec::new();
        for run in self.runs() {
            for note in of(&run.recording) {
                match found.iter_mut().find(|(other, _)| *other == note) {
                    Some((_, names)) => names.push(&run.recording.name),
                    None => found.push((note, vec![&run.recording.name])),
                }
            }
        }
        let count = self.runs().count();
        let named = |(note, names): (&String, Vec<&str>)| {
            if names.len() == count {
                note.clone()
            } else {
                format!("{}: {note}", names.join(", "))
            }
        };
        found.into_iter().map(named).collect()
    }

    /// Observations at the end of a step, in order.
    pub(in crate::calibration) fn observed(
        &self,
        step: &Step,
    ) -> impl Iterator<Item = Observation> + use<> {
        let at_rest = step.at_rest.as_ref();
        let reading = at_rest.is_some_and(|rest| rest.reading.is_some());
        let still = self.model.aiding == Aiding::Velocity;
        let kinds = [
            (Observation::Velocity, at_rest.is_some()),
            (Observation::Table, reading),
            (Observation::Attitude, at_rest.is_some() && still),
        ];
        let there = kinds.into_iter().filter(|(_, there)| *there);
        there.map(|(kind, _)| kind)
    }

    /// The kinds of observation that contain remainders of pulses.
    pub(in crate::calibration) fn with_pulses(&self) -> Vec<Observation> {
        let any = |kind: &Observation| {
            self.runs()
                .any(|run| *run.recording.imu.pulse.get(kind.sensor()) > 0.0)
        };
        Observation::ALL.into_iter().filter(any).collect()
    }

    /// Whether gravity is the same in all recordings.
    pub(in crate::calibration) fn one_gravity(&self) -> bool {
        self.runs().all(|run| run.site == self.run.site)
    }

    /// The dwells of all runs.
    pub fn dwells(&self) -> impl Iterator<Item = &Dwell> {
        self.stretches.iter().flat_map(|stretch| &stretch.dwells)
    }
}

impl<'a> Stretch<'a> {
    fn new(
        run: &'a Run,
        table: Option<&'a TableLog>,
        recording: usize,
        dwells: Vec<Dwell>,
        standstill_sigma: PerSensor<f64>,
    ) -> Self {
        let times = |dwell: &Dwell| run.recording.imu.times(&dwell.samples);
        let noise = (run.recording.magnetometer.as_ref())
            .map(|magnetometer| magnetometer.noise(dwells.iter().map(times)));
        Self {
            steps: steps(run, table, &dwells),
            magnetic_noise: noise.unwrap_or_default(),
            run,
            table,
            recording,
            dwells,
            standstill_sigma,
        }
    }

    /// Variance of an observation per axis, rad² or m²/s², including pulses; for a table attitude, the variance of the
    /// mean of this many readings.
    pub fn observation_variance(&self, model: &Model, kind: Observation, readings: usize) -> f64 {
        let sensor = kind.sensor();
        let own = match kind {
            Observation::Table => {
                let reading = model.reading_sigma.powi(2);
                reading * model.weight(BudgetSource::TableReading) / readings as f64
            }
            _ => {
                let still = self.standstill_sigma(model, sensor).powi(2);
                still * model.weight(BudgetSource::at_rest(sensor))
            }
        };
        let pulse = self.run.recording.imu.pulse.get(sensor).powi(2) / 12.0;
        own + pulse * model.weight(BudgetSource::Pulses)
    }

    /// Mean output of the magnetometer over these samples at rest, if there is one.
    pub fn magnetic(&self, samples: &Range<usize>) -> Option<MagneticMean> {
        let recording = &self.run.recording;
        let time = recording.imu.times(samples);
        (recording.magnetometer.as_ref())?.mean(&time, &self.magnetic_noise)
    }

    /// Variance of the position per axis at the start of a dwell, m².
    pub fn position_variance(&self, model: &Model) -> f64 {
        self.run.standstill.position_sigma.powi(2) * model.weight(BudgetSource::Place)
    }

    /// White 1σ at standstill used by the filter, of attitude in rad (gyros) or velocity in m/s.
    pub fn standstill_sigma(&self, model: &Model, sensor: Sensor) -> f64 {
        let of_model = *model.standstill_sigma.get(sensor);
        of_model.unwrap_or(*self.standstill_sigma.get(sensor))
    }

    /// Table attitude at the first sample, if there is one.
    pub fn attitude_of_table(&self) -> Option<AttitudePrior> {
        let reading = first_reading(self.table, &self.dwells)?;
        Some(AttitudePrior::of_reading(&self.run.table, reading))
    }

    /// Time from the end of this stretch to the start of another in the same recording, s.
    pub fn time_until(&self, next: &Self) -> f64 {
        let imu = &self.run.recording.imu;
        let ends = self.dwells.last().map(|dwell| dwell.samples.end);
        let begins = next.dwells.first().map(|dwell| dwell.samples.start);
        let pair = ends.zip(begins);
        pair.map_or(0.0, |(end, begin)| imu.time(begin) - imu.time(end))
    }

    /// 1σ of the velocity of a body that comes to rest, m/s.
    pub fn velocity_sigma(&self) -> f64 {
        INITIAL_VELOCITY.hypot(self.standstill_sigma.accel)
    }

    /// Uncertainty at the first sample, for errors relative to a linearisation point with the attitude `at`.
    pub fn start(&self, prior: &AttitudePrior, at: &Matrix3<f64>) -> Start {
        Start {
            attitude: to_tilt_and_heading(&(prior.mean * at.transpose())),
            attitude_sigma: prior.sigma,
            velocity_sigma: self.velocity_sigma(),
            position_sigma: self.run.standstill.position_sigma,
            // If Earth rate may point in any direction, its mean is zero, whatever value was assumed.
            earth_rate: -self.run.site.earth_rate_n().zip_map(
                &prior.earth_rate_sigma,
                |taken, sigma| {
                    if sigma > 0.0 { taken } else { 0.0 }
                },
            ),
            earth_rate_sigma: prior.earth_rate_sigma,
        }
    }
}

/// The stretches of a run, separated by breaks between dwells.
fn stretches<'a>(run: &'a Run, recording: usize, model: &Model) -> Vec<Stretch<'a>> {
    let table = run.observed_table(model.aiding);
    let dwells = run.dwells(model.aiding);
    let standstill_sigma = standstill_sigma(run, &dwells);
    let imu = &run.recording.imu;
    let unbroken = |before: &Dwell, after: &Dwell| {
        imu.unbroken(&(before.samples.end - 1..after.samples.start + 1))
    };
    let parts = dwells.chunk_by(unbroken);
    parts
        .map(|dwells| Stretch::new(run, table, recording, dwells.to_vec(), standstill_sigma))
        .collect()
}
