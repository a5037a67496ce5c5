//! What the outputs of an instrument that stands in one attitude say of its temperature.
//!
//! Nothing turns, so scale factors and installation are not seen, and of the accelerometers' biases only how they
//! change. Each output is a polynomial in the temperature of its axis and follows its rate, by least squares over
//! means of seconds; the order is the one that predicts best what is left out (cross-validation over blocks, Stone
//! 1974, J. Royal Statistical Society B 36(2)), for noise of such a record is anything but white.

use nalgebra::{DMatrix, DVector};

use crate::calibration::checks::finding::Finding;
use crate::calibration::checks::observability::{not_observed, temperature_not_seen};
use crate::calibration::estimate::Estimate;
use crate::calibration::parameters::{PARAMETERS, parameter_name, sensor_and_parameter};
use crate::calibration::several::thermal::{Coefficient, Thermal};
use crate::earth::ROTATION_RATE;
use crate::imu::{
    InstallationForm, PARAMETERS as PER_TRIAD, ParameterKind, PerSensor, RATE, Sensor,
    ThermalCoefficients, ThermalModel, ThermalRange, ThermalValues, Triad, TriadVector,
};
use crate::recording::{TEMPERATURE_SPACING, Temperature};
use crate::run::Run;

/// Blocks that are left out in turn: every other one.
const BLOCK: f64 = 100.0;
/// Temperatures within this of each other are the same where heating and cooling are compared, K.
const SAME: f64 = 2.0;
/// Slower than this part of the largest rate a temperature neither rises nor falls.
const CHANGES: f64 = 0.1;
/// Least seconds for each coefficient.
const SECONDS_EACH: usize = 10;

/// Outputs at rest against temperature.
#[derive(Debug, Clone)]
pub struct AtRest {
    /// Where the polynomials hold.
    pub range: PerSensor<ThermalRange>,
    /// Of gyro x, y, z, then accelerometer x, y, z.
    pub axes: Vec<AxisAtRest>,
}

/// One output at rest against temperature.
#[derive(Debug, Clone)]
pub struct AxisAtRest {
    /// Whose.
    pub sensor: Sensor,
    /// Which.
    pub axis: usize,
    /// Output at the reference temperature and its 1σ, normalised, rad/s or m/s².
    pub at_reference: (f64, f64),
    /// Coefficient of each function; zero where off.
    pub coefficients: ThermalValues,
    /// Covariance of the output at the reference, then of each coefficient that is on.
    pub covariance: DMatrix<f64>,
    /// The functions that are on.
    pub functions: Vec<usize>,
    /// RMS about the mean.
    pub about_mean: f64,
    /// RMS of what is left.
    pub residual: f64,
    /// RMS of what is left where it was left out.
    pub cross_validated: f64,
    /// The same of a cubic without its rate, which is what most compensate.
    pub cubic: f64,
    /// Cooling less heating at the same temperature, by temperature in °C.
    pub hysteresis: Vec<(f64, f64)>,
    /// Temperature, rate in K/s, output and residual of each second.
    pub seconds: Vec<Second>,
}

/// Means of one second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Second {
    /// °C.
    pub temperature: f64,
    /// K/s.
    pub rate: f64,
    /// Normalised output.
    pub output: f64,
    /// What the polynomial leaves of it.
    pub residual: f64,
}

impl AtRest {
    /// Of a run that stands throughout; `None` without its temperature, or where that changes too little or too short.
    pub fn new(run: &Run, highest_order: usize) -> Option<Self> {
        let imu = &run.recording.imu;
        let temperature = imu.temperature.as_ref()?;
        let length = ((TEMPERATURE_SPACING / imu.period).round() as usize).max(1);
        let range = Temperature::seen([temperature].into_iter());
        let mut axes = Vec::new();
        for sensor in Sensor::ALL {
            let samples = imu.of(sensor);
            let seconds = (0..imu.len()).step_by(length).map(|begin| {
                let end = (begin + length).min(imu.len());
                let middle = 0.5 * (imu.time(begin) + imu.time(end));
                let mean = samples.sum(begin..end) / ((end - begin) as f64 * imu.period);
                let (t, rate) = (temperature.at(middle), temperature.rate(middle));
                [0, 1, 2].map(|axis| Second {
                    temperature: t.get(sensor)[axis],
                    rate: rate.get(sensor)[axis],
                    output: mean[axis],
                    residual: 0.0,
                })
            });
            let seconds: Vec<[Second; 3]> = seconds.collect();
            for axis in 0..3 {
                let of_axis = seconds.iter().map(|second| second[axis]).collect();
                let of = range.get(sensor);
                axes.push(AxisAtRest::new(sensor, axis, of, of_axis, highest_order)?);
            }
        }
        Some(Self { range, axes })
    }

