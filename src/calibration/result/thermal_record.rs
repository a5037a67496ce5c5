//! How a calibration changes with temperature, as a file holds it, and the calibration at one temperature.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::calibration::estimate::Estimate;
use crate::calibration::outcome::Outcome;
use crate::calibration::parameters::{PARAMETERS, parameter_name, sensor_and_parameter};
use crate::calibration::several::thermal::Thermal;
use crate::imu::{
    AXES, InstallationForm, Nominal, PerSensor, RATE, Sensor, ThermalCoefficients, ThermalRange,
    ThermalState, ThermalValues, powers,
};
use crate::run::Run;

/// The equation of the record.
const EQUATION: &str = "p(T) = p + sum_k c_k (P_k(tau) - P_k(tau_ref)) + c_rate (dT/dt) / largest_rate_k_per_s; \
                        tau = (2 T - lowest - highest) / (highest - lowest); P_k Legendre; p stands in scale, \
                        installation (off the diagonal) and bias. powers: the same as sum_k a_k (T - reference)^k.";

/// Beyond its range a polynomial is not known; by so many kelvin a sensor may be off.
pub const TOLERANCE: f64 = 1.0;

/// How the parameters of a calibration change with temperature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ThermalRecord {
    /// What the figures mean.
    #[serde(default)]
    pub equation: String,
    /// Where they hold, by triad; the calibration itself is at the reference.
    pub range: PerSensor<RangeRecord>,
    /// The coefficients, in the units of their parameters.
    pub coefficients: Vec<CoefficientRecord>,
    /// Their covariance, in this order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub covariance: Vec<Vec<f64>>,
    /// Covariance of the calibration's `parameters` (rows) with them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cross: Vec<Vec<f64>>,
    /// Coefficients of the powers of T − reference in K from the first on, by parameter.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub powers: BTreeMap<String, Vec<f64>>,
}

/// The range of a triad's polynomials.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RangeRecord {
    /// Lowest temperature.
    pub lowest_degc: f64,
    /// Highest temperature.
    pub highest_degc: f64,
    /// Temperature of the calibration.
    pub reference_degc: f64,
    /// Largest magnitude of the rate of temperature.
    pub largest_rate_k_per_s: f64,
}

/// One coefficient.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CoefficientRecord {
    /// The parameter that it changes.
    pub parameter: String,
    /// The order of its polynomial; none: it follows the rate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub order: Option<usize>,
    /// In the unit of the parameter.
    pub value: f64,
    /// 1σ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma: Option<f64>,
}

/// A recording of a calibration from several.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordingRecord {
    /// Its name.
    pub name: String,
    /// Mean temperature of its dwells, of all axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_degc: Option<f64>,
    /// Its parameters alone, by name; none where it alone gives no calibration.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub alone: BTreeMap<String, ValueRecord>,
    /// By how much its parameters differ from what all have in common; `mounting.x` and so on, in rad: how the whole
    /// instrument is turned on its mounting face, about body axes.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub own: BTreeMap<String, ValueRecord>,
}

/// A value with its 1σ.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ValueRecord {
    /// In the unit of its parameter.
    pub value: f64,
    /// 1σ.
    pub sigma: f64,
}

impl From<&ThermalRange> for RangeRecord {
    fn from(range: &ThermalRange) -> Self {
        Self {
            lowest_degc: range.lowest,
            highest_degc: range.highest,
            reference_degc: range.reference,
            largest_rate_k_per_s: range.largest_rate,
        }
    }
}

impl From<&RangeRecord> for ThermalRange {
    fn from(range: &RangeRecord) -> Self {
        Self {
            lowest: range.lowest_degc,
            highest: range.highest_degc,
            reference: range.reference_degc,
            largest_rate: range.largest_rate_k_per_s,
        }
    }
}

impl ThermalRecord {
    /// Of estimates at the reference and of coefficients, in the file's quantity.
    pub(in crate::calibration) fn of(thermal: &Thermal, estimate: &Estimate, run: &Run) -> Self {
        let form = estimate.form();
        let factor = |index: usize| {
            let (sensor, of_triad) = sensor_and_parameter(index);
            run.instrument.nominal.get(sensor).factor(of_triad)
        };
        let of = |k: usize| factor(thermal.coefficients[k].index());
        let n = thermal.coefficients.len();
        let names = thermal.coefficients.iter().enumerate();
        let coefficients = names.filter_map(|(k, coefficient)| {
            Some(CoefficientRecord {
                parameter: parameter_name(form, coefficient.index())?,
                order: (coefficient.function != RATE).then_some(coefficient.function + 1),
                value: thermal.values[k] * of(k),
                sigma: Some(thermal.covariance[(k, k)].max(0.0).sqrt() * of(k).abs()),
            })
        });
        let all = thermal.coefficients();
        let mut by_powers = BTreeMap::new();
        for index in 0..PARAMETERS {
            let (order, _) = thermal.order(index);
            let (sensor, of_triad) = sensor_and_parameter(index);
            if let (Some(name), 1..) = (parameter_name(form, index), order) {
                let range = thermal.model.range.get(sensor);
                let row: ThermalValues = all.get(sensor).row(of_triad).transpose();
                let of_powers = powers(range, &row).map(|a| a * factor(index));
                by_powers.insert(name, of_powers[..order].to_vec());
            }
        }
        let estimated = estimate.estimated();
        Self {
            equation: EQUATION.to_owned(),
            range: PerSensor::from_fn(|sensor| thermal.model.range.get(sensor).into()),
            coefficients: coefficients.collect(),
            covariance: (0..n)
                .map(|i| {
                    let row = (0..n).map(|j| thermal.covariance[(i, j)] * of(i) * of(j));
                    row.collect()
                })
                .collect(),
            cross: estimated
                .map(|i| {
                    let row = (0..n).map(|j| thermal.cross[(i, j)] * factor(i) * of(j));
                    row.collect()
                })
                .collect(),
            powers: by_powers,
        }
    }

