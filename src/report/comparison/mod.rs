//! Report on a comparison of calibrations.

use crate::calibration::result::TermRecord;
use crate::calibration::{
    AUXILIARY, AuxiliaryKind, Canonical, ChiSquare, Comparison, Nees, ParameterVector, Side,
    auxiliary_name, parameter_name,
};
use crate::imu::{InstallationForm, Sensor};
use crate::report::prelude::*;
use crate::report::terms::unit;

/// Differences beyond this many σ are flagged.
const FLAGGED: f64 = 3.0;

/// The complete report on a comparison.
pub fn document(comparison: &Comparison) -> Document {
    let mut document = Document::new("Comparison of calibrations");
    let reference = match comparison.against_truth {
        true => "the truth",
        false => "the first calibration",
    };
    document.lead = vec![format!(
        "General form, body frame: {}. Reference: {}, {reference}.",
        comparison.body_frame.words(),
        comparison.reference.name
    )];
    document.warnings.items = comparison
        .calibrations()
        .filter(|calibration| !calibration.converged)
        .map(|calibration| {
            format!(
                "{} did not converge, so its σ are meaningless.",
                calibration.name
            )
        })
        .collect();
    document.page(figure(comparison));
    document.both(parameters(comparison));
    document.both(groups(comparison));
    document.both(auxiliary(comparison));
    document.both(scatter(comparison));
    document.data = data(comparison);
    document
}

fn short(index: usize) -> String {
    short_name(InstallationForm::General, index)
}

/// Rows of each triad.
fn by_triad(rows: impl Fn(Group) -> Vec<Vec<String>>) -> [Vec<Vec<String>>; 2] {
    Sensor::ALL.map(|sensor| {
        let groups = Group::all().filter(|group| group.sensor() == sensor);
        groups.flat_map(&rows).collect()
    })
}

/// A column for the reference and two for each calibration.
fn beside_reference(comparison: &Comparison) -> Vec<String> {
    let mut columns = cells!["", comparison.reference.name.as_str(), "unit"];
    for side in &comparison.sides {
        columns.extend([side.calibration.name.clone(), "z".to_owned()]);
    }
    columns
}

fn flagged(z: Option<f64>) -> String {
    or_dash(z, |z| {
        let flag = if z.abs() > FLAGGED { "! " } else { "" };
        format!("{flag}{}", value(z, 1.0))
    })
}

fn parameters(comparison: &Comparison) -> Table {
    let row = |index: usize| {
        let group = Group::of(index);
        let mut row = cells![
            short(index),
            reference_value(comparison, index),
            group.unit()
        ];
        let finest = finest(comparison, &[index]);
        for side in &comparison.sides {
            let own = side.calibration.sigma().map(|s| s[index]);
            let difference = with_sigma(side.difference[index], own, finest, group.unit_value());
            row.extend([difference, flagged(side.z(index))]);
        }
        row
    };
    let rows = |group: Group| group.among(&comparison.parameters).into_iter().map(row);
    let table = Table::new("Parameters", beside_reference(comparison))
        .sections(by_triad(|group| rows(group).collect()))
        .note("Calibrations: difference from the reference ± the 1σ of the calibration.")
        .note(format!(
            "z: difference divided by its σ; ! beyond {FLAGGED}."
        ));
    let table = match comparison.stated_nominal {
        Some(_) => table,
        None => table.note(
            "K of the reference is in the unit of the file, because no file states nominal scale factors.",
        ),
    };
    match comparison.against_truth {
        true => table,
        false => table.note("z and NEES are valid only if the calibrations use different data."),
    }
}

/// The smallest σ that any calibration states for some parameters; finer digits are meaningless.
fn finest(comparison: &Comparison, indices: &[usize]) -> Option<f64> {
    comparison
        .calibrations()
        .filter_map(|calibration| calibration.sigma())
        .flat_map(|sigma| indices.iter().map(move |&index| sigma[index]))
        .filter(|sigma| *sigma > 0.0)
        .reduce(f64::min)
}

