//! Temperature dependence and differences between recordings.

use crate::prelude::*;
use turncal::calibration::{
    Estimate, Outcome, ParameterMatrix, ParameterVector, SeparateEstimate, Thermal, parameter_name,
    sensor_and_parameter,
};
use turncal::imu::{InstallationForm, RATE, Sensor};

/// Points of a curve.
const POINTS: usize = 81;

/// Change of parameters with temperature, and any remaining effect of temperature.
pub fn figures(outcome: &Outcome) -> Vec<Plot> {
    let Some(thermal) = &outcome.thermal else {
        return Vec::new();
    };
    let reference = outcome.estimate.vector();
    let alone = |index: usize| {
        let alone = alone(outcome, index);
        let changes = alone.map(|(t, value, _)| (t, value - reference[index]));
        changes.collect()
    };
    let marks = "each recording alone, with stated noise";
    vec![
        curves(&outcome.estimate, thermal, marks, alone),
        residuals(outcome),
    ]
}

/// Adds tables and figures, if anything changes or differs.
pub fn add(document: &mut Document, outcome: &Outcome) {
    if let Some(thermal) = &outcome.thermal {
        let form = outcome.estimate.form();
        document.both(orders(form, thermal));
        document.both(hysteresis(form, thermal));
        let known = outcome.alone.iter().filter(|a| a.estimate.is_some());
        if known.count() > 1 {
            document.page(departures(outcome, thermal));
        }
    }
    document.both(recordings(outcome));
    document.both(differences(outcome));
}

