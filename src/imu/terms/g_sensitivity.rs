//! Gyro bias proportional to specific force, along and across the gyro axes.

use super::entry::{REFERENCE_RATE, TermEntry, set_rows};
use crate::imu::Sensor;
use crate::units::{DEG_PER_H, STANDARD_GRAVITY};

pub const ENTRY: TermEntry = TermEntry {
    name: "g-sensitivity",
    title: "gyro g-sensitivity",
    help: "Gyros: sensitivity to specific force",
    adds: "Q f to w, where q is one element of the matrix Q",
    shown_by: "long dwells with each axis up and down",
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
    response: |sensed, _, columns| set_rows(columns, |_| sensed.force.transpose()),
    added: None,
};
