//! Report on a calibration, and comparison of both methods.

mod attitudes;
mod brief;
mod budget;
mod error_bars;
pub mod figures;
mod noise;
#[cfg(test)]
mod pictures;
mod report;
mod residuals;
mod solved;
mod tables;
pub mod temperature;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use crate::prelude::*;
use crate::{ieee, navigation, terms, values};
use turncal::calibration::{Finding, FindingKind};
use turncal::imu::{Noise, Sensor};

pub use report::{ClosedForm, Report};
pub use solved::{Truth, document, dwell_times, note, within};
pub use tables::cross_validation;

/// Sorts the findings, the most severe first. Within a level, the first finding of each kind precedes further findings
/// of the same kind, and the assumptions made on reading come last.
pub fn in_order(findings: &[Finding]) -> Vec<Finding> {
    let mut seen = BTreeSet::new();
    let keyed = findings.iter().map(|finding| {
        let is_first = seen.insert(&finding.code) && !finding.is(FindingKind::Recording);
        ((finding.level(), !is_first), finding.clone())
    });
    let mut keyed: Vec<_> = keyed.collect();
    keyed.sort_by_key(|(key, _)| *key);
    keyed.into_iter().map(|(_, finding)| finding).collect()
}

impl Report<'_> {
    /// The complete report on the calibration. The named values of the report are in the calibration file.
    pub fn document(&self) -> Document {
        let mut document = Document::new(self.title);
        document.verdict = values::verdict(self.calibration);
        document.lead = self.lead();
        document.findings = in_order(self.findings);
        brief::add(&mut document, self);
        document.page(item(self));
        document.pages(self.estimate().map(|estimate| self.error_bars(estimate)));
        let quality = self.quality.filter(|of| !of.dwells.is_empty());
        document.pages(quality.map(residuals::figure));
        document.pages(self.against_time().and_then(|outcome| self.sigma(outcome)));
        document.pages(self.against_time().and_then(|_| self.attitudes()));
        document.pages(self.against_time().and_then(|_| self.noise()));
        document.pages(self.outcome.and_then(temperature::figure));
        document.fold("Every parameter");
        if let Some(estimate) = self.estimate() {
            document.both(self.parameters(estimate));
        }
        document.both(ieee::table(self.calibration));
        document.fold("Residuals, consistency, error terms");
        if let Some(quality) = self.quality {
            document.both(tables::residuals(quality, self.table()));
        }
        if let Some(outcome) = self.outcome {
            temperature::add(&mut document, outcome);
            document.page(tables::consistency(outcome));
            document.both(terms::explained(&outcome.terms));
        }
        if let (Some(of), Some(estimate)) = (self.budget, self.estimate()) {
            document.fold("Uncertainty budget");
            document.page(budget::table(of, estimate));
            document.page(budget::figure(of, estimate));
        }
        document.fold("Navigation");
        navigation::add(&mut document, self.navigation);
        document.fold("Figures");
        document.pages(self.figures());
        document.fold("Observability, model, method and run");
        if let Some(outcome) = self.outcome {
            document.page(tables::weakest(outcome));
        }
        document.page(self.model());
        document.page(run(self));
        document
    }

    /// Recording, date and files, unless they are in the title.
    fn origin(&self) -> Option<String> {
        let recording = &self.run.recording;
        let name = (recording.name != self.title).then(|| format!("Recording {}", recording.name));
        let date = recording.meta.get("date");
        let files = recording.files.iter().filter_map(|path| path.file_name());
        let files: Vec<_> = files.map(|name| name.to_string_lossy()).collect();
        let files = (!files.is_empty()).then(|| files.join(", "));
        let date = date.map(|date| format!("Recorded {date}"));
        let parts = Vec::from_iter([date, name, files].into_iter().flatten());
        (!parts.is_empty()).then(|| parts.join(" · "))
    }

    /// Methods and data.
    fn lead(&self) -> Vec<String> {
        let imu = &self.run.recording.imu;
        let origin = self.calibration.provenance.as_ref();
        let duration = origin.map_or(imu.duration(), |origin| origin.duration_s);
        let how = match self.table() {
            Some(_) => "with a table",
            None => "without a table",
        };
        let dwells = several(self.dwells.len(), "dwell");
        let mut lead = vec![
            match self.outcome.map_or(0, |outcome| outcome.alone.len()) {
                0 | 1 => format!(
                    "{} s at {} Hz, {dwells}, {how}",
                    value(duration, 10.0),
                    three_digits(1.0 / imu.period),
                ),
                recordings => format!("{recordings} recordings of one instrument, {dwells}, {how}"),
            },
        ];
        lead.extend(self.origin());
        lead.extend(self.outcome.map(|outcome| {
            let converged = if outcome.converged {
                "converged"
            } else {
                "NOT CONVERGED"
            };
            let (passes, nis) = (outcome.passes.len(), tables::nis(outcome).join(", "));
            format!("EKF {converged} after {passes} passes; NIS with its 95 % interval: {nis}.")
        }));
        let closed_form = self.closed_form;
        lead.extend(closed_form.map(|closed| format!("Closed form: {}.", closed.note)));
        lead
    }
}

