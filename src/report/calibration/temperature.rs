//! What changes with temperature, and what differs between recordings.

use crate::calibration::{
    Estimate, Outcome, ParameterMatrix, ParameterVector, SeparateEstimate, Thermal, parameter_name,
    sensor_and_parameter,
};
use crate::imu::{RATE, Sensor};
use crate::report::prelude::*;

/// Points of a curve.
const POINTS: usize = 81;

/// Adds tables and figures, where anything changes or differs.
pub fn add(document: &mut Document, outcome: &Outcome) {
    if let Some(thermal) = &outcome.thermal {
        document.both(orders(outcome, thermal));
        document.both(hysteresis(outcome, thermal));
        document.page(curves(outcome, thermal));
        let known = outcome.alone.iter().filter(|a| a.estimate.is_some());
        if known.count() > 1 {
            document.page(departures(outcome, thermal));
        }
        document.page(residuals(outcome));
    }
    document.both(recordings(outcome));
    document.both(differences(outcome));
}

/// Change of all parameters from those at the reference, and σ of what they are then.
fn there(
    outcome: &Outcome,
    thermal: &Thermal,
    temperature: f64,
) -> (ParameterVector, ParameterMatrix) {
    let state = thermal.model.range.everywhere(temperature, 0.0);
    thermal.at(&state, &outcome.estimate.covariance)
}

/// Order and coefficients of each parameter.
fn orders(outcome: &Outcome, thermal: &Thermal) -> Table {
    let form = outcome.estimate.form();
    let highest = thermal.coefficients.iter().filter(|c| c.function != RATE);
    let highest = highest.map(|c| c.function + 1).max().unwrap_or(0);
    let mut columns = vec!["parameter".to_owned(), "unit".to_owned()];
    let any_rate = thermal.coefficients.iter().any(|c| c.function == RATE);
    let functions = (0..highest).chain(any_rate.then_some(RATE));
    columns.extend(
        functions
            .clone()
            .map(|function| function_name(Some(function))),
    );
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
        false => format!(
            "gyros {}; accelerometers {}",
            range(Sensor::Gyro),
            range(Sensor::Accel)
        ),
    };
    Table::new("Change with temperature", columns)
        .sections(Group::all().map(|group| {
            let rows = group.parameters(form).into_iter();
            rows.filter_map(|i| row(group, i)).collect::<Vec<_>>()
        }))
        .note(format!(
            "Legendre coefficients ± 1σ over {ranges}: what the parameter does within half the range. Of each \
             kind the highest order whose likelihood ratio is significant at one in a thousand is kept."
        ))
}

/// What heating and cooling differ by.
fn hysteresis(outcome: &Outcome, thermal: &Thermal) -> Table {
    let form = outcome.estimate.form();
    let rows = thermal.coefficients.iter().enumerate();
    let rows = rows
        .filter(|(_, c)| c.function == RATE)
        .filter_map(|(k, c)| {
            let group = Group::of(c.index());
            let (unit, sigma) = (
                group.unit_value(),
                thermal.covariance[(k, k)].max(0.0).sqrt(),
            );
            let largest = thermal.model.range.get(c.sensor).largest_rate;
            Some(vec![
                parameter_name(form, c.index())?,
                plus_minus(2.0 * thermal.values[k] / unit, 2.0 * sigma / unit),
                group.unit().to_owned(),
                three_digits(largest * MINUTE),
            ])
        });
    Table::new(
        "Hysteresis: heating less cooling at the same temperature",
        columns("parameter | value ± 1σ | unit | at ± K/min"),
    )
    .section(rows)
}

/// Every parameter against temperature, with what each recording alone says.
fn curves(outcome: &Outcome, thermal: &Thermal) -> Plot {
    let form = outcome.estimate.form();
    let reference = outcome.estimate.vector();
    let panel = |group: Group| {
        let range = thermal.model.range.get(group.sensor());
        let unit = group.unit_value();
        let indices = group.estimated(&outcome.estimate);
        let curve: Vec<(f64, ParameterVector, ParameterMatrix)> =
            steps(range.lowest, range.highest, POINTS)
                .map(|t| {
                    let (change, covariance) = there(outcome, thermal, t);
                    (t, change, covariance)
                })
                .collect();
        let room = 0.03 * (range.highest - range.lowest);
        let x = Axis::linear("temperature, °C").between(range.lowest - room, range.highest + room);
        let title = format!("{}, change", group.titled());
        let mut panel = Panel::new(title, x, Axis::linear("").room(0.03, 0.03));
        for (n, &i) in indices.iter().enumerate() {
            let edge = |factor: f64| {
                let of = |(t, change, covariance): &(f64, ParameterVector, ParameterMatrix)| {
                    let sigma = covariance[(i, i)].max(0.0).sqrt();
                    (*t, (change[i] + factor * sigma) / unit)
                };
                curve.iter().map(of).collect::<Vec<_>>()
            };
            let marks = outcome.alone.iter().filter_map(|alone| {
                let estimate = alone.estimate.as_ref()?;
                let t = own_temperature(alone, i)?;
                Some((t, (estimate.vector()[i] - reference[i]) / unit))
            });
            panel = panel
                .with(Series::band(edge(-1.0), edge(1.0)))
                .with(Series::line(edge(0.0)).nth(n).label(axis_name(form, i)))
                .with(Series::marks(Mark::Ring, marks).nth(n));
        }
        panel
    };
    Plot::new(
        "temperature.svg",
        "Parameters against temperature",
        (3, 330),
        Group::all().map(panel),
    )
    .caption(
        "Change of each parameter from its value at the reference temperature, with its ±1σ band. Rings: what \
         each recording alone says, with stated noise.",
    )
}

