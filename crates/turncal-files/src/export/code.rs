//! A C99 header, without dependencies: constants and functions.

use super::notation::{comment, numbers};
use super::remarks::{Exported, Remarks, SIGMA};
use super::values::Values;
use turncal::imu::{AXES, InstallationForm, Sensor};

/// `turncal_calibrate`.
const FUNCTION: &str = include_str!("code/calibrate.h");
/// `turncal_calibrate_at`, at a temperature.
const AT_TEMPERATURE: &str = include_str!("code/calibrate_at.h");

pub fn write(values: &Values) -> Exported {
    let text = format!(
        "
#ifndef TURNCAL_CALIBRATION_H
#define TURNCAL_CALIBRATION_H

{}// raw: N, gyros x y z, accelerometers x y z; calibrated: u in rad/s and m/s^2; they may be the same array
{FUNCTION}
{}#endif
",
        Sensor::ALL.map(|sensor| constants(values, sensor)).concat(),
        at_temperature(values)
    );
    Remarks::new(values, "//", &[SIGMA])
        .with_test_vectors()
        .above(&text)
}

fn constants(values: &Values, sensor: Sensor) -> String {
    let (name, unit, input) = (sensor.name(), values.unit(sensor), Values::input(sensor));
    let matrix = values.correction.matrix.get(sensor);
    format!(
        "\
{}static const double turncal_{name}_correction[3][3] = {{
{}
}};
{}static const double turncal_{name}_bias[3] = {{{}}};

",
        comment(
            "//",
            &format!("{input} along each axis per {unit} of each output")
        ),
        [0, 1, 2]
            .map(|i| format!("    {{{}}}", numbers(matrix.row(i).iter())))
            .join(",\n"),
        comment("//", &unit),
        numbers(values.correction.bias.get(sensor))
    )
}

/// Polynomials in temperature and the function that evaluates them, if the record has them.
fn at_temperature(values: &Values) -> String {
    let form = values.record.installation_form.unwrap_or_default();
    if values.record.temperature.is_none() || form != InstallationForm::General {
        return String::new();
    }
    let note = "the same at a constant temperature in degC; include <math.h> first";
    let polynomials = Sensor::ALL.map(|sensor| polynomials(values, sensor));
    polynomials.concat() + &comment("//", note) + AT_TEMPERATURE + "\n"
}

fn polynomials(values: &Values, sensor: Sensor) -> String {
    let Some(thermal) = &values.record.temperature else {
        return String::new();
    };
    let (name, range) = (sensor.name(), thermal.range.get(sensor));
    let triad = values.record.triad(sensor);
    let row = |(value, parameter): (f64, String)| {
        let powers = thermal.powers.get(&format!("{name}.{parameter}"));
        let power = |k| powers.and_then(|p| p.get(k)).copied().unwrap_or(0.0);
        let all = [value, power(0), power(1), power(2), power(3), power(4)];
        format!("{{{}}}", numbers(&all))
    };
    let table = |kind: &str, entries: Vec<(f64, String)>| {
        let (count, rows) = (entries.len(), entries.into_iter().map(row));
        let rows = rows.collect::<Vec<_>>().join(",\n    ");
        format!(
            "static const double turncal_{name}_{kind}_of_t[{count}][6] = {{\n    {rows}\n}};\n"
        )
    };
    let of_axes = |kind: &str, of: [f64; 3]| {
        let entry = |k: usize| (of[k], format!("{kind}.{}", AXES[k]));
        table(kind, (0..3).map(entry).collect())
    };
    let places = (0..9).map(|k| (k / 3, k % 3));
    let entry = |(i, j): (usize, usize)| {
        let name = format!("installation.{}{}", AXES[i], AXES[j]);
        (triad.installation[i][j], name)
    };
    let (reference, lowest, highest) = (range.reference, range.lowest, range.highest);
    [
        format!(
            "// {name}: value at {reference} degC, then coefficients of powers 1 to 5 of T - {reference}; valid from \
             {lowest} to {highest} degC\nstatic const double turncal_{name}_reference_degc = {reference:e};\n"
        ),
        of_axes("scale", triad.scale),
        of_axes("bias", triad.bias),
        table("installation", places.map(entry).collect()),
        "\n".to_owned(),
    ]
    .concat()
}
