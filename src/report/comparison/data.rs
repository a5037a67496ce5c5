//! The figures of a comparison by name. Differences are calibration minus reference; units are those of the group
//! that a key names.

use crate::calibration::{ChiSquare, Comparison, ParameterVector, Side, parameter_name};
use crate::imu::InstallationForm;
use crate::report::prelude::*;

pub(super) fn data(comparison: &Comparison) -> Value {
    let (sides, reference) = (&comparison.sides, &comparison.reference);
    let groups = Group::all().map(|group| {
        let spreads = sides.iter().map(|side| spread(comparison, group, side));
        (group.key(), spreads.collect::<Value>())
    });
    let mut data = json!({
        "body_frame": comparison.body_frame,
        "installation_form": InstallationForm::General,
        "reference": reference.name,
        "reference_is_truth": comparison.against_truth,
        "calibrations": sides.iter().map(|side| json!({
            "name": side.calibration.name,
            "converged": side.calibration.converged,
            "nees_per_n": side.nees.map(|nees| nees.mean),
            "n": side.nees.map(|nees| nees.count),
            "nees_interval": side.nees.map(|nees| nees.interval),
        })).collect::<Value>(),
        "groups": groups.collect::<Map<_, _>>(),
        "parameters": comparison.parameters.iter().map(|&k| parameter(comparison, k)).collect::<Value>(),
    });
    if let Some(scatter) = &comparison.scatter {
        let parameters = scatter.parameters.iter().map(|of| {
            let group = Group::of(of.index);
            let unit = group.unit_value();
            let mut data = json!({
                "name": name(of.index),
                "group": group.key(),
                "count": of.count,
                "mean_less_reference": of.mean / unit,
                "mean_sigma": of.mean_sigma.map(|sigma| sigma / unit),
                "standard_deviation": of.deviation / unit,
            });
            if let (Some(chi), Value::Object(data)) = (of.chi_square, &mut data) {
                data.extend(chi2(chi));
            }
            data
        });
        let parameters: Value = parameters.collect();
        data["scatter"] = json!({ "parameters": parameters, "all": scatter.joint.map(chi2) });
    }
    data
}

fn name(index: usize) -> String {
    parameter_name(InstallationForm::General, index).unwrap_or_default()
}

/// Of a group's differences.
fn spread(comparison: &Comparison, group: Group, side: &Side) -> Value {
    let indices = group.among(&comparison.parameters);
    let of = |v: &ParameterVector| group.spread(v, &indices);
    let difference = of(&side.difference);
    json!({
        "name": side.calibration.name,
        "largest": difference.map(|d| d.0),
        "rms": difference.map(|d| d.1),
        "rms_sigma": side.calibration.sigma().and_then(|s| of(&s)).map(|s| s.1),
    })
}

/// The reference's value is in the file's quantity for scale factors, in the group's unit for others.
fn parameter(comparison: &Comparison, index: usize) -> Value {
    let group = Group::of(index);
    let unit = group.unit_value();
    let at = |v: Option<ParameterVector>| v.map(|v| v[index] / unit);
    let value = comparison.reference.vector()[index] / unit;
    json!({
        "name": name(index),
        "group": group.key(),
        "reference_value": comparison.scale_factor(index).unwrap_or(value),
        "reference_sigma": at(comparison.reference.sigma()),
        "calibrations": comparison.sides.iter().map(|side| json!({
            "name": side.calibration.name,
            "difference": side.difference[index] / unit,
            "sigma": at(side.calibration.sigma()),
            "difference_sigma": at(side.difference_sigma),
            "z": side.z(index),
        })).collect::<Value>(),
    })
}

fn chi2(of: ChiSquare) -> Map<String, Value> {
    Map::from_iter([
        ("chi2".to_owned(), of.value.into()),
        ("degrees_of_freedom".to_owned(), of.freedom.into()),
        ("p".to_owned(), of.p.into()),
    ])
}
