//! The named values of a comparison; `unit` states the unit of each quantity.

use super::shown::{in_unit, shown, unit_key, verdict};
use crate::prelude::*;
use turncal::calibration::Calibration;
use turncal::imu::InstallationForm;
use turncal::lot::{Check, ChiSquare, FALSE_ALARM, Lot, Quantity, Row, Statistics, Verdict};

pub fn data(lot: &Lot) -> Value {
    let reference = lot.reference();
    json!({
        "format": "turncal-lot/1",
        "body_frame": lot.body_frame,
        "installation_form": InstallationForm::General,
        "nominal_scale": { "gyro": lot.nominal.gyro.0.as_slice(), "accel": lot.nominal.accel.0.as_slice() },
        "verdict": verdict(lot).map(|(word, _)| json!({ "word": word, "reasons": reasons(lot) })),
        "false_alarm": FALSE_ALARM,
        "confidence": lot.specification.as_ref().map(|s| s.confidence),
        "units": lot.rows.iter().enumerate().map(|(place, row)| unit(lot, place, row)).collect::<Value>(),
        "quantities": lot.statistics.iter().map(|of| quantity(lot, of)).collect::<Value>(),
        "all_parameters": lot.joint.map(|of| chi2(Some(of))),
        "reference": reference.map(|of| &of.unit.name),
        "reference_is_truth": lot.truth.is_some(),
        "reference_values": reference.map(|of| values(lot, of)),
    })
}

/// Limits exceeded or undecided, by unit and parameter.
fn reasons(lot: &Lot) -> Vec<String> {
    let of_row = |row: &Row| {
        let open = row
            .checks
            .iter()
            .filter(|check| check.verdict != Verdict::Pass);
        let words = |check: &Check| {
            let (parameter, verdict) = (check.quantity().name(), check.verdict.name());
            format!("{} {parameter} {verdict}", row.unit.name)
        };
        open.map(words).collect::<Vec<_>>()
    };
    lot.rows.iter().flat_map(of_row).collect()
}

fn unit(lot: &Lot, place: usize, row: &Row) -> Value {
    let calibration = row.unit.calibrated.as_ref().ok().map(|of| &of.calibration);
    let outliers: Vec<String> = lot
        .outliers_of(place)
        .map(|of| of.quantity.name())
        .collect();
    let failing = { row.checks.iter() }.filter(|check| check.verdict == Verdict::Fail);
    json!({
        "name": row.unit.name,
        "meta": row.unit.meta,
        "failure": row.canonical.as_ref().err(),
        "calibration_verdict": calibration.and_then(Calibration::word),
        "converged": calibration.map(|c| c.converged),
        "nis": calibration.and_then(|c| Some(c.consistency.as_ref()?.all.nis)),
        "warnings": calibration.map(|c| &c.warnings),
        "verdict": row.verdict,
        "outside": failing.map(|check| check.quantity().name()).collect::<Vec<_>>(),
        "apart": outliers,
        "values": values(lot, row),
        "nees_per_n": row.nees.map(|nees| nees.mean),
        "n": row.nees.map(|nees| nees.count),
        "nees_interval": row.nees.map(|nees| nees.interval),
    })
}

/// Values by name, with the difference from the reference if there is one.
fn values(lot: &Lot, row: &Row) -> Map<String, Value> {
    let entry = |quantity: Quantity| {
        let (value, sigma) = shown(quantity, row.sample(quantity)?);
        let mut entry = json!({ "value": value, "sigma": sigma, "unit": unit_key(lot, quantity) });
        if let Some(check) = row.check_of(quantity) {
            entry["verdict"] = json!(check.verdict);
            entry["probability_within"] = json!(check.probability);
        }
        if let Some(of) = lot.difference(row, quantity) {
            entry["difference"] = json!(in_unit(quantity, of.value));
            entry["difference_sigma"] = json!(in_unit(quantity, of.sigma));
            entry["z"] = json!(of.in_sigma());
        }
        Some((quantity.name(), entry))
    };
    lot.quantities().filter_map(entry).collect()
}

fn quantity(lot: &Lot, of: &Statistics) -> Value {
    let quantity = of.quantity;
    let (mean, mean_sigma) = shown(quantity, of.mean());
    let spread = |x: f64| in_unit(quantity, x);
    let interval = of.scatter.spread.interval;
    let data = json!({
        "name": quantity.name(),
        "unit": unit_key(lot, quantity),
        "count": of.count,
        "outliers": of.outliers.iter().map(|&k| &lot.rows[k].unit.name).collect::<Vec<_>>(),
        "mean": mean,
        "mean_sigma": mean_sigma,
        "standard_deviation": spread(of.scatter.deviation),
        "spread": spread(of.scatter.spread.value),
        "spread_interval": [spread(interval.0), spread(interval.1)],
        "spread_is_real": of.real,
    });
    joined(data, chi2(of.scatter.chi_square))
}

fn chi2(of: Option<ChiSquare>) -> Value {
    json!({
        "chi2": of.map(|of| of.value),
        "degrees_of_freedom": of.map(|of| of.freedom),
        "p": of.map(|of| of.p),
    })
}

#[rustfmt::skip]
const HEADER: [&str; 10] = [
    "unit", "serial", "date", "quantity", "unit_of_value", "value", "sigma", "apart", "verdict", "calibration_verdict",
];

fn text(of: &Value) -> &str {
    of.as_str().unwrap_or_default()
}

/// The values of all units as CSV. A unit without a calibration has one row without values.
pub fn csv(data: &Value) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let mut write = |cells: &[&str]| {
        // Writing to memory does not fail.
        let _ = writer.write_record(cells);
    };
    write(&HEADER);
    for unit in data["units"].as_array().into_iter().flatten() {
        let meta = |key: &str| text(&unit["meta"][key]);
        let first = [text(&unit["name"]), meta("serial"), meta("date")];
        if !unit["failure"].is_null() {
            write(&[&first[..], &["", "", "", "", "", "not calibrated", ""]].concat());
        }
        for (name, of) in unit["values"].as_object().into_iter().flatten() {
            let [value, sigma] =
                ["value", "sigma"].map(|key| of[key].as_f64().unwrap_or(f64::NAN).to_string());
            let apart = unit["apart"]
                .as_array()
                .is_some_and(|all| all.contains(&json!(name)));
            let rest = [
                name.as_str(),
                text(&of["unit"]),
                &value,
                &sigma,
                &apart.to_string(),
                &text(&of["verdict"]).replace('-', " "),
                text(&unit["calibration_verdict"]),
            ];
            write(&[&first[..], &rest].concat());
        }
    }
    String::from_utf8(writer.into_inner().unwrap_or_default()).unwrap_or_default()
}
