//! The values of a calibration by the terms of IEEE Std 1293 (accelerometers) and IEEE Std 952 and 647 (gyros).

use crate::prelude::*;
use turncal::calibration::Calibration;
use turncal::imu::{AXES, Output, Sensor};

/// Conversion of a value in the unit of the file or in SI.
#[derive(Clone, Copy)]
enum Convert {
    /// Multiplied by a number.
    Times(f64),
    /// Divided by the scale factor of the axis and by a unit: outputs become inputs.
    ByScale(f64),
    /// Divided by a unit after inversion.
    Inverse(f64),
}
use Convert::{ByScale, Inverse, Times};

/// A term: symbol, parameter, conversion, unit and definition. In the last part of the parameter's name, `i` is the input
/// axis, and `p` and `o` are the two next axes in the order x, y, z, x.
type Entry = (&'static str, &'static str, Convert, String, &'static str);

const G: f64 = STANDARD_GRAVITY;

/// Every term of which the calibration has a value.
pub fn table(calibration: &Calibration) -> Table {
    let sections = [accel(calibration), gyro(calibration)];
    let sections = sections.map(|entries| {
        let rows = entries.iter().filter_map(|entry| row(calibration, entry));
        rows.collect::<Vec<_>>()
    });
    Table::new(
        "Values by the terms of IEEE Std 1293 and 952",
        columns("term | x | y | z | unit | definition"),
    )
    .sections(sections)
    .note(
        "In parentheses: 1σ in units of the last digit. Accelerometers, in g: output = K₁ (K₀ + a_i + K₁′/2 |a_i| + \
         K₂ a_i² + K₃ a_i³ + δ_o a_p − δ_p a_o + K_ip a_i a_p + K_io a_i a_o + K_po a_p a_o). i: input axis; p and o: \
         the two next axes in the order x, y, z, x.",
    )
    .note(
        "Gyros: input rate = S × output. S₊, S₋: positive and negative rates. K, E, D and q: the parameters of \
         turncal, by the names of calibration.json.",
    )
}

fn accel(calibration: &Calibration) -> Vec<Entry> {
    let per_g = match unit(calibration, Sensor::Accel) {
        (unit, true) => format!("{unit} per g"),
        (unit, false) => format!("{unit}/s per g"),
    };
    let micro = |power: i32| {
        (
            Times(G.powi(power) / MICRO_G),
            format!("µg/g{}", raised(power)),
        )
    };
    let ((second, of_second), (third, of_third)) = (micro(2), micro(3));
    let coupling =
        |symbol, parameter, definition| (symbol, parameter, second, of_second.clone(), definition);
    let arcsec = || "″".to_owned();
    vec![
        (
            "accel K₁",
            "accel.scale.i",
            Times(G),
            per_g,
            "scale factor: K × 1 g",
        ),
        (
            "accel K₀",
            "accel.bias.i",
            ByScale(MICRO_G),
            "µg".to_owned(),
            "bias: D / K",
        ),
        (
            "accel K₁′",
            "accel.asymmetry.i",
            Times(2.0 / PPM),
            "ppm".to_owned(),
            "asymmetry: 2 q",
        ),
        coupling("accel K₂", "accel.second_order.i", "second order: q"),
        (
            "accel K₃",
            "accel.third_order.i",
            third,
            of_third,
            "third order: q",
        ),
        coupling(
            "accel K_ip",
            "accel.cross_coupling.i.ip",
            "cross-coupling: q",
        ),
        coupling(
            "accel K_io",
            "accel.cross_coupling.i.io",
            "cross-coupling: q",
        ),
        coupling(
            "accel K_po",
            "accel.cross_coupling.i.po",
            "cross-coupling: q",
        ),
        (
            "accel δ_o",
            "accel.installation.ip",
            Times(1.0 / ARCSEC),
            arcsec(),
            "misalignment about o: E to p",
        ),
        (
            "accel δ_p",
            "accel.installation.io",
            Times(-1.0 / ARCSEC),
            arcsec(),
            "misalignment about p: −E to o",
        ),
    ]
}

fn gyro(calibration: &Calibration) -> Vec<Entry> {
    let (size, scale) = match unit(calibration, Sensor::Gyro) {
        ("count", true) => (ARCSEC, "″/s per count".to_owned()),
        ("count", false) => (ARCSEC, "″ per count".to_owned()),
        (unit, true) => (1.0, format!("rad/s per {unit}")),
        (unit, false) => (1.0, format!("rad per {unit}")),
    };
    let ppm = |times: f64| Times(times / PPM);
    let at = || "ppm at 100 °/s".to_owned();
    let per_g = |power: i32| {
        let unit = format!("°/h/g{}", raised(power));
        (Times(G.powi(power) / DEG_PER_H), unit)
    };
    let ((first, of_first), (second, of_second)) = (per_g(1), per_g(2));
    let drift =
        |symbol, parameter, definition| (symbol, parameter, first, of_first.clone(), definition);
    let turned = |symbol, parameter, definition| {
        (
            symbol,
            parameter,
            Times(1.0 / ARCSEC),
            "″".to_owned(),
            definition,
        )
    };
    vec![
        (
            "gyro S",
            "gyro.scale.i",
            Inverse(size),
            scale,
            "scale factor: 1 / K",
        ),
        (
            "gyro D_F",
            "gyro.bias.i",
            ByScale(DEG_PER_H),
            "°/h".to_owned(),
            "bias: D / K",
        ),
        (
            "gyro asymmetry",
            "gyro.asymmetry.i",
            ppm(-2.0),
            "ppm".to_owned(),
            "(S₊ − S₋) / S: −2 q",
        ),
        (
            "gyro asymmetry by rate",
            "gyro.second_order.i",
            ppm(-2.0),
            at(),
            "(S₊ − S₋) / S, proportional to rate: −2 q",
        ),
        (
            "gyro nonlinearity",
            "gyro.odd_quadratic.i",
            ppm(-1.0),
            at(),
            "change of S, proportional to |rate|: −q",
        ),
        (
            "gyro nonlinearity",
            "gyro.third_order.i",
            ppm(-1.0),
            at(),
            "change of S, proportional to rate²: −q",
        ),
        turned(
            "gyro Γ_p",
            "gyro.installation.ip",
            "input axis turned towards p: E to p",
        ),
        turned(
            "gyro Γ_o",
            "gyro.installation.io",
            "input axis turned towards o: E to o",
        ),
        drift(
            "gyro D_I",
            "gyro.g_sensitivity.ii",
            "drift per g along i: q",
        ),
        drift(
            "gyro D_p",
            "gyro.g_sensitivity.ip",
            "drift per g along p: q",
        ),
        drift(
            "gyro D_o",
            "gyro.g_sensitivity.io",
            "drift per g along o: q",
        ),
        (
            "gyro D_II",
            "gyro.g2_sensitivity.i",
            second,
            of_second,
            "drift per g² along i: q",
        ),
    ]
}

fn raised(power: i32) -> &'static str {
    match power {
        2 => "²",
        3 => "³",
        _ => "",
    }
}

