//! Gyro output proportional to the square of the rate; like an asymmetry, this term is even in the rate.

use super::asymmetry;
use super::entry::{PER_AXIS, REFERENCE_RATE, TermEntry};
use crate::units::PPM;

pub const ENTRY: TermEntry = TermEntry {
    name: "gyro-second-order",
    title: "gyro second order",
    help: "Gyros: square of angular rate",
    adds: "q w^2 / r along its axis to w, r = 100 deg/s",
    shown_by: "turns both ways about each axis, at two rates",
    unit: ("ppm at 100 °/s", PPM),
    parameters: ("gyro.second_order", &PER_AXIS),
    response: |sensed, _, columns| {
        columns.set_diagonal(&sensed.rate.map(|w| w * (w / REFERENCE_RATE)))
    },
    ..asymmetry::GYRO
};
