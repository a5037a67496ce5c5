//! An Octave (and MATLAB) function file.

use nalgebra::Matrix3;

use super::Exported;
use super::source::{Document, Source};
use crate::imu::Sensor;

pub(super) fn write(source: &Source) -> Exported {
    let mut file = Document::of_code(source, "%");
    file.comment("");
    file.comment("save as turncal_calibrate.m; a row of raw is N, a row of u is u:");
    file.comment("gyros x y z, accelerometers x y z");
    file.line("function u = turncal_calibrate(raw)");
    for sensor in Sensor::ALL {
        let name = sensor.name();
        let bias = row(source.correction.bias.get(sensor));
        file.line(&format!(
            "  {name}_correction = [{}];\n  {name}_bias = [{bias}];",
            rows(source.correction.matrix.get(sensor))
        ));
    }
    file.line(BODY);
    file.finish()
}

const BODY: &str = "  if size(raw, 2) ~= 6
    error('raw has %d columns, expected 6: gyros x y z, accelerometers x y z', size(raw, 2));
  end
  u = [bsxfun(@minus, raw(:, 1:3), gyro_bias) * gyro_correction.', ...
       bsxfun(@minus, raw(:, 4:6), accel_bias) * accel_correction.'];
end";

fn row<'a>(values: impl IntoIterator<Item = &'a f64>) -> String {
    let values: Vec<String> = values.into_iter().map(|v| format!("{v:e}")).collect();
    values.join(", ")
}

fn rows(matrix: &Matrix3<f64>) -> String {
    [0, 1, 2].map(|i| row(matrix.row(i).iter())).join("; ")
}