/// Unit of the file, and whether rows are rates.
fn unit(calibration: &Calibration, sensor: Sensor) -> (&str, bool) {
    let unit = calibration.unit.as_ref().map(|units| units.get(sensor));
    let is_rate = calibration.output == Some(Output::Rate);
    (unit.map_or("output", String::as_str), is_rate)
}

/// The values of all axes; `None` if the calibration has none.
fn row(
    calibration: &Calibration,
    (symbol, parameter, convert, unit, definition): &Entry,
) -> Option<Vec<String>> {
    let values = [0, 1, 2].map(|axis| value_of(calibration, parameter, *convert, axis));
    values.iter().any(Option::is_some).then(|| {
        let values = values.map(|value| value.unwrap_or_else(|| NONE.to_owned()));
        let [x, y, z] = values;
        cells![*symbol, x, y, z, unit.as_str(), *definition]
    })
}

/// The value for an axis with its σ; `None` if it was neither estimated nor stated.
fn value_of(
    calibration: &Calibration,
    parameter: &str,
    convert: Convert,
    axis: usize,
) -> Option<String> {
    let name = name_of(parameter, axis);
    let value = *calibration.get(&name)?;
    let sigma = calibration.sigma_of(&name).copied();
    let is_term = calibration.terms.contains_key(&name);
    if !is_term && sigma.is_some() && !calibration.parameters.contains(&name) {
        return None;
    }
    let scale = calibration.get(&name_of(
        &format!("{}.scale.i", name.split('.').next()?),
        axis,
    ))?;
    let (value, by) = match convert {
        Times(factor) => (value * factor, factor),
        ByScale(unit) => (value / (scale * unit), 1.0 / (scale * unit)),
        Inverse(unit) => (1.0 / (value * unit), 1.0 / (value * value * unit)),
    };
    let sigma = sigma
        .map(|sigma| sigma * by.abs())
        .filter(|sigma| *sigma > 0.0);
    Some(sigma.map_or_else(
        || three_digits(value),
        |sigma| with_last_digits(value, sigma),
    ))
}