    /// How the biases change.
    pub(in crate::calibration) fn thermal(&self) -> Thermal {
        let all: Vec<(&AxisAtRest, usize)> = self
            .axes
            .iter()
            .flat_map(|of| (0..of.functions.len()).map(move |k| (of, k)))
            .collect();
        let n = all.len();
        let mut cross = DMatrix::zeros(PARAMETERS, n);
        let mut sigma = PerSensor::<ThermalCoefficients>::default();
        let coefficients = all.iter().enumerate().map(|(place, &(of, k))| {
            let coefficient = Coefficient {
                sensor: of.sensor,
                parameter: PER_TRIAD - 3 + of.axis,
                function: of.functions[k],
                axis: of.axis,
            };
            cross[(coefficient.index(), place)] = of.covariance[(0, k + 1)];
            *coefficient.of_mut(&mut sigma) = f64::INFINITY;
            coefficient
        });
        let coefficients: Vec<Coefficient> = coefficients.collect();
        let covariance = DMatrix::from_fn(n, n, |i, j| {
            let ((one, k), (other, l)) = (all[i], all[j]);
            let same = (one.sensor, one.axis) == (other.sensor, other.axis);
            if same {
                one.covariance[(k + 1, l + 1)]
            } else {
                0.0
            }
        });
        Thermal {
            model: ThermalModel {
                range: self.range,
                sigma,
            },
            values: DVector::from_fn(n, |i, _| {
                all[i].0.coefficients[all[i].0.functions[all[i].1]]
            }),
            coefficients,
            covariance,
            cross,
        }
    }

    /// What it does not show.
    pub fn findings(&self, estimate: &Estimate) -> Vec<Finding> {
        let form = estimate.form();
        let unseen = (0..PARAMETERS).filter(|&index| {
            let (sensor, of_triad) = sensor_and_parameter(index);
            Triad::kind(of_triad) != ParameterKind::Bias || sensor == Sensor::Accel
        });
        let turned = (0..PARAMETERS).filter(|&index| {
            let (_, of_triad) = sensor_and_parameter(index);
            Triad::kind(of_triad) != ParameterKind::Bias
        });
        let names = |of: &mut dyn Iterator<Item = usize>| -> Vec<String> {
            of.filter_map(|index| parameter_name(form, index)).collect()
        };
        let by = "an instrument that stands in one attitude";
        let unseen = not_observed(by, names(&mut { unseen }));
        let turned = temperature_not_seen(names(&mut { turned }));
        unseen.into_iter().chain(turned).collect()
    }

    /// Both triads at the reference temperature and 1σ of their parameters: biases of the gyros within Earth rate, all
    /// else as it was known before.
    pub fn triads(&self, run: &Run) -> (PerSensor<Triad>, PerSensor<TriadVector>) {
        let form = InstallationForm::General;
        let mut triads = run.instrument.prior_mean(form);
        let mut sigma = PerSensor::from_fn(|sensor| run.instrument.prior.get(sensor).sigma(form));
        for of in self.axes.iter().filter(|of| of.sensor == Sensor::Gyro) {
            let (value, own) = of.at_reference;
            let known = own.hypot(ROTATION_RATE);
            let place = PER_TRIAD - 3 + of.axis;
            if known < sigma.gyro[place] {
                triads.gyro.bias[of.axis] = value;
                sigma.gyro[place] = known;
            }
        }
        (triads, sigma)
    }
}

impl AxisAtRest {
    fn new(
        sensor: Sensor,
        axis: usize,
        range: &ThermalRange,
        mut seconds: Vec<Second>,
        highest_order: usize,
    ) -> Option<Self> {
        let mean = seconds.iter().map(|s| s.output).sum::<f64>() / seconds.len() as f64;
        let rms = |of: &mut dyn Iterator<Item = f64>| {
            let (sum, count) = of.fold((0.0, 0usize), |(sum, n), x| (sum + x * x, n + 1));
            (sum / count.max(1) as f64).sqrt()
        };
        let choices = (0..=highest_order.min(RATE)).flat_map(|order| {
            let plain: Vec<usize> = (0..order).collect();
            let with_rate = plain.iter().copied().chain([RATE]).collect();
            [plain, with_rate]
        });
        let fits = choices
            .filter(|functions: &Vec<usize>| seconds.len() >= SECONDS_EACH * (functions.len() + 1));
        let scored = fits.filter_map(|functions| {
            let score = cross_validated(range, &seconds, &functions)?;
            Some((score, functions))
        });
        let (score, functions) = scored.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let cubic = cross_validated(range, &seconds, &[0, 1, 2]).unwrap_or(f64::NAN);
        let all: Vec<&Second> = seconds.iter().collect();
        let (solution, inverse) = fit(range, &all, &functions)?;
        for second in &mut seconds {
            second.residual = second.output - predicted(range, second, &functions, &solution);
        }
        let residual = rms(&mut seconds.iter().map(|s| s.residual));
        // What is left of neighbouring seconds is alike: as many are independent as blocks.
        let independent = (seconds.len() as f64 * TEMPERATURE_SPACING / BLOCK).max(1.0);
        let alike = seconds.len() as f64 / independent;
        let mut coefficients = ThermalValues::zeros();
        for (k, &function) in functions.iter().enumerate() {
            coefficients[function] = solution[k + 1];
        }
        let covariance = inverse * (score * score * alike);
        Some(Self {
            sensor,
            axis,
            at_reference: (solution[0], covariance[(0, 0)].sqrt()),
            coefficients,
            covariance,
            about_mean: rms(&mut seconds.iter().map(|s| s.output - mean)),
            residual,
            cross_validated: score,
            cubic,
            hysteresis: hysteresis(range, &seconds, &functions, &solution),
            functions,
            seconds,
        })
    }

