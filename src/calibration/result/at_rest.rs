//! Temperature dependence from the outputs of an instrument at rest in one attitude.
//!
//! Without rotation, scale factors and misalignment are not observed, and of the accelerometers' biases only their
//! change. Each output is a polynomial in the temperature of its axis, plus a term with its rate, fitted by least
//! squares to means over seconds. Because the noise of such a record is far from white, the order is selected by
//! cross-validation over blocks (Stone 1974, J. Royal Statistical Society B 36(2)).

use nalgebra::{DMatrix, DVector};

use crate::calibration::checks::observability::{not_observed, temperature_not_seen};
use crate::calibration::{
    Coefficient, Estimate, Finding, PARAMETERS, Thermal, parameter, parameter_name,
    sensor_and_parameter,
};
use crate::earth::ROTATION_RATE;
use crate::imu::{
    InstallationForm, PARAMETERS as PER_TRIAD, ParameterKind, PerSensor, RATE, Sensor,
    ThermalCoefficients, ThermalModel, ThermalRange, ThermalValues, Triad, TriadVector,
};
use crate::recording::{TEMPERATURE_SPACING, Temperature};
use crate::run::Run;

/// Blocks that are left out in turn: every other one.
const BLOCK: f64 = 100.0;
/// Temperatures within this difference count as equal when heating and cooling are compared, K.
const SAME: f64 = 2.0;
/// Below this fraction of the largest rate, a temperature counts as constant.
const CHANGES: f64 = 0.1;
/// Minimum number of seconds per coefficient.
const SECONDS_EACH: usize = 10;

/// Outputs at rest against temperature.
#[derive(Debug, Clone)]
pub struct AtRest {
    /// Temperature range of the polynomials.
    pub range: PerSensor<ThermalRange>,
    /// Gyro x, y, z, then accelerometer x, y, z.
    pub axes: Vec<AxisAtRest>,
}

/// One output at rest against temperature.
#[derive(Debug, Clone)]
pub struct AxisAtRest {
    /// The triad.
    pub sensor: Sensor,
    /// The axis.
    pub axis: usize,
    /// Output at the reference temperature and its 1σ, normalised, rad/s or m/s².
    pub at_reference: (f64, f64),
    /// Coefficient of each function; zero if off.
    pub coefficients: ThermalValues,
    /// Covariance of the output at the reference, then of each coefficient that is on.
    pub covariance: DMatrix<f64>,
    /// The functions that are on.
    pub functions: Vec<usize>,
    /// RMS about the mean.
    pub about_mean: f64,
    /// RMS of the residuals.
    pub residual: f64,
    /// RMS of the residuals in blocks that were excluded from the fit (cross-validation).
    pub cross_validated: f64,
    /// The same for a cubic without the rate, a common compensation.
    pub cubic: f64,
    /// Output during cooling minus output during heating at the same temperature, with the temperature in °C.
    pub hysteresis: Vec<(f64, f64)>,
    /// Temperature, rate in K/s, output and residual of each second.
    pub seconds: Vec<Second>,
}

/// Means of one second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Second {
    /// Temperature, °C.
    pub temperature: f64,
    /// Its rate, K/s.
    pub rate: f64,
    /// Normalised output.
    pub output: f64,
    /// Residual after the polynomial.
    pub residual: f64,
}

impl AtRest {
    /// Highest order of the polynomials in a calibration.
    pub const HIGHEST_ORDER: usize = 5;

    /// The evaluation of a run at rest throughout; `None` without temperature, or if it changes too little or too
    /// briefly.
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
        let n = self.axes.iter().map(|of| of.functions.len()).sum();
        let mut sigma = PerSensor::<ThermalCoefficients>::default();
        let (mut coefficients, mut values) = (Vec::new(), Vec::new());
        let mut covariance = DMatrix::zeros(n, n);
        let mut cross = DMatrix::zeros(PARAMETERS, n);
        for of in &self.axes {
            let (first, more) = (coefficients.len(), of.functions.len());
            let own = of.covariance.view((1, 1), (more, more));
            covariance
                .view_mut((first, first), (more, more))
                .copy_from(&own);
            let with_reference = of.covariance.view((0, 1), (1, more));
            let bias = PER_TRIAD - 3 + of.axis;
            cross
                .view_mut((parameter(of.sensor, bias), first), (1, more))
                .copy_from(&with_reference);
            for &function in &of.functions {
                let coefficient = Coefficient {
                    sensor: of.sensor,
                    parameter: bias,
                    function,
                    axis: of.axis,
                };
                *coefficient.of_mut(&mut sigma) = f64::INFINITY;
                coefficients.push(coefficient);
                values.push(of.coefficients[function]);
            }
        }
        Thermal {
            model: ThermalModel {
                range: self.range,
                sigma,
            },
            values: values.into(),
            coefficients,
            covariance,
            cross,
        }
    }

    /// Findings on parameters that the recording does not determine.
    pub fn findings(&self, estimate: &Estimate) -> Vec<Finding> {
        let names = |which: &dyn Fn(Sensor, bool) -> bool| -> Vec<String> {
            let is = |&index: &usize| {
                let (sensor, of_triad) = sensor_and_parameter(index);
                which(sensor, Triad::kind(of_triad) == ParameterKind::Bias)
            };
            let form = estimate.form();
            let of = (0..PARAMETERS).filter(is);
            of.filter_map(|index| parameter_name(form, index)).collect()
        };
        let by = "an instrument at rest in one attitude";
        let hidden = names(&|sensor, is_bias| !is_bias || sensor == Sensor::Accel);
        let turned = names(&|_, is_bias| !is_bias);
        let findings = [not_observed(by, hidden), temperature_not_seen(turned)];
        findings.into_iter().flatten().collect()
    }

    /// Both triads at the reference temperature and 1σ of their parameters: biases of the gyros to within Earth rate,
    /// the others from the prior.
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
        let count = seconds.len() as f64;
        let mean = seconds.iter().map(|s| s.output).sum::<f64>() / count;
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
        let curve = Curve::fit(range, &functions, seconds.iter())?;
        for second in &mut seconds {
            second.residual = second.output - curve.output(second.temperature, second.rate);
        }
        // Residuals of neighbouring seconds are alike: as many are independent as there are blocks.
        let independent = (count * TEMPERATURE_SPACING / BLOCK).max(1.0);
        let covariance = &curve.inverse * (score * score * (count / independent));
        let mut coefficients = ThermalValues::zeros();
        for (k, &function) in functions.iter().enumerate() {
            coefficients[function] = curve.solution[k + 1];
        }
        Some(Self {
            sensor,
            axis,
            at_reference: (curve.solution[0], covariance[(0, 0)].sqrt()),
            coefficients,
            covariance,
            about_mean: rms(seconds.iter().map(|s| s.output - mean))?,
            residual: rms(seconds.iter().map(|s| s.residual))?,
            cross_validated: score,
            cubic,
            hysteresis: curve.hysteresis(&seconds),
            functions,
            seconds,
        })
    }

    /// Change of the output from the reference to a constant temperature in °C, and the 1σ of the curve and of
    /// one-second means about it.
    pub fn at(&self, range: &ThermalRange, temperature: f64) -> (f64, f64) {
        let row = row(range, &self.functions, temperature, 0.0);
        let variance = row.dot(&(&self.covariance * &row));
        (
            self.coefficients.dot(&range.values(temperature, 0.0)),
            variance.max(0.0).sqrt().hypot(self.cross_validated),
        )
    }
}

