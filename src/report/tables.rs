//! The tables of the page.

use maud::{Markup, html};

use super::group::{Group, short_name};
use super::number::{self, count, sigma, three_digits, value};
use super::{ClosedForm, Report};
use crate::calibration::outcome::{Estimate, Outcome, parameter_name};
use crate::imu::{Noise, Sensor};
use crate::run::Run;
use crate::units::{
    ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, DEGREE, MICRO_G, MICRO_G_PER_SQRT_HZ, MILLISECOND,
};

/// A path that leaves more than this of the prior σ has hardly observed the parameter.
pub(super) const HARDLY_OBSERVED: f64 = 0.5;

/// A table whose first column names the row.
fn table(headings: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> Markup {
    html! {
        table {
            thead { tr { @for heading in headings { th scope="col" { (heading) } } } }
            tbody {
                @for row in rows {
                    tr {
                        @for (n, cell) in row.iter().enumerate() {
                            @if n == 0 { th scope="row" { (cell) } } @else { td { (cell) } }
                        }
                    }
                }
            }
        }
    }
}

/// Pairs of a name and a value.
fn facts(rows: impl IntoIterator<Item = (String, String)>) -> Markup {
    html! {
        dl { @for (name, value) in rows { div { dt { (name) } dd { (value) } } } }
    }
}

/// Largest error and σ of each group for each method: the answer at a glance.
pub(super) fn groups(report: &Report) -> Markup {
    let methods = report.methods();
    let truth = report.truth_vector();
    let mut headings = vec!["".to_owned(), "unit".to_owned()];
    for (name, _) in &methods {
        headings.push(format!("{name}: σ"));
        if truth.is_some() {
            headings.push("largest error".to_owned());
            headings.push("RMS error".to_owned());
        }
    }
    let difference = match methods.as_slice() {
        &[(_, closed), (_, filter)] if truth.is_none() => {
            headings.push("closed form less EKF, RMS".to_owned());
            Some(closed.vector() - filter.vector())
        }
        _ => None,
    };
    let rows = Group::all().map(|group| {
        let mut row = vec![group.title(), group.unit().to_owned()];
        for (_, estimate) in &methods {
            let indices = group.parameters(estimate.form());
            let claimed = group.spread(&estimate.sigma(), &indices);
            row.push(claimed.map_or("–".to_owned(), |(_, rms)| sigma(rms)));
            if let Some(truth) = &truth {
                let error = group.spread(&(estimate.vector() - truth), &indices);
                row.extend(
                    error.map_or(["–".to_owned(), "–".to_owned()], |(largest, rms)| {
                        [three_digits(largest), three_digits(rms)]
                    }),
                );
            }
        }
        if let (Some(difference), Some((_, first))) = (&difference, methods.first()) {
            let spread = group.spread(difference, &group.parameters(first.form()));
            row.push(spread.map_or("–".to_owned(), |(_, rms)| three_digits(rms)));
        }
        row
    });
    let headings: Vec<&str> = headings.iter().map(String::as_str).collect();
    table(&headings, rows.collect::<Vec<_>>())
}

/// Every parameter with its accuracy, and its error where the truth is known.
pub(super) fn estimates(report: &Report, estimate: &Estimate) -> Markup {
    let prior = report.outcome.map(|outcome| outcome.prior_sigma);
    let truth = report.truth_vector();
    let (form, posterior, values) = (estimate.form(), estimate.sigma(), estimate.vector());
    let mut headings = vec!["parameter", "value ± 1σ", "unit"];
    if prior.is_some() {
        headings.extend(["prior σ", "posterior σ", "ratio"]);
    }
    if truth.is_some() {
        headings.extend(["error", "error / σ"]);
    }
    let rows = (0..values.len()).filter_map(|i| {
        let group = Group::of(i);
        let (unit, fixed) = (group.unit_value(), posterior[i] <= 0.0);
        let s = posterior[i] / unit;
        let shown = value(group.shown(values[i]), s);
        let mut row = vec![
            parameter_name(form, i)?,
            if fixed {
                format!("{shown} (fixed)")
            } else {
                format!("{shown} ± {}", sigma(s))
            },
            group.unit().to_owned(),
        ];
        if let Some(prior) = &prior {
            row.push(three_digits(prior[i] / unit));
            row.push(sigma(s));
            row.push(ratio(posterior[i], prior[i]));
        }
        if let Some(truth) = &truth {
            let error = (values[i] - truth[i]) / unit;
            row.push(value(error, s));
            row.push(if fixed {
                "–".to_owned()
            } else {
                value(error / s, 0.1)
            });
        }
        Some(row)
    });
    table(&headings, rows)
}

/// Posterior over prior σ, with words where the path hardly observed the parameter.
fn ratio(posterior: f64, prior: f64) -> String {
    let ratio = posterior / prior;
    if !ratio.is_finite() {
        "–".to_owned()
    } else if ratio > HARDLY_OBSERVED {
        format!("{ratio:.2}, hardly observed")
    } else {
        format!("1 : {}", count((1.0 / ratio).round() as usize))
    }
}

/// The passes of the filter.
pub(super) fn passes(outcome: &Outcome) -> Markup {
    let rows = outcome.passes.iter().enumerate().map(|(n, pass)| {
        vec![
            (n + 1).to_string(),
            if pass.live { "live, fed back" } else { "held" }.to_owned(),
            three_digits(pass.largest_step),
            three_digits(pass.merit),
            count(pass.observations),
            three_digits(pass.merit / pass.observations as f64),
            count(pass.rejected),
        ]
    });
    table(
        &[
            "pass",
            "kind",
            "largest step, σ",
            "merit",
            "scalars",
            "merit / scalars",
            "rejected",
        ],
        rows,
    )
}

/// How the innovations agree with their covariance.
pub(super) fn consistency(outcome: &Outcome) -> Markup {
    let rows = [
        ("zero velocity", outcome.consistency.velocity),
        ("table attitude", outcome.consistency.table),
    ]
    .map(|(name, nis)| {
        if nis.count == 0 {
            return [name, "not observed", "", "", "0"]
                .map(str::to_owned)
                .to_vec();
        }
        let (low, high) = nis.interval;
        let verdict = if nis.mean < low {
            ", below"
        } else if nis.mean > high {
            ", above"
        } else {
            ""
        };
        vec![
            name.to_owned(),
            format!("{}{verdict}", value(nis.mean, 0.01)),
            format!("{} … {}", value(low, 0.01), value(high, 0.01)),
            value(nis.lag_one, 0.01),
            count(nis.count),
        ]
    });
    table(
        &[
            "observation",
            "NIS per scalar",
            "95 % interval",
            "lag-one correlation",
            "scalars",
        ],
        rows,
    )
}

/// What was recorded, where, and what was known before.
pub(super) fn run(run: &Run) -> Markup {
    let text = |name: &str, value: String| (name.to_owned(), value);
    let imu = &run.imu;
    let mut rows = vec![text("run", run.name.clone())];
    rows.extend(run.meta.iter().map(|(k, v)| (k.clone(), v.clone())));
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
        let nominal = run.nominal.get(sensor).0;
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
                run.unit.get(sensor)
            ),
        ));
        rows.push(text(
            &format!("{} noise", sensor.name()),
            noise(sensor, run.noise.get(sensor)),
        ));
    }
    rows.push(match &run.table {
        Some(table) => text(
            "turntable",
            format!(
                "{} readings; position {} ″ (1σ, new at every position), reading {} ″ (1σ, white)",
                count(table.time.len()),
                sigma(table.position_sigma / ARCSEC),
                sigma(table.reading_sigma / ARCSEC)
            ),
        ),
        None => text("turntable", "no record".to_owned()),
    });
    facts(rows)
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
    if let Some(instability) = noise.instability {
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
    rows.push(("body frame", report.body_frame.to_owned()));
    if let Some(outcome) = report.outcome {
        let held = outcome.passes.iter().filter(|pass| !pass.live).count();
        rows.push((
            "filter",
            format!(
                "error-state EKF, {} passes, {held} of them held; velocity at standstill {} mm/s (1σ, white)",
                outcome.passes.len(),
                sigma(outcome.velocity_sigma / MILLISECOND)
            ),
        ));
    }
    if let Some(ClosedForm { note, .. }) = report.closed_form {
        rows.push(("closed form", note.to_owned()));
    }
    rows.push(("dwells", number::count(report.dwells.len())));
    facts(
        rows.into_iter()
            .map(|(name, value)| (name.to_owned(), value)),
    )
}

/// Short names of the parameters that the path hardly observed.
pub(super) fn hardly_observed(outcome: &Outcome) -> Vec<String> {
    let sigma = outcome.estimate.sigma();
    outcome
        .estimate
        .estimated()
        .filter(|&i| sigma[i] > HARDLY_OBSERVED * outcome.prior_sigma[i])
        .map(|i| short_name(outcome.estimate.form(), i))
        .collect()
}
