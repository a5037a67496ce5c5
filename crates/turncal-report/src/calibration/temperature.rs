//! Temperature dependence and differences between recordings.

use crate::prelude::*;
use turncal::calibration::{
    Estimate, Outcome, SeparateEstimate, Thermal, parameter_name, sensor_and_parameter,
};
use turncal::imu::{InstallationForm, RATE, Sensor};

/// Number of points of a curve.
const POINTS: usize = 81;

/// Change of the parameters with temperature, if they depend on temperature.
pub fn figure(outcome: &Outcome) -> Option<Plot> {
    let thermal = outcome.thermal.as_ref()?;
    let reference = outcome.estimate.vector();
    let alone = |index: usize| {
        let (sensor, _) = sensor_and_parameter(index);
        let change = |alone: &SeparateEstimate| {
            let axes = alone.temperature.as_ref()?.get(sensor);
            let value = alone.estimate.as_ref()?.vector()[index];
            Some((axes.iter().sum::<f64>() / 3.0, value - reference[index]))
        };
        outcome.alone.iter().filter_map(change).collect()
    };
    let marks = "each recording alone";
    Some(curves(&outcome.estimate, thermal, marks, alone))
}

/// Adds tables and figures, if parameters change with temperature or differ between recordings.
pub fn add(document: &mut Document, outcome: &Outcome) {
    if let Some(thermal) = &outcome.thermal {
        let form = outcome.estimate.form();
        document.both(orders(form, thermal));
        document.both(hysteresis(form, thermal));
    }
    document.both(recordings(outcome));
    document.both(differences(outcome));
}

/// Order and coefficients of each parameter.
pub fn orders(form: InstallationForm, thermal: &Thermal) -> Table {
    let highest = thermal.coefficients.iter().filter(|c| c.function != RATE);
    let highest = highest.map(|c| c.function + 1).max().unwrap_or(0);
    let mut columns = cells!["parameter", "unit"];
    let any_rate = thermal.coefficients.iter().any(|c| c.function == RATE);
    let functions = (0..highest).chain(any_rate.then_some(RATE));
    columns.extend(functions.clone().map(function_name));
    let row = |group: Group, index: usize| {
        let mut row = vec![parameter_name(form, index)?, group.unit().to_owned()];
        let cell = |function: usize| {
            let mut all = thermal.coefficients.iter();
            let place = all.position(|c| c.index() == index && c.function == function);
            place.map_or(NONE.to_owned(), |k| {
                let sigma = thermal.covariance[(k, k)].max(0.0).sqrt();
                let unit = group.unit_value();
                plus_minus(thermal.values[k] / unit, sigma / unit)
            })
        };
        row.extend(functions.clone().map(cell));
        row[2..].iter().any(|cell| cell != NONE).then_some(row)
    };
    let range = |sensor: Sensor| {
        let range = thermal.model.range.get(sensor);
        format!(
            "{} to {} °C, stated at {} °C",
            three_digits(range.lowest),
            three_digits(range.highest),
            three_digits(range.reference)
        )
    };
    let ranges = Sensor::ALL.map(|of| format!("{} (axes of {})", range(of), triad_name(of)));
    let ranges = ranges.join(" and ");
    Table::new("Change with temperature", columns)
        .sections(Group::all().map(|group| {
            let rows = group.parameters(form).into_iter();
            rows.filter_map(|i| row(group, i)).collect::<Vec<_>>()
        }))
        .note(format!(
            "Legendre coefficients ± 1σ over {ranges}: each coefficient is the change of the parameter over half the \
             temperature range. Each order is averaged over the case that it is absent and the cases that it has one \
             of its usual sizes."
        ))
}

/// Differences between heating and cooling.
pub fn hysteresis(form: InstallationForm, thermal: &Thermal) -> Table {
    let rows = thermal.coefficients.iter().enumerate();
    let rows = rows.filter(|(_, c)| c.function == RATE);
    let rows = rows.filter_map(|(k, c)| {
        let group = Group::of(c.index());
        let of_both = 2.0 / group.unit_value();
        let sigma = thermal.covariance[(k, k)].max(0.0).sqrt();
        let largest = thermal.model.range.get(c.sensor).largest_rate;
        Some(cells![
            parameter_name(form, c.index())?,
            plus_minus(of_both * thermal.values[k], of_both * sigma),
            group.unit(),
            three_digits(largest * MINUTE),
        ])
    });
    Table::new(
        "Hysteresis: heating minus cooling at the same temperature",
        columns("parameter | value ± 1σ | unit | at ± K/min"),
    )
    .section(rows)
}

