//! Every value with its name, σ and unit, as text.

use nalgebra::Vector3;

use super::notation::numbers;
use super::remarks::{Exported, Remarks, equation, magnetic_words};
use super::values::Values;
use turncal::imu::{AXES, Sensor, Term};
use turncal::units::{DEG_PER_H, MICRO_G};

pub fn write(values: &Values) -> Exported {
    let covariance = "covariance of the parameters, which is in calibration.json";
    let mut lines = vec![format!(
        "\n{:<26}{:>25}{:>12}  unit",
        "name", "value", "1 sigma"
    )];
    let triads = Sensor::ALL.into_iter();
    let triads = triads.filter(|_| !values.record.is_of_magnetometer());
    for sensor in triads.clone() {
        lines.extend(triad(values, sensor));
    }
    for (name, term) in &values.record.terms {
        let of_term = Term::parameter_named(name).and_then(Term::of);
        // The others are table parameters, all of them angles.
        let unit = of_term.map_or("rad", |term| term.entry().si_unit);
        lines.push(row(name, term.value, term.sigma, unit));
    }
    for sensor in triads {
        let matrix = values.correction.matrix.get(sensor);
        let unit = format!("{} per {}", Values::input(sensor), values.unit(sensor));
        lines.extend(places().map(|(i, j, place)| {
            let name = format!("{}.correction.{place}", sensor.name());
            row(&name, matrix[(i, j)], None, &unit)
        }));
    }
    lines.extend(magnetometer(values).into_iter().flatten());
    let vectors = &values.record.test_vectors;
    let title = "\ntest vectors, raw -> calibrated, gyros x y z, accelerometers x y z:";
    lines.extend((!vectors.is_empty()).then(|| title.to_owned()));
    let vectors = vectors.iter();
    lines.extend(vectors.map(|v| format!("{} -> {}", numbers(&v.raw), numbers(&v.calibrated))));
    Remarks::new(values, "#", &[covariance])
        .including(|_| true)
        .defines(equation(values))
        .defines(magnetic_words(values))
        .above(&(lines.join("\n") + "\n"))
}

/// The magnetometer, if there is one.
fn magnetometer(values: &Values) -> Option<Vec<String>> {
    let mag = values.record.mag.as_ref()?;
    let (unit, field) = (&mag.unit, &mag.field.unit);
    let value = |name: &String| {
        let per_field = format!("{unit} per {field}");
        let unit = if name.starts_with("mag.bias") {
            unit
        } else {
            &per_field
        };
        Some(row(
            name,
            *mag.get(name)?,
            mag.sigma_of(name).copied(),
            unit,
        ))
    };
    let correction = places().map(|(i, j, place)| {
        let unit = format!("{field} per {unit}");
        row(
            &format!("mag.correction.{place}"),
            mag.correction[i][j],
            None,
            &unit,
        )
    });
    Some(
        mag.parameters
            .iter()
            .filter_map(value)
            .chain(correction)
            .collect(),
    )
}

/// Entries of a matrix, with their names.
fn places() -> impl Iterator<Item = (usize, usize, String)> {
    let places = (0..9).map(|k| (k / 3, k % 3));
    places.map(|(i, j)| (i, j, format!("{}{}", AXES[i], AXES[j])))
}

fn triad(values: &Values, sensor: Sensor) -> Vec<String> {
    let (of, sigma) = (values.record.triad(sensor), values.sigma(sensor));
    let (name, unit) = (sensor.name(), values.unit(sensor));
    let (in_words, factor) = sensor.pick(("deg/h", DEG_PER_H), ("ug", MICRO_G));
    let in_input = Vector3::from(of.bias).component_div(&Vector3::from(of.scale)) / factor;
    let per_input = format!("{unit} per {}", Values::input(sensor));
    let of_axis = |kind: &str, k: usize, values: [f64; 3], sigma: Option<[f64; 3]>, unit: &str| {
        let name = format!("{name}.{kind}.{}", AXES[k]);
        row(&name, values[k], sigma.map(|of| of[k]), unit)
    };
    let scale = (0..3).map(|k| of_axis("scale", k, of.scale, sigma.map(|of| of.scale), &per_input));
    let installation = places().map(|(i, j, place)| {
        let name = format!("{name}.installation.{place}");
        let sigma = sigma.filter(|_| i != j).map(|of| of.installation[i][j]);
        row(&name, of.installation[i][j], sigma, "1")
    });
    let bias = (0..3).map(|k| {
        let unit = format!("{unit}, {:.6} {in_words}", in_input[k]);
        of_axis("bias", k, of.bias, sigma.map(|of| of.bias), &unit)
    });
    scale.chain(installation).chain(bias).collect()
}

/// A σ of zero means that the value was not estimated.
fn row(name: &str, value: f64, sigma: Option<f64>, unit: &str) -> String {
    let sigma = match sigma {
        None => String::new(),
        Some(0.0) => "fixed".to_owned(),
        Some(sigma) => format!("{sigma:.2e}"),
    };
    format!("{name:<26}{value:>25e}{sigma:>12}  {unit}")
}
