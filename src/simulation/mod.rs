//! Simulated runs with known truth: an instrument on a table that follows a path.
//!
//! Simulations run entirely in memory. The truth, the noise, and the imperfections, position errors and readings of the
//! table use separate random generators, so that a change of one does not affect the others.

mod campaign;
mod draw;
mod drive;
mod increments;
mod magnetometer;
mod runs;
mod scenario;
mod thermal;

use std::borrow::Cow;

use nalgebra::{SVector, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

pub use campaign::SimulatedCampaign;
use draw::normal;
use drive::Drive;
pub use increments::{Integrator, true_increments};
pub use magnetometer::MagnetometerModel;
pub use runs::Runs;
pub use scenario::{Given, Scenario};
use thermal::Warming;
pub use thermal::{Chamber, ThermalTruth};

use crate::attitude::{exp, quaternion};
use crate::calibration::result::{FORMAT_WITH_TEMPERATURE, TermRecord};
use crate::calibration::{Calibration, Difference, MagRecord, ThermalRecord, truth_record};
use crate::imu::{
    Instrument, NoiseSource, Nominal, Output, PerSensor, Pulses, Sensor, TERM_PARAMETERS, Term,
    TermVector, Triad,
};
use crate::magnetic::MagneticTriad;
use crate::navigation::samples_of;
use crate::recording::{ImuSamples, Magnetometer, Recording, TableLog, Temperature};
use crate::run::{Run, SET_BY_HAND, Standstill};
use crate::turntable::{AxisError, TABLE_GEOMETRY, TableAccuracy, TableGeometry, across};
use crate::turntable::{Imperfection, Motion, Moves, TableError};

/// A run with its truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulated {
    /// The run, in the form in which a laboratory would record it.
    pub run: Run,
    /// The instrument's true parameters; if they depend on temperature, the values at the reference of
    /// [`Self::thermal`].
    pub truth: PerSensor<Triad>,
    /// True parameters without the deviations of this recording.
    pub common: PerSensor<Triad>,
    /// True parameters of the instrument's error terms.
    pub terms: TermVector,
    /// The table's true geometry, in the order of [`crate::turntable::TableGeometry::vector`], rad.
    pub geometry: SVector<f64, TABLE_GEOMETRY>,
    /// Temperature dependence of the true parameters, if they depend on temperature.
    pub thermal: Option<ThermalTruth>,
    /// The true magnetometer and the magnitude of the field in T, if any.
    pub magnetic: Option<(MagneticTriad, f64)>,
    /// Quantity of a sample when the run is written to a file.
    pub output: Output,
}

impl Simulated {
    /// The truth as a record, with the error terms that are on and the dependence on temperature over the recording.
    pub fn truth_record(&self) -> Calibration {
        let on = (0..TERM_PARAMETERS).filter(|&k| self.run.instrument.term_sigma[k] > 0.0);
        let term = |k: usize| {
            let (value, sigma) = (self.terms[k], None);
            Some((Term::parameter_name(k)?, TermRecord { value, sigma }))
        };
        let log = self.run.recording.magnetometer.as_ref();
        let mag = self.magnetic.as_ref().zip(log);
        Calibration {
            mag: mag.and_then(|((triad, magnitude), log)| {
                MagRecord::new(triad, log.field.map(|_| *magnitude), log)
            }),
            terms: on.filter_map(term).collect(),
            ..self.truth_over(std::slice::from_ref(self), &self.truth)
        }
    }

    /// A truth with these triads, and their dependence on temperature over the range of some recordings.
    fn truth_over(&self, recordings: &[Self], triads: &PerSensor<Triad>) -> Calibration {
        let Some(thermal) = &self.thermal else {
            return truth_record(triads, &self.run);
        };
        let known = recordings.iter();
        let known = known.filter_map(|one| one.run.recording.imu.temperature.as_ref());
        let range = Temperature::seen(known);
        let at = thermal.at(triads, range.gyro.reference, 0.0);
        let coefficients = thermal.coefficients(&range);
        Calibration {
            format: FORMAT_WITH_TEMPERATURE.to_owned(),
            temperature: Some(ThermalRecord::of_truth(&range, &coefficients, &self.run)),
            ..truth_record(&at, &self.run)
        }
    }
}

