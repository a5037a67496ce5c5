//! An instrument in a climatic chamber: its temperature as a function of time, and its true parameters.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use crate::imu::{
    HIGHEST_ORDER, InstallationForm, PARAMETERS, PerSensor, RATE, ThermalCoefficients,
    ThermalRange, ThermalValues, Triad, TriadVector,
};
use crate::models::ThermalVariation;
use crate::recording::{TEMPERATURE_SPACING, Temperature};

/// A climatic chamber, with the thermal response of the instrument.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Chamber {
    /// Time in s and temperature of the chamber in °C. The temperature is linear between points, and constant before
    /// the first and after the last point. The instrument starts soaked at the first temperature.
    pub profile: Vec<(f64, f64)>,
    /// Time constant of the instrument in the chamber, s; with zero, the instrument follows the chamber at once.
    pub time_constant: f64,
    /// White noise of one-second means from the temperature sensor, K.
    pub sensor_noise: f64,
}

/// Step of the instrument's temperature, s.
const STEP: f64 = 1.0;

impl Chamber {
    /// A constant temperature, °C.
    pub fn soak(temperature: f64) -> Self {
        Self {
            profile: vec![(0.0, temperature)],
            time_constant: 0.0,
            sensor_noise: 0.0,
        }
    }

    fn at(&self, time: f64) -> f64 {
        let after = self.profile.partition_point(|&(t, _)| t <= time);
        match (
            after.checked_sub(1).and_then(|k| self.profile.get(k)),
            self.profile.get(after),
        ) {
            (Some(&(t0, from)), Some(&(t1, to))) => from + (to - from) * (time - t0) / (t1 - t0),
            (Some(&(_, value)), None) | (None, Some(&(_, value))) => value,
            (None, None) => 0.0,
        }
    }

    /// The instrument's temperature and temperature rate at every second of a duration in s.
    pub(super) fn instrument(&self, duration: f64) -> Warming {
        let steps = (duration / STEP).ceil() as usize + 1;
        let keep = if self.time_constant > 0.0 {
            (-STEP / self.time_constant).exp()
        } else {
            0.0
        };
        let mut at = self.at(0.0);
        let mut values = vec![at];
        for k in 1..=steps {
            // A ramp within a step is counted from the middle of the step on.
            let chamber = self.at((k as f64 - 0.5 * f64::from(keep > 0.0)) * STEP);
            at = chamber + (at - chamber) * keep;
            values.push(at);
        }
        Warming { values }
    }
}

/// Temperature of an instrument at intervals of one second.
#[derive(Debug, Clone, PartialEq)]
pub struct Warming {
    values: Vec<f64>,
}

impl Warming {
    /// Temperature at a time, °C, and its rate, K/s.
    pub fn at(&self, time: f64) -> (f64, f64) {
        let last = self.values.len() - 2;
        let at = (time / STEP).max(0.0);
        let k = (at as usize).min(last);
        let rate = (self.values[k + 1] - self.values[k]) / STEP;
        (self.values[k] + rate * (at - k as f64) * STEP, rate)
    }

    /// Output of the temperature sensor.
    pub fn recorded(&self, duration: f64, noise: f64, rng: &mut ChaCha8Rng) -> Option<Temperature> {
        let spans = (duration / TEMPERATURE_SPACING).ceil() as usize;
        let middle = 0.5 * TEMPERATURE_SPACING;
        let values = (0..spans).map(|k| {
            let unit: f64 = StandardNormal.sample(rng);
            self.at(k as f64 * TEMPERATURE_SPACING + middle).0 + noise * unit
        });
        Temperature::new(middle, vec![values.collect()], PerSensor::default())
    }
}

/// True temperature dependence of a simulated instrument.
#[derive(Debug, Clone, PartialEq)]
pub struct ThermalTruth {
    /// Reference temperature of [`super::Simulated::truth`], °C.
    pub reference: f64,
    /// Coefficients of each triad for T, T² and dT/dt: per K, K² and K/s.
    pub by: PerSensor<[TriadVector; 3]>,
}

impl ThermalTruth {
    pub(super) fn draw(
        variation: &PerSensor<ThermalVariation>,
        form: InstallationForm,
        reference: f64,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let by = PerSensor::from_fn(|sensor| {
            variation.get(sensor).sigma().map(|sigma| {
                TriadVector::from_fn(|parameter, _| {
                    let unit: f64 = StandardNormal.sample(rng);
                    if Triad::has_parameter(form, parameter) {
                        sigma[parameter] * unit
                    } else {
                        0.0
                    }
                })
            })
        });
        Self { reference, by }
    }