/// Change of all parameters from those at the reference, and σ of the resulting values.
fn there(
    estimate: &Estimate,
    thermal: &Thermal,
    temperature: f64,
) -> (ParameterVector, ParameterMatrix) {
    let state = turncal::imu::thermal_state_everywhere(&thermal.model.range, temperature, 0.0);
    thermal.at(&state, &estimate.covariance)
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
    let ranges = match range(Sensor::Gyro) == range(Sensor::Accel) {
        true => range(Sensor::Gyro),
        false => Sensor::ALL
            .map(|of| format!("{}s {}", of.name(), range(of)))
            .join("; "),
    };
    Table::new("Change with temperature", columns)
        .sections(Group::all().map(|group| {
            let rows = group.parameters(form).into_iter();
            rows.filter_map(|i| row(group, i)).collect::<Vec<_>>()
        }))
        .note(format!(
            "Legendre coefficients ± 1σ over {ranges}: change of the parameter over half the range. The order of \
             each kind is the highest with a significant likelihood ratio (p < 0.001)."
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

/// A panel for each estimated group: its parameters against temperature, with a margin of this part of the range at both
/// ends.
fn against_temperature(
    estimate: &Estimate,
    thermal: &Thermal,
    room: f64,
    series: impl Fn(Group, &[usize]) -> Vec<Series>,
) -> Vec<Panel> {
    let panel = |group: Group| {
        let indices = group.estimated(estimate);
        let range = thermal.model.range.get(group.sensor());
        let room = room * (range.highest - range.lowest);
        let x = Axis::linear("temperature, °C").between(range.lowest - room, range.highest + room);
        let y = Axis::linear("").room(0.05, 0.05);
        let panel = Panel::new(group.titled(), x, y).with_all(series(group, &indices));
        (!indices.is_empty()).then_some(panel)
    };
    Group::all().filter_map(panel).collect()
}

/// Estimate of a parameter from each recording alone: temperature at its axis, value and σ.
fn alone(outcome: &Outcome, index: usize) -> impl Iterator<Item = (f64, f64, f64)> {
    let (sensor, _) = sensor_and_parameter(index);
    outcome.alone.iter().filter_map(move |alone| {
        let estimate = alone.estimate.as_ref()?;
        let axes = alone.temperature.as_ref()?.get(sensor);
        let temperature = axes.iter().sum::<f64>() / 3.0;
        Some((
            temperature,
            estimate.vector()[index],
            estimate.sigma()[index],
        ))
    })
}

/// Every parameter against temperature, with marks of this meaning: temperature and change of the parameter from the
/// reference.
pub fn curves(
    estimate: &Estimate,
    thermal: &Thermal,
    meaning: &str,
    marks: impl Fn(usize) -> Vec<(f64, f64)>,
) -> Plot {
    let form = estimate.form();
    let series = |group: Group, indices: &[usize]| {
        let (range, unit) = (thermal.model.range.get(group.sensor()), group.unit_value());
        let temperatures = steps(range.lowest, range.highest, POINTS);
        let curve = temperatures.map(|t| (t, there(estimate, thermal, t)));
        let curve: Vec<(f64, (ParameterVector, ParameterMatrix))> = curve.collect();
        let of_parameter = |(n, &i): (usize, &usize)| {
            let points = curve.iter().map(|(t, (change, covariance))| {
                (
                    *t,
                    change[i] / unit,
                    covariance[(i, i)].max(0.0).sqrt() / unit,
                )
            });
            let [band, line] = Series::curve(&points.collect::<Vec<_>>());
            let marks = marks(i).into_iter().map(|(t, change)| (t, change / unit));
            let line = line.nth(n).label(axis_name(form, i));
            [band, line, Series::marks(Mark::Ring, marks).nth(n)]
        };
        indices.iter().enumerate().flat_map(of_parameter).collect()
    };
    let panels = against_temperature(estimate, thermal, 0.03, series);
    let heading = "Parameters against temperature";
    Plot::new("temperature.svg", heading, (3, 330), panels).caption(format!(
        "Change of each parameter from its value at the reference temperature, with its ±1σ band. Rings: {meaning}."
    ))
}

/// Estimate of each recording alone minus the curve.
fn departures(outcome: &Outcome, thermal: &Thermal) -> Plot {
    let (form, reference) = (outcome.estimate.form(), outcome.estimate.vector());
    let series = |group: Group, indices: &[usize]| {
        let (range, unit) = (thermal.model.range.get(group.sensor()), group.unit_value());
        let of_parameter = |(n, &i): (usize, &usize)| {
            // Side by side, so that their intervals do not hide each other.
            let shift = beside(n, indices.len(), 0.06 * (range.highest - range.lowest));
            let points = alone(outcome, i).map(|(t, value, sigma)| {
                let (change, _) = there(&outcome.estimate, thermal, t);
                (
                    t + shift,
                    (value - reference[i] - change[i]) / unit,
                    sigma / unit,
                )
            });
            Series::measured(Mark::Dot, points)
                .nth(n)
                .key(axis_name(form, i))
        };
        let marks = indices.iter().enumerate().map(of_parameter);
        std::iter::once(Series::zero()).chain(marks).collect()
    };
    let heading = "Each recording alone, minus the joint estimate";
    let panels = against_temperature(&outcome.estimate, thermal, 0.06, series);
    Plot::new("recordings.svg", heading, (3, 330), panels).caption(
        "Estimate from each recording alone, ±1σ, minus the joint estimate at its temperature. Two thirds of the \
         intervals should include zero.",
    )
}

/// Innovations of each dwell against temperature and its rate.
fn residuals(outcome: &Outcome) -> Plot {
    let names = ["East", "North", "Up"];
    let panel = |x: &str, of: &dyn Fn((f64, f64)) -> f64| {
        let x = Axis::linear(x).room(0.03, 0.03);
        let marks = names.into_iter().enumerate().map(|(axis, name)| {
            let points = outcome.by_dwell().into_iter().filter_map(|(dwell, sums)| {
                let at = outcome.warming.get(dwell).map(|&at| of(at))?;
                at.is_finite().then_some((at, sums[axis]))
            });
            Series::marks(Mark::Ring, points).nth(axis).key(name)
        });
        Panel::new("sum over a dwell, σ", x, Axis::linear(""))
            .with(Series::zero())
            .with_all(marks)
    };
    let panels = [
        panel("temperature, °C", &|(temperature, _)| temperature),
        panel("rate of temperature, K/min", &|(_, rate)| rate * MINUTE),
    ];
    let heading = "Innovations of dwells against temperature";
    Plot::new("residuals-temperature.svg", heading, (2, 300), panels).caption(
        "Sum of the whitened velocity innovations in each dwell, divided by the square root of their number. No \
         trend and values mostly within ±2 mean that no temperature effect remains.",
    )
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
            if alone.estimate.is_some() {
                "yes"
            } else {
                "no"
            },
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
         normalised by their covariance and the stated [day_to_day] differences.",
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
        "Spread: standard deviation of the single-recording estimates about the common curve; by σ alone: value \
         expected from their σ. If χ²/n exceeds its limit, the instrument does not repeat; state the difference in \
         [day_to_day].",
    )
}
