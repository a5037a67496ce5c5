//! The analysis as named values. Deviations are in deg/h and µg; intervals are 95 %.

use crate::allan::quantity::{deviation_unit, quantity};
use crate::allan::words;
use crate::prelude::*;
use turncal::imu::{NoiseKeys, Sensor};
use turncal::noise::{AxisNoise, NoiseAnalysis, Process};

const PROBABILITY: f64 = 0.95;

pub fn data(run: &str, analysis: &NoiseAnalysis) -> Value {
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
        "imu_noise": fields(analysis),
        "imu_noise_toml": noise_table(analysis),
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
    // The minimum is often read as bias instability, whether or not its slope is detected.
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

/// A field of `[imu.noise]`: key, value, and a comment or nothing.
type Field = (&'static str, f64, String);

/// `[imu.noise]` with all detected processes, ready to be pasted into run.toml.
pub fn noise_table(analysis: &NoiseAnalysis) -> String {
    let mut text = "[imu.noise]\n".to_owned();
    for &sensor in &analysis.sensors {
        let fields = of_triad(analysis, sensor);
        if fields.is_empty() {
            let name = sensor.name();
            text += &format!("# {name}: not detected; use the value from the data sheet\n");
        }
        for (key, value, comment) in fields {
            let mark = if comment.is_empty() { "" } else { "  # " };
            text += &format!("{key} = {:?}{mark}{comment}\n", rounded(value, 4));
        }
    }
    text
}

/// The fields of `[imu.noise]` with all digits.
pub fn fields(analysis: &NoiseAnalysis) -> Map<String, Value> {
    let fields = Sensor::ALL.map(|sensor| of_triad(analysis, sensor));
    let fields = fields.into_iter().flatten();
    let fields = fields.map(|(key, value, _)| (key.to_owned(), value.into()));
    fields.collect()
}

fn of_triad(analysis: &NoiseAnalysis, sensor: Sensor) -> Vec<Field> {
    let Some(figures) = analysis.triads.get(sensor).figures() else {
        return Vec::new();
    };
    let walk = quantity(Process::RandomWalk, sensor);
    let comment = if figures.random_walk_is_limit {
        "upper limit, because the slope was not detected"
    } else {
        "RMS of the axes"
    };
    let of_walk = figures.noise.random_walk / walk.value;
    let mut fields = vec![(walk.key, of_walk, comment.to_owned())];
    let Some(of) = figures.noise.gauss_markov else {
        return fields;
    };
    let NoiseKeys {
        gauss_markov: (key, unit),
        correlation_time: time_key,
        ..
    } = NoiseKeys::of(sensor);
    let comment = "1σ of a Gauss–Markov process that was fitted to the deviations";
    fields.push((key, of.sigma / unit, comment.to_owned()));
    let open = if figures.correlation_is_open {
        "the longest time that the recording can show; σ grows with the square root of this time"
    } else {
        ""
    };
    fields.push((time_key, of.correlation_time, open.to_owned()));
    fields
}
