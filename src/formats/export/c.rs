//! A C99 header: constants and one function, no dependencies.

use nalgebra::{Matrix3, Vector3};

use super::Exported;
use super::source::{Document, Source};
use super::thermal;
use crate::imu::Sensor;

pub(super) fn write(source: &Source) -> Exported {
    let mut file = Document::of_code(source, "//");
    file.line("\n#ifndef TURNCAL_CALIBRATION_H\n#define TURNCAL_CALIBRATION_H\n");
    for sensor in Sensor::ALL {
        let (name, unit) = (sensor.name(), source.unit(sensor));
        let input = match sensor {
            Sensor::Gyro => "rad/s",
            Sensor::Accel => "m/s^2",
        };
        file.comment(&format!(
            "{input} along each axis for one {unit} of each output"
        ));
        let matrix = rows(source.correction.matrix.get(sensor));
        file.line(&format!(
            "static const double turncal_{name}_correction[3][3] = {{\n{matrix}\n}};"
        ));
        file.comment(&unit);
        let bias = list(source.correction.bias.get(sensor));
        file.line(&format!(
            "static const double turncal_{name}_bias[3] = {bias};\n"
        ));
    }
    file.comment(
        "raw: N, gyros x y z, accelerometers x y z; calibrated: u in rad/s and m/s^2; they may be \
         the same array",
    );
    file.line(FUNCTION);
    thermal::c(source, &mut file);
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

fn list<'a>(values: impl IntoIterator<Item = &'a f64>) -> String {
    let values: Vec<String> = values.into_iter().map(|v| format!("{v:e}")).collect();
    format!("{{{}}}", values.join(", "))
}

fn rows(matrix: &Matrix3<f64>) -> String {
    let row = |i| format!("    {}", list(&Vector3::from(matrix.row(i).transpose())));
    [0, 1, 2].map(row).join(",\n")
}
