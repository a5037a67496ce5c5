//! Every value with its name, σ and unit, as text.

use nalgebra::Vector3;

use super::Exported;
use super::document::{Document, TEST_VECTORS};
use super::source::Source;
use crate::imu::{AXES, Sensor, Term};

pub fn write(source: &Source) -> Exported {
    let covariance = "covariance of the parameters; it is in calibration.json";
    let mut file = Document::new(source, "#", [covariance]);
    file.line(&format!(
        "\n{:<26}{:>25}{:>12}  unit",
        "name", "value", "1 sigma"
    ));
    for sensor in Sensor::ALL {
        triad(&mut file, source, sensor);
    }
    for (name, term) in &source.record.terms {
        let of_term = Term::parameter_named(name).and_then(Term::of);
        // The others are the table's, all of them angles.
        let unit = of_term.map_or("rad", |term| term.entry().si_unit);
        row(&mut file, name, term.value, term.sigma, unit);
    }
    for sensor in Sensor::ALL {
        let input = Source::input(sensor);
        let matrix = source.correction.matrix.get(sensor);
        for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
            let name = format!("{}.correction.{}{}", sensor.name(), AXES[i], AXES[j]);
            let unit = format!("{input} per {}", source.unit(sensor));
            row(&mut file, &name, matrix[(i, j)], None, &unit);
        }
    }
    let vectors = source.test_vectors();
    if !vectors.is_empty() {
        file.line(&format!("\n{TEST_VECTORS}"));
        vectors.iter().for_each(|line| file.line(line));
    }
    file.finish()
}

fn triad(file: &mut Document, source: &Source, sensor: Sensor) {
    let (values, sigma) = (source.record.triad(sensor), source.sigma(sensor));
    let (name, unit) = (sensor.name(), source.unit(sensor));
    let (input, in_words, factor) = sensor.pick(
        ("rad/s", "deg/h", crate::units::DEG_PER_H),
        ("m/s^2", "ug", crate::units::MICRO_G),
    );
    for (i, axis) in AXES.iter().enumerate() {
        let sigma = sigma.map(|s| s.scale[i]);
        let unit = format!("{unit} per {input}");
        row(
            file,
            &format!("{name}.scale.{axis}"),
            values.scale[i],
            sigma,
            &unit,
        );
    }
    for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
        let name = format!("{name}.installation.{}{}", AXES[i], AXES[j]);
        let sigma = sigma.map(|s| s.installation[i][j]).filter(|_| i != j);
        row(file, &name, values.installation[i][j], sigma, "1");
    }
    let in_input = Vector3::from(values.bias).component_div(&Vector3::from(values.scale)) / factor;
    for (i, axis) in AXES.iter().enumerate() {
        let sigma = sigma.map(|s| s.bias[i]);
        let unit = format!("{unit}, {:.6} {in_words}", in_input[i]);
        row(
            file,
            &format!("{name}.bias.{axis}"),
            values.bias[i],
            sigma,
            &unit,
        );
    }
}

/// A σ of zero means that the value was not estimated.
fn row(file: &mut Document, name: &str, value: f64, sigma: Option<f64>, unit: &str) {
    let sigma = match sigma {
        None => String::new(),
        Some(0.0) => "fixed".to_owned(),
        Some(sigma) => format!("{sigma:.2e}"),
    };
    file.line(&format!("{name:<26}{value:>25e}{sigma:>12}  {unit}"));
}
