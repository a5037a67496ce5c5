//! Simulated runs with known truth: an instrument on a table that is driven along a path.
//!
//! Everything happens in memory. Truth, noise, the table's imperfections, its position errors and its
//! readings draw from generators of their own, so that changing one leaves the others as they were.

mod increments;
mod scenario;

use nalgebra::{Matrix3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

pub use increments::{Integrator, true_increments};
pub use scenario::{Given, Scenario};

use crate::attitude::exp;
use crate::imu::{NoiseSource, Nominal, Output, PerSensor, Pulses, Sensor, Triad};
use crate::run::{ImuRecord, Run, Standstill, TableRecord};
use crate::turntable::{Imperfection, Motion, TableError};

/// A run and what it was made from.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulated {
    /// What a laboratory would have recorded.
    pub run: Run,
    /// The instrument's true parameters.
    pub truth: PerSensor<Triad>,
    /// What a sample holds when the run is written to a file.
    pub output: Output,
}

/// What draws random numbers, each from a stream of its own.
#[derive(Clone, Copy)]
enum Draws {
    GyroTruth,
    AccelTruth,
    GyroNoise,
    AccelNoise,
    Imperfection,
    Positions,
    Readings,
}

impl Draws {
    const COUNT: u64 = 8;

    fn generator(self, seed: u64, stream: u64) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream.wrapping_mul(Self::COUNT) + self as u64);
        rng
    }
}

fn normal(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| StandardNormal.sample(rng))
}

impl Scenario {
    /// Simulates one run. The same seed and stream give the same bits; a Monte Carlo keeps the seed
    /// and counts the stream.
    ///
    /// # Errors
    /// If the path is beyond the table.
    pub fn simulate(&self, seed: u64, stream: u64) -> Result<Simulated, TableError> {
        let mut rng = Draws::Imperfection.generator(seed, stream);
        let imperfection = Imperfection::draw(&self.table, || StandardNormal.sample(&mut rng));
        let motion = Motion::new(&self.table, &self.path, &imperfection)?;
        let read = Motion::new(&self.table, &self.path, &Imperfection::none(&self.table))?;
        let ideal = true_increments(&motion, &self.site, &self.integrator);

        let truth = PerSensor::from_fn(|sensor| {
            let draws = match sensor {
                Sensor::Gyro => Draws::GyroTruth,
                Sensor::Accel => Draws::AccelTruth,
            };
            self.draw_truth(sensor, &mut draws.generator(seed, stream))
        });
        let nominal = PerSensor::from_fn(|sensor| {
            let per_unit = match self.output {
                Output::Pulse => 1.0 / self.instrument.pulse.get(sensor),
                Output::Increment | Output::Rate => 1.0,
            };
            Nominal(Vector3::repeat(per_unit))
        });
        let pulse = match self.output {
            Output::Pulse => self.instrument.pulse,
            Output::Increment | Output::Rate => PerSensor::default(),
        };
        let unit = PerSensor::from_fn(|sensor| {
            match (self.output, sensor) {
                (Output::Pulse, _) => "count",
                (Output::Increment, Sensor::Gyro) => "rad",
                (Output::Increment, Sensor::Accel) => "m/s",
                (Output::Rate, Sensor::Gyro) => "rad/s",
                (Output::Rate, Sensor::Accel) => "m/s^2",
            }
            .to_owned()
        });
        let sensed = |sensor: Sensor, draws: Draws, ideal: &[Vector3<f64>]| {
            self.sensed(
                truth.get(sensor),
                sensor,
                ideal,
                draws.generator(seed, stream),
            )
        };
        let run = Run {
            name: self.name.clone(),
            site: self.site,
            meta: [
                ("instrument", &self.instrument.name),
                ("table", &self.table_name),
            ]
            .map(|(key, value)| (key.to_owned(), value.clone()))
            .into(),
            imu: ImuRecord {
                start: 0.0,
                period: self.integrator.period,
                continuous: true,
                gyro: sensed(Sensor::Gyro, Draws::GyroNoise, &ideal.gyro),
                accel: sensed(Sensor::Accel, Draws::AccelNoise, &ideal.accel),
                pulse,
            },
            noise: self.instrument.noise,
            prior: PerSensor::from_fn(|sensor| self.instrument.prior(sensor, &self.installation)),
            nominal,
            unit,
            standstill: Standstill {
                velocity_sigma: None,
                position_sigma: Standstill::default()
                    .position_sigma
                    .max(self.integrator.lever_arm.norm()),
            },
            table: Some(self.readings(&read, seed, stream)),
            notes: Vec::new(),
            segments: Vec::new(),
        };
        Ok(Simulated {
            run,
            truth,
            output: self.output,
        })
    }