    /// Of a known truth, in the file's quantity.
    pub fn of_truth(
        range: &PerSensor<ThermalRange>,
        coefficients: &PerSensor<ThermalCoefficients>,
        run: &Run,
    ) -> Self {
        let form = InstallationForm::General;
        let mut all = Vec::new();
        let mut by_powers = BTreeMap::new();
        for index in 0..PARAMETERS {
            let (sensor, of_triad) = sensor_and_parameter(index);
            let factor = run.instrument.nominal.get(sensor).factor(of_triad);
            let row: ThermalValues = coefficients.get(sensor).row(of_triad).transpose();
            let Some(name) = parameter_name(form, index) else {
                continue;
            };
            for function in (0..row.len()).filter(|&function| row[function] != 0.0) {
                all.push(CoefficientRecord {
                    parameter: name.clone(),
                    order: (function != RATE).then_some(function + 1),
                    value: row[function] * factor,
                    sigma: None,
                });
            }
            let of_powers = powers(range.get(sensor), &row).map(|a| a * factor);
            by_powers.insert(name, of_powers.to_vec());
        }
        Self {
            equation: EQUATION.to_owned(),
            range: PerSensor::from_fn(|sensor| range.get(sensor).into()),
            coefficients: all,
            covariance: Vec::new(),
            cross: Vec::new(),
            powers: by_powers,
        }
    }

    /// Whether all temperatures lie in their ranges.
    pub fn holds(&self, temperatures: &PerSensor<[f64; 3]>) -> bool {
        Sensor::ALL.into_iter().all(|sensor| {
            let range = ThermalRange::from(self.range.get(sensor));
            let all = temperatures.get(sensor).iter();
            all.copied().all(|t| range.contains(t, TOLERANCE))
        })
    }

    /// The functions of temperature, for axes at temperatures in °C with rates in K/s.
    pub fn state(
        &self,
        temperatures: &PerSensor<[f64; 3]>,
        rates: &PerSensor<[f64; 3]>,
    ) -> ThermalState {
        PerSensor::from_fn(|sensor| {
            let range = ThermalRange::from(self.range.get(sensor));
            let (t, rate) = (temperatures.get(sensor), rates.get(sensor));
            [0, 1, 2].map(|axis| range.values(t[axis], rate[axis]))
        })
    }
}

impl RecordingRecord {
    /// Of each recording of an outcome, in the file's quantity.
    pub(in crate::calibration) fn all(outcome: &Outcome, run: &Run) -> Vec<Self> {
        let form = outcome.estimate.form();
        let nominal: &PerSensor<Nominal> = &run.instrument.nominal;
        let named = |index: usize, value: f64, sigma: f64| {
            let (sensor, of_triad) = sensor_and_parameter(index);
            let factor = nominal.get(sensor).factor(of_triad);
            let value = ValueRecord {
                value: value * factor,
                sigma: sigma * factor.abs(),
            };
            Some((parameter_name(form, index)?, value))
        };
        let all = outcome.alone.iter().enumerate();
        all.map(|(number, alone)| {
            let of = |estimate: &Estimate| {
                let (v, sigma) = (estimate.vector(), estimate.sigma());
                let estimated = estimate.estimated();
                estimated
                    .filter_map(|i| named(i, v[i], sigma[i]))
                    .collect::<BTreeMap<_, _>>()
            };
            let own = outcome.own.get(number).map(|own| {
                let (values, sigma) = (&own.values, &own.sigma);
                let differ = (0..PARAMETERS).filter(|&i| sigma.parameters[i] > 0.0);
                let parameters =
                    differ.filter_map(|i| named(i, values.parameters[i], sigma.parameters[i]));
                let turned = (0..3).filter(|&axis| sigma.mounting[axis] > 0.0);
                let mounting = turned.map(|axis| {
                    let value = ValueRecord {
                        value: values.mounting[axis],
                        sigma: sigma.mounting[axis],
                    };
                    (format!("mounting.{}", AXES[axis]), value)
                });
                parameters.chain(mounting).collect()
            });
            Self {
                name: alone.name.clone(),
                temperature_degc: alone.mean_temperature(),
                alone: alone.estimate.as_ref().map(of).unwrap_or_default(),
                own: own.unwrap_or_default(),
            }
        })
        .collect()
    }
}