/// The calibrated instrument, from the metadata of its run.
pub fn item(report: &Report) -> Facts {
    let meta = &report.run.recording.meta;
    let first = ["instrument", "serial", "date"];
    let others = meta.keys().map(String::as_str);
    let others = others.filter(|name| !first.contains(name));
    let names = first.into_iter().chain(others);
    let rows = names.filter_map(|name| Some((name, meta.get(name)?.clone())));
    Facts::new("", rows)
}

/// Recording, site and prior.
pub fn run(report: &Report) -> Facts {
    let run = report.run;
    let (imu, site) = (&run.recording.imu, &run.site);
    let mut facts = Facts::new("Run", [("run", run.recording.name.clone())]);
    let place = if site.is_known {
        format!(
            "latitude {}°, longitude {}°, height {} m",
            value(site.latitude / DEGREE, 1e-4),
            value(site.longitude / DEGREE, 1e-4),
            value(site.height, 1.0),
        )
    } else {
        "not stated".to_owned()
    };
    let gravity = value(site.gravity, 1e-5);
    facts.push("site", format!("{place}, gravity {gravity} m/s²"));
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
        let (name, instrument) = (sensor.name(), &run.instrument);
        let of = instrument.nominal.get(sensor).0.into();
        let scale = nominal_scale(of, instrument.unit.get(sensor), input);
        facts.push(&format!("{name} nominal scale"), scale);
        let noise = noise(sensor, instrument.noise.get(sensor));
        facts.push(&format!("{name} noise"), noise);
    }
    if let Some(table) = report.table() {
        let readings = format!(
            "{} readings; position error {} ″ (1σ, independent from position to position), reading error {} ″ (1σ, \
             white)",
            count(table.time.len()),
            sigma(run.table.position_sigma / ARCSEC),
            sigma(run.table.reading_sigma / ARCSEC)
        );
        facts.push("turntable", readings);
    } else if run.recording.table.is_some() {
        facts.push("turntable", "log not used");
    }
    facts
}

fn noise(sensor: Sensor, noise: &Noise) -> String {
    let (walk, walk_unit, bias, bias_unit) = match sensor {
        Sensor::Gyro => (DEG_PER_SQRT_H, "°/√h", DEG_PER_H, "°/h"),
        Sensor::Accel => (MICRO_G_PER_SQRT_HZ, "µg/√Hz", MICRO_G, "µg"),
    };
    let own = sigma(noise.random_walk / walk);
    let mut text = format!("random walk {own} {walk_unit}");
    if let Some(of) = noise.gauss_markov {
        let (of_bias, time) = (sigma(of.sigma / bias), sigma(of.correlation_time));
        text += &format!(", Gauss–Markov bias {of_bias} {bias_unit} over {time} s");
    }
    text
}

impl Report<'_> {
    /// The model, the method and the frame.
    pub fn model(&self) -> Facts {
        let symbols = "N: output per second divided by its nominal scale; u: angular rate or specific force along the \
        body axes; K: scale factors, shown as deviations from nominal; E: off-diagonal entries of C; D: bias";
        let equation = "N = K C u + D; u = (K C)⁻¹ (N − D)";
        let rows = [("equation", equation), ("symbols", symbols)];
        let mut facts = Facts::new("Model and method", rows);
        if let Some(estimate) = self.estimate() {
            facts.push("installation form", estimate.form().name());
        }
        facts.push("body frame", self.body_frame.words());
        let (observed, found_in) = match self.table() {
            Some(_) => (
                "zero velocity in dwells and table attitude",
                "the table's log",
            ),
            None => ("zero velocity in dwells", "the IMU readings"),
        };
        if let Some(outcome) = self.outcome {
            let filter = format!(
                "error-state EKF, {} Gauss–Newton iterations; velocity in dwells {} mm/s (1σ, white)",
                outcome.passes.len(),
                sigma(outcome.velocity_sigma / MILLISECOND)
            );
            facts.push("filter", filter);
            facts.push("observed", observed);
        }
        if let Some(closed) = self.closed_form {
            facts.push("closed form", closed.note);
        }
        let dwells = format!("{}, found in {found_in}", count(self.dwells.len()));
        facts.push("dwells", dwells);
        facts
    }
}