    /// Change of a triad's parameters from those at the reference, at a temperature in °C and its rate in
    /// K/s.
    fn change(&self, by: &[TriadVector; 3], temperature: f64, rate: f64) -> TriadVector {
        let t = temperature - self.reference;
        by[0] * t + by[1] * (t * t) + by[2] * rate
    }

    /// Both triads at a temperature, given the triads at the reference temperature.
    pub fn at(&self, triads: &PerSensor<Triad>, temperature: f64, rate: f64) -> PerSensor<Triad> {
        PerSensor::from_fn(|sensor| {
            let triad = triads.get(sensor);
            let change = self.change(self.by.get(sensor), temperature, rate);
            Triad::from_vector(triad.form, &(triad.to_vector() + change))
        })
    }

    /// Re-expands the polynomials over another range, which is exact for polynomials of the same order.
    pub fn coefficients(&self, range: &PerSensor<ThermalRange>) -> PerSensor<ThermalCoefficients> {
        PerSensor::from_fn(|sensor| {
            let (range, by) = (range.get(sensor), self.by.get(sensor));
            let span = (range.highest - range.lowest).max(1.0);
            let nodes: [f64; HIGHEST_ORDER] =
                std::array::from_fn(|k| range.reference + span * (k as f64 + 1.0));
            let functions = nodes.map(|t| range.values(t, 0.0));
            let matrix =
                nalgebra::SMatrix::<f64, HIGHEST_ORDER, HIGHEST_ORDER>::from_fn(|row, column| {
                    functions[row][column]
                });
            let lu = matrix.lu();
            let mut coefficients = ThermalCoefficients::zeros();
            let base = self.change(by, range.reference, 0.0);
            for parameter in 0..PARAMETERS {
                let values = SVector::<f64, HIGHEST_ORDER>::from_fn(|row, _| {
                    self.change(by, nodes[row], 0.0)[parameter] - base[parameter]
                });
                let solved = lu.solve(&values).unwrap_or_default();
                let mut of = ThermalValues::zeros();
                of.fixed_rows_mut::<HIGHEST_ORDER>(0).copy_from(&solved);
                of[RATE] = by[2][parameter] * range.largest_rate;
                coefficients.set_row(parameter, &of.transpose());
            }
            coefficients
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use rand::SeedableRng;

    #[test]
    fn an_instrument_lags_behind_a_ramp_by_its_time_constant() {
        let chamber = Chamber {
            profile: vec![(0.0, 0.0), (36_000.0, 360.0)],
            time_constant: 300.0,
            sensor_noise: 0.0,
        };
        let warming = chamber.instrument(20_000.0);
        let (temperature, rate) = warming.at(10_000.0);
        assert_relative_eq!(temperature, 0.01 * (10_000.0 - 300.0), epsilon = 1e-3);
        assert_relative_eq!(rate, 0.01, epsilon = 1e-9);
    }

    #[test]
    fn coefficients_of_a_range_are_the_same_instrument_at_every_temperature() {
        let variation = ThermalVariation::for_test();
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let form = InstallationForm::General;
        let of = PerSensor {
            gyro: variation,
            accel: variation,
        };
        let truth = ThermalTruth::draw(&of, form, 25.0, &mut rng);
        let range = PerSensor::from_fn(|_| ThermalRange {
            lowest: -20.0,
            highest: 60.0,
            reference: 10.0,
            largest_rate: 0.02,
        });
        let coefficients = truth.coefficients(&range);
        let ideal = PerSensor::from_fn(|_| Triad::ideal(form));
        let at_reference = truth.at(&ideal, 10.0, 0.0);
        for (temperature, rate) in [(-20.0, 0.0), (31.0, 0.01), (60.0, -0.02)] {
            let there = truth.at(&ideal, temperature, rate);
            let values = [range.gyro.values(temperature, rate); 3];
            let warmed = at_reference.gyro.warmed(&coefficients.gyro, &values);
            assert_relative_eq!(warmed.to_vector(), there.gyro.to_vector(), epsilon = 1e-12);
        }
    }
}
