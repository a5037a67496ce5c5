//! The comparison as one JSON document.

use std::collections::BTreeMap;

use serde::Serialize;
use turncal::calibration::ParameterVector;
use turncal::calibration::parameter_name;
use turncal::calibration::{ChiSquare, Comparison, Nees, Side};
use turncal::imu::BodyFrame;
use turncal::imu::InstallationForm;
use turncal::report::group::Group;

/// Differences are calibration minus reference; units are those of the group that a key names.
#[derive(Serialize)]
pub(super) struct Document<'a> {
    body_frame: BodyFrame,
    installation_form: InstallationForm,
    reference: &'a str,
    reference_is_truth: bool,
    calibrations: Vec<Consistency<'a>>,
    groups: BTreeMap<String, Vec<Spread<'a>>>,
    parameters: Vec<Parameter<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    scatter: Option<Scatter>,
}

#[derive(Serialize)]
struct Consistency<'a> {
    name: &'a str,
    converged: bool,
    nees_per_n: Option<f64>,
    n: Option<usize>,
    nees_interval: Option<[f64; 2]>,
}

/// Of a group's differences.
#[derive(Serialize)]
struct Spread<'a> {
    name: &'a str,
    largest: Option<f64>,
    rms: Option<f64>,
    rms_sigma: Option<f64>,
}

#[derive(Serialize)]
struct Parameter<'a> {
    name: String,
    group: String,
    /// In the file's quantity for scale factors, in the group's unit for others.
    reference_value: f64,
    /// In the group's unit.
    reference_sigma: Option<f64>,
    calibrations: Vec<Difference<'a>>,
}

#[derive(Serialize)]
struct Difference<'a> {
    name: &'a str,
    difference: f64,
    /// What the calibration claims.
    sigma: Option<f64>,
    difference_sigma: Option<f64>,
    z: Option<f64>,
}

#[derive(Serialize)]
struct Scatter {
    parameters: Vec<ParameterScatter>,
    all: Option<Chi2>,
}

#[derive(Serialize)]
struct ParameterScatter {
    name: String,
    group: String,
    count: usize,
    mean_less_reference: f64,
    mean_sigma: Option<f64>,
    standard_deviation: f64,
    #[serde(flatten)]
    chi_square: Option<Chi2>,
}

#[derive(Serialize)]
struct Chi2 {
    chi2: f64,
    degrees_of_freedom: usize,
    p: f64,
}

impl<'a> Document<'a> {
    pub(super) fn new(comparison: &'a Comparison) -> Self {
        Self {
            body_frame: comparison.body_frame,
            installation_form: InstallationForm::General,
            reference: &comparison.reference.name,
            reference_is_truth: comparison.against_truth,
            calibrations: comparison.sides.iter().map(consistency).collect(),
            groups: Group::all()
                .map(|group| {
                    let sides = comparison.sides.iter();
                    let spreads = sides.map(|side| spread(comparison, group, side));
                    (group.key(), spreads.collect())
                })
                .collect(),
            parameters: comparison
                .parameters
                .iter()
                .map(|&index| parameter(comparison, index))
                .collect(),
            scatter: comparison.scatter.as_ref().map(|scatter| Scatter {
                parameters: scatter.parameters.iter().map(of_parameter).collect(),
                all: scatter.joint.map(chi2),
            }),
        }
    }
}

fn name(index: usize) -> String {
    parameter_name(InstallationForm::General, index).unwrap_or_default()
}

fn consistency(side: &Side) -> Consistency<'_> {
    let of = |f: fn(Nees) -> f64| side.nees.map(f);
    Consistency {
        name: &side.calibration.name,
        converged: side.calibration.converged,
        nees_per_n: of(|nees| nees.mean),
        n: side.nees.map(|nees| nees.count),
        nees_interval: side.nees.map(|nees| nees.interval.into()),
    }
}

fn spread<'a>(comparison: &Comparison, group: Group, side: &'a Side) -> Spread<'a> {
    let indices: Vec<usize> = comparison
        .parameters
        .iter()
        .copied()
        .filter(|&index| Group::of(index) == group)
        .collect();
    let of = |v: &ParameterVector| group.spread(v, &indices);
    let difference = of(&side.difference);
    Spread {
        name: &side.calibration.name,
        largest: difference.map(|d| d.0),
        rms: difference.map(|d| d.1),
        rms_sigma: side.calibration.sigma().and_then(|s| of(&s)).map(|s| s.1),
    }
}

fn parameter(comparison: &Comparison, index: usize) -> Parameter<'_> {
    let group = Group::of(index);
    let unit = group.unit_value();
    let at = |v: Option<ParameterVector>| v.map(|v| v[index] / unit);
    let value = comparison.reference.vector()[index];
    Parameter {
        name: name(index),
        group: group.key(),
        reference_value: comparison.scale_factor(index).unwrap_or(value / unit),
        reference_sigma: at(comparison.reference.sigma()),
        calibrations: comparison
            .sides
            .iter()
            .map(|side| Difference {
                name: &side.calibration.name,
                difference: side.difference[index] / unit,
                sigma: at(side.calibration.sigma()),
                difference_sigma: at(side.difference_sigma),
                z: side.z(index),
            })
            .collect(),
    }
}

fn of_parameter(scatter: &turncal::calibration::ParameterScatter) -> ParameterScatter {
    let group = Group::of(scatter.index);
    let unit = group.unit_value();
    ParameterScatter {
        name: name(scatter.index),
        group: group.key(),
        count: scatter.count,
        mean_less_reference: scatter.mean / unit,
        mean_sigma: scatter.mean_sigma.map(|s| s / unit),
        standard_deviation: scatter.deviation / unit,
        chi_square: scatter.chi_square.map(chi2),
    }
}

fn chi2(chi_square: ChiSquare) -> Chi2 {
    Chi2 {
        chi2: chi_square.value,
        degrees_of_freedom: chi_square.freedom,
        p: chi_square.p,
    }
}
