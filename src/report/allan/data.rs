//! The analysis by name. Deviations are in deg/h and µg, intervals of 95 %.

use serde_json::{Map, Value, json};

use super::quantity::{deviation_unit, quantity};
use super::{run_toml, words};
use crate::imu::Sensor;
use crate::noise::{AxisNoise, NoiseAnalysis, Process};

const PROBABILITY: f64 = 0.95;

pub(super) fn data(run: &str, analysis: &NoiseAnalysis) -> Value {
    let triad = |sensor: Sensor| {
        let triad = analysis.triads.get(sensor);
        let [x, y, z] = triad.axes.each_ref().map(|of| axis(of, sensor));
        json!({
            "unit": deviation_unit(sensor).2,
            "x": x,
            "y": y,
            "z": z,
            "triad": axis(&triad.mean, sensor),
        })
    };
    let of = |sensor: Sensor| analysis.sensors.contains(&sensor).then(|| triad(sensor));
    let stretch = &analysis.stretch;
    json!({
        "run": run,
        "stretch": stretch.name,
        "start_sample": stretch.samples.start,
        "samples": stretch.samples.len(),
        "sample_period_s": analysis.period,
        "duration_s": analysis.duration(),
        "stands": stretch.stands,
        "gyro": of(Sensor::Gyro),
        "accel": of(Sensor::Accel),
        "imu_noise": run_toml::fields(analysis),
        "imu_noise_toml": run_toml::noise_table(analysis),
        "warnings": words::warnings(analysis),
        "not_found": words::advice(analysis),
        "method": words::METHOD,
    })
}

fn axis(axis: &AxisNoise, sensor: Sensor) -> Value {
    let unit = deviation_unit(sensor).1;
    let shown = |variance: f64| variance.sqrt() / unit;
    let (curve, identified) = (&axis.curve, axis.identified.as_ref());
    let interval = |point| {
        let (low, high) = identified?.interval(curve, point, PROBABILITY)?;
        Some((shown(low), shown(high)))
    };
    let model = identified.map_or_else(Vec::new, |of| {
        let variances = curve.tau.iter().map(|&tau| of.allan_variance(tau));
        variances.map(shown).collect()
    });
    let coefficients = axis.found().iter().map(|found| {
        let of = quantity(found.process, sensor);
        let mut data =
            json!({ "value": found.strength / of.value, "sigma": found.sigma / of.value });
        if let Process::GaussMarkov { correlation_time } = found.process {
            data["correlation_time_s"] = correlation_time.into();
        }
        if let Some(sigma) = found.sigma_log_time {
            data["sigma_log_correlation_time"] = sigma.into();
        }
        (of.key.to_owned(), data)
    });
    let limits = axis.hidden().iter().map(|hidden| {
        let of = quantity(hidden.process, sensor);
        (of.key.to_owned(), (hidden.limit / of.value).into())
    });
    // What is often read off as bias instability, whether its slope is there or not.
    let floor = Process::BiasInstability.allan_variance(1.0).sqrt();
    let lowest = axis.minimum().map(|(tau, deviation)| {
        let deviation = deviation / unit;
        json!({ "tau_s": tau, "deviation": deviation, "over_0_664": deviation / floor })
    });
    json!({
        "tau_s": curve.tau,
        "deviation": curve.variance.iter().copied().map(shown).collect::<Value>(),
        "interval": (0..curve.tau.len()).map(interval).collect::<Vec<_>>(),
        "degrees_of_freedom": identified.map_or_else(Vec::new, |of| of.freedom.clone()),
        "model": model,
        "coefficients": coefficients.collect::<Map<_, _>>(),
        "limits": limits.collect::<Map<String, Value>>(),
        "lowest": lowest,
        "described_from_s": identified.and_then(|of| curve.tau.get(of.first).copied()),
        "misfit": identified.map(|of| 0.5 * of.misfit),
        "jumps": axis.knocks,
    })
}
