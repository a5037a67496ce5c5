//! A calibration that changes with temperature, at one.

use nalgebra::{DMatrix, DVector, Vector3};
use thiserror::Error;

use crate::calibration::parameters::{
    PARAMETERS, parameter, parameter_index, sensor_and_parameter,
};
use crate::calibration::result::thermal_record::{TOLERANCE, ThermalRecord};
use crate::calibration::result::{Calibration, FORMAT, TriadRecord, rows};
use crate::imu::{InstallationForm, Nominal, PerSensor, Sensor, ThermalState, Triad, TriadVector};

/// Of a triad that stays in the file's quantity.
const ONE: Nominal = Nominal(Vector3::new(1.0, 1.0, 1.0));

/// Why there is no calibration at a temperature.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum TemperatureError {
    /// It lies outside.
    #[error(
        "{found} °C, expected {lowest} to {highest} °C: outside that the polynomials of the {} are not known; \
         calibrate at temperatures that reach there", .sensor.name()
    )]
    Outside {
        /// Which triad.
        sensor: Sensor,
        /// The temperature.
        found: f64,
        /// Lowest of the range.
        lowest: f64,
        /// Highest of the range.
        highest: f64,
    },
    /// A coefficient of what is no parameter, or of an order that does not exist.
    #[error(
        "`{0}` in temperature.coefficients is no parameter with a polynomial of order 1 to 5; correct the file"
    )]
    Unknown(String),
}

impl Calibration {
    /// The same at one temperature of all axes, °C, that does not change: a calibration without temperature, with
    /// the covariance that it has there. One that does not change with temperature is itself.
    ///
    /// # Errors
    /// If that lies outside its range, or coefficients are of no parameter.
    pub fn at_temperature(&self, temperature: f64) -> Result<Self, TemperatureError> {
        let Some(thermal) = &self.temperature else {
            return Ok(self.clone());
        };
        for sensor in Sensor::ALL {
            let range = thermal.range.get(sensor);
            if !range.contains(temperature, TOLERANCE) {
                return Err(TemperatureError::Outside {
                    sensor,
                    found: temperature,
                    lowest: range.lowest,
                    highest: range.highest,
                });
            }
        }
        let everywhere = PerSensor::from_fn(|_| [temperature; 3]);
        self.in_state(&thermal.range.state(&everywhere, &PerSensor::default()))
    }

    /// The same where the functions of temperature have these values.
    ///
    /// # Errors
    /// If coefficients are of no parameter.
    pub fn in_state(&self, state: &ThermalState) -> Result<Self, TemperatureError> {
        let Some(thermal) = &self.temperature else {
            return Ok(self.clone());
        };
        let form = self.installation_form.unwrap_or(InstallationForm::General);
        let n = thermal.coefficients.len();
        let mut by = DMatrix::zeros(PARAMETERS, n);
        for (k, coefficient) in thermal.coefficients.iter().enumerate() {
            let unknown = || TemperatureError::Unknown(coefficient.parameter.clone());
            let (index, function) = coefficient.place(form).ok_or_else(unknown)?;
            let (sensor, of_triad) = sensor_and_parameter(index);
            let axis = Triad::axis(form, of_triad).ok_or_else(unknown)?;
            by[(index, k)] = state.get(sensor)[axis][function];
        }
        let values = DVector::from_fn(n, |k, _| thermal.coefficients[k].value);
        let change = &by * values;
        let places: Vec<usize> = self
            .parameters
            .iter()
            .filter_map(|name| parameter_index(form, name))
            .collect();
        let covariance = self.covariance_by(thermal, &by, &places);
        let variance = |index: usize| {
            let place = places.iter().position(|&p| p == index);
            place
                .and_then(|p| Some(*covariance.get(p)?.get(p)?))
                .unwrap_or(0.0)
        };
        let triad = |sensor: Sensor| {
            moved(self.triad(sensor), form, |of_triad| {
                change[parameter(sensor, of_triad)]
            })
        };
        let sigma = self.sigma.is_some().then(|| {
            PerSensor::from_fn(|sensor| {
                let sigma = TriadVector::from_fn(|of_triad, _| {
                    variance(parameter(sensor, of_triad)).max(0.0).sqrt()
                });
                TriadRecord::of_sigma(form, &sigma, &ONE)
            })
        });
        let (gyro, accel) = (triad(Sensor::Gyro), triad(Sensor::Accel));
        let inverse = |record: &TriadRecord| Some(rows(&record.sensitivity().try_inverse()?));
        let correction = inverse(&gyro).zip(inverse(&accel));
        Ok(Self {
            correction: self
                .correction
                .and(correction.map(|(gyro, accel)| PerSensor { gyro, accel })),
            test_vectors: Vec::new(),
            format: FORMAT.to_owned(),
            temperature: None,
            covariance,
            sigma,
            gyro,
            accel,
            ..self.clone()
        })
    }

    /// Covariance of the parameters, moved by these weights of the coefficients.
    fn covariance_by(
        &self,
        thermal: &ThermalRecord,
        by: &DMatrix<f64>,
        places: &[usize],
    ) -> Vec<Vec<f64>> {
        let (m, n) = (self.covariance.len(), thermal.coefficients.len());
        if m == 0 || thermal.covariance.len() != n || thermal.cross.len() != m {
            return self.covariance.clone();
        }
        let weights = DMatrix::from_fn(m, n, |i, k| {
            places.get(i).map_or(0.0, |&place| by[(place, k)])
        });
        let entry = |of: &[Vec<f64>], i: usize, j: usize| {
            of.get(i).and_then(|row| row.get(j)).copied().unwrap_or(0.0)
        };
        let own = DMatrix::from_fn(m, m, |i, j| entry(&self.covariance, i, j));
        let cross = DMatrix::from_fn(m, n, |i, j| entry(&thermal.cross, i, j));
        let inner = DMatrix::from_fn(n, n, |i, j| entry(&thermal.covariance, i, j));
        let across = &cross * weights.transpose();
        let moved = own + &across + across.transpose() + &weights * inner * weights.transpose();
        moved
            .row_iter()
            .map(|row| row.iter().copied().collect())
            .collect()
    }
}

/// A triad whose parameters are changed, in the file's quantity.
fn moved(
    record: &TriadRecord,
    form: InstallationForm,
    change: impl Fn(usize) -> f64,
) -> TriadRecord {
    let v = record.triad(&ONE, form).to_vector();
    let v = v + TriadVector::from_fn(|of_triad, _| change(of_triad));
    TriadRecord::new(&Triad::from_vector(form, &v), &ONE)
}
