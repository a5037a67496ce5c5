//! The noise of an IMU in Gazebo (SDFormat).
//!
//! A sample is the true value plus white noise of `stddev`, plus a bias drawn from `bias_mean` ± `bias_stddev` with
//! either sign, plus a correlated walk with `dynamic_bias_correlation_time`, whose stationary standard deviation is
//! `dynamic_bias_stddev √(τ/2)`.
//!
//! Source: gz-sensors, `GaussianNoiseModel.cc`; SDFormat 1.6 and later, `noise.sdf`.

use super::affine::Affine;
use super::remarks::{Exported, Remarks};
use super::values::{Normalised, Values};
use turncal::imu::{AXES, PerSensor};

pub fn write(values: &Values) -> Exported {
    let PerSensor { gyro, accel } = &values.triads;
    let program = PerSensor {
        gyro: Affine::offset(gyro.bias),
        accel: Affine::offset(accel.bias),
    };
    let notes = [
        "the sign of the bias: Gazebo draws it at random for each axis, so half of the axes get the opposite sign",
    ];
    let reads = ("", "Gazebo writes rad/s and m/s^2, here");
    let no_noise = values.period.is_none();
    let no_noise = no_noise.then(|| "no noise: export with --run RUN.toml".to_owned());
    let remarks = Remarks::of_program(values, reads, &program, &notes).defines(no_noise);
    let text = format!(
        "\
<!--
{}-->
<imu>
  <angular_velocity>
{}  </angular_velocity>
  <linear_acceleration>
{}  </linear_acceleration>
</imu>
",
        remarks.text().replace("--", "- -"),
        axes(gyro, values.period),
        axes(accel, values.period),
    );
    remarks.of_file(text.into_bytes())
}

fn axes(triad: &Normalised, period: Option<f64>) -> String {
    let white = triad.density().zip(period);
    let stddev = white.map_or(0.0, |(density, period)| density / period.sqrt());
    let bias_stddev = triad.bias_sigma.unwrap_or_default();
    let axis = |k: usize| {
        let mut all = vec![
            ("mean", 0.0),
            ("stddev", stddev),
            ("bias_mean", triad.bias[k]),
            ("bias_stddev", bias_stddev[k]),
        ];
        if let Some(bias) = triad.varying() {
            all.push(("dynamic_bias_stddev", bias.walk()));
            all.push(("dynamic_bias_correlation_time", bias.correlation_time));
        }
        let line = |(key, value)| format!("        <{key}>{value:e}</{key}>\n");
        let (lines, axis) = (all.into_iter().map(line).collect::<String>(), AXES[k]);
        format!(
            "    <{axis}>\n      <noise type=\"gaussian\">\n{lines}      </noise>\n    </{axis}>\n"
        )
    };
    [0, 1, 2].map(axis).concat()
}
