//! The run, the model and the method as pairs of a name and a value.

use super::report::Report;
use crate::imu::{Noise, Sensor};
use crate::report::prelude::*;
use crate::units::{
    ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, DEGREE, MICRO_G, MICRO_G_PER_SQRT_HZ, MILLISECOND,
};

/// What was calibrated, by what its run says of it.
pub(super) fn item(report: &Report) -> Facts {
    let meta = &report.run.recording.meta;
    let first = ["instrument", "serial", "date"];
    let others = meta.keys().map(String::as_str);
    let names = first
        .into_iter()
        .chain(others.filter(|name| !first.contains(name)));
    let rows = names.filter_map(|name| Some((name, meta.get(name)?.clone())));
    Facts::new("", rows)
}

/// What was recorded, where, and what was known before.
pub(super) fn run(report: &Report) -> Facts {
    let run = report.run;
    let (imu, site) = (&run.recording.imu, &run.site);
    let mut facts = Facts::new("Run", [("run", run.recording.name.clone())]);
    let place = format!(
        "latitude {}°, longitude {}°, height {} m, gravity {} m/s²",
        value(site.latitude / DEGREE, 1e-4),
        value(site.longitude / DEGREE, 1e-4),
        value(site.height, 1.0),
        value(site.gravity, 1e-5),
    );
    facts.push("site", place);
    let (rate, duration) = (three_digits(1.0 / imu.period), value(imu.duration(), 1.0));
    facts.push(
        "samples",
        format!("{} at {rate} Hz, {duration} s", count(imu.len())),
    );
    if imu.pulse.gyro > 0.0 || imu.pulse.accel > 0.0 {
        let gyro = three_digits(imu.pulse.gyro / ARCSEC);
        let accel = three_digits(imu.pulse.accel / MILLISECOND);
        facts.push("one pulse", format!("{gyro} ″, {accel} mm/s"));
    }
    for (sensor, input) in [(Sensor::Gyro, "rad/s"), (Sensor::Accel, "m/s²")] {
        let (name, of, unit) = (
            sensor.name(),
            run.instrument.nominal.get(sensor).0,
            run.instrument.unit.get(sensor),
        );
        let scale = format!(
            "{}, {}, {} {unit} per second for 1 {input}",
            of.x, of.y, of.z
        );
        facts.push(&format!("{name} nominal scale"), scale);
        facts.push(
            &format!("{name} noise"),
            noise(sensor, run.instrument.noise.get(sensor)),
        );
    }
    facts.push(
        "turntable",
        report.table().map_or("its log was not used".to_owned(), |table| {
            format!(
                "{} readings; position {} ″ (1σ, new at every position), reading {} ″ (1σ, white)",
                count(table.time.len()),
                sigma(run.table.position_sigma / ARCSEC),
                sigma(run.table.reading_sigma / ARCSEC)
            )
        }),
    );
    facts
}

fn noise(sensor: Sensor, noise: &Noise) -> String {
    let (walk, walk_unit, bias, bias_unit) = match sensor {
        Sensor::Gyro => (DEG_PER_SQRT_H, "°/√h", DEG_PER_H, "°/h"),
        Sensor::Accel => (MICRO_G_PER_SQRT_HZ, "µg/√Hz", MICRO_G, "µg"),
    };
    let mut text = format!(
        "random walk {} {walk_unit}",
        sigma(noise.random_walk / walk)
    );
    if let Some(of) = noise.gauss_markov {
        let (of_bias, time) = (sigma(of.sigma / bias), sigma(of.correlation_time));
        text += &format!(", Gauss–Markov bias {of_bias} {bias_unit} over {time} s");
    }
    text
}

impl Report<'_> {
    /// The model, the method and the frame.
    pub(super) fn model(&self) -> Facts {
        let symbols = "N: output per second over its nominal scale; u: angular rate or specific force along the \
                       body axes; K: scale factors, given as departure from nominal; E: entries of C beside the \
                       diagonal; D: bias";
        let equation = "N = K C u + D; u = (K C)⁻¹ (N − D)";
        let mut facts = Facts::new(
            "Model and method",
            [("equation", equation), ("symbols", symbols)],
        );
        if let Some(estimate) = self.estimate() {
            facts.push("installation form", estimate.form().name());
        }
        facts.push("body frame", self.body_frame.words());
        let (observed, found_in) = match self.table() {
            Some(_) => (
                "zero velocity in dwells and the attitude of the table",
                "the table's log",
            ),
            None => ("zero velocity in dwells", "the IMU's own readings"),
        };
        if let Some(outcome) = self.outcome {
            let iterations = outcome.passes.len();
            let velocity = sigma(outcome.velocity_sigma / MILLISECOND);
            facts.push(
                "filter",
                format!(
                    "error-state EKF, {iterations} Gauss–Newton iterations; velocity in dwells {velocity} \
                     mm/s (1σ, white)"
                ),
            );
            facts.push("observed", observed);
        }
        if let Some(closed) = self.closed_form {
            facts.push("closed form", closed.note);
        }
        facts.push(
            "dwells",
            format!("{}, found in {found_in}", count(self.dwells.len())),
        );
        facts
    }
}
