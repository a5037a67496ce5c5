//! A C99 header, without dependencies: constants and functions.

use nalgebra::{Matrix3, Vector3};

use super::notation::numbers;
use super::remarks::{Exported, Remarks, SIGMA, equation, magnetic_words};
use super::values::Values;
use turncal::calibration::ThermalRecord;
use turncal::imu::{AXES, InstallationForm, Sensor};

/// `turncal_calibrate`.
const FUNCTION: &str = include_str!("code/calibrate.h");
/// `turncal_calibrate_mag`.
const OF_MAGNETOMETER: &str = include_str!("code/calibrate_mag.h");
/// `turncal_calibrate_at`, at a temperature.
const AT_TEMPERATURE: &str = include_str!("code/calibrate_at.h");

pub fn write(values: &Values) -> Exported {
    let constants_of = |sensor: Sensor| {
        let matrix = values.correction.matrix.get(sensor);
        constants(sensor.name(), matrix, values.correction.bias.get(sensor))
    };
    let is_of_triads = !values.record.is_of_magnetometer();
    let triads = || Sensor::ALL.map(constants_of).concat() + FUNCTION + "\n";
    let text = format!(
        "
#ifndef TURNCAL_CALIBRATION_H
#define TURNCAL_CALIBRATION_H

{}{}{}{}#endif
",
        is_of_triads.then(triads).unwrap_or_default(),
        magnetometer(values),
        at_temperature(values),
        test_vectors(values)
    );
    let functions = "raw: N, gyros x y z, accelerometers x y z; calibrated: u in the same order; raw and calibrated \
    may be the same array; each test vector contains the raw values, then the calibrated values";
    Remarks::new(values, "//", &[SIGMA])
        .defines(equation(values))
        .defines(is_of_triads.then(|| functions.to_owned()))
        .defines(polynomial_words(values))
        .defines(magnetic_words(values))
        .above(&text)
}

/// Raw outputs with their calibrated values, for a program that asks for them.
fn test_vectors(values: &Values) -> String {
    let vectors = values.record.test_vectors.iter();
    let rows = vectors.map(|v| format!("    {{{}}}", numbers(v.raw.iter().chain(&v.calibrated))));
    let rows: Vec<String> = rows.collect();
    match rows.len() {
        0 => String::new(),
        count => format!(
            "#ifdef TURNCAL_TEST_VECTORS\nstatic const double turncal_test_vectors[{count}][12] = \
             {{\n{}\n}};\n#endif\n\n",
            rows.join(",\n")
        ),
    }
}

/// Constants and function of the magnetometer, if there is one.
fn magnetometer(values: &Values) -> String {
    let Some(mag) = &values.record.mag else {
        return String::new();
    };
    let matrix = Matrix3::from_fn(|i, j| mag.correction[i][j]);
    constants("mag", &matrix, &mag.bias.into()) + OF_MAGNETOMETER + "\n"
}

fn constants(name: &str, matrix: &Matrix3<f64>, bias: &Vector3<f64>) -> String {
    format!(
        "\
static const double turncal_{name}_correction[3][3] = {{
{}
}};
static const double turncal_{name}_bias[3] = {{{}}};

",
        [0, 1, 2]
            .map(|i| format!("    {{{}}}", numbers(matrix.row(i).iter())))
            .join(",\n"),
        numbers(bias)
    )
}

/// Temperature dependence, if the header can evaluate it.
fn temperature<'a>(values: &'a Values) -> Option<&'a ThermalRecord> {
    let form = values.record.installation_form.unwrap_or_default();
    let thermal = values.record.temperature.as_ref();
    thermal.filter(|_| form == InstallationForm::General)
}

fn polynomial_words(values: &Values) -> Option<String> {
    let thermal = temperature(values)?;
    let [gyro, accel] = Sensor::ALL.map(|sensor| {
        let range = thermal.range.get(sensor);
        format!("{} to {} degC", range.lowest, range.highest)
    });
    Some(format!(
        "turncal_calibrate_at, for a constant temperature in degC: include <math.h> first; each row of ..._of_t \
         contains the value at the reference temperature, then the coefficients of the powers 1 to 5; valid for \
         {gyro} (gyros), {accel} (accelerometers)"
    ))
}

/// Polynomials in temperature and the function that evaluates them, if the record has them.
fn at_temperature(values: &Values) -> String {
    let Some(thermal) = temperature(values) else {
        return String::new();
    };
    let polynomials = Sensor::ALL.map(|sensor| polynomials(values, thermal, sensor));
    polynomials.concat() + AT_TEMPERATURE + "\n"
}

fn polynomials(values: &Values, thermal: &ThermalRecord, sensor: Sensor) -> String {
    let name = sensor.name();
    let reference = thermal.range.get(sensor).reference;
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
    [
        format!("static const double turncal_{name}_reference_degc = {reference:e};\n"),
        of_axes("scale", triad.scale),
        of_axes("bias", triad.bias),
        table("installation", places.map(entry).collect()),
        "\n".to_owned(),
    ]
    .concat()
}