/// Name of a parameter for an input axis.
fn name_of(parameter: &str, input: usize) -> String {
    let Some((kind, axes)) = parameter.rsplit_once('.') else {
        return parameter.to_owned();
    };
    let axis = |letter: char| {
        let next = "ipo".find(letter).unwrap_or(0);
        AXES[(input + next) % AXES.len()]
    };
    let mut axes: Vec<char> = axes.chars().map(axis).collect();
    match kind.strip_suffix(".i") {
        // A product of two components has them in order.
        Some(kind) => {
            axes.sort_unstable();
            format!("{kind}.{}.{}", AXES[input], String::from_iter(axes))
        }
        None => format!("{kind}.{}", String::from_iter(axes)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use turncal::calibration::result::TermRecord;

    /// An accelerometer with 2000 counts/s per m/s², a bias of 4 counts/s and q of second order and cross-coupling.
    fn calibration() -> Calibration {
        let mut calibration = Calibration::default();
        for triad in [&mut calibration.gyro, &mut calibration.accel] {
            (triad.scale, triad.bias) = ([2000.0; 3], [4.0, 0.0, 0.0]);
        }
        calibration.accel.installation[2][0] = 10.0 * ARCSEC;
        let unit = MICRO_G / (G * G);
        for (name, value) in [("second_order.x", 7.0), ("cross_coupling.y.xy", 3.0)] {
            let (value, sigma) = (value * unit, Some(unit));
            let term = TermRecord { value, sigma };
            calibration.terms.insert(format!("accel.{name}"), term);
        }
        calibration
    }

    fn cell(row: &str, column: usize) -> Option<String> {
        let table = table(&calibration());
        let mut rows = table.sections.into_iter().flatten();
        Some(rows.find(|of| of[0] == row)?[column].clone())
    }

    #[test]
    fn the_output_of_the_standard_is_that_of_the_model() {
        let micro_g = format!("{:.0}", 4.0 / 2000.0 / MICRO_G);
        assert_eq!(cell("accel K₀", 1), Some(micro_g));
        assert_eq!(cell("accel K₂", 1).as_deref(), Some("7.0(10)"));
        // The second axis has i = y, p = z, o = x.
        assert_eq!(cell("accel K_io", 2).as_deref(), Some("3.0(10)"));
        assert_eq!(cell("accel K_ip", 2), None);
        // i = z, p = x: a rotation about o = y by δ turns z towards x by δ.
        assert_eq!(cell("accel δ_o", 3).as_deref(), Some("10.0"));
        assert_eq!(cell("accel K₃", 1), None);
    }
}
