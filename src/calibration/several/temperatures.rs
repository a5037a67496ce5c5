//! The temperatures of recordings: range, and how many of them are distinct.

use crate::calibration::error::CalibrationError;
use crate::calibration::parameters::parameter;
use crate::calibration::problem::Problem;
use crate::imu::{
    HIGHEST_ORDER, ParameterKind, PerSensor, RATE, Sensor, ThermalCoefficients, ThermalModel,
    ThermalRange, Triad,
};
use crate::recording::Temperature;

/// Recordings within this many kelvin are at one temperature: what a soaked instrument changes by itself.
const ONE_TEMPERATURE: f64 = 1.0;

/// What a parameter may change by within the range, in σ of what is known of it beforehand: more than an
/// instrument of its grade, so that the data decide.
const CHANGE: f64 = 3.0;

/// How parameters follow temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TemperatureOptions {
    /// Highest order of the polynomials that is tried, at most [`HIGHEST_ORDER`].
    pub highest_order: usize,
    /// Whether biases may follow the rate of temperature, too.
    pub rate: bool,
    /// At which parameters are stated, °C; none: in the middle of the range.
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

/// Temperatures that a problem's dwells were at.
pub struct Temperatures {
    /// Of each dwell, the mean of a triad's axes, °C, ascending.
    of_dwells: PerSensor<Vec<f64>>,
    range: PerSensor<ThermalRange>,
}

impl Temperatures {
    pub fn of(problem: &Problem) -> Result<Self, CalibrationError> {
        for (number, run) in problem.runs().enumerate() {
            if run.recording.imu.temperature.is_none() {
                return Err(CalibrationError::NoTemperature {
                    recording: run.recording.name.clone(),
                    number: number + 1,
                });
            }
        }
        let runs = problem.runs();
        let known = runs.filter_map(|run| run.recording.imu.temperature.as_ref());
        let range = Temperature::seen(known.collect::<Vec<_>>().into_iter());
        let of_dwells = PerSensor::from_fn(|sensor| {
            let mut all: Vec<f64> = Vec::new();
            for stretch in problem.stretches() {
                let imu = &stretch.run.recording.imu;
                let Some(temperature) = &imu.temperature else {
                    continue;
                };
                for dwell in &stretch.dwells {
                    for edge in [dwell.samples.start, dwell.samples.end] {
                        let axes = temperature.at(imu.time(edge));
                        all.push(axes.get(sensor).iter().sum::<f64>() / 3.0);
                    }
                }
            }
            all.sort_by(f64::total_cmp);
            all
        });
        Ok(Self { of_dwells, range })
    }

    /// The polynomials that they support; none where the instrument was at one temperature.
    pub fn model(&self, problem: &Problem, options: TemperatureOptions) -> Option<ThermalModel> {
        let mut range = self.range;
        if let Some(reference) = options.reference {
            range.gyro.reference = reference;
            range.accel.reference = reference;
        }
        let order = PerSensor::from_fn(|sensor| {
            let most = self.distinct(sensor).saturating_sub(1);
            most.min(options.highest_order).min(HIGHEST_ORDER)
        });
        let any = order.gyro + order.accel > 0;
        any.then(|| model_of(problem, range, order, options.rate))
    }

    /// How many temperatures lie apart by as much as a polynomial of the highest order needs to tell them.
    fn distinct(&self, sensor: Sensor) -> usize {
        let all = self.of_dwells.get(sensor);
        let (Some(first), Some(last)) = (all.first(), all.last()) else {
            return 0;
        };
        let apart = ((last - first) / (2 * HIGHEST_ORDER) as f64).max(ONE_TEMPERATURE);
        let (mut count, mut before) = (0, f64::NEG_INFINITY);
        for &temperature in all {
            if temperature - before > apart {
                count += 1;
                before = temperature;
            }
        }
        count
    }
}

/// 1σ of a triad's coefficients before the recordings, of polynomials up to an order.
fn prior_sigma(problem: &Problem, sensor: Sensor, order: usize, rate: bool) -> ThermalCoefficients {
    let model = &problem.model;
    ThermalCoefficients::from_fn(|of_triad, function| {
        let on = match function {
            RATE => rate && Triad::kind(of_triad) == ParameterKind::Bias,
            _ => function < order.min(HIGHEST_ORDER),
        };
        let sigma = model.prior_sigma[parameter(sensor, of_triad)];
        if on { CHANGE * sigma } else { 0.0 }
    })
}

/// The model of polynomials up to an order in these ranges.
fn model_of(
    problem: &Problem,
    range: PerSensor<ThermalRange>,
    order: PerSensor<usize>,
    rate: bool,
) -> ThermalModel {
    ThermalModel {
        sigma: PerSensor::from_fn(|sensor| {
            let changes = range.get(sensor).largest_rate > 0.0;
            prior_sigma(problem, sensor, *order.get(sensor), rate && changes)
        }),
        range,
    }
}