/// One, then these functions of a temperature and its rate.
fn row(range: &ThermalRange, functions: &[usize], temperature: f64, rate: f64) -> DVector<f64> {
    let values = range.values(temperature, rate);
    let of_functions = functions.iter().map(|&function| values[function]);
    DVector::from_iterator(
        functions.len() + 1,
        std::iter::once(1.0).chain(of_functions),
    )
}

/// Root mean square; `None` without values.
fn rms(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, n), x| (sum + x * x, n + 1));
    (count > 0).then(|| (sum / count as f64).sqrt())
}

/// An output as a linear function of some functions of temperature.
struct Curve<'a> {
    range: &'a ThermalRange,
    functions: &'a [usize],
    /// Output at the reference, then the coefficient of each function.
    solution: DVector<f64>,
    /// Inverse of the normal matrix.
    inverse: DMatrix<f64>,
}

impl<'a> Curve<'a> {
    /// Least-squares fit; `None` if the data do not determine it.
    fn fit<'s>(
        range: &'a ThermalRange,
        functions: &'a [usize],
        seconds: impl Iterator<Item = &'s Second>,
    ) -> Option<Self> {
        let n = functions.len() + 1;
        let (mut normal, mut right) = (DMatrix::zeros(n, n), DVector::zeros(n));
        for second in seconds {
            let row = row(range, functions, second.temperature, second.rate);
            normal.ger(1.0, &row, &row, 1.0);
            right.axpy(second.output, &row, 1.0);
        }
        let factor = normal.cholesky()?;
        Some(Self {
            range,
            functions,
            solution: factor.solve(&right),
            inverse: factor.inverse(),
        })
    }

    fn output(&self, temperature: f64, rate: f64) -> f64 {
        row(self.range, self.functions, temperature, rate).dot(&self.solution)
    }

    /// Cooling minus heating at temperatures passed in both directions, from the residuals without the rate term.
    fn hysteresis(&self, seconds: &[Second]) -> Vec<(f64, f64)> {
        let range = self.range;
        let limit = CHANGES * range.largest_rate;
        let bins = ((range.highest - range.lowest) / SAME).ceil().max(1.0) as usize;
        let mut sums = vec![[(0.0, 0usize); 2]; bins];
        for second in seconds.iter().filter(|second| second.rate.abs() > limit) {
            let residual = second.output - self.output(second.temperature, 0.0);
            let bin = ((second.temperature - range.lowest) / SAME) as usize;
            if let Some(of) = sums.get_mut(bin) {
                let (sum, count) = &mut of[usize::from(second.rate < 0.0)];
                (*sum, *count) = (*sum + residual, *count + 1);
            }
        }
        let means = sums.iter().enumerate().filter_map(|(bin, of)| {
            let [heats, cools] = of.map(|(sum, count)| (count > 0).then(|| sum / count as f64));
            Some((range.lowest + (bin as f64 + 0.5) * SAME, cools? - heats?))
        });
        means.collect()
    }
}

/// RMS of alternate blocks from a fit to the others.
fn cross_validated(range: &ThermalRange, seconds: &[Second], functions: &[usize]) -> Option<f64> {
    let block = (BLOCK / TEMPERATURE_SPACING) as usize;
    let mut off = Vec::new();
    for left_out in 0..2 {
        let numbered = seconds.iter().enumerate();
        let (out, kept): (Vec<_>, Vec<_>) =
            numbered.partition(|(k, _)| (k / block) % 2 == left_out);
        let curve = Curve::fit(range, functions, kept.into_iter().map(|(_, second)| second))?;
        let of = |second: &Second| second.output - curve.output(second.temperature, second.rate);
        off.extend(out.into_iter().map(|(_, second)| of(second)));
    }
    rms(off.into_iter())
}