/// Figure of every parameter against temperature. Each mark is at a temperature and shows the change of the parameter
/// from its value at the reference temperature; `meaning` describes the marks.
pub fn curves(
    estimate: &Estimate,
    thermal: &Thermal,
    meaning: &str,
    marks: impl Fn(usize) -> Vec<Point>,
) -> Plot {
    let panel = |group: Group| {
        let (range, unit) = (thermal.model.range.get(group.sensor()), group.unit_value());
        let temperatures = steps(range.lowest, range.highest, POINTS);
        let curve = temperatures.map(|t| {
            let state = turncal::imu::thermal_state_everywhere(&thermal.model.range, t, 0.0);
            (t, thermal.at(&state, &estimate.covariance))
        });
        let curve: Vec<_> = curve.collect();
        let indices = group.estimated(estimate);
        let series = indices.iter().enumerate().flat_map(|(n, &i)| {
            let points = curve.iter().map(|(t, (change, covariance))| {
                let sigma = covariance[(i, i)].max(0.0).sqrt();
                (*t, change[i] / unit, sigma / unit)
            });
            let [band, line] = Series::curve(&points.collect::<Vec<_>>());
            let marks = marks(i).into_iter().map(|(t, change)| (t, change / unit));
            let line = line.nth(n).label(axis_name(estimate.form(), i));
            [band, line, Series::marks(Mark::Ring, marks).nth(n)]
        });
        let room = 0.03 * (range.highest - range.lowest);
        let x = Axis::linear("temperature, °C").between(range.lowest - room, range.highest + room);
        let y = Axis::linear("").room(0.05, 0.05);
        let panel = Panel::new(group.titled(), x, y).with_all(series);
        (!indices.is_empty()).then_some(panel)
    };
    let heading = "Parameters against temperature";
    let panels = Group::all().filter_map(panel);
    Plot::new("temperature.svg", heading, (3, 330), panels).caption(format!(
        "Change of each parameter from its value at the reference temperature, with a band of ±1σ. Rings: {meaning}."
    ))
}

/// Each recording with its temperature and its distance from the joint estimate.
fn recordings(outcome: &Outcome) -> Table {
    if outcome.alone.len() < 2 {
        return Table::default();
    }
    let row = |(number, alone): (usize, &SeparateEstimate)| {
        let distance = outcome.distance_alone(number);
        cells![
            alone.name.as_str(),
            or_dash(alone.mean_temperature(), |t| value(t, 0.01)),
            alone.estimate.as_ref().map_or("no", |_| "yes"),
            or_dash(distance.map(|of| of.0), three_digits),
            or_dash(distance.map(|of| of.1), three_digits),
        ]
    };
    Table::new(
        "Recordings",
        columns("recording | °C | calibrates alone | χ²/n against all | 99.9 % limit"),
    )
    .section(outcome.alone.iter().enumerate().map(row))
    .note(
        "χ²/n: squared difference between the estimate from one recording and the joint estimate, per parameter, \
         normalised by the covariance of the estimates and by the stated [day_to_day] differences.",
    )
}

/// Differences of parameters between recordings (repeatability).
fn differences(outcome: &Outcome) -> Table {
    let form = outcome.estimate.form();
    let rows = outcome.repeatability();
    let rows = rows.iter().filter_map(|of| {
        let group = Group::of(of.parameter);
        let unit = group.unit_value();
        Some(vec![
            parameter_name(form, of.parameter)?,
            plus_minus(of.spread / unit, of.sigma / unit),
            three_digits(of.claimed / unit),
            group.unit().to_owned(),
            three_digits(of.chi_square),
            three_digits(of.limit),
        ])
    });
    Table::new(
        "Repeatability between recordings",
        columns("parameter | spread ± 1σ | by σ alone | unit | χ²/n | 99.9 % limit"),
    )
    .section(rows)
    .note(
        "Spread: standard deviation of the estimates from single recordings about the common curve; by σ alone: the \
         spread expected from the σ of these estimates. If χ²/n exceeds its limit, the values differ between \
         recordings by more than stated; state the difference in [day_to_day].",
    )
}
