//! Report on a calibration file, with the values as written in the file.

use super::calibration::{cross_validation, in_order};
use super::ieee;
use super::prelude::*;
use super::values;
use turncal::calibration::Calibration;

/// Shows the verdict, the findings and the values; the long form also shows every parameter with its sources of
/// uncertainty.
pub fn document(calibration: &Calibration, name: &str) -> Document {
    let mut document = Document::new(name);
    document.verdict = values::verdict(calibration);
    document.lead.extend(origin(calibration));
    document.findings = in_order(&calibration.findings);
    if !calibration.is_of_magnetometer() {
        document.brief.push(values::table(calibration).into());
    }
    let magnetometer = values::magnetometer(calibration);
    document.brief.extend(magnetometer.map(Into::into));
    document.brief.push(facts(calibration).into());
    document.both(parameters(calibration));
    document.both(noise(calibration));
    document.both(terms(calibration));
    if !calibration.is_of_magnetometer() {
        document.both(ieee::table(calibration));
    }
    document
}

/// Duration, rate and dwells of the recording.
fn origin(calibration: &Calibration) -> Option<String> {
    let of = calibration.provenance.as_ref();
    // Values of a magnetometer alone need no times.
    let of = of.filter(|_| !calibration.is_of_magnetometer())?;
    let [duration, rate] = [of.duration_s, of.rate_hz].map(three_digits);
    Some(format!(
        "{duration} s at {rate} Hz, {}",
        several(of.dwells, "dwell")
    ))
}

fn facts(calibration: &Calibration) -> Facts {
    let mut facts = Facts::default();
    let held_out = calibration.quality.as_ref().and_then(cross_validation);
    if let Some(words) = held_out {
        facts.push("excluded from fit", words);
    }
    if let Some(mag) = &calibration.mag
        && let Some(of) = mag.ellipsoid
    {
        let percent = three_digits(100.0 * of.residual);
        let unit = &mag.field.unit;
        let magnitude = format!(
            "field = correction (N − hard iron); its magnitude is {} {unit}",
            mag.field.magnitude
        );
        facts.push("convention", format!("symmetric matrix; {magnitude}"));
        facts.push(
            "residual",
            format!(
                "{percent} % of the magnitude (RMS of {} values)",
                count(of.values)
            ),
        );
        facts.push(
            "sphere",
            format!("values in {} of {} equal parts", of.seen, of.parts),
        );
    }
    if let Some(of) = &calibration.provenance {
        let files = of.inputs.iter().map(|input| input.name.as_str());
        facts.push("from", files.collect::<Vec<_>>().join(", "));
        facts.push("by", of.program.clone());
    }
    for (name, text) in &calibration.meta {
        facts.push(name, text.clone());
    }
    facts
}

/// Every estimated parameter in the unit of the file, with the largest part of its uncertainty.
fn parameters(calibration: &Calibration) -> Table {
    let columns = ["parameter", "value", "1σ", "coverage factor", "mostly from"];
    let rows = calibration.parameters.iter().enumerate();
    let rows = rows.filter_map(|(k, name)| {
        let (value, own) = (calibration.get(name)?, *calibration.sigma_of(name)?);
        let budget = calibration.budget.as_ref();
        let factor = budget.and_then(|of| of.coverage_factor.get(k).copied());
        let parts = budget.into_iter().flat_map(|of| &of.sources);
        let parts = parts.filter_map(|of| Some((of, *of.u.get(k)?)));
        let largest = parts.max_by(|a, b| a.1.total_cmp(&b.1));
        let source = largest.map(|(of, u)| {
            let share = 100.0 * (u / own).powi(2);
            format!("{} {share:.0} %", of.source)
        });
        Some(cells![
            name,
            turncal::number::value(*value, own),
            sigma(own),
            or_dash(factor, three_digits),
            source.unwrap_or_else(|| NONE.to_owned())
        ])
    });
    Table::new("Parameters, in the unit of the file", columns).section(rows)
}

fn noise(calibration: &Calibration) -> Table {
    let columns = ["noise", "used", "95 % interval", "stated", "unit"];
    let sources = calibration.noise.iter().flat_map(|of| &of.report.sources);
    let rows = sources.filter(|of| of.counts()).map(|of| {
        let ends = of
            .interval
            .map(|[low, high]| format!("{} to {}", three_digits(low), three_digits(high)));
        cells![
            of.name.clone(),
            three_digits(of.used),
            ends.unwrap_or_else(|| NONE.to_owned()),
            or_dash(of.stated, three_digits),
            of.unit.clone()
        ]
    });
    Table::new("Noise", columns).section(rows)
}

fn terms(calibration: &Calibration) -> Table {
    let rows = calibration.terms.iter().map(|(name, of)| {
        let own = of.sigma.unwrap_or(0.0);
        cells![name, turncal::number::value(of.value, own), sigma(own)]
    });
    Table::new("Error terms, in SI", ["term", "value", "1σ"]).section(rows)
}
