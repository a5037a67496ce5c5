//! The analysis as one JSON document. Deviations are in deg/h and µg.

use std::collections::BTreeMap;

use serde::Serialize;

use super::quantity::{deviation_unit, quantity};
use super::{AllanReport, run_toml, words};
use crate::imu::{PerSensor, Sensor};
use crate::noise::{AxisNoise, NoiseAnalysis, Process};

/// Probability of the intervals.
const PROBABILITY: f64 = 0.95;

#[derive(Serialize)]
struct Document<'a> {
    run: &'a str,
    stretch: &'a str,
    start_sample: usize,
    samples: usize,
    sample_period_s: f64,
    duration_s: f64,
    stands: bool,
    gyro: Triad,
    accel: Triad,
    imu_noise: BTreeMap<&'static str, f64>,
    imu_noise_toml: String,
    warnings: Vec<String>,
    not_found: Vec<String>,
    method: &'static str,
}

#[derive(Serialize)]
struct Triad {
    unit: &'static str,
    x: Axis,
    y: Axis,
    z: Axis,
    /// Of the mean of the three variances.
    triad: Axis,
}

#[derive(Serialize)]
struct Axis {
    tau_s: Vec<f64>,
    deviation: Vec<f64>,
    /// 95 %.
    interval: Vec<Option<(f64, f64)>>,
    degrees_of_freedom: Vec<f64>,
    /// Of all that was found, together.
    model: Vec<f64>,
    coefficients: BTreeMap<&'static str, Coefficient>,
    /// 95 % limits of what was not found.
    limits: BTreeMap<&'static str, f64>,
    lowest: Option<Lowest>,
    /// Departure from every model, of the deviation.
    misfit: Option<f64>,
    jumps: usize,
}

#[derive(Serialize)]
struct Coefficient {
    value: f64,
    sigma: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    correlation_time_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sigma_log_correlation_time: Option<f64>,
}

#[derive(Serialize)]
struct Lowest {
    tau_s: f64,
    deviation: f64,
    /// Divided by 0.664: what is often read off as bias gauss_markov, whether its slope is there or not.
    over_0_664: f64,
}

pub(super) fn document<'a>(report: &AllanReport<'a>) -> impl Serialize + use<'a> {
    let analysis = report.analysis;
    let PerSensor { gyro, accel } = PerSensor::from_fn(|sensor| {
        let triad = analysis.triads.get(sensor);
        let [x, y, z] = triad.axes.each_ref().map(|a| axis(a, sensor));
        Triad {
            unit: deviation_unit(sensor).2,
            x,
            y,
            z,
            triad: axis(&triad.mean, sensor),
        }
    });
    Document {
        run: report.run,
        stretch: &analysis.stretch.name,
        start_sample: analysis.stretch.samples.start,
        samples: analysis.stretch.samples.len(),
        sample_period_s: analysis.period,
        duration_s: analysis.duration(),
        stands: analysis.stretch.stands,
        gyro,
        accel,
        imu_noise: noise(analysis),
        imu_noise_toml: run_toml::noise_table(analysis),
        warnings: words::warnings(analysis),
        not_found: words::advice(analysis),
        method: words::METHOD,
    }
}

fn axis(axis: &AxisNoise, sensor: Sensor) -> Axis {
    let unit = deviation_unit(sensor).1;
    let shown = |variance: f64| variance.sqrt() / unit;
    let curve = &axis.curve;
    let identified = axis.identified.as_ref();
    let interval = |point| {
        let (low, high) = identified?.interval(curve, point, PROBABILITY)?;
        Some((shown(low), shown(high)))
    };
    Axis {
        tau_s: curve.tau.clone(),
        deviation: curve.variance.iter().copied().map(shown).collect(),
        interval: (0..curve.tau.len()).map(interval).collect(),
        degrees_of_freedom: identified.map_or_else(Vec::new, |of| of.freedom.clone()),
        model: identified.map_or_else(Vec::new, |of| {
            let model = curve.tau.iter().map(|&tau| shown(of.allan_variance(tau)));
            model.collect()
        }),
        coefficients: axis
            .found()
            .iter()
            .map(|found| {
                let of = quantity(found.process, sensor);
                let correlation_time_s = match found.process {
                    Process::GaussMarkov { correlation_time } => Some(correlation_time),
                    _ => None,
                };
                let coefficient = Coefficient {
                    value: found.strength / of.value,
                    sigma: found.sigma / of.value,
                    correlation_time_s,
                    sigma_log_correlation_time: found.sigma_log_time,
                };
                (of.key, coefficient)
            })
            .collect(),
        limits: axis
            .hidden()
            .iter()
            .map(|hidden| {
                let of = quantity(hidden.process, sensor);
                (of.key, hidden.limit / of.value)
            })
            .collect(),
        lowest: axis.minimum().map(|(tau_s, deviation)| Lowest {
            tau_s,
            deviation: deviation / unit,
            over_0_664: deviation / unit / Process::BiasInstability.allan_variance(1.0).sqrt(),
        }),
        misfit: identified.map(|of| 0.5 * of.misfit),
        jumps: axis.knocks,
    }
}

/// The fields of `[imu.noise]`.
fn noise(analysis: &NoiseAnalysis) -> BTreeMap<&'static str, f64> {
    let mut fields = BTreeMap::new();
    for sensor in Sensor::ALL {
        let Some(figures) = analysis.figures(sensor) else {
            continue;
        };
        let (sigma, time) = match sensor {
            Sensor::Gyro => ("gyro_instability_deg_per_h", "gyro_correlation_time_s"),
            Sensor::Accel => ("accel_instability_ug", "accel_correlation_time_s"),
        };
        let walk = quantity(Process::RandomWalk, sensor);
        fields.insert(walk.key, figures.noise.random_walk / walk.value);
        if let Some(gauss_markov) = figures.noise.gauss_markov {
            fields.insert(sigma, gauss_markov.sigma / deviation_unit(sensor).1);
            fields.insert(time, gauss_markov.correlation_time);
        }
    }
    fields
}
