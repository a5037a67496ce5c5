//! A calibration that changes with temperature, at one.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use thiserror::Error;

use crate::calibration::parameters::{PARAMETERS, parameter, parameter_name, sensor_and_parameter};
use crate::calibration::result::record::{rows, sigma_rows};
use crate::calibration::result::thermal_record::{TOLERANCE, ThermalRecord};
use crate::calibration::result::{Calibration, FORMAT, TriadRecord};
use crate::imu::{
    InstallationForm, PerSensor, RATE, Sensor, ThermalRange, ThermalState, Triad, TriadVector,
};

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
            if !ThermalRange::from(range).contains(temperature, TOLERANCE) {
                return Err(TemperatureError::Outside {
                    sensor,
                    found: temperature,
                    lowest: range.lowest_degc,
                    highest: range.highest_degc,
                });
            }
        }
        let everywhere = PerSensor::from_fn(|_| [temperature; 3]);
        self.in_state(&thermal.state(&everywhere, &PerSensor::default()))
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
            let named = |&index: &usize| {
                parameter_name(form, index).as_ref() == Some(&coefficient.parameter)
            };
            let index = (0..PARAMETERS).find(named).ok_or_else(unknown)?;
            let function = match coefficient.order {
                None => RATE,
                Some(order @ 1..=RATE) => order - 1,
                Some(_) => return Err(unknown()),
            };
            let (sensor, of_triad) = sensor_and_parameter(index);
            let axis = Triad::axis(form, of_triad).ok_or_else(unknown)?;
            by[(index, k)] = state.get(sensor)[axis][function];
        }
        let values = DVector::from_fn(n, |k, _| thermal.coefficients[k].value);
        let change = &by * values;
        let places: Vec<usize> = self
            .parameters
            .iter()
            .filter_map(|name| {
                (0..PARAMETERS).find(|&i| parameter_name(form, i).as_ref() == Some(name))
            })
            .collect();
        let covariance = self.covariance_by(thermal, &by, &places);
        let variance = |index: usize| {
            let place = places.iter().position(|&p| p == index);
            place
                .and_then(|p| Some(*covariance.get(p)?.get(p)?))
                .unwrap_or(0.0)
        };
        let triad = |sensor: Sensor| {
            let record = match sensor {
                Sensor::Gyro => &self.gyro,
                Sensor::Accel => &self.accel,
            };
            moved(record, form, |of_triad| change[parameter(sensor, of_triad)])
        };
        let sigma = self.sigma.is_some().then(|| {
            PerSensor::from_fn(|sensor| {
                let sigma = TriadVector::from_fn(|of_triad, _| {
                    variance(parameter(sensor, of_triad)).max(0.0).sqrt()
                });
                sigma_rows(form, &sigma)
            })
        });
        let (gyro, accel) = (triad(Sensor::Gyro), triad(Sensor::Accel));
        let inverse = |record: &TriadRecord| Some(rows(&sensitivity(record).try_inverse()?));
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
    let bias = Vector3::from(record.bias);
    let triad = Triad::from_sensitivity(form, &sensitivity(record), bias);
    let v = triad.to_vector() + TriadVector::from_fn(|of_triad, _| change(of_triad));
    let triad = Triad::from_vector(form, &v);
    TriadRecord {
        scale: triad.scale.into(),
        installation: rows(&triad.installation()),
        bias: triad.bias.into(),
    }
}

fn sensitivity(record: &TriadRecord) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| record.scale[i] * record.installation[i][j])
}
