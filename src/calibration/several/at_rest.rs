//! Biases against temperature for an instrument that is never turned.
//!
//! In one attitude, scale factors, misalignments and the true input are constant, so each output is the bias of its
//! axis plus an unknown constant. Means over blocks give equations for the same constants as a recording with turns,
//! but without navigation. The temperature functions, the averaging over orders and the covariance are the same.
//! Navigation through such a recording does not converge if the biases wander: over two hours at 0.2 °/s, the
//! innovations are 20 times their σ.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, SVector};

use super::{TemperatureOptions, temperatures};
use crate::calibration::checks::observability::{not_observed, temperature_not_seen};
use crate::calibration::constants::triangle;
use crate::calibration::sizes::Candidates;
use crate::calibration::{
    Constant, Estimate, Finding, Known, Linearisation, Model, PARAMETERS, ParameterMatrix, Prior,
    Problem, Thermal, from_vector, parameter, parameter_name, sensor_and_parameter,
};
use crate::earth::ROTATION_RATE;
use crate::imu::{
    HIGHEST_ORDER, PARAMETERS as PER_TRIAD, ParameterKind, PerSensor, Sensor, ThermalRange,
    ThermalState, ThermalValues, Triad,
};
use crate::recording::TEMPERATURE_SPACING;
use crate::run::Run;

/// Longest duration of a block, s: residuals of neighbouring seconds are correlated, residuals of longer blocks hardly
/// are.
const BLOCK: f64 = 100.0;
/// Minimum number of blocks, for a shorter recording.
const FEWEST_BLOCKS: f64 = 30.0;

/// Biases of an instrument at rest against temperature.
#[derive(Debug, Clone)]
pub struct AtRest {
    /// The outputs at the reference temperature, which are used as the biases; no other parameters are estimated.
    pub outputs: Estimate,
    /// Change of the biases with temperature.
    pub thermal: Thermal,
    /// Means over consecutive blocks, for each bias.
    pub means: Vec<(usize, Vec<MeanAtRest>)>,
    /// Findings on parameters that the recording does not determine.
    pub findings: Vec<Finding>,
}

/// Mean output of an axis over a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanAtRest {
    /// Temperature in the middle, °C.
    pub temperature: f64,
    /// Rate, K/s.
    pub rate: f64,
    /// Normalised output minus the output at the reference temperature, rad/s or m/s².
    pub change: f64,
    /// Residual relative to the polynomial.
    pub residual: f64,
}

/// Mean outputs of all axes over a block.
struct Block {
    /// Temperature of each axis in the middle, °C.
    temperature: PerSensor<[f64; 3]>,
    /// Rate, K/s.
    rate: PerSensor<[f64; 3]>,
    /// Mean output of each axis, normalised.
    output: PerSensor<[f64; 3]>,
    /// Functions of temperature.
    state: ThermalState,
}

impl Problem<'_> {
    /// The biases as a function of temperature, if the instrument is never turned. `None` if there are several dwells
    /// or recordings, if there is no temperature, or if the temperature changes too little.
    pub fn at_rest(&self) -> Option<AtRest> {
        let run = self.run();
        if self.dwells().nth(1).is_some() || self.runs().nth(1).is_some() {
            return None;
        }
        let options = TemperatureOptions {
            highest_order: HIGHEST_ORDER,
            ..TemperatureOptions::default()
        };
        let mut problem = self.as_one_dwell().with(|model| only_biases(model, run));
        let thermal = temperatures::model(&problem, options).ok()??;
        let blocks = Block::all(run, &thermal.range);
        let model = &mut problem.model;
        model.thermal = Some(Arc::new(thermal));
        model.may_have.clear();
        model.may_be_elsewhere = false;
        let constants = Constant::all(model, false);
        let sigma = noise(&rows(&blocks, &constants, model, [1.0; 6]))?;
        let triads = from_vector(model.form, &model.prior_mean);
        let at = Linearisation::new(triads, SVector::zeros(), Vec::new());
        let prior = Prior::new(&constants, model, &at);
        let mut known = Known::new(prior.clone());
        known.learn(&rows(&blocks, &constants, model, sigma));
        let mut orders = Candidates::new(&constants, model);
        orders.weigh(&known, &prior);
        let posterior = known.with(&orders.sites(&prior))?;
        let thermal = posterior.thermal(&at, model)?;
        let outputs = Estimate {
            triads: from_vector(model.form, &(model.prior_mean + posterior.parameters)),
            covariance: posterior.parameter_covariance,
        };
        Some(AtRest {
            means: means(&blocks, &outputs, &thermal),
            outputs,
            thermal,
            findings: not_turned(&self.model).collect(),
        })
    }
}