/// Sources of random numbers, each with a separate stream.
#[derive(Clone, Copy)]
enum Draws {
    GyroTruth,
    AccelTruth,
    GyroNoise,
    AccelNoise,
    Imperfection,
    Positions,
    Readings,
    Terms,
}

impl Draws {
    const COUNT: u64 = 8;

    /// Stream for temperature effects, separate from all others.
    fn thermal(seed: u64, stream: u64) -> ChaCha8Rng {
        Self::beside(THERMAL, seed, stream)
    }

    /// Stream for effects that some scenarios have, separate from all others.
    fn beside(effect: u64, seed: u64, stream: u64) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ effect);
        rng.set_stream(stream);
        rng
    }

    fn generator(self, seed: u64, stream: u64) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream.wrapping_mul(Self::COUNT) + self as u64);
        rng
    }
}

/// Derives a second seed: `thermal!` in ASCII.
const THERMAL: u64 = 0x7468_6572_6d61_6c21;
/// The same for a magnetometer: `magnetic`.
const MAGNETIC: u64 = 0x6d61_676e_6574_6963;
/// Interval in which temperature changes are negligible, s.
const WARMED_EVERY: f64 = 0.1;

impl Scenario {
    /// Simulates one run. The same seed and stream give the same bits; a Monte Carlo study keeps the seed
    /// and increments the stream.
    ///
    /// # Errors
    /// Returns an error if the table cannot follow the path.
    pub fn simulate(&self, seed: u64, stream: u64) -> Result<Simulated, TableError> {
        self.simulate_recording(seed, stream, stream, &Difference::default())
    }

    /// Simulates one recording. The instrument is drawn from one random stream and all other random numbers from
    /// another stream; `own` contains the differences of the parameters in this recording.
    ///
    /// # Errors
    /// Returns an error if the table cannot follow the path.
    pub fn simulate_recording(
        &self,
        seed: u64,
        instrument: u64,
        stream: u64,
        own: &Difference,
    ) -> Result<Simulated, TableError> {
        self.simulate_on(None, seed, instrument, stream, own)
    }

    /// Simulates with an existing drive, if it matches this recording.
    fn simulate_on(
        &self,
        made: Option<&Drive>,
        seed: u64,
        instrument: u64,
        stream: u64,
        own: &Difference,
    ) -> Result<Simulated, TableError> {
        let mut rng = Draws::Imperfection.generator(seed, stream);
        let imperfection = Imperfection::draw(&self.table, || StandardNormal.sample(&mut rng));
        let terms = self.draw_terms(&mut Draws::Terms.generator(seed, instrument));
        let geometry = self.geometry(&imperfection);
        let magnetic = (self.magnetometer.as_ref())
            .map(|model| self.magnetic(model, &imperfection, (seed, instrument, stream)))
            .transpose()?;
        let drive = match made.filter(|drive| drive.is_of(&imperfection, &terms)) {
            Some(drive) => Cow::Borrowed(drive),
            None => Cow::Owned(Drive::new(self, imperfection, terms)?),
        };
        let draw = |sensor: Sensor| {
            let draws = sensor.pick(Draws::GyroTruth, Draws::AccelTruth);
            self.draw_truth(sensor, &mut draws.generator(seed, instrument))
        };
        let common = PerSensor::from_fn(draw);
        let truth = own.applied(&common);
        let thermal = self.instrument.thermal.as_ref().map(|variation| {
            let mut rng = Draws::thermal(seed, instrument);
            let form = self.installation.form;
            ThermalTruth::draw(variation, form, self.reference_temperature(), &mut rng)
        });
        let chamber = self.chamber.as_ref();
        let warming = chamber.map(|chamber| chamber.instrument(drive.duration));
        let triad_at = |sensor: Sensor, time: f64| match (&thermal, &warming) {
            (Some(thermal), Some(warming)) => {
                let (temperature, rate) = warming.at(time);
                *thermal.at(&truth, temperature, rate).get(sensor)
            }
            _ => *truth.get(sensor),
        };
        let imu = self.samples(&drive, &triad_at, warming.as_ref(), seed, stream);
        let mut run = self.recorded(imu, self.readings(&drive, seed, stream));
        let (magnetic, magnetometer) = magnetic.unzip();
        run.recording.magnetometer = magnetometer;
        let date = self.magnetometer.as_ref().and_then(|model| model.date);
        let date = date.map(|(year, month, day)| format!("{year:04}-{month:02}-{day:02}"));
        run.recording
            .meta
            .extend(date.map(|date| ("date".to_owned(), date)));
        Ok(Simulated {
            run,
            truth,
            common,
            terms,
            geometry,
            thermal,
            magnetic,
            output: self.output,
        })
    }

