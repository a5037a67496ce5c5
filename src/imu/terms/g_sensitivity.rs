//! Bias of the gyros with specific force, along and across their axes.

use super::entry::{Columns, REFERENCE_RATE, Sensed, TermEntry};
use crate::imu::Sensor;
use crate::units::{DEG_PER_H, STANDARD_GRAVITY};

pub const ENTRY: TermEntry = TermEntry {
    name: "g-sensitivity",
    title: "gyro g-sensitivity",
    help: "Gyros: sensitivity to specific force",
    adds: "Q f to w, this the row and column of Q",
    sensor: Sensor::Gyro,
    unit: ("°/h/g", DEG_PER_H / STANDARD_GRAVITY),
    si_unit: "(rad/s)/(m/s^2)",
    d_si_unit: "\\radian\\second\\metre\\tothe{-1}",
    usual_sigma: 1.0,
    largest: REFERENCE_RATE / STANDARD_GRAVITY,
    parameters: (
        "gyro.g_sensitivity",
        &[
            ".xx", ".xy", ".xz", ".yx", ".yy", ".yz", ".zx", ".zy", ".zz",
        ],
    ),
    response,
    added: None,
};

fn response(sensed: &Sensed, _: &[f64], columns: &mut Columns) {
    for axis in 0..3 {
        for (column, &f) in sensed.force.iter().enumerate() {
            columns[(axis, 3 * axis + column)] = f;
        }
    }
}