/// Leaves only the biases to be estimated, together with the unknown input: Earth rate or gravity.
fn only_biases(model: &mut Model, run: &Run) {
    for index in 0..PARAMETERS {
        let (sensor, of_triad) = sensor_and_parameter(index);
        let input = match sensor {
            Sensor::Gyro => ROTATION_RATE,
            Sensor::Accel => run.site.gravity,
        };
        let sigma = &mut model.prior_sigma[index];
        *sigma = if Triad::kind(of_triad) == ParameterKind::Bias {
            sigma.hypot(input)
        } else {
            0.0
        };
    }
}

/// The axes of both triads, in the order of the rows.
fn axes() -> impl Iterator<Item = (Sensor, usize)> {
    let sensors = Sensor::ALL.into_iter();
    sensors.flat_map(|sensor| (0..3).map(move |axis| (sensor, axis)))
}

fn bias(sensor: Sensor, axis: usize) -> usize {
    parameter(sensor, PER_TRIAD - 3 + axis)
}

impl Block {
    /// The whole blocks of a run.
    fn all(run: &Run, range: &PerSensor<ThermalRange>) -> Vec<Self> {
        let imu = &run.recording.imu;
        let length = (imu.duration() / FEWEST_BLOCKS).min(BLOCK) / imu.period;
        let length = (length.round() as usize).max(1);
        let blocks = (0..imu.len() / length).map(|k| k * length..(k + 1) * length);
        blocks
            .filter_map(|block| Self::new(run, block, range))
            .collect()
    }

    /// Means over these samples; `None` without temperature.
    fn new(run: &Run, samples: Range<usize>, range: &PerSensor<ThermalRange>) -> Option<Self> {
        let imu = &run.recording.imu;
        let temperature = imu.temperature.as_ref()?;
        let (begin, end) = (imu.time(samples.start), imu.time(samples.end));
        let seconds = ((end - begin) / TEMPERATURE_SPACING).ceil().max(1.0) as usize;
        let times = (0..seconds).map(|k| begin + (k as f64 + 0.5) / seconds as f64 * (end - begin));
        let mean = |sensor: Sensor, axis: usize| {
            let values = times.clone().map(|time| {
                let [here, rate] = [temperature.at(time), temperature.rate(time)];
                let range = range.get(sensor);
                range.values(here.get(sensor)[axis], rate.get(sensor)[axis])
            });
            values.sum::<ThermalValues>() / seconds as f64
        };
        let middle = 0.5 * (begin + end);
        Some(Self {
            temperature: temperature.at(middle),
            rate: temperature.rate(middle),
            output: PerSensor::from_fn(|sensor| {
                let sum = imu.of(sensor).sum(samples.clone());
                (sum / (end - begin)).into()
            }),
            state: PerSensor::from_fn(|sensor| [0, 1, 2].map(|axis| mean(sensor, axis))),
        })
    }
}

/// The rows of all blocks: one for each axis, with noise of this σ; the last column is what was observed.
fn rows(blocks: &[Block], constants: &[Constant], model: &Model, sigma: [f64; 6]) -> DMatrix<f64> {
    let n = constants.len();
    let mut rows = DMatrix::zeros(6 * blocks.len(), n + 1);
    for (number, block) in blocks.iter().enumerate() {
        for (k, (sensor, axis)) in axes().enumerate() {
            let (row, bias) = (6 * number + k, bias(sensor, axis));
            for (column, constant) in constants.iter().enumerate() {
                rows[(row, column)] = match constant {
                    Constant::Parameter(index) if *index == bias => 1.0,
                    Constant::Thermal(of) if of.index() == bias => of.weight(&block.state),
                    _ => 0.0,
                };
            }
            rows[(row, n)] = block.output.get(sensor)[axis] - model.prior_mean[bias];
            rows.row_mut(row).unscale_mut(sigma[k]);
        }
    }
    rows
}

