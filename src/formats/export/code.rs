//! Functions in C99, without dependencies, and in Octave.

use std::fmt::Write;

use nalgebra::Matrix3;

use super::Exported;
use super::document::Document;
use super::source::Source;
use crate::imu::{AXES, InstallationForm, Sensor};

/// A C99 header: constants and functions.
pub fn c(source: &Source) -> Exported {
    let mut file = Document::of_code(source, "//");
    file.line("\n#ifndef TURNCAL_CALIBRATION_H\n#define TURNCAL_CALIBRATION_H\n");
    for sensor in Sensor::ALL {
        let (name, unit, input) = (sensor.name(), source.unit(sensor), Source::input(sensor));
        file.comment(&format!(
            "{input} along each axis per {unit} of each output"
        ));
        let matrix = rows(source.correction.matrix.get(sensor)).map(|row| format!("    {{{row}}}"));
        let matrix = matrix.join(",\n");
        file.line(&format!(
            "static const double turncal_{name}_correction[3][3] = {{\n{matrix}\n}};"
        ));
        file.comment(&unit);
        let bias = numbers(source.correction.bias.get(sensor));
        file.line(&format!(
            "static const double turncal_{name}_bias[3] = {{{bias}}};\n"
        ));
    }
    file.comment(
        "raw: N, gyros x y z, accelerometers x y z; calibrated: u in rad/s and m/s^2; they may be \
         the same array",
    );
    file.line(FUNCTION);
    at_temperature(source, &mut file);
    file.line("#endif");
    file.finish()
}

const FUNCTION: &str = "\
static inline void turncal_calibrate(const double raw[6], double calibrated[6])
{
    double gyro[3], accel[3];
    for (int i = 0; i < 3; i++) {
        gyro[i] = raw[i] - turncal_gyro_bias[i];
        accel[i] = raw[3 + i] - turncal_accel_bias[i];
    }
    for (int i = 0; i < 3; i++) {
        calibrated[i] = 0.0;
        calibrated[3 + i] = 0.0;
        for (int j = 0; j < 3; j++) {
            calibrated[i] += turncal_gyro_correction[i][j] * gyro[j];
            calibrated[3 + i] += turncal_accel_correction[i][j] * accel[j];
        }
    }
}
";

/// Numbers with full precision.
fn numbers<'a>(values: impl IntoIterator<Item = &'a f64>) -> String {
    let values: Vec<String> = values.into_iter().map(|v| format!("{v:e}")).collect();
    values.join(", ")
}

/// The rows of a matrix.
fn rows(matrix: &Matrix3<f64>) -> [String; 3] {
    [0, 1, 2].map(|i| numbers(matrix.row(i).iter()))
}

/// An Octave (and MATLAB) function file.
pub fn octave(source: &Source) -> Exported {
    let mut file = Document::of_code(source, "%");
    file.comment("");
    file.comment("save as turncal_calibrate.m; each row of raw is N, each row of u is u:");
    file.comment("gyros x y z, accelerometers x y z");
    file.line("function u = turncal_calibrate(raw)");
    for sensor in Sensor::ALL {
        let name = sensor.name();
        let bias = numbers(source.correction.bias.get(sensor));
        file.line(&format!(
            "  {name}_correction = [{}];\n  {name}_bias = [{bias}];",
            rows(source.correction.matrix.get(sensor)).join("; ")
        ));
    }
    file.line(OCTAVE);
    file.finish()
}

