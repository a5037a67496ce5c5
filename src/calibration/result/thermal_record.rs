//! Temperature dependence of a calibration in the form stored in a file, and the calibration at one temperature.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::calibration::parameters::factor;
use crate::calibration::{
    Coefficient, Estimate, Outcome, Own, PARAMETERS, ParameterVector, Thermal, parameter_index,
    parameter_name, sensor_and_parameter,
};
use crate::imu::{
    AXES, HIGHEST_ORDER, InstallationForm, Nominal, PerSensor, RATE, Sensor, ThermalCoefficients,
    ThermalRange, ThermalValues, Triad, powers,
};
use crate::run::Run;

/// The equation of the record.
const EQUATION: &str = "p(T) = p + sum_k c_k (P_k(tau) - P_k(tau_ref)) + c_rate (dT/dt) / largest_rate_k_per_s; \
                        tau = (2 T - lowest - highest) / (highest - lowest); P_k Legendre; p stands in scale, \
                        installation (off the diagonal) and bias. powers: the same as sum_k a_k (T - reference)^k.";

/// Tolerance for the error of a temperature sensor in range checks, K.
pub const TOLERANCE: f64 = 1.0;

/// Temperature dependence of the parameters of a calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ThermalRecord {
    /// Meaning of the figures.
    #[serde(default)]
    pub equation: String,
    /// Temperature range of each triad; the calibration itself applies at the reference temperature.
    pub range: PerSensor<ThermalRange>,
    /// The coefficients, in the units of their parameters.
    pub coefficients: Vec<CoefficientRecord>,
    /// Covariance of the coefficients, in the same order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub covariance: Vec<Vec<f64>>,
    /// Covariance of the calibration's `parameters` (rows) with the coefficients.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cross: Vec<Vec<f64>>,
    /// Coefficients of the powers of T − reference in K, from the first power on, by parameter.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub powers: BTreeMap<String, Vec<f64>>,
}

/// One coefficient.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CoefficientRecord {
    /// Parameter.
    pub parameter: String,
    /// The order of the polynomial; `None` for the rate term.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub order: Option<usize>,
    /// The value, in the unit of the parameter.
    pub value: f64,
    /// 1σ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma: Option<f64>,
}

/// One recording of a joint calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordingRecord {
    /// Name.
    pub name: String,
    /// Mean temperature of all axes over the dwells of the recording.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_degc: Option<f64>,
    /// Parameters from the recording calibrated alone, by name; empty if this recording alone gives no calibration.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub alone: BTreeMap<String, ValueRecord>,
    /// Deviation of the parameters of the recording from the common parameters; `mounting.x` and so on, in rad, is the
    /// rotation of the whole instrument on its mounting face, about body axes.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub own: BTreeMap<String, ValueRecord>,
}

/// A value with its 1σ.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ValueRecord {
    /// The value, in the unit of the parameter.
    pub value: f64,
    /// 1σ.
    pub sigma: f64,
}

impl CoefficientRecord {
    /// The coefficient of a parameter and a function of temperature, by their indices; `None` if the form has no such
    /// parameter.
    fn new(
        (form, index, function): (InstallationForm, usize, usize),
        value: f64,
        sigma: Option<f64>,
    ) -> Option<Self> {
        Some(Self {
            parameter: parameter_name(form, index)?,
            order: (function != RATE).then_some(function + 1),
            value,
            sigma,
        })
    }

    /// Parameter and function in a form; `None` if it does not exist.
    pub(super) fn coefficient(&self, form: InstallationForm) -> Option<Coefficient> {
        let function = match self.order {
            None => RATE,
            Some(order @ 1..=RATE) => order - 1,
            Some(_) => return None,
        };
        let (sensor, parameter) = sensor_and_parameter(parameter_index(form, &self.parameter)?);
        Some(Coefficient {
            sensor,
            parameter,
            function,
            axis: Triad::axis(form, parameter)?,
        })
    }
}

impl ThermalRecord {
    /// The record of estimates at the reference and of coefficients, in the file's quantity.
    pub(in crate::calibration) fn of(thermal: &Thermal, estimate: &Estimate, run: &Run) -> Self {
        let (form, nominal) = (estimate.form(), &run.instrument.nominal);
        let of = |k: usize| factor(nominal, thermal.coefficients[k].index());
        let n = thermal.coefficients.len();
        let coefficients = (0..n).filter_map(|k| {
            let (coefficient, value) = (&thermal.coefficients[k], thermal.values[k] * of(k));
            let sigma = thermal.covariance[(k, k)].max(0.0).sqrt() * of(k).abs();
            let of = (form, coefficient.index(), coefficient.function);
            CoefficientRecord::new(of, value, Some(sigma))
        });
        let table = |rows: &mut dyn Iterator<Item = usize>, entry: &dyn Fn(usize, usize) -> f64| {
            rows.map(|i| (0..n).map(|j| entry(i, j)).collect())
                .collect()
        };
        let covariance = |i, j| thermal.covariance[(i, j)] * of(i) * of(j);
        let cross = |i, j| thermal.cross[(i, j)] * factor(nominal, i) * of(j);
        let orders = |index| Some(thermal.order(index).0).filter(|&order| order > 0);
        let (range, all) = (&thermal.model.range, thermal.coefficients());
        Self {
            equation: EQUATION.to_owned(),
            range: *range,
            coefficients: coefficients.collect(),
            covariance: table(&mut (0..n), &covariance),
            cross: table(&mut estimate.estimated(), &cross),
            powers: all_powers((form, nominal), range, &all, orders),
        }
    }