/// 1σ of the blocks of each axis about its curve of the highest order, from rows with a σ of one; `None` if the blocks
/// are too few, or the outputs of an axis constant.
fn noise(rows: &DMatrix<f64>) -> Option<[f64; 6]> {
    let (count, observed) = (rows.nrows() / 6, rows.ncols() - 1);
    let mut sigma = [0.0; 6];
    for (axis, sigma) in sigma.iter_mut().enumerate() {
        let entry = |block: usize, column: usize| rows[(6 * block + axis, column)];
        let is_on = |&column: &usize| (0..count).any(|block| entry(block, column) != 0.0);
        let mut on: Vec<usize> = (0..observed).filter(is_on).collect();
        let freedom = count.checked_sub(on.len()).filter(|&freedom| freedom > 0)?;
        on.push(observed);
        let triangle = triangle(&DMatrix::from_fn(count, on.len(), |k, i| entry(k, on[i])));
        *sigma = triangle[(on.len() - 1, on.len() - 1)].abs() / (freedom as f64).sqrt();
    }
    sigma.iter().all(|sigma| *sigma > 0.0).then_some(sigma)
}

/// The blocks of each bias, with their residuals from the polynomial.
fn means(blocks: &[Block], at: &Estimate, thermal: &Thermal) -> Vec<(usize, Vec<MeanAtRest>)> {
    let reference = at.vector();
    let of_axis = |(sensor, axis)| {
        let bias = bias(sensor, axis);
        let means = blocks.iter().map(|block| {
            let (expected, _) = thermal.at(&block.state, &at.covariance);
            let change = block.output.get(sensor)[axis] - reference[bias];
            MeanAtRest {
                temperature: block.temperature.get(sensor)[axis],
                rate: block.rate.get(sensor)[axis],
                change,
                residual: change - expected[bias],
            }
        });
        (bias, means.collect())
    };
    axes().map(of_axis).collect()
}

/// Findings on the parameters of a model that need turns.
fn not_turned(model: &Model) -> impl Iterator<Item = Finding> {
    let names = |which: &dyn Fn(Sensor, bool) -> bool| -> Vec<String> {
        let is = |&index: &usize| {
            let (sensor, of_triad) = sensor_and_parameter(index);
            let is_bias = Triad::kind(of_triad) == ParameterKind::Bias;
            model.prior_sigma[index] > 0.0 && which(sensor, is_bias)
        };
        let of = (0..PARAMETERS).filter(is);
        of.filter_map(|index| parameter_name(model.form, index))
            .collect()
    };
    let by = "only a recording at rest in one attitude";
    let hidden = names(&|sensor, is_bias| !is_bias || sensor == Sensor::Accel);
    let turned = names(&|_, is_bias| !is_bias);
    let findings = [not_observed(by, hidden), temperature_not_seen(turned)];
    findings.into_iter().flatten()
}

impl AtRest {
    /// The estimate of both triads, and its temperature dependence: the biases of the gyros (accurate to Earth rate);
    /// all other values are those of the prior, because they cannot be separated from the input.
    pub fn biases(&self, problem: &Problem) -> (Estimate, Thermal) {
        let model = &problem.model;
        let variances = model.prior_sigma.map(|sigma| sigma.powi(2));
        let mut estimate = Estimate {
            triads: from_vector(model.form, &model.prior_mean),
            covariance: ParameterMatrix::from_diagonal(&variances),
        };
        let mut thermal = self.thermal.clone();
        for (sensor, axis) in axes() {
            let bias = bias(sensor, axis);
            let variance = self.outputs.covariance[(bias, bias)] + ROTATION_RATE.powi(2);
            if sensor == Sensor::Gyro && variance < variances[bias] {
                estimate.triads.gyro.bias[axis] = self.outputs.triads.gyro.bias[axis];
                estimate.covariance[(bias, bias)] = variance;
            } else {
                thermal.cross.row_mut(bias).fill(0.0);
            }
        }
        (estimate, thermal)
    }
}
