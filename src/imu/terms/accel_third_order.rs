//! Accelerometer output proportional to the third power of specific force along its axis.

use super::entry::{PER_AXIS, TermEntry};
use crate::imu::Sensor;
use crate::units::{MICRO_G, STANDARD_GRAVITY};

pub const ENTRY: TermEntry = TermEntry {
    name: "accel-third-order",
    title: "accel third order",
    help: "Accelerometers: third power of specific force",
    adds: "q f^3 to f, along its axis",
    shown_by: "dwells with each axis up, level and at 45°",
    sensor: Sensor::Accel,
    unit: (
        "µg/g³",
        MICRO_G / (STANDARD_GRAVITY * STANDARD_GRAVITY * STANDARD_GRAVITY),
    ),
    si_unit: "s^4/m^2",
    d_si_unit: "\\second\\tothe{4}\\metre\\tothe{-2}",
    usual_sigma: 100.0,
    largest: 1.0 / (STANDARD_GRAVITY * STANDARD_GRAVITY),
    parameters: ("accel.third_order", &PER_AXIS),
    response: |sensed, _, columns| columns.set_diagonal(&sensed.force.map(|f| f.powi(3))),
    added: None,
};