/// The value of the reference; scale factors in the quantity of the file if no nominal value is stated.
fn reference_value(comparison: &Comparison, index: usize) -> String {
    let own = comparison.reference.sigma().map(|s| s[index]);
    let (departure, scale) = (comparison.departure(index), comparison.scale_factor(index));
    let (size, unit) = match (departure, scale) {
        (Some(departure), _) => (departure / PPM, PPM),
        (None, Some(scale)) => (scale, 1.0 / scale.abs()),
        (None, None) => {
            let unit = Group::of(index).unit_value();
            (comparison.reference.vector()[index] / unit, unit)
        }
    };
    match (own.filter(|own| *own > 0.0), finest(comparison, &[index])) {
        (None, None) => value(size, size.abs() * 1e-6),
        (own, finest) => with_sigma(size * unit, own, finest, unit),
    }
}

/// A number in a unit with its σ, otherwise with the digits of the finest.
fn with_sigma(of: f64, own: Option<f64>, finest: Option<f64>, unit: f64) -> String {
    match (own.filter(|own| *own > 0.0), finest) {
        (Some(own), _) => plus_minus(of / unit, own / unit),
        (None, Some(finest)) => value(of / unit, finest / unit),
        (None, None) => three_digits(of / unit),
    }
}

fn groups(comparison: &Comparison) -> Table {
    let mut columns = cells!["", "unit"];
    for side in &comparison.sides {
        let largest = format!("{}: largest", side.calibration.name);
        columns.extend(cells![largest, "RMS", "RMS σ"]);
    }
    let row = |group: Group| {
        let indices = group.among(&comparison.parameters);
        let spread = |v: &ParameterVector| group.spread(v, &indices);
        let mut row = cells![group.title(), group.unit()];
        let finest = finest(comparison, &indices).map(|s| s / group.unit_value());
        let shown = |x: f64| finest.map_or_else(|| three_digits(x), |finest| value(x, finest));
        for side in &comparison.sides {
            let difference = spread(&side.difference);
            row.push(or_dash(difference.map(|x| x.0), shown));
            row.push(or_dash(difference.map(|x| x.1), shown));
            let own = side.calibration.sigma().and_then(|s| spread(&s));
            row.push(or_dash(own.map(|x| x.1).filter(|s| *s > 0.0), sigma));
        }
        vec![row]
    };
    let mut last = cells!["NEES/n", ""];
    last.extend(comparison.sides.iter().flat_map(|side| nees(side.nees)));
    Table::new("Groups", columns)
        .sections(by_triad(row))
        .section([last])
        .note("Largest and RMS: of the differences from the reference. RMS σ: of the stated 1σ.")
        .note("NEES/n, its 95 % interval and n: 1 if the covariance is correct.")
}

fn nees(nees: Option<Nees>) -> [String; 3] {
    nees.map_or([NONE; 3].map(str::to_owned), |nees| {
        let [mean, low, high] =
            [nees.mean, nees.interval.0, nees.interval.1].map(|x| value(x, 0.1));
        [mean, format!("{low}…{high}"), format!("n = {}", nees.count)]
    })
}

/// Auxiliary parameters of any calibration.
fn auxiliary(comparison: &Comparison) -> Table {
    fn of<'a>(calibration: &'a Canonical, name: &str) -> Option<&'a TermRecord> {
        calibration.constants.get(name)
    }
    let shown = |of: Option<&TermRecord>, unit| {
        of.map_or(NONE.to_owned(), |of| {
            with_sigma(of.value, of.sigma, None, unit)
        })
    };
    let row = |index: usize| {
        let name = auxiliary_name(index)?;
        let (symbol, unit) = unit(AuxiliaryKind::of(index)?.error_term());
        let reference = of(&comparison.reference, &name);
        let mut row = cells![name.as_str(), shown(reference, unit), symbol];
        let mut any = reference.is_some();
        for Side { calibration, .. } in &comparison.sides {
            let side = of(calibration, &name);
            let z = side.zip(reference).and_then(|(side, reference)| {
                let sigma = side.sigma?.hypot(reference.sigma.unwrap_or(0.0));
                (sigma > 0.0).then(|| (side.value - reference.value) / sigma)
            });
            row.extend([shown(side, unit), flagged(z)]);
            any |= side.is_some();
        }
        any.then_some(row)
    };
    Table::new("Auxiliary parameters", beside_reference(comparison))
        .section((0..AUXILIARY).filter_map(row))
        .note(
            "Error terms of instrument and table: value ± 1σ of each calibration; z: difference from the reference \
             divided by its σ, if both have the term.",
        )
}