    /// Change of the output from that at the reference at a temperature in °C that does not change, and 1σ of the
    /// output then: of the curve, and of a second about it.
    pub fn at(&self, range: &ThermalRange, temperature: f64) -> (f64, f64) {
        let values = range.values(temperature, 0.0);
        let n = self.functions.len();
        let row = DVector::from_fn(n + 1, |k, _| match k.checked_sub(1) {
            None => 1.0,
            Some(k) => values[self.functions[k]],
        });
        let variance = row.dot(&(&self.covariance * &row));
        (
            self.coefficients.dot(&values),
            variance.max(0.0).sqrt().hypot(self.cross_validated),
        )
    }
}

fn row(range: &ThermalRange, second: &Second, functions: &[usize]) -> DVector<f64> {
    let values = range.values(second.temperature, second.rate);
    DVector::from_fn(functions.len() + 1, |k, _| match k.checked_sub(1) {
        None => 1.0,
        Some(k) => values[functions[k]],
    })
}

fn predicted(
    range: &ThermalRange,
    second: &Second,
    functions: &[usize],
    solution: &DVector<f64>,
) -> f64 {
    row(range, second, functions).dot(solution)
}

/// Least squares, and the inverse of the normal matrix.
fn fit(
    range: &ThermalRange,
    seconds: &[&Second],
    functions: &[usize],
) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let n = functions.len() + 1;
    let (mut normal, mut right) = (DMatrix::zeros(n, n), DVector::zeros(n));
    for second in seconds {
        let row = row(range, second, functions);
        normal.ger(1.0, &row, &row, 1.0);
        right.axpy(second.output, &row, 1.0);
    }
    let factor = normal.cholesky()?;
    Some((factor.solve(&right), factor.inverse()))
}

/// RMS of every other block by a fit to the others.
fn cross_validated(range: &ThermalRange, seconds: &[Second], functions: &[usize]) -> Option<f64> {
    let block = (BLOCK / TEMPERATURE_SPACING) as usize;
    let (mut sum, mut count) = (0.0, 0usize);
    for left_out in 0..2 {
        let is_out = |k: usize| (k / block) % 2 == left_out;
        let kept = seconds.iter().enumerate().filter(|(k, _)| !is_out(*k));
        let kept: Vec<&Second> = kept.map(|(_, second)| second).collect();
        let (solution, _) = fit(range, &kept, functions)?;
        for (_, second) in seconds.iter().enumerate().filter(|(k, _)| is_out(*k)) {
            let off = second.output - predicted(range, second, functions, &solution);
            sum += off * off;
            count += 1;
        }
    }
    (count > 0).then(|| (sum / count as f64).sqrt())
}

/// Cooling less heating where both passed the same temperature: of what a polynomial leaves without its rate.
fn hysteresis(
    range: &ThermalRange,
    seconds: &[Second],
    functions: &[usize],
    solution: &DVector<f64>,
) -> Vec<(f64, f64)> {
    let steady = |second: &Second| Second {
        rate: 0.0,
        ..*second
    };
    let limit = CHANGES * range.largest_rate;
    let bins = ((range.highest - range.lowest) / SAME).ceil().max(1.0) as usize;
    let mut sums = vec![[(0.0, 0usize); 2]; bins];
    for second in seconds.iter().filter(|second| second.rate.abs() > limit) {
        let left = second.output - predicted(range, &steady(second), functions, solution);
        let bin = ((second.temperature - range.lowest) / SAME) as usize;
        let cools = usize::from(second.rate < 0.0);
        if let Some(of) = sums.get_mut(bin) {
            of[cools].0 += left;
            of[cools].1 += 1;
        }
    }
    let both = sums
        .iter()
        .enumerate()
        .filter(|(_, of)| of[0].1 > 0 && of[1].1 > 0);
    both.map(|(bin, [heats, cools])| {
        let mean = |(sum, count): &(f64, usize)| sum / *count as f64;
        let middle = range.lowest + (bin as f64 + 0.5) * SAME;
        (middle, mean(cools) - mean(heats))
    })
    .collect()
}