    fn sensed(
        &self,
        triad: &Triad,
        sensor: Sensor,
        ideal: &[Vector3<f64>],
        mut rng: ChaCha8Rng,
    ) -> Vec<Vector3<f64>> {
        let period = self.integrator.period;
        let sensitivity = triad.sensitivity();
        let bias = triad.bias * period;
        let pulse = *self.instrument.pulse.get(sensor);
        let mut noise = NoiseSource::new(*self.instrument.noise.get(sensor), period, &mut rng);
        let mut pulses = Pulses::default();
        ideal
            .iter()
            .map(|u| {
                let increment = sensitivity * u + bias + noise.draw(&mut rng);
                match self.output {
                    Output::Pulse => pulses.count(increment / pulse) * pulse,
                    Output::Increment | Output::Rate => increment,
                }
            })
            .collect()
    }

    /// The table's log: `exp(−[τ×]) C_b_n`, τ the error of the position in force and white noise.
    fn readings(&self, motion: &Motion, seed: u64, stream: u64) -> TableRecord {
        let errors = &self.table.errors;
        let mut positions = Draws::Positions.generator(seed, stream);
        let mut readings = Draws::Readings.generator(seed, stream);
        let mut position = 0;
        let mut of_position = normal(&mut positions) * errors.position;
        let count = (motion.duration() * self.reading_rate + 1e-6) as usize;
        let (time, attitude): (Vec<f64>, Vec<Matrix3<f64>>) = (0..=count)
            .map(|k| k as f64 / self.reading_rate)
            .map(|time| {
                while position < motion.position(time) {
                    position += 1;
                    of_position = normal(&mut positions) * errors.position;
                }
                let tau = of_position + normal(&mut readings) * errors.reading;
                (time, exp(-tau) * motion.at(time).attitude)
            })
            .unzip();
        TableRecord {
            time,
            attitude,
            position_sigma: errors.position,
            reading_sigma: errors.reading,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::log;
    use crate::imu::InstallationForm;
    use crate::units::{ARCSEC, DEG_PER_H, DEGREE, PPM};

    fn demo() -> Scenario {
        Scenario::load("demo").unwrap()
    }

    #[test]
    fn the_same_seed_and_stream_give_the_same_bits_and_others_do_not() {
        let scenario = demo();
        let once = scenario.simulate(7, 3).unwrap();
        assert_eq!(once, scenario.simulate(7, 3).unwrap());
        assert_ne!(once.truth, scenario.simulate(7, 4).unwrap().truth);
        assert_ne!(once.truth, scenario.simulate(8, 3).unwrap().truth);
    }

    #[test]
    fn the_table_s_errors_move_neither_truth_nor_noise() {
        let plain = demo().simulate(7, 3).unwrap();
        let mut scenario = demo();
        scenario.table.errors.position *= 10.0;
        scenario.table.errors.reading = 0.0;
        let other = scenario.simulate(7, 3).unwrap();
        assert_eq!(plain.truth, other.truth);
        assert_eq!(plain.run.imu, other.run.imu);
        assert_ne!(plain.run.table, other.run.table);
    }

    #[test]
    fn the_paper_s_draw_keeps_its_bounds_in_every_form() {
        for form in InstallationForm::ALL {
            let mut scenario = demo();
            scenario.installation = models_installation(form);
            let of_form = scenario.simulate(1, 0).unwrap();
            for stream in 0..50 {
                let truth = PerSensor::from_fn(|sensor| {
                    scenario.draw_truth(sensor, &mut Draws::GyroTruth.generator(2, stream))
                });
                for (triad, scale) in [(truth.gyro, 2500.0), (truth.accel, 5e6 / 700.0)] {
                    assert_eq!(triad.form, form);
                    assert!((triad.scale.add_scalar(-1.0)).amax() <= scale * PPM);
                    assert!(triad.angles.amax() <= 0.1 * DEGREE);
                    assert!(
                        triad.angles.iter().filter(|a| **a != 0.0).count()
                            == form.angle_names().len()
                    );
                }
                assert!(
                    truth
                        .gyro
                        .bias
                        .iter()
                        .all(|d| (d / DEG_PER_H - 25.0).abs() <= 2.5)
                );
                assert!(
                    truth
                        .accel
                        .bias
                        .iter()
                        .all(|d| (d - 20.0 / 700.0).abs() <= 5.0 / 700.0 + 1e-9)
                );
            }
            assert_eq!(of_form.truth.gyro.form, form);
        }
    }

    fn models_installation(form: InstallationForm) -> crate::models::InstallationModel {
        crate::models::InstallationModel::load(form.name()).unwrap()
    }

    #[test]
    fn the_prior_is_the_draw_s_mean_and_standard_deviation() {
        let prior = demo().simulate(1, 0).unwrap().run.prior;
        let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-6;
        assert!(close(prior.gyro.scale_sigma.x, 2500.0 * PPM / 3f64.sqrt()));
        assert!(close(
            prior.gyro.installation_sigma.y,
            360.0 * ARCSEC / 3f64.sqrt()
        ));
        assert!(close(prior.gyro.bias.z, 25.0 * DEG_PER_H));
        assert!(close(prior.accel.bias.x, 20.0 / 700.0));
        assert!(close(prior.accel.bias_sigma.x, 5.0 / 700.0 / 3f64.sqrt()));
    }

    #[test]
    fn a_position_error_stays_while_the_table_stands_and_is_new_after_each_move() {
        let mut scenario = demo();
        scenario.table.errors.reading = 0.0;
        let table = scenario.simulate(1, 0).unwrap().run.table.unwrap();
        let motion = Motion::new(
            &scenario.table,
            &scenario.path,
            &Imperfection::none(&scenario.table),
        )
        .unwrap();
        assert_eq!(table.time[0], 0.0);
        let mut positions: Vec<(usize, Vector3<f64>)> = Vec::new();
        for (&time, attitude) in table.time.iter().zip(&table.attitude) {
            // Reading = exp(−[τ×]) true.
            let tau = -log(&(attitude * motion.at(time).attitude.transpose()));
            match positions.last() {
                Some((position, of_position)) if *position == motion.position(time) => {
                    assert!((tau - of_position).norm() < 1e-14);
                }
                _ => positions.push((motion.position(time), tau)),
            }
        }
        assert_eq!(positions.len(), motion.dwells().count());
        let mean_square = positions
            .iter()
            .map(|(_, tau)| tau.norm_squared())
            .sum::<f64>()
            / (3 * positions.len()) as f64;
        assert!((mean_square.sqrt() / scenario.table.errors.position - 1.0).abs() < 0.4);
    }

    #[test]
    fn level_and_north_errors_move_the_truth_but_not_the_reading() {
        let mut crooked = demo();
        crooked.table.errors.level = 5.0 * ARCSEC;
        crooked.table.errors.north = 20.0 * ARCSEC;
        crooked.table.errors.nonorthogonality = 3.0 * ARCSEC;
        let [plain, crooked] = [demo(), crooked].map(|scenario| scenario.simulate(1, 0).unwrap());
        assert_eq!(plain.run.table, crooked.run.table);
        assert_ne!(plain.run.imu.accel, crooked.run.imu.accel);
    }

    #[test]
    fn pulses_add_up_to_the_increments_within_a_count() {
        let pulses = demo().simulate(1, 0).unwrap().run.imu;
        let increments = Scenario {
            output: Output::Increment,
            ..demo()
        }
        .simulate(1, 0)
        .unwrap()
        .run
        .imu;
        for (counted, integral, pulse) in [
            (&pulses.gyro, &increments.gyro, pulses.pulse.gyro),
            (&pulses.accel, &increments.accel, pulses.pulse.accel),
        ] {
            let mut lag = Vector3::zeros();
            for (counted, integral) in counted.iter().zip(integral) {
                let counts = counted / pulse;
                assert!((counts - counts.map(f64::round)).amax() < 1e-6);
                lag += counted - integral;
                assert!(lag.amax() < 0.5001 * pulse);
            }
        }
    }

    #[test]
    fn what_standing_still_leaves_beside_the_model_is_the_stated_random_walk() {
        let scenario = Scenario {
            output: Output::Increment,
            ..demo()
        };
        let simulated = scenario.simulate(1, 0).unwrap();
        let imu = &simulated.run.imu;
        // The first dwell: model output is constant, so the scatter is the noise.
        let still = 0..5900;
        for (samples, noise) in [
            (&imu.gyro, &simulated.run.noise.gyro),
            (&imu.accel, &simulated.run.noise.accel),
        ] {
            let samples = &samples[still.clone()];
            let mean = samples.iter().sum::<Vector3<f64>>() / samples.len() as f64;
            let variance = samples
                .iter()
                .map(|s| (s - mean).norm_squared())
                .sum::<f64>()
                / (3 * samples.len()) as f64;
            let density = (variance / imu.period).sqrt();
            assert!((density / noise.random_walk - 1.0).abs() < 0.02);
        }
    }
}