    /// The record of a known truth, in the file's quantity.
    pub fn of_truth(
        range: &PerSensor<ThermalRange>,
        coefficients: &PerSensor<ThermalCoefficients>,
        run: &Run,
    ) -> Self {
        let (form, nominal) = (InstallationForm::General, &run.instrument.nominal);
        let all = (0..PARAMETERS).flat_map(|index| {
            let row = functions(coefficients, index);
            let on = (0..row.len()).filter(move |&function| row[function] != 0.0);
            on.filter_map(move |function| {
                let value = row[function] * factor(nominal, index);
                CoefficientRecord::new((form, index, function), value, None)
            })
        });
        Self {
            equation: EQUATION.to_owned(),
            range: *range,
            coefficients: all.collect(),
            covariance: Vec::new(),
            cross: Vec::new(),
            powers: all_powers((form, nominal), range, coefficients, |_| {
                Some(HIGHEST_ORDER)
            }),
        }
    }

    /// Whether all temperatures are in range.
    pub fn holds(&self, temperatures: &PerSensor<[f64; 3]>) -> bool {
        Sensor::ALL.into_iter().all(|sensor| {
            let range = self.range.get(sensor);
            let all = temperatures.get(sensor).iter();
            all.copied().all(|t| range.contains(t, TOLERANCE))
        })
    }
}

/// Coefficients of a parameter's functions of temperature.
fn functions(all: &PerSensor<ThermalCoefficients>, index: usize) -> ThermalValues {
    let (sensor, of_triad) = sensor_and_parameter(index);
    all.get(sensor).row(of_triad).transpose()
}

/// Coefficients of powers of temperature of each parameter, up to its order, in the file's quantity.
fn all_powers(
    (form, nominal): (InstallationForm, &PerSensor<Nominal>),
    range: &PerSensor<ThermalRange>,
    all: &PerSensor<ThermalCoefficients>,
    order: impl Fn(usize) -> Option<usize>,
) -> BTreeMap<String, Vec<f64>> {
    let of = |index: usize| {
        let (name, order) = (parameter_name(form, index)?, order(index)?);
        let (sensor, _) = sensor_and_parameter(index);
        let powers = powers(range.get(sensor), &functions(all, index));
        let powers = powers.iter().map(|a| a * factor(nominal, index));
        Some((name, powers.take(order).collect()))
    };
    (0..PARAMETERS).filter_map(of).collect()
}

impl RecordingRecord {
    /// The record of each recording of an outcome, in the file's quantity.
    pub(in crate::calibration) fn all(outcome: &Outcome, run: &Run) -> Vec<Self> {
        let (form, nominal) = (outcome.estimate.form(), &run.instrument.nominal);
        let named = |values: &ParameterVector, sigma: &ParameterVector| {
            let known = (0..PARAMETERS).filter(|&i| sigma[i] > 0.0);
            let of = |i: usize| {
                let value = ValueRecord {
                    value: values[i] * factor(nominal, i),
                    sigma: sigma[i] * factor(nominal, i).abs(),
                };
                Some((parameter_name(form, i)?, value))
            };
            known.filter_map(of).collect::<BTreeMap<_, _>>()
        };
        let all = outcome.alone.iter().enumerate();
        all.map(|(number, alone)| {
            let estimate = alone.estimate.as_ref();
            let of_own = |own: &Own| {
                let (values, sigma) = (&own.values, &own.sigma);
                let turned = (0..3).filter(|&axis| sigma.mounting[axis] > 0.0);
                let mounting = turned.map(|axis| {
                    let (value, sigma) = (values.mounting[axis], sigma.mounting[axis]);
                    (
                        format!("mounting.{}", AXES[axis]),
                        ValueRecord { value, sigma },
                    )
                });
                let parameters = named(&values.parameters, &sigma.parameters);
                parameters.into_iter().chain(mounting).collect()
            };
            Self {
                name: alone.name.clone(),
                temperature_degc: alone.mean_temperature(),
                alone: estimate
                    .map(|of| named(&of.vector(), &of.sigma()))
                    .unwrap_or_default(),
                own: outcome.own.get(number).map(of_own).unwrap_or_default(),
            }
        })
        .collect()
    }
}
