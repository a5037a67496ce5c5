//! The values of a calibration in the notation of IEEE Std 1293 (accelerometers) and IEEE Std 952 and 647 (gyros).

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

/// A term. In the last part of the parameter's name, `i` is the input axis, and `p` and `o` are the two next axes in the
/// order x, y, z, x.
struct Entry {
    symbol: &'static str,
    parameter: &'static str,
    convert: Convert,
    unit: String,
    definition: &'static str,
}

const G: f64 = STANDARD_GRAVITY;

/// Every term of which the calibration has a value.
pub fn table(calibration: &Calibration) -> Table {
    let gyro = gyro(calibration).into_iter().chain(gyro_drift());
    let sections = [accel(calibration), gyro.collect()];
    let sections = sections.map(|entries| {
        let rows = entries.iter().filter_map(|entry| row(calibration, entry));
        rows.collect::<Vec<_>>()
    });
    Table::new(
        "Values in the notation of IEEE Std 1293 and 952",
        columns("term | x | y | z | unit | definition"),
    )
    .sections(sections)
    .note(
        "In parentheses: 1σ in units of the last digit. Accelerometers, in g: output = K₁ (K₀ + a_i + K₁′/2 |a_i| + K₂ \
         a_i² + K₃ a_i³ + δ_o a_p − δ_p a_o + K_ip a_i a_p + K_io a_i a_o + K_po a_p a_o). i: input axis; p and o: the \
         next two axes in the order x, y, z, x.",
    )
    .note(
        "Gyros: input rate = S × output. S₊, S₋: positive and negative rates. K, E, D and q: the parameters of \
         turncal, named as in calibration.json.",
    )
}

fn entry(
    symbol: &'static str,
    parameter: &'static str,
    (convert, unit): (Convert, &str),
    definition: &'static str,
) -> Entry {
    Entry {
        symbol,
        parameter,
        convert,
        unit: unit.to_owned(),
        definition,
    }
}

fn accel(calibration: &Calibration) -> Vec<Entry> {
    let per_g = match unit(calibration, Sensor::Accel) {
        (unit, true) => format!("{unit} per g"),
        (unit, false) => format!("{unit}/s per g"),
    };
    let (second, third) = (
        (Times(G.powi(2) / MICRO_G), "µg/g²"),
        (Times(G.powi(3) / MICRO_G), "µg/g³"),
    );
    let arcsec = |sign: f64| (Times(sign / ARCSEC), "″");
    let (ppm, bias) = ((Times(2.0 / PPM), "ppm"), (ByScale(MICRO_G), "µg"));
    let (of_o, of_p) = (
        "misalignment about o: E to p",
        "misalignment about p: −E to o",
    );
    let coupling = "cross-coupling: q";
    vec![
        entry(
            "accel K₁",
            "accel.scale.i",
            (Times(G), &per_g),
            "scale factor: K × 1 g",
        ),
        entry("accel K₀", "accel.bias.i", bias, "bias: D / K"),
        entry("accel K₁′", "accel.asymmetry.i", ppm, "asymmetry: 2 q"),
        entry(
            "accel K₂",
            "accel.second_order.i",
            second,
            "second order: q",
        ),
        entry("accel K₃", "accel.third_order.i", third, "third order: q"),
        entry("accel K_ip", "accel.cross_coupling.i.ip", second, coupling),
        entry("accel K_io", "accel.cross_coupling.i.io", second, coupling),
        entry("accel K_po", "accel.cross_coupling.i.po", second, coupling),
        entry("accel δ_o", "accel.installation.ip", arcsec(1.0), of_o),
        entry("accel δ_p", "accel.installation.io", arcsec(-1.0), of_p),
    ]
}

fn gyro(calibration: &Calibration) -> Vec<Entry> {
    let (size, scale) = match unit(calibration, Sensor::Gyro) {
        ("count", true) => (ARCSEC, "″/s per count".to_owned()),
        ("count", false) => (ARCSEC, "″ per count".to_owned()),
        (unit, true) => (1.0, format!("rad/s per {unit}")),
        (unit, false) => (1.0, format!("rad per {unit}")),
    };
    let (scale, bias) = ((Inverse(size), scale.as_str()), (ByScale(DEG_PER_H), "°/h"));
    let ppm = (Times(-2.0 / PPM), "ppm");
    let [twice, once] = [-2.0, -1.0].map(|by| (Times(by / PPM), "ppm at 100 °/s"));
    let arcsec = (Times(1.0 / ARCSEC), "″");
    let by_rate = "(S₊ − S₋) / S, proportional to rate: −2 q";
    let [linear, square] = [
        "change of S, proportional to |rate|: −q",
        "change of S, proportional to rate²: −q",
    ];
    vec![
        entry("gyro S", "gyro.scale.i", scale, "scale factor: 1 / K"),
        entry("gyro D_F", "gyro.bias.i", bias, "bias: D / K"),
        entry(
            "gyro asymmetry",
            "gyro.asymmetry.i",
            ppm,
            "(S₊ − S₋) / S: −2 q",
        ),
        entry(
            "gyro asymmetry by rate",
            "gyro.second_order.i",
            twice,
            by_rate,
        ),
        entry("gyro nonlinearity", "gyro.odd_quadratic.i", once, linear),
        entry("gyro nonlinearity", "gyro.third_order.i", once, square),
        entry(
            "gyro Γ_p",
            "gyro.installation.ip",
            arcsec,
            "input axis turned towards p: E to p",
        ),
        entry(
            "gyro Γ_o",
            "gyro.installation.io",
            arcsec,
            "input axis turned towards o: E to o",
        ),
    ]
}

/// Drift of the gyros by specific force.
fn gyro_drift() -> [Entry; 4] {
    let first = (Times(G / DEG_PER_H), "°/h/g");
    let second = (Times(G.powi(2) / DEG_PER_H), "°/h/g²");
    [
        entry(
            "gyro D_I",
            "gyro.g_sensitivity.ii",
            first,
            "drift per g along i: q",
        ),
        entry(
            "gyro D_p",
            "gyro.g_sensitivity.ip",
            first,
            "drift per g along p: q",
        ),
        entry(
            "gyro D_o",
            "gyro.g_sensitivity.io",
            first,
            "drift per g along o: q",
        ),
        entry(
            "gyro D_II",
            "gyro.g2_sensitivity.i",
            second,
            "drift per g² along i: q",
        ),
    ]
}

/// Unit of the file, and whether rows are rates.
fn unit(calibration: &Calibration, sensor: Sensor) -> (&str, bool) {
    let unit = calibration.unit.as_ref().map(|units| units.get(sensor));
    let is_rate = calibration.output == Some(Output::Rate);
    (unit.map_or("output", String::as_str), is_rate)
}

/// The values of all axes; `None` if the calibration has none.
fn row(calibration: &Calibration, entry: &Entry) -> Option<Vec<String>> {
    let of_axis = |axis| value_of(calibration, entry.parameter, entry.convert, axis);
    let values = [0, 1, 2].map(of_axis);
    values.iter().any(Option::is_some).then(|| {
        let [x, y, z] = values.map(|value| value.unwrap_or_else(|| NONE.to_owned()));
        cells![entry.symbol, x, y, z, entry.unit.as_str(), entry.definition]
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
        let estimated = ["accel.bias.x", "accel.installation.zx"];
        let mut calibration = Calibration {
            sigma: Some(Default::default()),
            parameters: estimated.map(str::to_owned).into(),
            ..Calibration::default()
        };
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
