//! The temperatures of recordings: range, and number of distinct temperatures.

use crate::calibration::problem::Stretch;
use crate::calibration::{CalibrationError, Problem, parameter};
use crate::imu::{
    HIGHEST_ORDER, ParameterKind, PerSensor, RATE, Sensor, ThermalCoefficients, ThermalModel, Triad,
};
use crate::recording::Temperature;
use crate::units::MINUTE;

/// Recordings within this many kelvin count as one temperature, because of the self-heating of a soaked instrument.
const ONE_TEMPERATURE: f64 = 1.0;

/// Span over which a parameter usually changes by as much as an instrument of its grade differs from another: the
/// −40 to 85 °C of data sheets, K.
const SPECIFIED: f64 = 125.0;
/// Usual change due to each further order, relative to that of the preceding order.
const HIGHER: f64 = 1.0 / 3.0;
/// Usual lag of the temperature of the sensing element, s.
const LAG: f64 = 60.0;

/// Options for the temperature dependence of parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TemperatureOptions {
    /// Highest polynomial order to try, at most [`HIGHEST_ORDER`].
    pub highest_order: usize,
    /// Whether biases may also depend on the temperature rate.
    pub rate: bool,
    /// Reference temperature of the parameters, °C; `None` for the middle of the range.
    pub reference: Option<f64>,
}

impl Default for TemperatureOptions {
    fn default() -> Self {
        Self {
            highest_order: 3,
            rate: true,
            reference: None,
        }
    }
}

/// The polynomials that the dwell temperatures of a problem support; `None` for a single temperature.
pub fn model(
    problem: &Problem,
    options: TemperatureOptions,
) -> Result<Option<ThermalModel>, CalibrationError> {
    let mut known = Vec::new();
    for (number, run) in problem.runs().enumerate() {
        let temperature = run.recording.imu.temperature.as_ref();
        known.push(temperature.ok_or_else(|| CalibrationError::NoTemperature {
            recording: run.recording.name.clone(),
            number: number + 1,
        })?);
    }
    let mut range = Temperature::seen(known.into_iter());
    if let Some(reference) = options.reference {
        range.gyro.reference = reference;
        range.accel.reference = reference;
    }
    let order = PerSensor::from_fn(|sensor| {
        let most = distinct(problem, sensor).saturating_sub(1);
        most.min(options.highest_order).min(HIGHEST_ORDER)
    });
    let sigma = PerSensor::from_fn(|sensor| {
        let changes = options.rate && range.get(sensor).largest_rate > 0.0;
        ThermalCoefficients::from_fn(|of_triad, function| {
            let on = match function {
                RATE => changes && Triad::kind(of_triad) == ParameterKind::Bias,
                _ => function < *order.get(sensor),
            };
            let sigma = problem.model.prior_sigma[parameter(sensor, of_triad)];
            let range = range.get(sensor);
            let span = match function {
                RATE => LAG * range.largest_rate,
                _ => HIGHER.powi(function as i32) * (range.highest - range.lowest),
            };
            if on { sigma * span / SPECIFIED } else { 0.0 }
        })
    });
    let any = order.gyro + order.accel > 0;
    Ok(any.then_some(ThermalModel { range, sigma }))
}

/// Number of temperatures in dwells, averaged over a triad's axes, that are far enough apart for a polynomial of the
/// highest order.
fn distinct(problem: &Problem, sensor: Sensor) -> usize {
    let of_stretch = |stretch: &Stretch| {
        let imu = &stretch.run.recording.imu;
        let minute = ((MINUTE / imu.period) as usize).max(1);
        let each = stretch.dwells.iter().flat_map(|dwell| {
            let samples = dwell.samples.clone();
            samples.step_by(minute).chain([dwell.samples.end])
        });
        let at = |sample: usize| Some(imu.temperature.as_ref()?.at(imu.time(sample)));
        let mean = |axes: PerSensor<[f64; 3]>| axes.get(sensor).iter().sum::<f64>() / 3.0;
        each.filter_map(at).map(mean).collect::<Vec<f64>>()
    };
    let mut all: Vec<f64> = problem.stretches().iter().flat_map(of_stretch).collect();
    all.sort_by(f64::total_cmp);
    let (Some(first), Some(last)) = (all.first(), all.last()) else {
        return 0;
    };
    let apart = ((last - first) / (2 * HIGHEST_ORDER) as f64).max(ONE_TEMPERATURE);
    let (mut count, mut before) = (0, f64::NEG_INFINITY);
    for &temperature in &all {
        if temperature - before > apart {
            count += 1;
            before = temperature;
        }
    }
    count
}