    /// The true magnetometer of an instrument, and its output in a recording.
    fn magnetic(
        &self,
        model: &MagnetometerModel,
        imperfection: &Imperfection,
        (seed, instrument, stream): (u64, u64, u64),
    ) -> Result<((MagneticTriad, f64), Magnetometer), TableError> {
        let motion = Motion::new(&self.table, &self.path, imperfection)?;
        let truth = model.draw(&mut Draws::beside(MAGNETIC, seed, instrument));
        let mut rng = Draws::beside(MAGNETIC, seed, !stream);
        Ok((truth, model.recorded(&truth, &motion, &mut rng)))
    }

    /// Output of an instrument on a drive, with the recorded temperature.
    fn samples(
        &self,
        drive: &Drive,
        triad_at: &dyn Fn(Sensor, f64) -> Triad,
        warming: Option<&Warming>,
        seed: u64,
        stream: u64,
    ) -> ImuSamples {
        let sensed = |sensor: Sensor, draws: Draws| {
            let at = |time: f64| triad_at(sensor, time);
            let ideal = drive.ideal.get(sensor);
            self.sensed(&at, sensor, ideal, draws.generator(seed, stream))
        };
        let temperature = self.chamber.as_ref().zip(warming);
        let temperature = temperature.and_then(|(chamber, warming)| {
            let mut rng = Draws::thermal(seed, !stream);
            warming.recorded(drive.duration, chamber.sensor_noise, &mut rng)
        });
        ImuSamples {
            pulse: match self.output {
                Output::Pulse => self.instrument.pulse,
                Output::Increment | Output::Rate => PerSensor::default(),
            },
            temperature,
            ..ImuSamples::made(
                0.0,
                self.integrator.period,
                sensed(Sensor::Gyro, Draws::GyroNoise),
                sensed(Sensor::Accel, Draws::AccelNoise),
            )
        }
    }

    /// The run with these samples and the table log.
    fn recorded(&self, imu: ImuSamples, table: TableLog) -> Run {
        let meta = [
            ("instrument", &self.instrument.name),
            ("table", &self.table_name),
        ];
        Run {
            recording: Recording {
                meta: meta
                    .map(|(key, value)| (key.to_owned(), value.clone()))
                    .into(),
                table: Some(table),
                ..Recording::of(&self.name, imu)
            },
            instrument: self.known_instrument(),
            site: self.site,
            table: self.table_accuracy(),
            standstill: Standstill {
                position_sigma: Standstill::default()
                    .position_sigma
                    .max(self.integrator.lever_arm.norm()),
                ..Standstill::default()
            },
            segment_sigma: SET_BY_HAND,
        }
    }

    /// Prior of the instrument.
    fn known_instrument(&self) -> Instrument {
        let nominal = |sensor: Sensor| {
            let per_unit = match self.output {
                Output::Pulse => 1.0 / self.instrument.pulse.get(sensor),
                Output::Increment | Output::Rate => 1.0,
            };
            Nominal(Vector3::repeat(per_unit))
        };
        let unit = |sensor: Sensor| match (self.output, sensor) {
            (Output::Pulse, _) => "count",
            (Output::Increment, Sensor::Gyro) => "rad",
            (Output::Increment, Sensor::Accel) => "m/s",
            (Output::Rate, Sensor::Gyro) => "rad/s",
            (Output::Rate, Sensor::Accel) => "m/s^2",
        };
        Instrument {
            nominal: PerSensor::from_fn(nominal),
            unit: PerSensor::from_fn(|sensor| unit(sensor).to_owned()),
            prior: PerSensor::from_fn(|sensor| self.instrument.prior(sensor, &self.installation)),
            noise: self.instrument.noise,
            noise_is_stated: PerSensor::from_fn(|_| true),
            motion_noise: PerSensor::default(),
            term_sigma: self.instrument.term_sigma,
            absent_terms: self.instrument.absent_terms.clone(),
        }
    }