const OCTAVE: &str = "  if size(raw, 2) ~= 6
    error('raw has %d columns, expected 6: gyros x y z, accelerometers x y z', size(raw, 2));
  end
  u = [bsxfun(@minus, raw(:, 1:3), gyro_bias) * gyro_correction.', ...
       bsxfun(@minus, raw(:, 4:6), accel_bias) * accel_correction.'];
end";

/// A C function that calibrates at a temperature.
fn at_temperature(source: &Source, file: &mut Document) {
    let Some(thermal) = &source.record.temperature else {
        return;
    };
    let form = source.record.installation_form.unwrap_or_default();
    if form != InstallationForm::General {
        return;
    }
    for sensor in Sensor::ALL {
        let (name, range) = (sensor.name(), thermal.range.get(sensor));
        let triad = source.record.triad(sensor);
        let powers = |parameter: &str| -> Vec<f64> {
            let known = thermal.powers.get(&format!("{name}.{parameter}"));
            let of = |k: usize| known.and_then(|p| p.get(k)).copied().unwrap_or(0.0);
            (0..5).map(of).collect()
        };
        let row = |value: f64, parameter: &str| {
            let mut text = format!("{{{value:e}");
            for power in powers(parameter) {
                let _ = write!(text, ", {power:e}");
            }
            text + "}"
        };
        file.comment(&format!(
            "{name}: value at {} degC, then coefficients of powers 1 to 5 of T - {}; valid from {} to {} degC",
            range.reference, range.reference, range.lowest, range.highest
        ));
        file.line(&format!(
            "static const double turncal_{name}_reference_degc = {:e};",
            range.reference
        ));
        for (kind, values) in [("scale", triad.scale), ("bias", triad.bias)] {
            let rows = (0..3).map(|axis| row(values[axis], &format!("{kind}.{}", AXES[axis])));
            file.line(&format!(
                "static const double turncal_{name}_{kind}_of_t[3][6] = {{\n    {}\n}};",
                rows.collect::<Vec<_>>().join(",\n    ")
            ));
        }
        let entries = (0..9).map(|k| {
            let (i, j) = (k / 3, k % 3);
            row(
                triad.installation[i][j],
                &format!("installation.{}{}", AXES[i], AXES[j]),
            )
        });
        file.line(&format!(
            "static const double turncal_{name}_installation_of_t[9][6] = {{\n    {}\n}};\n",
            entries.collect::<Vec<_>>().join(",\n    ")
        ));
    }
    file.comment("the same at a constant temperature in degC; include <math.h> first");
    file.line(AT_TEMPERATURE);
}

const AT_TEMPERATURE: &str = "\
static inline double turncal_of_t(const double c[6], double d)
{
    return c[0] + d * (c[1] + d * (c[2] + d * (c[3] + d * (c[4] + d * c[5]))));
}

static inline void turncal_triad_at(const double scale[3][6], const double installation[9][6],
                                    const double bias[3][6], double d, const double *raw, double *calibrated)
{
    double a[3][3], n[3];
    for (int i = 0; i < 3; i++) {
        double k = turncal_of_t(scale[i], d), squares = 0.0;
        for (int j = 0; j < 3; j++) {
            a[i][j] = turncal_of_t(installation[3 * i + j], d);
            squares += i == j ? 0.0 : a[i][j] * a[i][j];
        }
        a[i][i] = sqrt(1.0 - squares);
        for (int j = 0; j < 3; j++)
            a[i][j] *= k;
        n[i] = raw[i] - turncal_of_t(bias[i], d);
    }
    double c[3][3], determinant = 0.0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int p = (i + 1) % 3, q = (i + 2) % 3, r = (j + 1) % 3, s = (j + 2) % 3;
            c[j][i] = a[p][r] * a[q][s] - a[p][s] * a[q][r];
        }
    for (int j = 0; j < 3; j++)
        determinant += a[0][j] * c[j][0];
    for (int i = 0; i < 3; i++)
        calibrated[i] = (c[i][0] * n[0] + c[i][1] * n[1] + c[i][2] * n[2]) / determinant;
}

static inline void turncal_calibrate_at(const double raw[6], double temperature_degc, double calibrated[6])
{
    double copy[6];
    for (int i = 0; i < 6; i++)
        copy[i] = raw[i];
    turncal_triad_at(turncal_gyro_scale_of_t, turncal_gyro_installation_of_t, turncal_gyro_bias_of_t,
                     temperature_degc - turncal_gyro_reference_degc, copy, calibrated);
    turncal_triad_at(turncal_accel_scale_of_t, turncal_accel_installation_of_t, turncal_accel_bias_of_t,
                     temperature_degc - turncal_accel_reference_degc, copy + 3, calibrated + 3);
}
";