/// The temperature of a recording at the axis of a parameter.
fn own_temperature(alone: &SeparateEstimate, index: usize) -> Option<f64> {
    let (sensor, _) = sensor_and_parameter(index);
    let axes = alone.temperature.as_ref()?.get(sensor);
    Some(axes.iter().sum::<f64>() / 3.0)
}

/// What each recording alone says less the curve.
fn departures(outcome: &Outcome, thermal: &Thermal) -> Plot {
    let form = outcome.estimate.form();
    let panel = |group: Group| {
        let range = thermal.model.range.get(group.sensor());
        let unit = group.unit_value();
        let indices = group.estimated(&outcome.estimate);
        let span = range.highest - range.lowest;
        let x = Axis::linear("temperature, °C")
            .between(range.lowest - 0.06 * span, range.highest + 0.06 * span);
        let mut panel = Panel::new(
            format!("{}, {}", group.short(), group.unit()),
            x,
            Axis::linear("").room(0.05, 0.05),
        )
        .with(Series::zero());
        for (n, &i) in indices.iter().enumerate() {
            // Side by side, so that their intervals do not hide each other.
            let shift = beside(n, indices.len(), 0.06 * span);
            let points = outcome.alone.iter().filter_map(|alone| {
                let estimate: &Estimate = alone.estimate.as_ref()?;
                let t = own_temperature(alone, i)?;
                let (change, _) = there(outcome, thermal, t);
                let off = estimate.vector()[i] - outcome.estimate.vector()[i] - change[i];
                Some((t + shift, off / unit, estimate.sigma()[i] / unit))
            });
            let marks = Series::measured(Mark::Dot, points).nth(n);
            panel = panel.with(marks.key(axis_name(form, i)));
        }
        panel
    };
    Plot::new(
        "recordings.svg",
        "Each recording alone, less all together",
        (3, 330),
        Group::all().map(panel),
    )
    .caption(
        "What each recording alone says, ±1σ, less the parameter at its temperature by all together. Two thirds \
         of the intervals should reach zero.",
    )
}

/// Innovations of each dwell against temperature and its rate.
fn residuals(outcome: &Outcome) -> Plot {
    let names = ["East", "North", "Up"];
    let panel = |title: &str, x: Axis, of: &dyn Fn(usize) -> f64| {
        let mut panel = Panel::new(title, x, Axis::linear("")).with(Series::zero());
        for (axis, name) in names.into_iter().enumerate() {
            let sums = outcome.by_dwell().into_iter();
            let known = sums.filter(|&(dwell, _)| of(dwell).is_finite());
            let points = known.map(|(dwell, sums)| (of(dwell), sums[axis]));
            panel = panel.with(Series::marks(Mark::Ring, points).nth(axis).key(name));
        }
        panel
    };
    let of = |dwell: usize| {
        outcome
            .warming
            .get(dwell)
            .copied()
            .unwrap_or((f64::NAN, f64::NAN))
    };
    Plot::new(
        "residuals-temperature.svg",
        "Innovations of dwells against temperature",
        (2, 300),
        [
            panel(
                "sum over a dwell, σ",
                Axis::linear("temperature, °C").room(0.03, 0.03),
                &|dwell| of(dwell).0,
            ),
            panel(
                "sum over a dwell, σ",
                Axis::linear("rate of temperature, K/min").room(0.03, 0.03),
                &|dwell| of(dwell).1 * MINUTE,
            ),
        ],
    )
    .caption(
        "Sum of the whitened innovations of velocity in each dwell over the root of their number. Without a trend, \
         and mostly within ±2, nothing of temperature is left.",
    )
}

/// Each recording with its temperature and how far it alone is from all together.
fn recordings(outcome: &Outcome) -> Table {
    if outcome.alone.len() < 2 {
        return Table::default();
    }
    let row = |(number, alone): (usize, &SeparateEstimate)| {
        let distance = outcome.distance_alone(number);
        vec![
            alone.name.clone(),
            alone
                .mean_temperature()
                .map_or(NONE.to_owned(), |t| value(t, 0.01)),
            match alone.estimate {
                Some(_) => "yes".to_owned(),
                None => "no".to_owned(),
            },
            distance.map_or(NONE.to_owned(), |(chi, _)| three_digits(chi)),
            distance.map_or(NONE.to_owned(), |(_, limit)| three_digits(limit)),
        ]
    };
    Table::new(
        "Recordings",
        columns("recording | °C | calibrates alone | χ²/n from all | 999 of 1000 below"),
    )
    .section(outcome.alone.iter().enumerate().map(row))
    .note(
        "χ²/n: squared distance of what the recording alone says from all together, for each of its parameters, by \
         what it knows less than all and the stated difference from day to day.",
    )
}

/// By how much parameters differ between recordings: repeatability.
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
        columns("parameter | spread ± 1σ | by σ alone | unit | χ²/n | 999 of 1000 below"),
    )
    .section(rows)
    .note(
        "Spread: standard deviation of what each recording alone says about the common curve; by σ alone: what the \
         claimed σ make of it. Where χ²/n is beyond its limit the instrument does not repeat: state the difference \
         under [day_to_day].",
    )
}