/// For three or more calibrations.
fn scatter(comparison: &Comparison) -> Table {
    let table = Table::new(
        "Scatter",
        columns("| unit | mean minus reference | scatter | χ²/n | n | p"),
    );
    let Some(scatter) = &comparison.scatter else {
        return table;
    };
    let rows = |group: Group| {
        let all = scatter.parameters.iter();
        let row = all.filter(|p| Group::of(p.index) == group).map(|p| {
            let unit = group.unit_value();
            let finest = finest(comparison, &[p.index]);
            let mean = with_sigma(p.mean, p.mean_sigma, None, unit);
            let deviation = with_sigma(p.deviation, None, finest, unit);
            let mut row = cells![short(p.index), group.unit(), mean, deviation];
            row.extend(chi_square(p.chi_square));
            row
        });
        row.collect()
    };
    let mut all = cells!["all", "", "", ""];
    all.extend(chi_square(scatter.joint));
    table
        .sections(by_triad(rows))
        .section([all])
        .note("Mean: weighted by the stated σ, ± its 1σ; scatter: sample standard deviation.")
        .note(
            "χ² of the scatter against the stated σ, n its degrees of freedom; p: probability of a larger value. \
             Near 0 the σ are too small, near 1 too large.",
        )
        .note("All: with correlations, for the calibrations that state them.")
}

fn chi_square(chi_square: Option<ChiSquare>) -> [String; 3] {
    chi_square.map_or([NONE; 3].map(str::to_owned), |of| {
        [
            value(of.value / of.freedom as f64, 0.1),
            count(of.freedom),
            chance(of.p),
        ]
    })
}

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
            let data = json!({
                "name": name(of.index),
                "group": group.key(),
                "count": of.count,
                "mean_less_reference": of.mean / unit,
                "mean_sigma": of.mean_sigma.map(|sigma| sigma / unit),
                "standard_deviation": of.deviation / unit,
            });
            joined(data, of.chi_square.map_or(Value::Null, chi2))
        });
        let parameters: Value = parameters.collect();
        data["scatter"] = json!({ "parameters": parameters, "all": scatter.joint.map(chi2) });
    }
    data
}

fn name(index: usize) -> String {
    parameter_name(InstallationForm::General, index).unwrap_or_default()
}

/// Statistics of the differences of a group.
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

/// The value of the reference is in the quantity of the file for scale factors, otherwise in the unit of the group.
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

fn chi2(of: ChiSquare) -> Value {
    json!({ "chi2": of.value, "degrees_of_freedom": of.freedom, "p": of.p })
}

pub(super) fn figure(comparison: &Comparison) -> Plot {
    let panels = Group::all().map(|group| panel(comparison, group));
    Plot::new("differences.svg", "Differences from the reference", (3, 320), panels).caption(format!(
        "Each calibration minus the reference, {}; bars: stated 1σ. About two bars in three should include the true \
         value. If one calibration is much less accurate than another, the axis is logarithmic away from zero.",
        comparison.reference.name
    ))
}

fn panel(comparison: &Comparison, group: Group) -> Panel {
    let (indices, unit) = (group.among(&comparison.parameters), group.unit_value());
    let side = |side: &Side| {
        let sigma = side.calibration.sigma().unwrap_or_default();
        let points = indices.iter();
        let points = points.map(|&i| (side.difference[i] / unit, sigma[i] / unit));
        (
            side.calibration.name.clone(),
            points.collect::<Vec<Point>>(),
        )
    };
    let sides: Vec<(String, Vec<Point>)> = comparison.sides.iter().map(side).collect();
    let (y, kind) = Axis::about_zero(sides.iter().map(|(_, points)| reach(points)));
    let series = sides.iter().enumerate().map(|(n, (name, points))| {
        let shift = beside(n, sides.len(), 0.6);
        let points = points.iter().enumerate();
        let points = points.map(|(k, (off, sigma))| (k as f64 + shift, *off, *sigma));
        let mark = [Mark::Dot, Mark::Ring, Mark::Cross][n % 3];
        let marks = Series::measured(mark, points).nth(n);
        marks.width(1.75).label(name)
    });
    let names = indices
        .iter()
        .map(|&i| axis_name(InstallationForm::General, i));
    Panel::new(
        format!("{}, {}{kind}", group.title(), group.unit()),
        Axis::places(names),
        y,
    )
    .with(Series::zero())
    .with_all(series)
}

/// Largest distance of points from zero, including σ.
fn reach(points: &[Point]) -> f64 {
    let reaches = points.iter().map(|(off, sigma)| off.abs() + sigma);
    reaches.fold(0.0, f64::max)
}
