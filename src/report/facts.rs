//! The run, the model and the method as pairs of a name and a value.

use maud::{Markup, html};

use super::number::{count, sigma, three_digits, value};
use super::{ClosedForm, Report};
use crate::imu::{Noise, Sensor};
use crate::run::{Aiding, Run};
use crate::units::{
    ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, DEGREE, MICRO_G, MICRO_G_PER_SQRT_HZ, MILLISECOND,
};

/// Pairs of a name and a value.
pub(super) fn facts(rows: &[(String, String)]) -> Markup {
    html! {
        dl { @for (name, value) in rows { div { dt { (name) } dd { (value) } } } }
    }
}

/// What was recorded, where, and what was known before.
pub(super) fn run(run: &Run, aiding: Aiding) -> Markup {
    let text = |name: &str, value: String| (name.to_owned(), value);
    let imu = &run.recording.imu;
    let mut rows = vec![text("run", run.recording.name.clone())];
    rows.extend(
        run.recording
            .meta
            .iter()
            .map(|(k, v)| (k.clone(), v.clone())),
    );
    rows.push(text(
        "site",
        format!(
            "latitude {}°, longitude {}°, height {} m, gravity {} m/s²",
            value(run.site.latitude / DEGREE, 1e-4),
            value(run.site.longitude / DEGREE, 1e-4),
            value(run.site.height, 1.0),
            value(run.site.gravity, 1e-5),
        ),
    ));
    rows.push(text(
        "samples",
        format!(
            "{} at {} Hz, {} s",
            count(imu.len()),
            three_digits(1.0 / imu.period),
            value(imu.duration(), 1.0)
        ),
    ));
    if imu.pulse.gyro > 0.0 || imu.pulse.accel > 0.0 {
        rows.push(text(
            "one pulse",
            format!(
                "{} ″, {} mm/s",
                three_digits(imu.pulse.gyro / ARCSEC),
                three_digits(imu.pulse.accel / MILLISECOND)
            ),
        ));
    }
    for sensor in Sensor::ALL {
        let nominal = run.instrument.nominal.get(sensor).0;
        let input = match sensor {
            Sensor::Gyro => "rad/s",
            Sensor::Accel => "m/s²",
        };
        rows.push(text(
            &format!("{} nominal scale", sensor.name()),
            format!(
                "{}, {}, {} {} per second for 1 {input}",
                nominal.x,
                nominal.y,
                nominal.z,
                run.instrument.unit.get(sensor)
            ),
        ));
        rows.push(text(
            &format!("{} noise", sensor.name()),
            noise(sensor, run.instrument.noise.get(sensor)),
        ));
    }
    rows.push(match run.recording.table.as_ref().filter(|_| aiding == Aiding::Table) {
        Some(table) => text(
            "turntable",
            format!(
                "{} readings; position {} ″ (1σ, new at every position), reading {} ″ (1σ, white)",
                count(table.time.len()),
                sigma(run.table.position_sigma / ARCSEC),
                sigma(run.table.reading_sigma / ARCSEC)
            ),
        ),
        None => text("turntable", "its log was not used".to_owned()),
    });
    facts(&rows)
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
    if let Some(instability) = noise.gauss_markov {
        text.push_str(&format!(
            ", instability {} {bias_unit} over {} s",
            sigma(instability.sigma / bias),
            sigma(instability.correlation_time)
        ));
    }
    text
}

/// The model, the method and the frame.
pub(super) fn model(report: &Report) -> Markup {
    let mut rows = vec![
        ("equation", "N = K C u + D; u = (K C)⁻¹ (N − D)".to_owned()),
        (
            "symbols",
            "N: output per second over its nominal scale; u: angular rate or specific force along the \
             body axes; K: scale factors, given as departure from nominal; E: entries of C beside the \
             diagonal; D: bias"
                .to_owned(),
        ),
    ];
    if let Some(estimate) = report.estimate() {
        rows.push(("installation form", estimate.form().name().to_owned()));
    }
    rows.push(("body frame", report.body_frame.words().to_owned()));
    if let Some(outcome) = report.outcome {
        let held = outcome.passes.iter().filter(|pass| !pass.feedback).count();
        let passes = if held < outcome.passes.len() {
            format!("one live pass and {held} held")
        } else {
            format!("{held} held passes")
        };
        rows.push((
            "filter",
            format!(
                "error-state EKF, {passes}; velocity at standstill {} mm/s (1σ, white)",
                sigma(outcome.velocity_sigma / MILLISECOND)
            ),
        ));
    }
    if let Some(ClosedForm { note, .. }) = report.closed_form {
        rows.push(("closed form", note.to_owned()));
    }
    let (observed, found_in) = match report.table() {
        Some(_) => (
            "standstill and the attitude of the table",
            "the table's log",
        ),
        None => ("standstill alone", "the IMU's own readings"),
    };
    if report.outcome.is_some() {
        rows.push(("observed", observed.to_owned()));
    }
    let dwells = count(report.dwells.len());
    rows.push(("dwells", format!("{dwells}, found in {found_in}")));
    let rows = rows.into_iter();
    let rows: Vec<_> = rows.map(|(name, value)| (name.to_owned(), value)).collect();
    facts(&rows)
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::synthetic;
    use super::*;
    use crate::imu::InstallationForm;

    #[test]
    fn noise_is_given_in_the_units_of_data_sheets() {
        let made_up = synthetic(InstallationForm::General);
        let shown = run(&made_up.run).into_string();
        for fact in [
            "random walk 0.0010 °/√h, instability 0.0030 °/h over 3600 s",
            "random walk 5.0 µg/√Hz",
            "position 1.0 ″",
            "latitude 39.90000°",
        ] {
            assert!(shown.contains(fact), "{fact}");
        }
    }
}
