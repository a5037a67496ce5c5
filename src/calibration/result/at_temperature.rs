//! Conversion of a calibration to an estimate, and of a temperature-dependent calibration to one temperature.

use nalgebra::{DMatrix, DVector, Vector3};
use thiserror::Error;

use super::record::correction_of;
use super::thermal_record::{CoefficientRecord, TOLERANCE};
use super::{Calibration, FORMAT, TriadRecord, triads_of};
use crate::calibration::parameters::factor;
use crate::calibration::{
    Coefficient, PARAMETERS, ParameterMatrix, ParameterVector, Thermal, from_vector,
    parameter_index, parameter_name, to_vector,
};
use crate::imu::{
    Nominal, PerSensor, Sensor, ThermalModel, ThermalState, thermal_state_everywhere,
};

/// Converts triads, which remain in the quantity of the file.
const ONE: PerSensor<Nominal> = PerSensor {
    gyro: Nominal(Vector3::new(1.0, 1.0, 1.0)),
    accel: Nominal(Vector3::new(1.0, 1.0, 1.0)),
};

/// Errors of a calibration at a temperature.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum TemperatureError {
    /// The temperature is out of range.
    #[error(
        "{found} °C is outside {lowest} to {highest} °C, where the polynomials of the {} are valid. Calibrate over a \
         range that includes it", .sensor.name()
    )]
    Outside {
        /// The triad.
        sensor: Sensor,
        /// The temperature.
        found: f64,
        /// Lower end of the valid range.
        lowest: f64,
        /// Upper end of the valid range.
        highest: f64,
    },
    /// A coefficient belongs to an unknown parameter, or its order is invalid.
    #[error(
        "`{0}` in temperature.coefficients is not a parameter with a polynomial of order 1 to 5. Correct the file"
    )]
    Unknown(String),
}

impl Calibration {
    /// The calibration at one constant temperature of all axes, °C, with its covariance at this temperature; the result
    /// does not depend on temperature. A calibration without temperature dependence is returned unchanged.
    ///
    /// # Errors
    /// Returns an error if the temperature is out of range, or a coefficient has an unknown parameter.
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
        self.in_state(&thermal_state_everywhere(&thermal.range, temperature, 0.0))
    }

    /// The calibration for these values of the functions of temperature.
    ///
    /// # Errors
    /// Returns an error if a coefficient belongs to no parameter.
    pub fn in_state(&self, state: &ThermalState) -> Result<Self, TemperatureError> {
        let Some(thermal) = self.thermal()? else {
            return Ok(self.clone());
        };
        let form = self.installation_form.unwrap_or_default();
        let places = self.parameters.iter();
        let places: Vec<usize> = places
            .filter_map(|name| parameter_index(form, name))
            .collect();
        let covariance = self.covariance_by(&ONE).unwrap_or_default();
        let (change, covariance) = thermal.at(state, &covariance);
        let moved = to_vector(&triads_of(self, &ONE, form)) + change;
        let triads = from_vector(form, &moved);
        let [gyro, accel] =
            Sensor::ALL.map(|sensor| TriadRecord::new(triads.get(sensor), ONE.get(sensor)));
        let sigma = covariance.diagonal().map(|v| v.max(0.0).sqrt());
        let row = |&i: &usize| places.iter().map(|&j| covariance[(i, j)]).collect();
        Ok(Self {
            correction: self.correction.and(correction_of(&triads, &ONE)),
            test_vectors: Vec::new(),
            // The budget is that of the reference temperature.
            budget: None,
            format: FORMAT.to_owned(),
            temperature: None,
            covariance: if self.covariance.is_empty() {
                Vec::new()
            } else {
                places.iter().map(row).collect()
            },
            sigma: self
                .sigma
                .map(|_| TriadRecord::of_both_sigma(form, &sigma, &ONE)),
            gyro,
            accel,
            ..self.clone()
        })
    }

    /// Covariance of the parameters of the record, normalised by nominal scales. If correlations are missing, the
    /// covariance follows from σ alone; if σ is missing too, it is zero. `None` if it does not match the named
    /// parameters.
    pub fn covariance_by(&self, nominal: &PerSensor<Nominal>) -> Option<ParameterMatrix> {
        let form = self.installation_form.unwrap_or_default();
        let factor = |index| factor(nominal, index);
        if self.covariance.is_empty() && self.parameters.is_empty() {
            let sigma = ParameterVector::from_fn(|index, _| {
                let name = parameter_name(form, index);
                let sigma = name.and_then(|name| self.sigma_of(&name).copied());
                sigma.unwrap_or(0.0) / factor(index)
            });
            return Some(ParameterMatrix::from_diagonal(
                &sigma.map(|sigma| sigma * sigma),
            ));
        }
        let names = self.parameters.iter();
        let places: Vec<usize> = names
            .map(|name| parameter_index(form, name))
            .collect::<Option<_>>()?;
        let is_whole = |row: &Vec<f64>| row.len() == places.len();
        if !self.covariance.iter().all(is_whole) || self.covariance.len() != places.len() {
            return None;
        }
        let mut covariance = ParameterMatrix::zeros();
        for (&i, row) in places.iter().zip(&self.covariance) {
            for (&j, value) in places.iter().zip(row) {
                covariance[(i, j)] = value / (factor(i) * factor(j));
            }
        }
        Some(covariance)
    }

    /// Temperature dependence of its parameters, in the file's quantity; `None` if constant.
    fn thermal(&self) -> Result<Option<Thermal>, TemperatureError> {
        let Some(of) = &self.temperature else {
            return Ok(None);
        };
        let form = self.installation_form.unwrap_or_default();
        let coefficient = |record: &CoefficientRecord| {
            let found = record.coefficient(form);
            found.ok_or_else(|| TemperatureError::Unknown(record.parameter.clone()))
        };
        let coefficients = of.coefficients.iter().map(coefficient);
        let coefficients: Vec<Coefficient> = coefficients.collect::<Result<_, _>>()?;
        let n = coefficients.len();
        let entry = |rows: &[Vec<f64>], i: usize, j: usize| {
            rows.get(i)
                .and_then(|row| row.get(j))
                .copied()
                .unwrap_or(0.0)
        };
        let mut cross = DMatrix::zeros(PARAMETERS, n);
        for (row, name) in self.parameters.iter().enumerate() {
            if let Some(index) = parameter_index(form, name) {
                for k in 0..n {
                    cross[(index, k)] = entry(&of.cross, row, k);
                }
            }
        }
        Ok(Some(Thermal {
            // A record does not contain prior knowledge.
            model: ThermalModel {
                range: of.range,
                sigma: PerSensor::default(),
            },
            values: DVector::from_fn(n, |k, _| of.coefficients[k].value),
            covariance: DMatrix::from_fn(n, n, |i, j| entry(&of.covariance, i, j)),
            coefficients,
            cross,
        }))
    }
}