    fn geometry(&self, imperfection: &Imperfection) -> SVector<f64, TABLE_GEOMETRY> {
        let directions = self.table.axes.iter().map(|axis| axis.direction);
        let axes = directions.zip(&imperfection.axes);
        let tilts = axes.clone().skip(1);
        let tilts = tilts.flat_map(|(axis, of)| across(&axis).map(|across| across.dot(&of.tilt)));
        let wobble = axes.clone().flat_map(|(axis, of)| {
            of.harmonics
                .map(|turn| across(&axis).map(|across| across.dot(&turn)))
        });
        let encoder = axes.flat_map(|(axis, of)| of.harmonics.map(|turn| axis.dot(&turn)));
        let mut geometry = TableGeometry {
            base: imperfection.base,
            ..TableGeometry::default()
        };
        let mut set = |kind: AxisError, values: &mut dyn Iterator<Item = f64>| {
            for (k, value) in kind.range().zip(values) {
                geometry.axes[k] = value;
            }
        };
        set(AxisError::Tilt, &mut { tilts });
        set(AxisError::Wobble, &mut wobble.flatten());
        set(AxisError::Encoder, &mut { encoder });
        geometry.vector()
    }

    fn sensed(
        &self,
        triad_at: &dyn Fn(f64) -> Triad,
        sensor: Sensor,
        ideal: &[Vector3<f64>],
        mut rng: ChaCha8Rng,
    ) -> Vec<Vector3<f64>> {
        let period = self.integrator.period;
        let mut triad = triad_at(0.0);
        let (mut sensitivity, mut bias) = (triad.sensitivity(), triad.bias * period);
        let warms = self.chamber.is_some();
        let every = samples_of(WARMED_EVERY, period);
        let pulse = *self.instrument.pulse.get(sensor);
        let mut noise = NoiseSource::new(*self.instrument.noise.get(sensor), period, &mut rng);
        let mut pulses = Pulses::default();
        ideal
            .iter()
            .enumerate()
            .map(|(k, u)| {
                if warms && k % every == 0 {
                    triad = triad_at((k as f64 + 0.5 * every as f64) * period);
                    (sensitivity, bias) = (triad.sensitivity(), triad.bias * period);
                }
                let increment = sensitivity * u + bias + noise.draw(&mut rng);
                match self.output {
                    Output::Pulse => pulses.count(increment / pulse) * pulse,
                    Output::Increment | Output::Rate => increment,
                }
            })
            .collect()
    }

    /// The table's log: `exp(−[τ×]) C_b_n`, with τ the current position error plus white noise.
    fn readings(&self, drive: &Drive, seed: u64, stream: u64) -> TableLog {
        let errors = &self.table.errors;
        let mut positions = Draws::Positions.generator(seed, stream);
        let mut readings = Draws::Readings.generator(seed, stream);
        let mut position = 0;
        let mut of_position = normal(&mut positions) * errors.position;
        let (time, attitude): (Vec<f64>, Vec<_>) = drive
            .read
            .iter()
            .map(|(time, of, attitude)| {
                while position < *of {
                    position += 1;
                    of_position = normal(&mut positions) * errors.position;
                }
                let tau = of_position + normal(&mut readings) * errors.reading;
                (*time, quaternion(&(exp(-tau) * attitude)))
            })
            .unzip();
        TableLog {
            axes: drive.axes.clone(),
            time,
            attitude,
        }
    }

    fn table_accuracy(&self) -> TableAccuracy {
        let errors = &self.table.errors;
        TableAccuracy {
            position_sigma: errors.position,
            reading_sigma: errors.reading,
            settling_sigma: 0.0,
            geometry: TableGeometry {
                base: Vector3::new(errors.level, errors.level, errors.north),
                axes: match self.path.moves {
                    Moves::Axes { .. } => AxisError::ALL
                        .into_iter()
                        .map(|kind| kind.of_table(self.table.axes.len(), errors.of_axes(kind)))
                        .sum(),
                    Moves::Body { .. } => SVector::zeros(),
                },
            },
        }
    }
}

#[cfg(test)]
mod tests;
