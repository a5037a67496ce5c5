//! Accelerometer samples refer to a time that is q seconds later than that of the gyro samples. If the body stays in
//! place and rotates by θ during q, the samples are `exp(−[θ×]) f`, or `f − q (ω − ω_ie) × f` to first order.

use nalgebra::Vector3;

use super::entry::{Columns, REFERENCE_RATE, Sensed, TermEntry};
use crate::attitude::exp;
use crate::imu::Sensor;

pub const ENTRY: TermEntry = TermEntry {
    name: "time-offset",
    title: "accel time offset",
    help: "Accelerometers: delay of the accelerometer samples relative to the gyro samples",
    adds: "-q w x f to f, accelerometers sampled later",
    shown_by: "fast turns about horizontal axes",
    sensor: Sensor::Accel,
    unit: ("ms", 1e-3),
    si_unit: "s",
    d_si_unit: "\\second",
    usual_sigma: 10.0,
    largest: 1.0 / REFERENCE_RATE,
    parameters: ("accel.time_offset", &[""]),
    response,
    added: Some(added),
};

fn added(sensed: &Sensed, q: &[f64]) -> Vector3<f64> {
    let turn = sensed.rate_over_earth * q[0] + sensed.angular_acceleration * (0.5 * q[0] * q[0]);
    exp(-turn) * sensed.force - sensed.force
}

fn response(sensed: &Sensed, q: &[f64], columns: &mut Columns) {
    let rate = sensed.rate_over_earth + sensed.angular_acceleration * q[0];
    columns.set_column(0, &-rate.cross(&sensed.force));
}
